// The narrow-range filter (Truong18: "limiting the depth range", "bias correction", "dynamic range adjustment"): FULL over a
// square window, or ALONG one axis.
//   d'_i = sum_j w_ij f_ij / sum_j w_ij,  G_ij = exp(-|x_j - x_i|^2 / (2 sigma^2)), sigma = reach / 3
//   d_j < low (too near):  w_ij = 0, and 0 for the pixel opposite j as well, so that nothing is left lopsided
//   d_j > high (too far):  w_ij = G_ij, f_ij = d_i + clamp: the asymmetry that rounds edges off
//   otherwise:             w_ij = G_ij, f_ij = d_j, and the range grows: low = min(low, d_j - threshold),
//                          high = max(high, d_j + threshold), from low = d_i - threshold, high = d_i + threshold.
// (Depths here are positive: what the paper calls upper is near.) Samples are visited from the pixel outwards, pair by
// opposite pair. ALONG: each side has a range of its own. FULL: all share one, and it grows ring by ring, so that the order
// within a ring does not matter; the paper leaves that order open.
//
// Counters: COUNTERS + 0: pixels whose kernel was clipped to REACH; none if FIXED.
#version 460
// Compiled with one of: ALONG, FULL
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "depth_map.glsl"
#include "pixel_groups.glsl"
layout(local_size_x = IMAGE_GROUP, local_size_y = IMAGE_GROUP) in;
layout(constant_id = 0) const int REACH = 4;
layout(constant_id = 1) const bool FIXED = false; // the kernel is REACH pixels, at any depth
layout(constant_id = 2) const uint COUNTERS = 0;
layout(constant_id = 3) const bool EMPTY_FAR = false;
#ifdef ALONG
layout(constant_id = 4) const int AXIS = 0; // 0: along rows, 1: along columns
#endif
layout(set = 0, binding = 2, r32f) uniform writeonly image2DArray depth_out;
layout(set = 0, binding = 3, std430) buffer CounterBlock { uint at[]; } counters;
layout(push_constant) uniform PushBlock {
    float kernel;
    float threshold;
    float clamp;
} push;

struct Sample {
    float weight; // 0 or 1
    float rise;   // f - d_i
    bool near;
};

// Judges the depth at p by the range, and lets it widen the range to come.
Sample judge(ivec2 p, int layer, float own, vec2 range, inout vec2 wider) {
    if (any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, ivec2(frame.size)))) return Sample(0.0, 0.0, false);
    float d = texelFetch(depth_in, ivec3(p, layer), 0).x;
    if (EMPTY_FAR && d == 0.0) return Sample(1.0, push.clamp, false);
    if (!(d > 0.0)) return Sample(0.0, 0.0, false);
    if (d < range.x) return Sample(0.0, 0.0, true);
    if (d > range.y) return Sample(1.0, push.clamp, false);
    wider = vec2(min(wider.x, d - push.threshold), max(wider.y, d + push.threshold));
    return Sample(1.0, d - own, false);
}

float rise_sum = 0.0, total = 1.0; // the pixel itself: rise 0, weight 1

void add(Sample a, Sample b, float w) {
    if (a.near || b.near) return;
    rise_sum += w * (a.weight * a.rise + b.weight * b.rise);
    total += w * (a.weight + b.weight);
}

void main() {
    ivec2 pixel = own_pixel(IMAGE_GROUP);
    int layer = int(gl_WorkGroupID.z);
    if (any(greaterThanEqual(pixel, ivec2(frame.size)))) return;
    float own = depth_at(pixel, layer);
    if (!(own > 0.0)) {
        imageStore(depth_out, ivec3(pixel, layer), vec4(own));
        return;
    }
    int reach = REACH;
    if (!FIXED) {
        float wanted = ceil(projected(push.kernel, own));
        if (wanted > float(REACH)) atomicAdd(counters.at[COUNTERS], 1u);
        reach = int(min(wanted, float(REACH)));
    }
    float in_space = -4.5 / max(float(reach * reach), 1.0); // -1 / (2 sigma^2)
    vec2 range = vec2(own - push.threshold, own + push.threshold);
#ifdef ALONG
    ivec2 step = ivec2(1 - AXIS, AXIS); // lavapipe 22.3 gets a choice between constant vectors wrong
    vec2 before = range, after = range;
    for (int x = 1; x <= reach; ++x) {
        Sample a = judge(pixel - x * step, layer, own, before, before);
        Sample b = judge(pixel + x * step, layer, own, after, after);
        add(a, b, exp(float(x * x) * in_space));
    }
#else
    for (int ring = 1; ring <= reach; ++ring) {
        vec2 wider = range;
        // One of each opposite pair: the right side with both corners, then the lower side without.
        for (int k = 0; k < 4 * ring; ++k) {
            ivec2 at = k <= 2 * ring ? ivec2(ring, k - ring) : ivec2(k - 3 * ring, ring);
            Sample a = judge(pixel - at, layer, own, range, wider);
            Sample b = judge(pixel + at, layer, own, range, wider);
            add(a, b, exp(float(at.x * at.x + at.y * at.y) * in_space));
        }
        range = wider;
    }
#endif
    imageStore(depth_out, ivec3(pixel, layer), vec4(own + rise_sum / total));
}
