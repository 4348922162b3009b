// The walk of one view ray through the liquid that a density field and balls are, and the light it brings back: what walk.frag
// does in maps, without a view. DEBUG, SCENE, CUBE as there.
#version 460
// Compiled with any of: DEBUG, SCENE, CUBE
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "output.glsl"
#include "optics.glsl"
#include "field.glsl"
layout(constant_id = 0) const uint REFRACTIONS = 4;
layout(constant_id = 1) const uint INTERNAL_REFLECTIONS = 4;
layout(constant_id = 2) const bool EXACT_FRESNEL = false;
layout(constant_id = 3) const bool ENCODE_SRGB = false;
layout(constant_id = 4) const bool HOST_BACKGROUND = false; // only liquid is drawn, over what is there
layout(constant_id = 5) const uint TRACE_REFLECTIONS = 0; // rays followed beside the view's, a pixel
layout(push_constant) uniform PushBlock {
    uint slots;    // of the directory
    float ball;    // radius of a ball, in spacings
    float spacing; // of the nodes, in particle radii
} push;
layout(location = 0) out vec4 out_color;
#ifdef DEBUG
layout(location = 1) out vec4 out_walk;      // pattern, outcome, hits, length inside
layout(location = 2) out vec4 out_direction; // world space; w: surfaces whose normal faced the wrong way
#endif
#include "environment.glsl"
#include "scene.glsl"
#include "line.glsl"
#include "background.glsl"
#include "field_space.glsl"
#include "field_walls.glsl"
#include "field_first.glsl"

// How far a pixel's view ray has come.
struct Walk {
    vec3 x; // in the field
    vec3 dir;
    vec3 color; // gathered so far
    vec3 light; // fraction of what the ray brings back from here on that reaches the eye
    float hits;
    float length_inside; // in particle radii
    float flipped; // surfaces whose normal faced the wrong way
    int within;    // class of the volume it is in, or AIR
    vec3 center;   // of the ball, where that is one
    int second;    // class of the second volume, or -1
    int outcome;
    uint volumes;  // entered
    uint bounces;
    ivec2 scene_pixel; // where it ended on the scene
};

// Up to where a ray stays in the box around the liquid, and from where on; beyond that where it passes by.
vec2 within_box(vec3 x, vec3 dir) {
    vec3 part = field_part();
    vec3 low = (frame.bounds_min - BOX_MARGIN) / push.spacing + part, high = (frame.bounds_max + BOX_MARGIN) / push.spacing + part;
    vec3 per_dir = 1.0 / mix(dir, vec3(1e-20), lessThan(abs(dir), vec3(1e-20)));
    vec3 a = (low - x) * per_dir, b = (high - x) * per_dir, begin = min(a, b), end = max(a, b);
    return vec2(max(max(begin.x, begin.y), max(begin.z, 0.0)), min(end.x, min(end.y, end.z)));
}

void write_color(vec3 color) { out_color = vec4(ENCODE_SRGB ? encode_srgb(color) : color, 1.0); }

// What is known of the view ray's own walk.
void write_walk(int pattern, int outcome, Walk w) {
#ifdef DEBUG
    out_walk = vec4(float(pattern), float(outcome), w.hits, w.length_inside);
    out_direction = vec4(w.dir, w.flipped);
#endif
}

// What a ray brings back that meets no more liquid. The host's scene is known in the view alone.
vec3 light_from(vec3 x, vec3 dir) {
    vec3 eye = to_eye(x), eye_dir = dir_to_eye(dir);
#ifdef SCENE
    return in_sight(eye) ? background(eye, eye_dir) : infinitely_far(eye_dir);
#else
    return env_color(eye_dir);
#endif
}

// A reflected ray that waits to be followed: where it begins, what share of the pixel's light it brings, and what it is in.
struct Reflection {
    vec3 x;
    vec3 dir;
    vec3 light; // none: there is no such ray
    int within;
    vec3 center;
};
Reflection waiting[REFLECTIONS_WAITING]; // the most important first
const Reflection NO_REFLECTION = Reflection(vec3(0.0), vec3(0.0), vec3(0.0), AIR, vec3(0.0));
float importance(Reflection r) { return max(r.light.x, max(r.light.y, r.light.z)); }

