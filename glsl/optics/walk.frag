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
layout(location = 0) out vec4 out_color;
#ifdef DEBUG
layout(location = 1) out vec4 out_walk;      // pattern, outcome, hits, length inside
layout(location = 2) out vec4 out_direction; // world space; w: surfaces whose normal faced the wrong way
#endif
#include "environment.glsl"
#include "scene.glsl"
#include "search.glsl"
#include "background.glsl"

// How far a pixel's view ray has come.
struct Walk {
    vec3 x; // eye space
    vec3 dir;
    vec3 color; // gathered so far
    vec3 light; // fraction of what the ray brings back from here on that reaches the eye
    float hits;
    float length_inside;
    float flipped; // surfaces whose normal faced the wrong way
    int cls;       // of the volume it is in, or enters
    int second;    // class of the second volume, or -1
    int outcome;
    int doubt; // why a walk that met every surface may have missed one, or OUTCOME_HIT
    uint bounces;
    ivec2 scene_pixel; // where it ended on the scene
};

void write_pixel(vec3 color, int pattern, int outcome, Walk w) {
    out_color = vec4(ENCODE_SRGB ? encode_srgb(color) : color, 1.0);
#ifdef DEBUG
    out_walk = vec4(float(pattern), float(outcome), w.hits, w.length_inside);
    out_direction = vec4(transpose(mat3(frame.view)) * w.dir, w.flipped);
#endif
}

void note_doubt(inout Walk w, int why) { w.doubt = w.doubt == OUTCOME_HIT ? why : w.doubt; }

// Turns a normal to where it has to face.
void face(inout Walk w, inout vec3 n, bool wrong) {
    if (wrong) {
        n = -n;
        w.flipped += 1.0;
    }
}

// Depth of the first surface at a pixel, the nearer of both fronts, and its class; not above 0 where there is no liquid.
// Where liquid surrounds the eye, the ray starts `inside`, at the near plane.
float first_surface(ivec2 pixel, out int cls, out bool inside) {
    float splash = HAS_SPLASH ? map_depth(CLASS_SPLASH, SIDE_FRONT, pixel) : 0.0;
    float body = HAS_BODY ? map_depth(CLASS_BODY, SIDE_FRONT, pixel) : 0.0;
    // Negative: the near plane lies inside that class. The eye is inside the body where the host says so.
    bool body_around = false;
    if (HAS_BODY) body_around = frame.eye_inside * (REFRACTIONS == 1 ? 1.0 : map_depth(CLASS_BODY, SIDE_BACK, pixel)) > 0.0;
    inside = body_around || body < 0.0 || splash < 0.0;
    cls = body_around || body < 0.0 ? CLASS_BODY : CLASS_SPLASH;
    float depth = frame.near;
    if (!inside) {
        cls = splash > 0.0 && (body <= 0.0 || splash <= body) ? CLASS_SPLASH : CLASS_BODY;
        depth = cls == CLASS_SPLASH ? splash : body;
    }
    return depth;
}

// Eq. (6): what is reflected at a front surface is gathered, what is refracted goes on.
void enter(inout Walk w, vec3 n) {
    face(w, n, dot(w.dir, n) > 0.0);
    float air = -dot(w.dir, n);
    vec3 bent = refract(w.dir, n, 1.0 / frame.ior);
    float reflected = fresnel(air, -dot(bent, n), frame.ior, EXACT_FRESNEL);
    w.color += w.light * reflected * background(w.x, reflect(w.dir, n));
    w.light *= 1.0 - reflected;
    w.dir = bent;
    w.hits += 1.0;
}

// Follows the ray inside up to a wall, whose normal is n, or to where it ends otherwise; eq. (9) for this interval.
void run_inside(inout Walk w, int came_from, out int side, out vec3 n) {
    float t;
    int found = find_exit(trace(w.x, w.dir), w.cls, came_from, t, side);
    t = max(t, 0.0); // the last step onto a wall at hand may round to before it
    if (found == OUTCOME_PAST_JUMP || found == OUTCOME_OPPOSITE_WALL) {
        note_doubt(w, found);
        found = OUTCOME_HIT;
    }
    w.outcome = found;
    bool whole = true;
    n = w.dir;
    if (w.outcome == OUTCOME_HIT) n = sample_normal(w.cls, side, project(w.x + t * w.dir), whole);
#ifdef SCENE
    // Where the scene stands in the liquid, or just beyond its wall, the liquid reaches up to it.
    float t_scene, gap = w.outcome == OUTCOME_HIT ? WETTING_GAP / max(abs(dot(w.dir, n)), WETTING_FLAT) : 0.0;
    if (meets_scene(in_view(w.x, w.dir, t + gap), t_scene, w.scene_pixel)) {
        t = t_scene;
        w.outcome = OUTCOME_SCENE;
    }
#endif
    w.x += t * w.dir;
    w.length_inside += t;
    w.light *= exp(-frame.absorption * t);
    if (w.outcome == OUTCOME_HIT && !whole) note_doubt(w, OUTCOME_PAST_JUMP);
}

