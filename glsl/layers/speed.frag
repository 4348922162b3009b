// How fast the particle is that a pixel shows in front: the velocity map of Cords08 section 4, drawn and depth-tested as its
// surface is.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "quadric.glsl"
layout(location = 0) flat in vec3 center;
layout(location = 1) flat in vec3 g_diagonal;
layout(location = 2) flat in vec3 g_mixed;
layout(location = 3) flat in float speed;
layout(location = 0) out float out_speed; // world units a second; 0 where nothing is

void main() {
    vec3 v = view_ray(gl_FragCoord.xy);
    vec3 q;
    float a, b, discriminant = quadratic(Cast(center, g_diagonal, g_mixed), v, q, a, b);
    if (discriminant < 0.0) discard;
    float root = sqrt(discriminant), near = frame.near;
    if (center.z + (root - b) / a < near) discard;
    gl_FragDepth = near / max(center.z + (-root - b) / a, near);
    out_speed = speed;
}
