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
#include "output.glsl"
#include "normal.glsl"
#include "optics.glsl"
layout(constant_id = 0) const uint REFRACTIONS = 4;
layout(constant_id = 1) const uint INTERNAL_REFLECTIONS = 4;
layout(constant_id = 2) const bool EXACT_FRESNEL = false;
layout(constant_id = 3) const bool HAS_SPLASH = true;
layout(constant_id = 4) const bool HAS_BODY = true;
layout(constant_id = 5) const bool ENCODE_SRGB = false;
layout(constant_id = 6) const bool HOST_BACKGROUND = false; // only liquid is drawn, over what is there
layout(set = 0, binding = 1, rgba32f) uniform readonly image2D walls; // pixels above, tiles below (walls.comp)
layout(set = 0, binding = 2) uniform texture2DArray body_depth;
layout(set = 0, binding = 3) uniform utexture2DArray body_normal;
layout(set = 0, binding = 4) uniform texture2DArray splash_depth;
layout(set = 0, binding = 5) uniform utexture2DArray splash_normal;
layout(location = 0) out vec4 out_color;
#ifdef DEBUG
layout(location = 1) out vec4 out_walk;      // pattern, outcome, hits, length inside
layout(location = 2) out vec4 out_direction; // world space; w: surfaces whose normal faced the wrong way
#endif
#include "environment.glsl"
#include "scene.glsl"
#include "line.glsl"
#include "walls.glsl"
#include "background.glsl"

const int AIR = -1; // beside the classes: what a ray is in

// How far a pixel's view ray has come.
struct Walk {
    vec3 x; // eye space
    vec3 dir;
    vec3 color; // gathered so far
    vec3 light; // fraction of what the ray brings back from here on that reaches the eye
    float hits;
    float length_inside;
    float flipped; // surfaces whose normal faced the wrong way
    int within;    // class of the volume it is in, or AIR
    Ball ball;     // where that is a splash
    int second;    // class of the second volume, or -1
    int outcome;
    uint volumes;  // entered
    uint bounces;
    bool side;     // whether it met a side wall
    ivec2 scene_pixel; // where it ended on the scene
};

void write_pixel(vec3 color, int pattern, int outcome, Walk w) {
    out_color = vec4(ENCODE_SRGB ? encode_srgb(color) : color, 1.0);
#ifdef DEBUG
    out_walk = vec4(float(pattern), float(outcome), w.hits, w.length_inside);
    out_direction = vec4(transpose(mat3(frame.view)) * w.dir, w.flipped);
#endif
}

float front_depth(int cls, ivec2 pixel) {
    if (cls == CLASS_SPLASH) return HAS_SPLASH ? texelFetch(splash_depth, ivec3(pixel, SIDE_FRONT), 0).x : 0.0;
    return HAS_BODY ? texelFetch(body_depth, ivec3(pixel, SIDE_FRONT), 0).x : 0.0;
}

// Depth of the first surface at a pixel, the nearer of both fronts, and its class; not above 0 where there is no liquid.
// Where liquid surrounds the eye, the ray starts `inside`, at the near plane.
float first_surface(ivec2 pixel, out int cls, out bool inside) {
    float splash = front_depth(CLASS_SPLASH, pixel), body = front_depth(CLASS_BODY, pixel);
    // Negative: the near plane lies inside that class. The eye is inside the body where the host says so.
    bool body_around = false;
    if (HAS_BODY) body_around = frame.eye_inside * (REFRACTIONS == 1 ? 1.0 : walls_at(pixel).y) > 0.0;
    inside = body_around || body < 0.0 || splash < 0.0;
    cls = body_around || body < 0.0 ? CLASS_BODY : CLASS_SPLASH;
    float depth = frame.near;
    if (!inside) {
        cls = splash > 0.0 && (body <= 0.0 || splash <= body) ? CLASS_SPLASH : CLASS_BODY;
        depth = cls == CLASS_SPLASH ? splash : body;
    }
    return depth;
}

// Eqs. (6) to (8) at a wall with the outward normal n: what the outside sends back is gathered, and the ray is bent, or beyond the
// critical angle reflected inside.
void meet(inout Walk w, Wall wall) {
    vec3 n = wall.normal, dir = w.dir;
    bool entering = w.within == AIR;
    w.hits += 1.0;
    if ((dot(w.dir, n) > 0.0) == entering) {
        // A ray that comes through a side wall the wrong way is not bent.
        n = wall.side ? (entering ? -dir : dir) : -n;
        w.flipped += 1.0;
    }
    vec3 against = entering ? n : -n;
    vec3 bent = refract(w.dir, against, entering ? 1.0 / frame.ior : frame.ior), mirrored = reflect(w.dir, against);
    if (dot(bent, bent) > 0.0) {
        float before = -dot(w.dir, against), after = -dot(bent, against);
        float reflected = fresnel(entering ? before : after, entering ? after : before, frame.ior, EXACT_FRESNEL);
        w.color += w.light * reflected * background(w.x, mirrored);
        w.light *= 1.0 - reflected;
        w.dir = bent;
        w.within = entering ? wall.cls : AIR;
        if (entering) {
            ++w.volumes;
            if (w.volumes == 2u) w.second = wall.cls;
        }
    } else {
        w.dir = mirrored;
        if (w.bounces == INTERNAL_REFLECTIONS) w.outcome = OUTCOME_REFLECTION_LIMIT;
        ++w.bounces;
    }
    w.x += (w.within == AIR ? wall.beside.y : wall.beside.x) * dir;
}