// Eqs. (7) and (8): refracts out through a wall, or reflects all light beyond the critical angle. Returns whether the ray
// is outside now.
bool leave(inout Walk w, vec3 n) {
    w.hits += 1.0;
    face(w, n, dot(w.dir, n) < 0.0);
    vec3 bent = refract(w.dir, -n, frame.ior), mirrored = reflect(w.dir, -n);
    bool outside = dot(bent, bent) > 0.0;
    if (outside) {
        float reflected = fresnel(dot(bent, n), dot(w.dir, n), frame.ior, EXACT_FRESNEL);
        w.color += w.light * reflected * background(w.x, mirrored);
        w.light *= 1.0 - reflected;
        w.dir = bent;
    } else {
        w.dir = mirrored;
        if (w.bounces == INTERNAL_REFLECTIONS) w.outcome = OUTCOME_REFLECTION_LIMIT;
        ++w.bounces;
    }
    return outside;
}

// Through a volume, from wall to wall, until the ray leaves it or ends.
void cross_volume(inout Walk w) {
    int came_from = -1;
    bool outside = false;
    while (!outside && w.outcome == OUTCOME_HIT) {
        int side;
        vec3 n;
        run_inside(w, came_from, side, n);
        if (w.outcome != OUTCOME_HIT) break;
        outside = leave(w, n);
        came_from = side;
    }
}

// To the front of a second volume. False where the ray meets none.
bool reach_second(inout Walk w) {
    float t;
    int found;
    bool jumped;
    int next = find_entry(trace(w.x, w.dir), t, found, jumped);
#ifdef SCENE
    float t_scene;
    if (next >= 0 && meets_scene(in_view(w.x, w.dir, t), t_scene, w.scene_pixel)) {
        w.outcome = OUTCOME_SCENE;
        return false;
    }
#endif
    if (jumped) note_doubt(w, OUTCOME_PAST_JUMP);
    if (next < 0) {
        w.outcome = found;
        return false;
    }
    w.x += t * w.dir;
    w.cls = w.second = next;
    return true;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 v = view_ray(gl_FragCoord.xy), dir = normalize(v);
    int first;
    bool inside;
    float depth = first_surface(pixel, first, inside);
    Walk w = Walk(depth * v, dir, vec3(0.0), vec3(1.0), 0.0, 0.0, 0.0, first, -1, OUTCOME_HIT, OUTCOME_HIT, 0u, pixel);
    if (depth <= 0.0 || scene_hides(pixel, depth)) {
        if (HOST_BACKGROUND) discard;
        write_pixel(behind(pixel, dir), PATTERN_NONE, OUTCOME_NO_LIQUID, w);
        return;
    }

    const uint volumes = REFRACTIONS == 1 ? 1u : REFRACTIONS / 2u;
    for (uint volume = 0u; volume < volumes && w.outcome == OUTCOME_HIT; ++volume) {
        if (volume > 0u || !inside) {
            bool whole;
            enter(w, volume == 0u ? map_normal(w.cls, SIDE_FRONT, pixel) : sample_normal(w.cls, SIDE_FRONT, project(w.x), whole));
        }
        if (REFRACTIONS == 1) break;
        cross_volume(w);
        if (w.outcome != OUTCOME_HIT || volume + 1u == volumes) break;
        if (!reach_second(w)) break;
    }
#ifdef SCENE
    if (w.outcome == OUTCOME_SCENE) w.color += w.light * scene_light(w.scene_pixel);
    else
#endif
    w.color += w.light * background(w.x, w.dir);
    int pattern = w.second < 0 ? PATTERN_SPLASH + first : PATTERN_SPLASH_SPLASH + 2 * first + w.second;
    write_pixel(w.color, pattern, w.outcome == OUTCOME_HIT ? w.doubt : w.outcome, w);
}
