// Particles as point sprites, or as quads where points are too small (QUADS). Both hand the same numbers to
// splat.frag, which ray-casts the quadric; the primitive only has to cover it.
#version 460
// Compiled with any of: QUADS, SPEED
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "quadric.glsl"
#include "particles.glsl"
layout(set = 0, binding = 4, std430) readonly buffer DrawnBlock { uint at[]; } drawn;
#ifdef SPEED
layout(set = 0, binding = 5, std430) readonly buffer SpeedBlock { float at[]; } speeds; // of the particles
#endif
layout(push_constant) uniform PushBlock { Splat splat; };
layout(location = 0) flat out vec3 center; // eye space, z as depth
layout(location = 1) flat out vec3 g_diagonal; // G = S^-1 in eye space: xx, yy, zz
layout(location = 2) flat out vec3 g_mixed;    // xy, xz, yz
#ifdef SPEED
layout(location = 3) flat out float speed;
#endif

void main() {
#ifdef QUADS
    uint rank = gl_InstanceIndex;
#else
    uint rank = gl_VertexIndex;
    gl_PointSize = 1.0;
#endif
    // The list of this class and side (compact).
    uint count = frame.count;
    Particle p;
    int cls;
    uint i = drawn.at[splat.side * count + (splat.cls == CLASS_SPLASH ? rank : count - 1u - rank)];
    particle(i, p, cls);
#ifdef SPEED
    speed = speeds.at[i];
#endif
    Ellipsoid e = to_eye(p);
    vec4 box = pixel_bounds(e);

    center = vec3(e.center.xy, -e.center.z);
    inverse_shape(e, g_diagonal, g_mixed);

    vec2 scale = 2.0 / frame.size;
#ifdef QUADS
    // Half a pixel more each way, as the points have: vertices may snap to sixteenths of a pixel.
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
    gl_Position = vec4(mix(box.xy - 0.5, box.zw + 0.5, corner) * scale - 1.0, 0.5, 1.0);
#else
    vec2 size = box.zw - box.xy;
    gl_PointSize = max(size.x, size.y) + 1.0;
    gl_Position = vec4(0.5 * (box.xy + box.zw) * scale - 1.0, 0.5, 1.0);
#endif
}
