// How much of a view ray lies inside a particle, up to the host's scene: added up by blending (Green10). Particles that
// overlap count twice, as published.
#version 460
// Compiled with any of: SCENE
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "quadric.glsl"
#ifdef SCENE
layout(set = 0, binding = 9) uniform texture2D scene_depth; // the host's depth buffer
#endif
layout(location = 0) flat in vec3 center;
layout(location = 1) flat in vec3 g_diagonal;
layout(location = 2) flat in vec3 g_mixed;
layout(location = 0) out float out_length;

void main() {
    vec3 v = view_ray(gl_FragCoord.xy);
    vec3 q;
    float a, b, discriminant = quadratic(Cast(center, g_diagonal, g_mixed), v, q, a, b);
    if (discriminant < 0.0) discard;
    float root = sqrt(discriminant);
    float front = max(center.z + (-root - b) / a, frame.near), back = center.z + (root - b) / a;
#ifdef SCENE
    float z = texelFetch(scene_depth, ivec2(gl_FragCoord.xy + frame.scene_origin), 0).x;
    if (z != frame.scene_cleared) back = min(back, frame.scene_z_offset / (z + frame.scene_z_scale));
#endif
    if (back <= front) discard;
    out_length = (back - front) * length(v);
}
