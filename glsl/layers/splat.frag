// The nearest front or farthest back of a class of particles: exact ray cast of each ellipsoid (Sigg06). BALL: a front also says
// where the ray leaves the particle again.
#version 460
// Compiled with any of: BALL
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
#ifdef BALL
layout(location = 2) out float out_far; // depth at which the ray leaves the same particle
#endif

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
#ifdef BALL
    out_far = far_depth;
    // From within, the wall that is met is the far one.
    if (depth < near) out_normal = encode_normal(normalize(times_shape(g_diagonal, g_mixed, q + (root - b) / a * v)));
#endif
    if (depth < near) {
        // The ray starts inside this particle: nothing can be in front of that.
        depth = near;
        out_depth = -near;
    }
    gl_FragDepth = near / depth;
}
