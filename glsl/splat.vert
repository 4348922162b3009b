// Particles as point sprites, or as quads where points are too small (QUADS). Both hand the same numbers to
// splat.frag, which ray-casts the quadric; the primitive only has to cover it.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "quadric.glsl"
layout(set = 0, binding = 1, std430) readonly buffer ParticleBlock { Particle at[]; } particles;
layout(set = 0, binding = 2, std430) readonly buffer VisibleBlock { uint at[]; } visible;
layout(push_constant) uniform PushBlock { Splat splat; };
layout(location = 0) flat out vec3 center; // eye space, z as depth
layout(location = 1) flat out vec3 g_diagonal; // G = S^-1 in eye space: xx, yy, zz
layout(location = 2) flat out vec3 g_mixed;    // xy, xz, yz

void main() {
#ifdef QUADS
    uint i = splat.range.x + gl_InstanceIndex;
#else
    uint i = splat.range.x + gl_VertexIndex;
    gl_PointSize = 1.0;
#endif
    center = g_diagonal = g_mixed = vec3(0.0);
    gl_Position = vec4(2.0, 2.0, 0.5, 1.0); // outside: clipped
    uint bit = splat.range.w == SIDE_FRONT ? VISIBLE_FRONT : VISIBLE_BACK;
    if ((visible.at[i] & bit) == 0u) return;
    Ellipsoid e = to_eye(particles.at[i]);
    vec4 box = pixel_bounds(e);

    center = vec3(e.center.xy, -e.center.z);
    vec3 d = e.sd, m = e.sm;
    vec3 cofactor = vec3(d.y * d.z - m.z * m.z, d.x * d.z - m.y * m.y, d.x * d.y - m.x * m.x);
    vec3 cofactor_mixed = vec3(m.y * m.z - m.x * d.z, m.x * m.z - m.y * d.y, m.x * m.y - m.z * d.x);
    float det = d.x * cofactor.x + m.x * cofactor_mixed.x + m.y * cofactor_mixed.y;
    g_diagonal = cofactor / det;
    g_mixed = cofactor_mixed / det;

    vec2 scale = 2.0 / frame.viewport.xy;
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
