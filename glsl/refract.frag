// The walk of one view ray through up to two volumes of liquid, and the light it brings back (Imai16 sections 4.4,
// 4.5, eqs. 6 to 9), with total internal reflection followed inside (beyond the paper).
// DEBUG writes what the walk met beside the colour it writes anyway. SCENE: there is an opaque scene of the host's. CUBE: the
// environment is a cube map.
//
// No branch here, or in any other shader, may hang on uniforms alone: lavapipe inlines such values as constants, and with
// Mesa 22.3 compiles the shader anew in every frame and keeps it (9 MB and 200 ms each). Mixed with something fetched, or
// as a specialisation constant, the same condition costs nothing (tests/endurance.rs).
#version 460
// Compiled with any of: DEBUG, SCENE, CUBE
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
layout(constant_id = 5) const bool ENCODE_SRGB = false;
layout(constant_id = 6) const bool HOST_BACKGROUND = false; // only liquid is drawn, over what is there
layout(set = 0, binding = 1) uniform texture2DArray body_depth;
layout(set = 0, binding = 2) uniform utexture2DArray body_normal;
layout(set = 0, binding = 3) uniform texture2DArray splash_depth;
layout(set = 0, binding = 4) uniform utexture2DArray splash_normal;
layout(set = 0, binding = 5) uniform texture2DArray front_tiles; // smallest, largest front depth
#ifdef CUBE
layout(set = 0, binding = 6) uniform textureCube environment; // linear
layout(set = 0, binding = 7) uniform sampler environment_sampler; // nearest
#else
layout(set = 0, binding = 6) uniform texture2D environment; // equirectangular, linear
#endif
#ifdef SCENE
layout(set = 0, binding = 8) uniform texture2D scene_color; // the host's opaque scene, linear
layout(set = 0, binding = 9) uniform texture2D scene_depth; // its depth buffer
#endif
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
    bool body_around = false;
    if (HAS_BODY) body_around = frame.scene.w * (REFRACTIONS == 1 ? 1.0 : map_depth(CLASS_BODY, SIDE_BACK, pixel)) > 0.0;
    bool inside = body_around || body < 0.0 || splash < 0.0;
    int cls = body_around || body < 0.0 ? CLASS_BODY : CLASS_SPLASH;
    float depth = near;
    if (!inside) {
        cls = splash > 0.0 && (body <= 0.0 || splash <= body) ? CLASS_SPLASH : CLASS_BODY;
        depth = cls == CLASS_SPLASH ? splash : body;
    }
    if (depth <= 0.0 || scene_hides(pixel, depth)) {
        if (HOST_BACKGROUND) discard;
        finish(behind(pixel, dir), PATTERN_NONE, OUTCOME_NO_LIQUID, 0.0, 0.0, dir, 0.0);
        return;
    }

    vec3 x = depth * v, color = vec3(0.0), light = vec3(1.0);
    float hits = 0.0, length_inside = 0.0, flipped = 0.0;
    int outcome = OUTCOME_HIT, doubt = OUTCOME_HIT, first = cls, second = -1;
    uint bounces = 0u;
    bool entering = !inside;
#ifdef SCENE
    ivec2 met; // where the ray ended on the scene
#endif
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
            t = max(t, 0.0); // the last step onto a wall at hand may round to before it
            if (found == OUTCOME_PAST_JUMP || found == OUTCOME_OTHER_WALL) {
                doubt = doubt == OUTCOME_HIT ? found : doubt;
                found = OUTCOME_HIT;
            }
            outcome = found;
            bool smooth_here = true;
            vec3 n = dir;
            if (outcome == OUTCOME_HIT) n = sample_normal(cls, side, project(x + t * dir), smooth_here);
#ifdef SCENE
            // Where the scene stands in the liquid, or just beyond its wall, the liquid reaches up to it.
            float t_scene, gap = outcome == OUTCOME_HIT ? WETTED / max(abs(dot(dir, n)), WETTED_FLAT) : 0.0;
            if (meets_scene(in_view(x, dir, t + gap), t_scene, met)) {
                t = t_scene;
                outcome = OUTCOME_SCENE;
            }
#endif
            x += t * dir;
            length_inside += t;
            light *= exp(-frame.absorption.rgb * t);
            if (outcome != OUTCOME_HIT) break;
            hits += 1.0;
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
#ifdef SCENE
        float t_scene;
        if (next >= 0 && meets_scene(in_view(x, dir, t), t_scene, met)) {
            outcome = OUTCOME_SCENE;
            break;
        }
#endif
        if (jumped && doubt == OUTCOME_HIT) doubt = OUTCOME_PAST_JUMP;
        if (next < 0) {
            outcome = found;
            break;
        }
        x += t * dir;
        cls = second = next;
    }
#ifdef SCENE
    if (outcome == OUTCOME_SCENE) color += light * scene_light(met);
    else
#endif
    color += light * background(x, dir);
    int pattern = second < 0 ? PATTERN_SPLASH + first : PATTERN_SPLASH_SPLASH + 2 * first + second;
    finish(color, pattern, outcome == OUTCOME_HIT ? doubt : outcome, hits, length_inside, dir, flipped);
}
