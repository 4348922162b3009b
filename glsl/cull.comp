// Which particles can show: inside the view, and on some pixel not certainly behind the body's own bounds (occlude).
// Also counts those larger than a point can be.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "quadric.glsl"
#include "particles.glsl"
#include "groups.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(set = 0, binding = 4, std430) readonly buffer BoundBlock { uint at[]; } bounds;
layout(set = 0, binding = 5, std430) buffer VisibleBlock { uint at[]; } visible;
layout(set = 0, binding = 6, std430) buffer LargeBlock { uint at[]; } large; // particles larger than a point, by class
layout(constant_id = 0) const bool OCCLUSION_CULLING = true;
layout(constant_id = 1) const bool BACK_SIDES = true;

void main() {
    uint i = invocation();
    if (i >= frame.count) return;
    Particle p;
    int cls;
    if (!particle(i, p, cls) || repeats(i)) {
        visible.at[i] = 0u;
        return;
    }
    Ellipsoid e = to_eye(p);
    vec4 box = pixel_bounds(e);
    ivec2 lo = ivec2(ceil(box.xy - 0.5)), hi = ivec2(floor(box.zw - 0.5));
    uint wanted = BACK_SIDES ? (VISIBLE_FRONT | VISIBLE_BACK) : VISIBLE_FRONT;
    uint verdict = all(lessThanEqual(lo, hi)) ? wanted : 0u;
    float near = -e.center.z - sqrt(e.sd.z), far = -e.center.z + sqrt(e.sd.z);
    // Few particles are larger than 64 pixels, and those show; walking their pixels would cost more than drawing them.
    if (OCCLUSION_CULLING && cls == CLASS_BODY && verdict != 0u && near > frame.near && all(lessThan(hi - lo, ivec2(LARGE)))) {
        verdict = 0u;
        uint width = uint(frame.size.x), pixels = width * uint(frame.size.y);
        Cast c = cast_of(e);
        uint front = floatBitsToUint(max(near - DEPTH_ROUNDING, 0.0)), back = floatBitsToUint(far + DEPTH_ROUNDING);
        for (int y = lo.y; y <= hi.y && verdict != wanted; ++y) {
            for (int x = lo.x; x <= hi.x && verdict != wanted; ++x) {
                uint pixel = uint(y) * width + uint(x);
                bool may_front = front <= bounds.at[pixel], may_back = BACK_SIDES && back >= bounds.at[pixels + pixel];
                if (!may_front && !may_back) continue;
                // Only then the surface itself.
                float nearer, farther;
                if (!hits(c, vec2(x, y) + 0.5, 1.0, nearer, farther)) continue;
                if (may_front && nearer - DEPTH_ROUNDING <= uintBitsToFloat(bounds.at[pixel])) verdict |= VISIBLE_FRONT;
                if (may_back && farther + DEPTH_ROUNDING >= uintBitsToFloat(bounds.at[pixels + pixel])) verdict |= VISIBLE_BACK;
            }
        }
    }
    visible.at[i] = verdict | (cls == CLASS_BODY ? VISIBLE_BODY : 0u);
    // One pixel more than the box, for the centre's rounding.
    float size = max(box.z - box.x, box.w - box.y) + 1.0;
    if (verdict != 0u && size > float(frame.largest_point)) atomicAdd(large.at[cls], 1u);
}
