// What the host is told of the first surface, one thing at a time: depths as its own depth buffer has them, normals in the world.
// Where no liquid shows its image keeps what it holds.
#version 460
// Compiled with one of: DEPTH, DEPTH_AS_COLOR, NORMAL
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
layout(set = 0, binding = 1) uniform texture2D first_surface; // first_surface.frag
#ifdef NORMAL
layout(constant_id = 0) const bool HALVED = false; // of a format without signs
#endif
#ifndef DEPTH
layout(location = 0) out vec4 out_said;
#endif

// Of a linear depth in particle radii.
float host_depth(float d) { return clamp(frame.scene_z_offset / d - frame.scene_z_scale, 0.0, 1.0); }

void main() {
    vec4 surface = texelFetch(first_surface, ivec2(gl_FragCoord.xy), 0);
    // The block is read in any case: every pass has it.
    if (surface.w <= 0.0 || frame.size.x <= 0.0) discard;
#if defined(DEPTH)
    gl_FragDepth = host_depth(surface.w);
#elif defined(DEPTH_AS_COLOR)
    out_said = vec4(host_depth(surface.w));
#else
    out_said = vec4(HALVED ? 0.5 * surface.xyz + 0.5 : surface.xyz, 1.0);
#endif
}
