// The first surface that each pixel shows: its unit normal in the world, towards the eye's side, and its linear depth in particle
// radii; what is drawn into starts as zeros, which stay where no liquid shows. FIELD: of a density field and balls, in place of maps.
// SCENE: there is an opaque scene of the host's.
#version 460
// Compiled with any of: FIELD, SCENE
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "scene_depth.glsl"
layout(location = 0) out vec4 out_surface;

// With an outward normal in the world, of a surface that may face away: then it is seen from its back.
void write_surface(ivec2 pixel, vec3 dir, vec3 normal, float depth) {
    if (depth <= 0.0 || scene_hides(pixel, depth)) discard;
    out_surface = vec4(dot(dir, normal) > 0.0 ? -normal : normal, depth);
}

#ifdef FIELD
#include "field.glsl"
layout(push_constant) uniform PushBlock {
    uint slots;    // of the directory
    float ball;    // radius of a ball, in spacings
    float spacing; // of the nodes, in particle radii
} push;
#include "field_space.glsl"
#include "field_walls.glsl"
#include "field_first.glsl"

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 v = view_ray(gl_FragCoord.xy), eye_dir = normalize(v), dir = transpose(mat3(frame.view)) * eye_dir;
    vec3 x = to_field(frame.near * v), center;
    int within = AIR;
    Block block = NOWHERE;
    bool stopped;
    Wall wall = first_wall(block, pixel, x, dir, eye_dir, within, center, stopped);
    bool inside = within != AIR, met = !inside && wall.t < NONE;
    vec3 normal = -dir;
    if (met) {
        x += wall.t * dir;
        normal = normal_at(wall, x, dir);
    }
    write_surface(pixel, dir, normal, inside ? frame.near : met ? -to_eye(x).z : 0.0);
}
#else
#include "normal.glsl"
layout(constant_id = 0) const bool HAS_SPLASH = true;
layout(constant_id = 1) const bool HAS_BODY = true;
layout(constant_id = 2) const bool EYE_MAY_BE_INSIDE = true; // where the host says so
layout(constant_id = 3) const bool BACKS = true;             // and there only where the body has a far side
layout(constant_id = 4) const bool HALF_RESOLUTION = false;  // of the maps
layout(set = 0, binding = 1) uniform texture2DArray body_depth;
layout(set = 0, binding = 2) uniform utexture2DArray body_normal;
layout(set = 0, binding = 3) uniform texture2DArray splash_depth;
layout(set = 0, binding = 4) uniform utexture2DArray splash_normal;
#include "upsample.glsl"

Front body_at(ivec2 pixel) {
    Front front = Front(0.0, vec3(0.0), 1.0, 0.0);
    if (!HAS_BODY) return front;
    if (HALF_RESOLUTION) {
        front = upsampled(gl_FragCoord.xy);
        if (front.coverage < 0.5) front.depth = 0.0;
        return front;
    }
    front.depth = texelFetch(body_depth, ivec3(pixel, SIDE_FRONT), 0).x;
    front.normal = decode_normal(texelFetch(body_normal, ivec3(pixel, SIDE_FRONT), 0).x);
    return front;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 dir = normalize(view_ray(gl_FragCoord.xy));
    Front body = body_at(pixel);
    float splash = HAS_SPLASH ? texelFetch(splash_depth, ivec3(pixel, SIDE_FRONT), 0).x : 0.0;
    // Negative: the near plane lies inside. Inside the body it does where the host says so, too.
    bool inside = body.depth < 0.0 || splash < 0.0;
    if (HAS_BODY && EYE_MAY_BE_INSIDE) {
        float back = BACKS && body.depth != 0.0 ? texelFetch(body_depth, ivec3(pixel, SIDE_BACK), 0).x : BACKS ? 0.0 : 1.0;
        inside = inside || frame.eye_inside * back > 0.0;
    }
    bool of_splash = splash > 0.0 && (body.depth <= 0.0 || splash <= body.depth);
    vec3 normal = of_splash ? decode_normal(texelFetch(splash_normal, ivec3(pixel, SIDE_FRONT), 0).x) : body.normal;
    float depth = of_splash ? splash : body.depth;
    mat3 to_world = transpose(mat3(frame.view));
    write_surface(pixel, to_world * dir, to_world * (inside ? -dir : normal), inside ? frame.near : depth);
}
#endif
