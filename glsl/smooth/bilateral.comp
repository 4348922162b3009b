// One iteration of the bilateral filter (Tomasi & Manduchi 1998) on depths, over a square window, as Imai14 smooths
// (Imai16 section 3.1):
//   d'_i = sum_j w_ij d_j / sum_j w_ij,  w_ij = exp(-|x_j - x_i|^2 / (2 sigma_s^2)) exp(-(d_j - d_i)^2 / (2 sigma_d^2))
// over the neighbours j that have a surface. Near a boundary only one side is averaged, which warps the map towards it
// (Imai16 section 3.2, problem 2): that is the method's own failure, and it stays.
//
// Counters: COUNTERS + 0: pixels whose kernel (3 sigma_space) was clipped to REACH; only if PROJECTED.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "depth_map.glsl"
#include "pixel_groups.glsl"
// A square tile: of 16 pixels an edge up to REACH 23, of 8 up to 27, so that it fits the guaranteed 16 KiB.
layout(local_size_x_id = 0, local_size_y_id = 1) in;
layout(constant_id = 2) const int REACH = 4;
layout(constant_id = 3) const bool PROJECTED = false; // sigma_space in particle radii instead of pixels
layout(constant_id = 4) const uint COUNTERS = 0;
layout(set = 0, binding = 2, r32f) uniform writeonly image2DArray depth_out;
layout(set = 0, binding = 3, std430) buffer CounterBlock { uint at[]; } counters;
layout(push_constant) uniform PushBlock {
    float sigma_space;
    float sigma_depth;
} push;

const int TILE = int(gl_WorkGroupSize.x);
const int EDGE = TILE + 2 * REACH;
shared float tile[EDGE * EDGE];
shared uint occupied;

void main() {
    ivec2 size = ivec2(frame.size);
    ivec2 pixel = own_pixel(TILE);
    ivec2 origin = pixel_group() * TILE - REACH;
    int layer = int(gl_WorkGroupID.z);
    if (gl_LocalInvocationIndex == 0u) occupied = 0u;
    float own = depth_at(pixel, layer);
    barrier();
    if (own > 0.0) occupied = 1u;
    barrier();
    if (occupied == 0u) { // nothing to smooth in the whole group
        if (all(lessThan(pixel, size))) imageStore(depth_out, ivec3(pixel, layer), vec4(own));
        return;
    }
    for (int k = int(gl_LocalInvocationIndex); k < EDGE * EDGE; k += TILE * TILE) {
        tile[k] = depth_at(origin + ivec2(k % EDGE, k / EDGE), layer);
    }
    barrier();
    if (any(greaterThanEqual(pixel, size))) return;
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
    ivec2 home = ivec2(gl_LocalInvocationID.xy) + REACH;
    float rise_sum = 0.0, total = 0.0;
    for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
            float d = tile[(home.y + y) * EDGE + home.x + x];
            if (!(d > 0.0)) continue;
            float rise = d - own;
            // The limit keeps infinities out of exp; e^-80 is nothing.
            float w = exp(max(float(x * x + y * y) * in_space + rise * rise * in_depth, -80.0));
            rise_sum += w * rise;
            total += w;
        }
    }
    imageStore(depth_out, ivec3(pixel, layer), vec4(own + rise_sum / total));
}
