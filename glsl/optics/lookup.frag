// One refraction as a look-up in the picture of what lies behind, moved sideways by what the surface is like: screen-space
// fluid rendering (Green10; Im16 figs. 4 and 5) and Instant Liquids (Cords08). Nothing is traced.
#version 460
// Compiled with any of: SCENE, CUBE, THICKNESS, SPEED
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "output.glsl"
#include "normal.glsl"
#include "optics.glsl"
layout(constant_id = 0) const uint MODE = 0; // one of LOOKUP_…
layout(constant_id = 1) const bool EXACT_FRESNEL = false;
layout(constant_id = 2) const bool ENCODE_SRGB = false;
layout(constant_id = 3) const bool HOST_BACKGROUND = false; // only liquid is drawn, over what is there
layout(constant_id = 4) const bool HALF_RESOLUTION = false; // of the maps
layout(set = 0, binding = 1) uniform texture2DArray body_depth;
layout(set = 0, binding = 2) uniform utexture2DArray body_normal;
#ifdef THICKNESS
layout(set = 0, binding = 3) uniform texture2D thickness; // in particle radii
#endif
#ifdef SPEED
layout(set = 0, binding = 4) uniform texture2D speed; // of the particle in front, in world units a second
#endif
layout(push_constant) uniform PushBlock {
    float strength;          // of the offset
    float thickness_scale;   // of T = 1 - exp(-scale thickness), over the particle radius
    float light_x;           // towards the light, in eye space, of length 1
    float light_y;
    float light_z;
    float diffuse;           // fraction of white that is scattered
    float specular;          // of the light's mirror image
    float shininess;         // its exponent
    float spray;             // fraction of white at the speed after it, and above
    float spray_speed;
} push;
layout(location = 0) out vec4 out_color;
#include "environment.glsl"
#include "scene.glsl"
#include "upsample.glsl"

// What lies behind the liquid at a position of the picture, as far as the picture reaches.
vec3 seen_at(vec2 p) {
#ifdef SCENE
    // Clamped before it is a whole number: those do not go as far.
    ivec2 pixel = whole(clamp(floor(p), vec2(0.0), frame.size - 1.0));
    if (HOST_BACKGROUND || scene_linear(pixel) < CLEARED) return scene_light(pixel);
#endif
    // Far beside the picture the square of the ray's length is no number.
    vec3 v = view_ray(p);
    return env_color(normalize(v / max(max(abs(v.x), abs(v.y)), 1.0)));
}

// Moved by parts of the picture's edges, y up.
vec3 seen_beside(vec2 offset) { return seen_at(view_position() + offset * sign(frame.pixel_scale) * frame.size); }

vec3 refracted(vec3 dir, vec3 n, float t_weight) {
    if (MODE == LOOKUP_NORMAL) return seen_beside(push.strength * t_weight * n.xy);
    if (MODE == LOOKUP_BENT) return seen_beside(push.strength * refract(dir, n, 1.0 / frame.ior).xy);
    // Im16 fig. 5 prints "refract(...).xy - E.z"; what it must mean is the perspective division.
    vec3 bent = refract(dir, n, mix(frame.ior, 1.0, t_weight) / frame.ior);
    return bent.z < 0.0 ? seen_at(project(bent)) : infinitely_far(bent);
}

// The surface at a pixel.
Front front_at(ivec2 pixel) {
    Front front;
    if (HALF_RESOLUTION) {
        front = upsampled(view_position());
        // Over the host's picture a pixel is the liquid's or not.
        if (HOST_BACKGROUND && front.coverage < 0.5) front.depth = 0.0;
        return front;
    }
    front.depth = texelFetch(body_depth, ivec3(pixel, SIDE_FRONT), 0).x;
    front.normal = decode_normal(texelFetch(body_normal, ivec3(pixel, SIDE_FRONT), 0).x);
    front.coverage = 1.0;
    front.speed = 0.0;
#ifdef SPEED
    front.speed = texelFetch(speed, pixel, 0).x;
#endif
    return front;
}

float thickness_at(ivec2 pixel) {
#ifdef THICKNESS
    return texelFetch(thickness, pixel, 0).x;
#else
    return 0.0;
#endif
}

// White light from far away, by Phong.
float phong(vec3 dir, vec3 n) {
    vec3 light = vec3(push.light_x, push.light_y, push.light_z);
    float facing = dot(light, n), mirror = max(dot(reflect(dir, n), light), 0.0);
    float lit = push.diffuse * max(facing, 0.0);
    return facing > 0.0 && mirror > 0.0 ? lit + push.specular * exp(push.shininess * log(mirror)) : lit;
}

// What the surface adds to the light through it: reflection, and for Instant Liquids highlights and spray.
vec3 shaded(vec3 color, vec3 dir, vec3 n, Front front) {
    vec3 bent = refract(dir, n, 1.0 / frame.ior);
    float reflectance = fresnel(-dot(dir, n), -dot(bent, n), frame.ior, EXACT_FRESNEL);
    color = mix(color, infinitely_far(reflect(dir, n)), reflectance);
    if (MODE == LOOKUP_BENT) color += phong(dir, n);
#ifdef SPEED
    // Spray: shifted to white by the velocity map (Cords08 section 4).
    color = mix(color, vec3(1.0), push.spray * min(front.speed / push.spray_speed, 1.0));
#endif
    return color;
}

void main() {
    ivec2 pixel = ivec2(view_position());
    vec3 v = view_ray(view_position()), dir = normalize(v);
    Front front = front_at(pixel);
    float depth = front.depth;
    bool inside = depth < 0.0; // a particle around the near plane: nothing to bend at
    if (depth == 0.0 || scene_hides(pixel, inside ? frame.near : depth)) {
        if (HOST_BACKGROUND) discard;
        vec3 color = behind(pixel, dir);
        out_color = vec4(ENCODE_SRGB ? encode_srgb(color) : color, 1.0);
        return;
    }
    vec3 n = inside ? -dir : front.normal;
    if (dot(dir, n) > 0.0) n = -n;
    float length_inside = thickness_at(pixel);
    float t_weight = 1.0 - exp(-push.thickness_scale * length_inside);
    vec3 color = inside ? seen_at(view_position()) : refracted(dir, n, t_weight);
    color *= exp(-frame.absorption * length_inside);
    if (!inside) color = shaded(color, dir, n, front);
    // The liquid's edge runs between the maps' pixels.
    if (HALF_RESOLUTION && !HOST_BACKGROUND && front.coverage < 1.0) color = mix(behind(pixel, dir), color, front.coverage);
    out_color = vec4(ENCODE_SRGB ? encode_srgb(color) : color, 1.0);
}
