// The nearest front or farthest back of a class of particles: exact ray cast of each ellipsoid (Sigg06).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "normal.glsl"
#include "quadric.glsl"
layout(push_constant) uniform PushBlock { Splat splat; };
layout(location = 0) flat in vec3 center;
layout(location = 1) flat in vec3 g_diagonal;
layout(location = 2) flat in vec3 g_mixed;
layout(location = 0) out float out_depth; // linear depth; negative where the near plane lies inside this particle
layout(location = 1) out uint out_normal; // outward, eye space

void main() {
    vec3 v = view_ray(gl_FragCoord.xy);
    vec3 q;
    float a, b, discriminant = quadratic(Cast(center, g_diagonal, g_mixed), v, q, a, b);
    if (discriminant < 0.0) discard;
    float root = sqrt(discriminant), near = frame.near;
    bool back = splat.side == SIDE_BACK;
    float far_depth = center.z + (root - b) / a;
    if (far_depth < near) discard;
    float s = back ? (root - b) / a : (-root - b) / a;
    float depth = center.z + s;
    out_normal = encode_normal(normalize(times_shape(g_diagonal, g_mixed, q + s * v)));
    out_depth = depth;
    if (depth < near) {
        // The ray starts inside this particle: nothing can be in front of that.
        depth = near;
        out_depth = -near;
    }
    gl_FragDepth = near / depth;
}
