// How deep the body certainly reaches at each pixel: the bounds against which the cull pass tests.
//
// Every particle is cast at the pixels it covers, where its nearest or farthest depth promises something better than what
// the pixel has already; which particles come first decides only how often that saves the work.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "quadric.glsl"
#include "particles.glsl"
#include "groups.glsl"
#include "bounds.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(set = 0, binding = 4, std430) buffer BoundBlock { uvec2 at[]; } bounds; // of front and back
layout(constant_id = 0) const bool BACK_SIDES = true;

void main() {
    uint i = invocation();
    Particle p;
    int cls;
    if (i >= frame.count || !particle(i, p, cls) || cls != CLASS_BODY || repeats(i)) return;
    Ellipsoid e = to_eye(p);
    float near = -e.center.z - sqrt(e.sd.z), far = -e.center.z + sqrt(e.sd.z);
    if (near <= frame.near) return;
    vec4 box = pixel_bounds(e);
    ivec2 lo = whole(ceil(box.xy - 0.5)), hi = whole(floor(box.zw - 0.5));
    // Few particles are larger than 64 pixels, and those hide little that others do not.
    if (any(greaterThanEqual(hi - lo, ivec2(LARGE)))) return;
    Cast c = cast_of(e);
    uint width = uint(frame.size.x);
    vec2 scale = frame.pixel_scale, origin = frame.pixel_origin;
    uvec2 best = uvec2(front_bound(near), back_bound(far));
    for (int y = lo.y; y <= hi.y; ++y) {
        for (int x = lo.x; x <= hi.x; ++x) {
            uint pixel = uint(y) * width + uint(x);
            uvec2 bound = bounds.at[pixel];
            bool front = best.x < bound.x, back = BACK_SIDES && best.y < bound.y;
            float nearer, farther;
            if (!(front || back) || !hits(c, view_ray(vec2(x, y) + 0.5, origin, scale), -1.0, nearer, farther)) continue;
            if (front_bound(nearer) < bound.x) atomicMin(bounds.at[pixel].x, front_bound(nearer));
            if (BACK_SIDES && back_bound(farther) < bound.y) atomicMin(bounds.at[pixel].y, back_bound(farther));
        }
    }
}
