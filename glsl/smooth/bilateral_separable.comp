// One direction of the separated bilateral filter (Green10): first along rows, then along columns, each as if the filter
// were separable, which it is not; Green10 accepts what artefacts that leaves.
//   d'_i = sum_j w_ij d_j / sum_j w_ij,  w_ij = exp(-(x_j - x_i)^2 / (2 sigma_s^2)) exp(-(d_j - d_i)^2 / (2 sigma_d^2))
// over the neighbours j in the row or column that have a surface. Green10 writes exp(-(x blurScale)^2) and
// exp(-(rise blurDepthFalloff)^2): sigma = 1 / (sqrt(2) times either).
//
// Counters: COUNTERS + 0: pixels whose kernel (3 sigma_space) was clipped to REACH; only if PROJECTED.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "depth_map.glsl"
#include "pixel_groups.glsl"
layout(local_size_x = IMAGE_GROUP, local_size_y = IMAGE_GROUP) in;
layout(constant_id = 0) const int REACH = 4;
layout(constant_id = 1) const bool PROJECTED = false; // sigma_space in particle radii instead of pixels
layout(constant_id = 2) const uint COUNTERS = 0;
layout(constant_id = 3) const int AXIS = 0; // 0: along rows, 1: along columns
layout(set = 0, binding = 2, r32f) uniform writeonly image2DArray depth_out;
layout(set = 0, binding = 3, std430) buffer CounterBlock { uint at[]; } counters;
layout(push_constant) uniform PushBlock {
    float sigma_space;
    float sigma_depth;
} push;

void main() {
    ivec2 pixel = own_pixel(IMAGE_GROUP);
    int layer = int(gl_WorkGroupID.z);
    if (any(greaterThanEqual(pixel, ivec2(frame.size)))) return;
    float own = depth_at(pixel, layer);
    if (!(own > 0.0)) {
        imageStore(depth_out, ivec3(pixel, layer), vec4(own));
        return;
    }
    float sigma = push.sigma_space;
    int reach = REACH;
    if (PROJECTED) {
        sigma = projected(push.sigma_space, own);
        float wanted = ceil(3.0 * sigma);
        if (wanted > float(REACH)) atomicAdd(counters.at[COUNTERS], 1u);
        reach = int(min(wanted, float(REACH)));
    }
    // A kernel narrower than this weighs no neighbour; its square would underflow.
    sigma = max(sigma, 1e-3);
    float in_space = -0.5 / (sigma * sigma);
    float sigma_depth = max(push.sigma_depth, 1e-6);
    float in_depth = -0.5 / (sigma_depth * sigma_depth);
    ivec2 step = ivec2(1 - AXIS, AXIS); // lavapipe 22.3 gets a choice between constant vectors wrong
    float rise_sum = 0.0, total = 0.0;
    for (int x = -reach; x <= reach; ++x) {
        float d = depth_at(pixel + x * step, layer);
        if (!(d > 0.0)) continue;
        float rise = d - own;
        // The limit keeps infinities out of exp; e^-80 is nothing.
        float w = exp(max(float(x * x) * in_space + rise * rise * in_depth, -80.0));
        rise_sum += w * rise;
        total += w;
    }
    imageStore(depth_out, ivec3(pixel, layer), vec4(own + rise_sum / total));
}
