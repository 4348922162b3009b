// What is seen where there is no liquid. DEBUG, SCENE, CUBE as in walk.frag.
#version 460
// Compiled with any of: DEBUG, SCENE, CUBE
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "output.glsl"
#include "optics.glsl"
layout(constant_id = 0) const bool ENCODE_SRGB = false;
const bool HOST_BACKGROUND = false; // the host's picture is not drawn over
layout(location = 0) out vec4 out_color;
#ifdef DEBUG
layout(location = 1) out vec4 out_walk;
layout(location = 2) out vec4 out_direction;
#endif
#include "environment.glsl"
#include "scene.glsl"

void main() {
    vec3 dir = normalize(view_ray(view_position())), color = behind(ivec2(view_position()), dir);
    out_color = vec4(ENCODE_SRGB ? encode_srgb(color) : color, 1.0);
#ifdef DEBUG
    out_walk = vec4(float(PATTERN_NONE), float(OUTCOME_NO_LIQUID), 0.0, 0.0);
    out_direction = vec4(transpose(mat3(frame.view)) * dir, 0.0);
#endif
}
