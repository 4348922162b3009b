// Which particles can show: inside the view, and on some pixel not certainly behind the body's own bounds (occlude).
// Also chooses between points and quads: one particle larger than a point can be moves its whole class to quads,
// so that the order of drawing, and with it the image, is the same either way.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "quadric.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(set = 0, binding = 1, std430) readonly buffer ParticleBlock { Particle at[]; } particles;
layout(set = 0, binding = 2, std430) readonly buffer BoundBlock { uint at[]; } bounds;
layout(set = 0, binding = 3, std430) buffer VisibleBlock { uint at[]; } visible;
layout(set = 0, binding = 4, std430) buffer DrawBlock { Draws at[]; } draws;
layout(set = 0, binding = 5, std430) buffer CounterBlock { uint at[]; } counters;
layout(push_constant) uniform PushBlock { Splat splat; };
layout(constant_id = 0) const bool OCCLUSION = true;
layout(constant_id = 1) const bool BACK = true;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= splat.range.y) return;
    Ellipsoid e = to_eye(particles.at[splat.range.x + i]);
    vec4 box = pixel_bounds(e);
    ivec2 lo = ivec2(ceil(box.xy - 0.5)), hi = ivec2(floor(box.zw - 0.5));
    uint wanted = BACK ? (VISIBLE_FRONT | VISIBLE_BACK) : VISIBLE_FRONT;
    uint verdict = all(lessThanEqual(lo, hi)) ? wanted : 0u;
    float near = -e.center.z - sqrt(e.sd.z), far = -e.center.z + sqrt(e.sd.z);
    // Few particles are larger than 64 pixels, and those show; walking their pixels would cost more than drawing them.
    if (OCCLUSION && verdict != 0u && near > frame.viewport.z && all(lessThan(hi - lo, ivec2(64)))) {
        verdict = 0u;
        uint width = uint(frame.viewport.x), pixels = width * uint(frame.viewport.y);
        // A few units in the last place, so that rounding here never hides what the rasteriser would show.
        uint front = floatBitsToUint(near * 0.999999), back = floatBitsToUint(far * 1.000001);
        for (int y = lo.y; y <= hi.y && verdict != wanted; ++y) {
            for (int x = lo.x; x <= hi.x && verdict != wanted; ++x) {
                uint pixel = uint(y) * width + uint(x);
                if (front <= bounds.at[pixel]) verdict |= VISIBLE_FRONT;
                if (BACK && back >= bounds.at[pixels + pixel]) verdict |= VISIBLE_BACK;
            }
        }
    }
    visible.at[splat.range.x + i] = verdict;
    uint cls = splat.range.z;
    if ((verdict & VISIBLE_FRONT) != 0u) atomicAdd(counters.at[COUNT_SPLASH_FRONT + 2u * cls], 1u);
    if ((verdict & VISIBLE_BACK) != 0u) atomicAdd(counters.at[COUNT_SPLASH_BACK + 2u * cls], 1u);
    // One pixel more than the box, for the centre's rounding.
    float size = max(box.z - box.x, box.w - box.y) + 1.0;
    if (verdict != 0u && (frame.particles.w != 0u || size > float(frame.particles.z))) {
        atomicMin(draws.at[cls].points.y, 0u);
        atomicMax(draws.at[cls].quads.y, splat.range.y);
    }
}
