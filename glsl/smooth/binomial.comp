// Binomial smoothing with a silhouette map (Cords08 sections 2.2 and 3), one direction: ACROSS along rows, DOWN along
// columns. Weights are row 2k of Pascal's triangle, so that the kernel is k pixels to either side:
//   d'_i = sum_j B(2k, k + x_j - x_i) d_j / sum_j B(2k, k + x_j - x_i)
// over the neighbours j that have a surface; k is the particle's projected radius ("splat radius") times a factor. Nothing
// stops at depth jumps: that is the method's own failure, and it stays.
//
// Silhouette map: 1 where there is liquid and 0 elsewhere, smoothed by the same kernel; drawn is only where it is still 1.
// What is kept here is how much is missing from 1, a sum of no terms where nothing is, and so exactly 0. What lies outside
// the image is unknown and counts for nothing. Where the eye is inside (d < 0) there is liquid.
//
// Counters: COUNTERS + 0: pixels whose kernel was clipped to REACH.
#version 460
// Compiled with one of: ACROSS, DOWN
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "depth_map.glsl"
#include "pixel_groups.glsl"
layout(local_size_x = IMAGE_GROUP, local_size_y = IMAGE_GROUP) in;
layout(constant_id = 0) const int REACH = 32;
layout(constant_id = 1) const bool SILHOUETTE_MAP = true;
layout(constant_id = 2) const uint COUNTERS = 0;
layout(set = 0, binding = 2, r32f) uniform writeonly image2DArray depth_out;
#ifdef ACROSS
layout(set = 0, binding = 3, r32f) uniform writeonly image2DArray missing_out;
const ivec2 STEP = ivec2(1, 0);
#else
layout(set = 0, binding = 3) uniform texture2DArray missing_in;
const ivec2 STEP = ivec2(0, 1);
#endif
layout(set = 0, binding = 4, std430) buffer CounterBlock { uint at[]; } counters;
layout(push_constant) uniform PushBlock {
    float kernel;
} push;

float rise_sum = 0.0, total = 0.0; // of the neighbours with a surface
float missing = 0.0, silhouette_total = 0.0;

void add(ivec2 p, int layer, float own, float w) {
    if (any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, ivec2(frame.size)))) return;
    float d = texelFetch(depth_in, ivec3(p, layer), 0).x;
    if (d > 0.0) {
        rise_sum += w * (d - own);
        total += w;
    }
    silhouette_total += w;
    float hole = d == 0.0 ? 1.0 : 0.0;
#ifdef DOWN
    if (hole == 0.0) hole = texelFetch(missing_in, ivec3(p, layer), 0).x;
#endif
    missing += w * hole;
}

void main() {
    ivec2 pixel = own_pixel(IMAGE_GROUP);
    int layer = int(gl_WorkGroupID.z);
    if (any(greaterThanEqual(pixel, ivec2(frame.size)))) return;
    float own = depth_at(pixel, layer);
    float result = own;
    if (own > 0.0) {
        float wanted = ceil(projected(push.kernel, own));
        if (wanted > float(REACH)) atomicAdd(counters.at[COUNTERS], 1u);
        int k = int(min(wanted, float(REACH)));
        float w = 1.0; // B(2k, k + x) / B(2k, k)
        add(pixel, layer, own, w);
        for (int x = 1; x <= k; ++x) {
            w *= float(k + 1 - x) / float(k + x);
            add(pixel - x * STEP, layer, own, w);
            add(pixel + x * STEP, layer, own, w);
        }
        result = own + rise_sum / total;
#ifdef DOWN
        if (SILHOUETTE_MAP && missing > 0.0) result = 0.0;
#endif
    }
    imageStore(depth_out, ivec3(pixel, layer), vec4(result));
#ifdef ACROSS
    float share = 0.0; // where the eye is inside there is liquid
    if (own > 0.0) share = missing / silhouette_total;
    if (own == 0.0) share = 1.0;
    imageStore(missing_out, ivec3(pixel, layer), vec4(share));
#endif
}
