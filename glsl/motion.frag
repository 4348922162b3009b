// How the first surface moves: as the particle whose center is nearest to what the pixel shows of it, if any is near; the depth test
// finds which.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
layout(set = 0, binding = 3) uniform texture2D first_surface; // first_surface.frag
layout(location = 0) flat in vec3 center;
layout(location = 1) flat in vec3 moved;
layout(location = 0) out vec4 out_moved; // eye space, in particle radii; w: 1

void main() {
    float depth = texelFetch(first_surface, ivec2(gl_FragCoord.xy), 0).w;
    float part = distance(depth * view_ray(gl_FragCoord.xy), center) / MOTION_REACH;
    if (depth <= 0.0 || !(part < 1.0)) discard;
    gl_FragDepth = part;
    out_moved = vec4(moved, 1.0);
}
