// How deep the body certainly reaches at each pixel: the bounds against which the cull pass tests.
//
// A ray that crosses an ellipsoid's cut at its centre's depth dc meets its front at or before dc and its back at or
// beyond. Over the pixels of a square inside that cut, the front map is therefore at most dc and the back map at
// least dc. Integer order equals float order for positive floats.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "quadric.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(set = 0, binding = 1, std430) readonly buffer ParticleBlock { Particle at[]; } particles;
layout(set = 0, binding = 2, std430) buffer BoundBlock { uint at[]; } bounds; // front bounds, then back bounds
layout(push_constant) uniform PushBlock { Splat splat; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= splat.range.y) return;
    Ellipsoid e = to_eye(particles.at[splat.range.x + i]);
    float dc = -e.center.z;
    if (dc - sqrt(e.sd.z) <= frame.viewport.z) return;
    // The cut at dc is { p : p^T Q p <= 1 } with Q the lateral block of S^-1; det and the cofactors give it directly.
    float cxx = e.sd.y * e.sd.z - e.sm.z * e.sm.z;
    float cyy = e.sd.x * e.sd.z - e.sm.y * e.sm.y;
    float cxy = e.sm.y * e.sm.z - e.sm.x * e.sd.z;
    float det = e.sd.x * cxx + e.sm.x * cxy + e.sm.y * (e.sm.x * e.sm.z - e.sd.y * e.sm.y);
    vec2 aspect = abs(frame.to_pixel.xy) / dc; // pixels per world unit at dc
    // The largest pixel square |dx|, |dy| <= w whose corners lie in the cut, less a hundredth of a pixel.
    float q = cxx / (aspect.x * aspect.x) + cyy / (aspect.y * aspect.y) + 2.0 * abs(cxy) / (aspect.x * aspect.y);
    if (!(det > 0.0) || !(q > 0.0)) return;
    float w = sqrt(det / q) - 0.01;
    vec2 center = project(e.center);
    ivec2 lo = max(ivec2(ceil(center - w - 0.5)), ivec2(0));
    ivec2 hi = min(ivec2(floor(center + w - 0.5)), ivec2(frame.viewport.xy) - 1);
    uint width = uint(frame.viewport.x), pixels = width * uint(frame.viewport.y);
    for (int y = lo.y; y <= hi.y; ++y) {
        for (int x = lo.x; x <= hi.x; ++x) {
            uint pixel = uint(y) * width + uint(x);
            atomicMin(bounds.at[pixel], floatBitsToUint(dc));
            atomicMax(bounds.at[pixels + pixel], floatBitsToUint(dc));
        }
    }
}
