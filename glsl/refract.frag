// The walk of one view ray through up to two volumes of liquid, and the light it brings back (Imai16 sections 4.4,
// 4.5, eqs. 6 to 9), with total internal reflection followed inside (beyond the paper).
// DEBUG writes what the walk met beside the colour it writes anyway.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "normal.glsl"
#include "optics.glsl"
layout(constant_id = 0) const uint REFRACTIONS = 4;
layout(constant_id = 1) const uint INTERNAL_REFLECTIONS = 4;
layout(constant_id = 2) const bool EXACT_FRESNEL = false;
layout(constant_id = 3) const bool HAS_SPLASH = true;
layout(constant_id = 4) const bool HAS_BODY = true;
layout(constant_id = 5) const bool HAS_SCENE = false;
layout(constant_id = 6) const bool ENCODE_SRGB = false;
layout(set = 0, binding = 1) uniform texture2DArray body_depth;
layout(set = 0, binding = 2) uniform utexture2DArray body_normal;
layout(set = 0, binding = 3) uniform texture2DArray splash_depth;
layout(set = 0, binding = 4) uniform utexture2DArray splash_normal;
layout(set = 0, binding = 5) uniform texture2D environment; // equirectangular, linear
layout(set = 0, binding = 6) uniform texture2D scene_color; // the host's opaque scene, linear
layout(set = 0, binding = 7) uniform texture2D scene_depth; // its depth buffer
layout(set = 0, binding = 8) uniform texture2DArray front_tiles; // smallest, largest front depth
layout(location = 0) out vec4 out_color;
#ifdef DEBUG
layout(location = 1) out vec4 out_walk;      // pattern, outcome, hits, length inside
layout(location = 2) out vec4 out_direction; // world space; w: surfaces whose normal faced the wrong way
#endif
#include "search.glsl"
#include "background.glsl"

void finish(vec3 color, int pattern, int outcome, float hits, float length_inside, vec3 direction, float flipped) {
    out_color = vec4(ENCODE_SRGB ? encode_srgb(color) : color, 1.0);
#ifdef DEBUG
    out_walk = vec4(float(pattern), float(outcome), hits, length_inside);
    out_direction = vec4(transpose(mat3(frame.view)) * direction, flipped);
#endif
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 v = view_ray(gl_FragCoord.xy), dir = normalize(v);
    float ior = frame.search.w, near = frame.viewport.z;
    float splash = HAS_SPLASH ? map_depth(CLASS_SPLASH, SIDE_FRONT, pixel) : 0.0;
    float body = HAS_BODY ? map_depth(CLASS_BODY, SIDE_FRONT, pixel) : 0.0;

    // Negative: the near plane lies inside that class. The eye is inside the body where the host says so.
    bool body_around = HAS_BODY && frame.scene.w != 0.0 && (REFRACTIONS == 1 || map_depth(CLASS_BODY, SIDE_BACK, pixel) > 0.0);
    bool inside = body_around || body < 0.0 || splash < 0.0;
    int cls = body_around || body < 0.0 ? CLASS_BODY : CLASS_SPLASH;
    float depth = near;
    if (!inside) {
        cls = splash > 0.0 && (body <= 0.0 || splash <= body) ? CLASS_SPLASH : CLASS_BODY;
        depth = cls == CLASS_SPLASH ? splash : body;
    }
    if (depth <= 0.0 || scene_hides(pixel, depth)) {
        finish(behind(pixel, dir), PATTERN_NONE, OUTCOME_NO_LIQUID, 0.0, 0.0, dir, 0.0);
        return;
    }

    vec3 x = depth * v, color = vec3(0.0), light = vec3(1.0);
    float hits = 0.0, length_inside = 0.0, flipped = 0.0;
    int outcome = OUTCOME_HIT, doubt = OUTCOME_HIT, first = cls, second = -1;
    uint bounces = 0u;
    bool entering = !inside;
    const uint volumes = REFRACTIONS == 1 ? 1u : REFRACTIONS / 2u;
    for (uint volume = 0u; volume < volumes && outcome == OUTCOME_HIT; ++volume) {
        if (entering) {
            bool smooth_here;
            vec3 n = volume == 0u ? map_normal(cls, SIDE_FRONT, pixel) : sample_normal(cls, SIDE_FRONT, project(x), smooth_here);
            if (dot(dir, n) > 0.0) {
                n = -n;
                flipped += 1.0;
            }
            float air = -dot(dir, n);
            vec3 bent = refract(dir, n, 1.0 / ior);
            float share = fresnel(air, -dot(bent, n), ior, EXACT_FRESNEL);
            color += light * share * background(x, reflect(dir, n));
            light *= 1.0 - share;
            dir = bent;
            hits += 1.0;
        }
        entering = true;
        if (REFRACTIONS == 1) break;

        int came_from = -1;
        bool outside = false;
        while (!outside && outcome == OUTCOME_HIT) {
            float t;
            int side;
            int found = find_exit(trace(x, dir), cls, came_from, t, side);
            if (found == OUTCOME_PAST_JUMP || found == OUTCOME_OTHER_WALL) {
                doubt = doubt == OUTCOME_HIT ? found : doubt;
                found = OUTCOME_HIT;
            }
            outcome = found;
            x += t * dir;
            length_inside += t;
            light *= exp(-frame.absorption.rgb * t);
            if (outcome != OUTCOME_HIT) break;
            hits += 1.0;
            bool smooth_here;
            vec3 n = sample_normal(cls, side, project(x), smooth_here);
            if (!smooth_here && doubt == OUTCOME_HIT) doubt = OUTCOME_PAST_JUMP;
            if (dot(dir, n) < 0.0) {
                n = -n;
                flipped += 1.0;
            }
            vec3 bent = refract(dir, -n, ior), mirrored = reflect(dir, -n);
            if (dot(bent, bent) > 0.0) {
                float share = fresnel(dot(bent, n), dot(dir, n), ior, EXACT_FRESNEL);
                color += light * share * background(x, mirrored);
                light *= 1.0 - share;
                dir = bent;
                outside = true;
            } else {
                // Beyond the critical angle all of it stays inside.
                dir = mirrored;
                came_from = side;
                if (bounces == INTERNAL_REFLECTIONS) outcome = OUTCOME_REFLECTION_LIMIT;
                ++bounces;
            }
        }
        if (outcome != OUTCOME_HIT || volume + 1u == volumes) break;

        float t;
        int found;
        bool jumped;
        int next = find_entry(trace(x, dir), t, found, jumped);
        if (jumped && doubt == OUTCOME_HIT) doubt = OUTCOME_PAST_JUMP;
        if (next < 0) {
            outcome = found;
            break;
        }
        x += t * dir;
        cls = second = next;
    }
    color += light * background(x, dir);
    int pattern = second < 0 ? PATTERN_SPLASH + first : PATTERN_SPLASH_SPLASH + 2 * first + second;
    finish(color, pattern, outcome == OUTCOME_HIT ? doubt : outcome, hits, length_inside, dir, flipped);
}
