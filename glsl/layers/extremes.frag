// The nearest front and the farthest back of all particles in one pass: the largest of (-d, d) stays, by blending.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "quadric.glsl"
layout(location = 0) flat in vec3 center;
layout(location = 1) flat in vec3 g_diagonal;
layout(location = 2) flat in vec3 g_mixed;
layout(location = 0) out vec2 out_extremes; // -front, back; a front of -near where the near plane lies inside

void main() {
    vec3 v = view_ray(gl_FragCoord.xy);
    vec3 q;
    float a, b, discriminant = quadratic(Cast(center, g_diagonal, g_mixed), v, q, a, b);
    if (discriminant < 0.0) discard;
    float root = sqrt(discriminant), near = frame.near;
    float front = center.z + (-root - b) / a, back = center.z + (root - b) / a;
    if (back < near) discard;
    // Nothing can be in front of a particle in which the ray starts.
    out_extremes = vec2(front < near ? near : -front, back);
}