vec3 light_of(Reflection r) {
    vec3 light = vec3(0.0);
    if (importance(r) > 0.0) light = r.light * light_from(r.x, r.dir);
    return light;
}

// Has a reflected ray wait for its turn. The light of the one that is not to be followed: this one, or the least important
// where there is no room.
vec3 reflected_light(Reflection r) {
    for (int i = 0; i < REFLECTIONS_WAITING; ++i) {
        Reflection other = waiting[i];
        bool before = importance(r) >= REFLECTION_LEAST && importance(r) > importance(other);
        if (before) {
            waiting[i] = r;
            r = other;
        }
    }
    return light_of(r);
}

Reflection next_reflection() {
    Reflection next = waiting[0];
    for (int i = 1; i < REFLECTIONS_WAITING; ++i) waiting[i - 1] = waiting[i];
    waiting[REFLECTIONS_WAITING - 1] = NO_REFLECTION;
    return next;
}

// Eqs. (6) to (8) of Imai16 at a wall: what the outside sends back is gathered, and the ray is bent, or
// beyond the critical angle reflected inside.
void meet(inout Walk w, Wall wall) {
    vec3 dir = w.dir, n = normal_at(wall, w.x, dir);
    bool entering = w.within == AIR;
    w.hits += 1.0;
    if ((dot(dir, n) > 0.0) == entering) {
        n = -n;
        w.flipped += 1.0;
    }
    vec3 against = entering ? n : -n;
    vec3 bent = refract(dir, against, entering ? 1.0 / frame.ior : frame.ior), mirrored = reflect(dir, against);
    if (dot(bent, bent) > 0.0) {
        float before = -dot(dir, against), after = -dot(bent, against);
        float reflected = fresnel(entering ? before : after, entering ? after : before, frame.ior, EXACT_FRESNEL);
        if (TRACE_REFLECTIONS == 0u) w.color += w.light * reflected * light_from(w.x, mirrored);
        else w.color += reflected_light(Reflection(w.x + FIELD_NUDGE * against, mirrored, w.light * reflected, w.within, w.center));
        w.light *= 1.0 - reflected;
        w.dir = bent;
        w.within = entering ? wall.cls : AIR;
        w.center = wall.place;
        if (entering) {
            ++w.volumes;
            if (w.volumes == 2u) w.second = wall.cls;
        }
        w.x -= FIELD_NUDGE * against;
    } else {
        w.dir = mirrored;
        if (w.bounces == INTERNAL_REFLECTIONS) w.outcome = OUTCOME_REFLECTION_LIMIT;
        ++w.bounces;
        w.x += FIELD_NUDGE * against;
    }
}

// Whether liquid goes on behind a wall from within: then there is none.
bool handed_over(inout Walk w, inout Block block, Wall wall) {
    uint ball = wall.ball;
    vec3 center;
    // Behind a ball there may be the body.
    bool body = false;
    if (w.within == CLASS_SPLASH) body = in_field(block, w.x, ball);
    bool other = !body && ball_around(w.x, ball, center);
    if (body) w.within = CLASS_BODY;
    if (other) {
        w.within = CLASS_SPLASH;
        w.center = center;
    }
    return body || other;
}

// Goes on to the next wall, or to where the walk ends; eq. (9) on the way inside. True where there is nothing to meet: from
// one volume into another.
bool go_on(inout Walk w, inout Block block, out Wall wall) {
    bool inside = w.within != AIR, stopped = false;
    vec2 box = within_box(w.x, w.dir);
    if (w.within == CLASS_SPLASH) {
        vec2 t;
        meets_ball(w.center, w.x, w.dir, t);
        t.y = max(t.y, 0.0);
        wall = Wall(t.y, CLASS_SPLASH, w.center, 0u, 0u);
    } else {
        wall = find_wall(block, w.x, w.dir, inside, box.x, box.y, stopped);
    }
    int found = stopped ? OUTCOME_NOT_CONVERGED : wall.t < NONE ? OUTCOME_HIT : inside ? OUTCOME_NO_WALL : OUTCOME_NO_LIQUID;
    float t = min(wall.t, max(box.y, 0.0));
#ifdef SCENE
    // Where the scene stands in the liquid, or just beyond its wall, the liquid reaches up to it.
    float t_scene, gap = 0.0;
    if (inside && found == OUTCOME_HIT)
        gap = WETTING_GAP / max(abs(dot(w.dir, normal_at(wall, w.x + t * w.dir, w.dir))), WETTING_FLAT);
    vec3 eye = to_eye(w.x);
    if ((inside || found == OUTCOME_HIT) && in_sight(eye) &&
        meets_scene(in_view(eye, dir_to_eye(w.dir), push.spacing * t + gap), t_scene, w.scene_pixel)) {
        t = t_scene / push.spacing;
        found = OUTCOME_SCENE;
    }
#endif
    if (inside) {
        w.length_inside += push.spacing * t;
        w.light *= exp(-frame.absorption * (push.spacing * t));
    }
    if (inside || found == OUTCOME_HIT) w.x += t * w.dir;
    w.outcome = found;
    return found == OUTCOME_HIT && inside && handed_over(w, block, wall);
}

