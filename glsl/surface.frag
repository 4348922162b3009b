// What the host is told of the first surface, one thing at a time: depths as its own depth buffer has them, normals in the world,
// motion vectors, and that here history is not to be trusted (REACTIVE).
// Where no liquid shows its image keeps what it holds.
#version 460
// Compiled with one of: DEPTH, DEPTH_AS_COLOR, NORMAL, MOTION, REACTIVE
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "output.glsl"
layout(set = 0, binding = 1) uniform texture2D first_surface; // first_surface.frag
#ifdef NORMAL
layout(constant_id = 0) const bool HALVED = false; // of a format without signs
#endif
#ifdef MOTION
layout(constant_id = 0) const bool MOVES = false; // not with the camera alone
layout(set = 0, binding = 2) uniform texture2D surface_motion; // motion.frag
layout(push_constant) uniform PushBlock { Motions motions; };

// Where a point on this ray was in the frame before less where it is, in parts of the picture.
vec2 motion_vector(vec3 v, float depth, vec3 moved) {
    vec4 before = vec4(depth * v - moved, 1.0);
    vec2 now = motions.now.xy * v.xy + motions.now.zw;
    float w = dot(motions.then_w, before);
    vec2 then = vec2(dot(motions.then_x, before), dot(motions.then_y, before)) / max(w, 1e-30);
    return w > 0.0 ? 0.5 * (then - now) : vec2(0.0);
}
#endif
#ifdef REACTIVE
layout(push_constant) uniform PushBlock { float reactive; } push;
#endif
#ifndef DEPTH
layout(location = 0) out vec4 out_said;
#endif

// Of a linear depth in particle radii.
float host_depth(float d) { return clamp(frame.scene_z_offset / d - frame.scene_z_scale, 0.0, 1.0); }

void main() {
    vec4 surface = texelFetch(first_surface, ivec2(view_position()), 0);
    // The block is read in any case: every pass has it.
    if (surface.w <= 0.0 || frame.size.x <= 0.0) discard;
#if defined(DEPTH)
    gl_FragDepth = host_depth(surface.w);
#elif defined(DEPTH_AS_COLOR)
    out_said = vec4(host_depth(surface.w));
#elif defined(MOTION)
    vec3 moved = vec3(0.0);
    if (MOVES) moved = texelFetch(surface_motion, ivec2(view_position()), 0).xyz;
    out_said = vec4(motion_vector(view_ray(view_position()), surface.w, moved), 0.0, 0.0);
#elif defined(REACTIVE)
    out_said = vec4(push.reactive);
#else
    out_said = vec4(HALVED ? 0.5 * surface.xyz + 0.5 : surface.xyz, 1.0);
#endif
}
