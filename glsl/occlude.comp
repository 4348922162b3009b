// How deep the body certainly reaches at each pixel: the bounds against which the cull pass tests. The front map is at
// most the front bound there, the back map at least the back bound.
//
// Every particle is cast at the pixels it covers, where its nearest or farthest depth promises something better than what
// the pixel has already; which particles come first decides only how often that saves the work. Integer order equals float
// order for positive floats.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "quadric.glsl"
#include "particles.glsl"
#include "groups.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(set = 0, binding = 4, std430) buffer BoundBlock { uint at[]; } bounds; // front bounds, then back bounds

void main() {
    uint i = invocation();
    Particle p;
    int cls;
    if (i >= frame.count || !particle(i, p, cls) || cls != CLASS_BODY || repeats(i)) return;
    Ellipsoid e = to_eye(p);
    float near = -e.center.z - sqrt(e.sd.z), far = -e.center.z + sqrt(e.sd.z);
    if (near <= frame.near) return;
    vec4 box = pixel_bounds(e);
    ivec2 lo = ivec2(ceil(box.xy - 0.5)), hi = ivec2(floor(box.zw - 0.5));
    // Few particles are larger than 64 pixels, and those hide little that others do not.
    if (any(greaterThanEqual(hi - lo, ivec2(LARGE)))) return;
    Cast c = cast_of(e);
    uint width = uint(frame.size.x), pixels = width * uint(frame.size.y);
    for (int y = lo.y; y <= hi.y; ++y) {
        for (int x = lo.x; x <= hi.x; ++x) {
            uint pixel = uint(y) * width + uint(x);
            bool front = floatBitsToUint(near) < bounds.at[pixel], back = floatBitsToUint(far) > bounds.at[pixels + pixel];
            float nearer, farther;
            if ((front || back) && hits(c, vec2(x, y) + 0.5, -1.0, nearer, farther)) {
                if (front) atomicMin(bounds.at[pixel], floatBitsToUint(nearer));
                if (back) atomicMax(bounds.at[pixels + pixel], floatBitsToUint(farther));
            }
        }
    }
}
