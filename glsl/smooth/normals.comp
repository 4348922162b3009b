// Normals of the smoothed body surface: one-sided differences of eye-space positions, on each axis the side with the
// smaller depth jump (Green10). Fronts face the viewer, backs face away.
#version 460
// Compiled with any of: RAW
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "normal.glsl"
#include "depth_map.glsl"
#include "pixel_groups.glsl"
layout(local_size_x = IMAGE_GROUP, local_size_y = IMAGE_GROUP) in;
#ifdef RAW
layout(set = 0, binding = 2) uniform utexture2DArray normal_raw; // where differences say nothing
#endif
layout(set = 0, binding = 3, r32ui) uniform writeonly uimage2DArray normal_out;
layout(set = 0, binding = 4, std430) buffer CounterBlock { uint at[]; } counters;
layout(constant_id = 0) const uint COUNTERS = 0; // slot of its first counter

// Difference of positions along one pixel step, from the side with the smaller jump; zero if neither side has a surface.
vec3 tangent(ivec2 pixel, ivec2 step, int layer, float d, vec3 v) {
    float before = depth_at(pixel - step, layer), after = depth_at(pixel + step, layer);
    bool forward = after > 0.0 && (before <= 0.0 || abs(after - d) <= abs(before - d));
    if (!forward && before <= 0.0) return vec3(0.0);
    float neighbour = forward ? after : before, sign = forward ? 1.0 : -1.0;
    // neighbour (v +- step) - d v, without the cancellation
    return sign * ((neighbour - d) * v) + vec3(neighbour * vec2(step) / frame.pixel_scale, 0.0);
}

void main() {
    ivec2 pixel = own_pixel(IMAGE_GROUP);
    int layer = int(gl_WorkGroupID.z);
    if (any(greaterThanEqual(pixel, ivec2(frame.size)))) return;
    float d = depth_at(pixel, layer);
    uint result = 0u;
    if (d > 0.0) {
        vec3 v = view_ray(vec2(pixel) + 0.5);
        vec3 n = cross(tangent(pixel, ivec2(1, 0), layer, d, v), tangent(pixel, ivec2(0, 1), layer, d, v));
        float size = length(n);
        if (size > 0.0) {
            float away = dot(n, v);
            result = encode_normal(n * (((away > 0.0) == (layer == SIDE_BACK)) ? 1.0 / size : -1.0 / size));
        } else {
#ifdef RAW
            result = texelFetch(normal_raw, ivec3(pixel, layer), 0).x;
#else
            result = encode_normal((layer == SIDE_BACK ? 1.0 : -1.0) * normalize(v));
#endif
            atomicAdd(counters.at[COUNTERS], 1u);
        }
    }
    imageStore(normal_out, ivec3(pixel, layer), uvec4(result));
}
