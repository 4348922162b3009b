// One explicit step of curvature flow (vdLaan09, the section on surface smoothing), dz/dt = H with
//   2H = d/dx n_x + d/dy n_y,  n = (-C_y z_x, -C_x z_y, C_x C_y z) / sqrt(D),
//   D = C_y^2 z_x^2 + C_x^2 z_y^2 + C_x^2 C_y^2 z^2,  C_x = 2 / (V_x F_x) = -1 / a_x,
// where x and y are pixels and the view's position within the image is left out of n, as the paper leaves it out: only a
// plane across the view axis is at rest. C is negative because z = -depth is what positions are multiples of; the other sign
// would roughen. Depth d moves by -H dt. Worked out, with the slopes p = a_x d_x / d and q = a_y d_y / d and
// s = 1 + p^2 + q^2, all that is large cancels:
//   -2H s^(3/2) d = a_x d_xx (1 + q^2) + a_y d_yy (1 + p^2) - (a_x + a_y) p q d_xy - p d_x - q d_y
// Central differences. On an axis where a neighbour has no surface, or one beyond a jump, both derivatives are zero, so that
// nothing is smoothed across (vdLaan09: "at boundaries").
//
// Explicit steps diverge above dt (a_x + a_y) / d = 1 (the flow spreads by at most a dt / (2 d) square pixels a step, and
// two dimensions admit a quarter each): longer ones are shortened to that.
//
// Counters: COUNTERS + 0: pixels whose step was shortened to the stable one.
//           COUNTERS + 1: updates refused: they would end before the near plane; the depth is kept.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "depth_map.glsl"
#include "pixel_groups.glsl"
layout(local_size_x = IMAGE_GROUP, local_size_y = IMAGE_GROUP) in;
layout(constant_id = 0) const uint COUNTERS = 0;
layout(set = 0, binding = 2, r32f) uniform writeonly image2DArray depth_out;
layout(set = 0, binding = 3, std430) buffer CounterBlock { uint at[]; } counters;
layout(push_constant) uniform PushBlock {
    float time_step;
    float jump;
} push;

// Rises to the two neighbours at -step and step, or zero if either is none or beyond a jump; the third says which.
vec3 rises(ivec2 pixel, ivec2 step, int layer, float own) {
    vec2 d = vec2(depth_at(pixel - step, layer), depth_at(pixel + step, layer));
    vec2 rise = d - own;
    bool smooth_here = all(greaterThan(d, vec2(0.0))) && all(lessThanEqual(abs(rise), vec2(push.jump)));
    return smooth_here ? vec3(rise, 1.0) : vec3(0.0);
}

void main() {
    ivec2 pixel = own_pixel(IMAGE_GROUP);
    int layer = int(gl_WorkGroupID.z);
    if (any(greaterThanEqual(pixel, ivec2(frame.size)))) return;
    float own = depth_at(pixel, layer);
    float result = own;
    if (own > 0.0) {
        vec3 across = rises(pixel, ivec2(1, 0), layer, own), down = rises(pixel, ivec2(0, 1), layer, own);
        vec3 falling = rises(pixel, ivec2(1, 1), layer, own), rising = rises(pixel, ivec2(1, -1), layer, own);
        float dx = 0.5 * (across.y - across.x), dy = 0.5 * (down.y - down.x);
        float dxx = across.x + across.y, dyy = down.x + down.y;
        float dxy = 0.25 * ((falling.x + falling.y) - (rising.x + rising.y)) * (falling.z * rising.z);
        vec2 a = abs(frame.pixel_scale);
        float p = a.x * dx / own, q = a.y * dy / own;
        float s = 1.0 + p * p + q * q;
        float flow = a.x * dxx * (1.0 + q * q) + a.y * dyy * (1.0 + p * p) - (a.x + a.y) * (p * q) * dxy - p * dx - q * dy;
        float stable = own / (a.x + a.y);
        if (push.time_step > stable) atomicAdd(counters.at[COUNTERS], 1u);
        float update = min(push.time_step, stable) * (0.5 * flow / (s * sqrt(s) * own));
        if (!(own + update >= frame.near)) {
            atomicAdd(counters.at[COUNTERS + 1], 1u);
        } else {
            result = own + update;
        }
    }
    imageStore(depth_out, ivec3(pixel, layer), vec4(result));
}