// Whether liquid of the other class goes on behind a wall from within: then there is none. Takes the ray there.
bool handed_over(inout Walk w, int cls) {
    ivec2 pixel = nearest(project(w.x));
    float d = -w.x.z;
    if (cls == CLASS_SPLASH) {
        if (!HAS_BODY || g_of(body_at(project(w.x), d).terms) >= 0.0) return false;
        w.within = CLASS_BODY;
        return true;
    }
    if (!HAS_SPLASH) return false;
    vec2 depths = walls_at(pixel).zw;
    if (d < depths.x || d > depths.y) return false;
    Ball ball = ball_at(pixel, depths);
    vec3 q = w.x - ball.center;
    if (dot(q, q) >= ball.radius * ball.radius) return false;
    w.within = CLASS_SPLASH;
    w.ball = ball;
    return true;
}

// Goes on to the next wall, or to where the walk ends; eq. (9) on the way inside. True where there is nothing to meet: from
// splash to body, or back.
bool go_on(inout Walk w, out Wall wall) {
    bool inside = w.within != AIR;
    int found = OUTCOME_HIT;
    if (w.within == CLASS_SPLASH) {
        vec2 t;
        meets_ball(w.ball, w.x, w.dir, t);
        t.y = max(t.y, 0.0);
        wall = Wall(t.y, (w.x + t.y * w.dir - w.ball.center) / w.ball.radius, CLASS_SPLASH, false, vec2(0.0), w.ball);
    } else {
        Ray ray = trace(w.x, w.dir);
        int outcome;
        if (!find_wall(ray, inside, wall, outcome)) {
            found = outcome;
            if (!inside && outcome == OUTCOME_HIT) found = OUTCOME_NO_LIQUID;
        }
    }
    w.ball = wall.ball; // so that the last one needs no registers while a wall is looked for
    float t = wall.t;
#ifdef SCENE
    // Where the scene stands in the liquid, or just beyond its wall, the liquid reaches up to it.
    float t_scene, gap = inside && found == OUTCOME_HIT ? WETTING_GAP / max(abs(dot(w.dir, wall.normal)), WETTING_FLAT) : 0.0;
    if ((inside || found == OUTCOME_HIT) && meets_scene(in_view(w.x, w.dir, t + gap), t_scene, w.scene_pixel)) {
        t = t_scene;
        found = OUTCOME_SCENE;
    }
#endif
    if (inside) {
        w.length_inside += t;
        w.light *= exp(-frame.absorption * t);
    }
    if (inside || found == OUTCOME_HIT) w.x += t * w.dir;
    w.outcome = found;
    if (found != OUTCOME_HIT) return false;
    if (inside && handed_over(w, wall.cls)) return true;
    w.side = w.side || wall.side;
    return false;
}

void main() {
    ivec2 pixel = whole(floor(view_position()));
    vec3 v = view_ray(view_position()), dir = normalize(v);
    int first;
    bool inside;
    float depth = first_surface(pixel, first, inside);
    Walk w = Walk(depth * v, dir, vec3(0.0), vec3(1.0), 0.0, 0.0, 0.0, AIR, Ball(vec3(0.0), 1.0), -1, OUTCOME_HIT, 0u, 0u, false, pixel);
    bool nothing = depth <= 0.0 || scene_hides(pixel, depth);
    if (nothing && HOST_BACKGROUND) discard;
#ifdef SCENE
    if (nothing) {
        write_pixel(behind(pixel, dir), PATTERN_NONE, OUTCOME_NO_LIQUID, w);
        return;
    }
#endif

    Wall wall = Wall(0.0, vec3(0.0), first, false, vec2(0.0), w.ball);
    if (first == CLASS_SPLASH) {
        wall.normal = decode_normal(texelFetch(splash_normal, ivec3(pixel, SIDE_FRONT), 0).x);
        vec2 depths = vec2(depth, texelFetch(splash_depth, ivec3(pixel, SIDE_BACK), 0).x);
        wall.ball = ball_at(pixel, depths);
        w.ball = wall.ball;
    } else {
        wall.normal = body_normal_of(SIDE_FRONT, pixel);
    }
    if (inside) {
        w.within = first;
        w.volumes = 1u;
    }
    const uint volumes = REFRACTIONS == 1 ? 1u : REFRACTIONS / 2u, most = REFRACTIONS + INTERNAL_REFLECTIONS + uint(MOST_HAND_OVERS);
    // Where nothing is to be met: inside at the start, or from one class to the other.
    bool straight = inside, done = nothing; // without a scene the same look-up serves rays that meet nothing
    for (uint i = 0u; i < most && !done; ++i) {
        if (!straight) meet(w, wall);
        done = REFRACTIONS == 1 || w.outcome != OUTCOME_HIT || (w.within == AIR && w.volumes == volumes);
        if (!done) {
            straight = go_on(w, wall);
            done = w.outcome != OUTCOME_HIT;
        }
    }
    int outcome = w.outcome;
    if (!done) outcome = OUTCOME_NOT_CONVERGED;
    if (outcome == OUTCOME_NO_LIQUID) outcome = OUTCOME_HIT; // no second volume
    if (outcome == OUTCOME_HIT && w.side) outcome = OUTCOME_SIDE_WALL;
#ifdef SCENE
    if (w.outcome == OUTCOME_SCENE) w.color += w.light * scene_light(w.scene_pixel);
    else
#endif
    w.color += w.light * background(w.x, w.dir);
    int pattern = w.second < 0 ? PATTERN_SPLASH + first : PATTERN_SPLASH_SPLASH + 2 * first + w.second;
    if (nothing) {
        pattern = PATTERN_NONE;
        outcome = OUTCOME_NO_LIQUID;
    }
    write_pixel(w.color, pattern, outcome, w);
}