void main() {
    ivec2 pixel = whole(floor(view_position()));
    vec3 v = view_ray(view_position()), eye_dir = normalize(v);
    Walk w = Walk(to_field(frame.near * v), transpose(mat3(frame.view)) * eye_dir, vec3(0.0), vec3(1.0), 0.0, 0.0, 0.0, AIR, vec3(0.0), -1,
                  OUTCOME_HIT, 0u, 0u, pixel);
    Block block = NOWHERE;
    bool stopped;
    Wall wall = first_wall(block, pixel, w.x, w.dir, eye_dir, w.within, w.center, stopped);
    int first = wall.cls;
    bool straight = w.within != AIR;
    if (straight) {
        first = w.within;
        w.volumes = 1u;
    } else {
        w.x += wall.t * w.dir;
    }
    if (wall.t == NONE || scene_hides(pixel, -to_eye(w.x).z)) {
        if (HOST_BACKGROUND) discard;
        write_color(behind(pixel, eye_dir));
        write_walk(PATTERN_NONE, stopped ? OUTCOME_NOT_CONVERGED : OUTCOME_NO_LIQUID, w);
        return;
    }
    const uint volumes = REFRACTIONS == 1 ? 1u : REFRACTIONS / 2u, most = REFRACTIONS + INTERNAL_REFLECTIONS + uint(MOST_HAND_OVERS);
    if (TRACE_REFLECTIONS > 0u) {
        for (int i = 0; i < REFLECTIONS_WAITING; ++i) waiting[i] = NO_REFLECTION;
    }
    // The view ray, then reflected ones, each with as many refractions and reflections of its own.
    for (uint traced = 0u;; ++traced) {
        bool done = false;
        for (uint i = 0u; i < most && !done; ++i) {
            if (!straight) meet(w, wall);
            done = REFRACTIONS == 1 || w.outcome != OUTCOME_HIT || (w.within == AIR && w.volumes == volumes);
            if (!done) {
                straight = go_on(w, block, wall);
                done = w.outcome != OUTCOME_HIT;
            }
        }
#ifdef SCENE
        if (w.outcome == OUTCOME_SCENE) w.color += w.light * scene_light(w.scene_pixel);
        else
#endif
        w.color += w.light * light_from(w.x, w.dir);
        if (traced == 0u) {
            int outcome = done ? w.outcome : OUTCOME_NOT_CONVERGED;
            if (outcome == OUTCOME_NO_LIQUID) outcome = OUTCOME_HIT; // no second volume
            int pattern = w.second < 0 ? PATTERN_SPLASH + first : PATTERN_SPLASH_SPLASH + 2 * first + w.second;
            write_walk(pattern, outcome, w);
        }
        if (TRACE_REFLECTIONS == 0u || traced == TRACE_REFLECTIONS || importance(waiting[0]) == 0.0) break;
        Reflection next = next_reflection();
        w.x = next.x;
        w.dir = next.dir;
        w.light = next.light;
        w.within = next.within;
        w.center = next.center;
        w.outcome = OUTCOME_HIT;
        w.volumes = w.within == AIR ? 0u : 1u;
        w.bounces = 0u;
        straight = true;
    }
    if (TRACE_REFLECTIONS > 0u) {
        for (int i = 0; i < REFLECTIONS_WAITING; ++i) w.color += light_of(waiting[i]);
    }
    write_color(w.color);
}
