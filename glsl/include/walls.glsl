// Walls of the liquid along a ray (docs/methods.md, "Walls along a ray").

const float HOLE = 1e30; // g where the body has no interval

// How much the depth of a steep surface changes from pixel to pixel at a depth.
float pixel_depth(float d) { return d / max(abs(frame.pixel_scale.x), abs(frame.pixel_scale.y)); }
float jump_at(float d) { return max(JUMP, STEEP * pixel_depth(d)); }
float accepted_at(float d) { return max(ACCEPTED, ACCEPTED_PIXELS * pixel_depth(d)); }
float start_accepted_at(float d) { return max(ACCEPTED, pixel_depth(d)); }

vec4 walls_at(ivec2 pixel) { return imageLoad(walls, pixel); }

// The four pixels around a position, and the weights of the upper corner.
struct Footprint {
    ivec2 lo;
    ivec2 hi;
    vec2 weight;
};

Footprint footprint(vec2 position) {
    vec2 q = position - 0.5, corner = floor(q), last = frame.size - 1.0;
    return Footprint(whole(clamp(corner, vec2(0.0), last)), whole(clamp(corner + 1.0, vec2(0.0), last)), q - corner);
}

// From the lowest corner, so that the interpolation rounds at the spread's size and not at the depth's.
float bilinear(vec4 d, vec2 weight, float low) {
    d -= low;
    return low + mix(mix(d.x, d.y, weight.x), mix(d.z, d.w, weight.x), weight.y);
}

// The body at a position, as a ray at depth d meets it.
struct Body {
    vec2 terms;   // of g: F - d, d - B
    float spread; // of the depths that were interpolated; 0 where they were not
    bvec2 whole;  // front, back: whether they were interpolated
};

// Negative inside.
float g_of(vec2 terms) { return max(terms.x, terms.y); }

// Whose term of g is the larger.
int side_of(vec2 terms) { return terms.x > terms.y ? SIDE_FRONT : SIDE_BACK; }

Body body_at(vec2 position, float d) {
    Footprint p = footprint(position);
    vec2 a = walls_at(p.lo).xy, b = walls_at(ivec2(p.hi.x, p.lo.y)).xy, c = walls_at(ivec2(p.lo.x, p.hi.y)).xy,
         e = walls_at(p.hi).xy;
    vec2 low = min(min(a, b), min(c, e)), high = max(max(a, b), max(c, e));
    // The pixel that holds the position is one of the four.
    bool right = p.weight.x >= 0.5, lower = p.weight.y >= 0.5;
    vec2 own = lower ? (right ? e : c) : (right ? b : a);
    bool all_there = low.y > 0.0;
    float jump = jump_at(d);
    bvec2 whole = bvec2(all_there && high.x - low.x <= jump, all_there && high.y - low.y <= jump);
    float front = whole.x ? bilinear(vec4(a.x, b.x, c.x, e.x), p.weight, low.x) : own.x;
    float back = whole.y ? bilinear(vec4(a.y, b.y, c.y, e.y), p.weight, low.y) : own.y;
    float spread = max(whole.x ? high.x - low.x : 0.0, whole.y ? high.y - low.y : 0.0);
    return Body(own.y > 0.0 ? vec2(front - d, d - back) : vec2(HOLE), spread, whole);
}

vec3 body_normal_of(int side, ivec2 pixel) { return decode_normal(texelFetch(body_normal, ivec3(pixel, side), 0).x); }

// With the weights of the depth there; that of `pixel` where depths were not interpolated.
vec3 body_normal_at(int side, bool whole, vec2 position, ivec2 pixel) {
    if (!whole) return body_normal_of(side, pixel);
    Footprint p = footprint(position);
    vec3 upper = mix(body_normal_of(side, p.lo), body_normal_of(side, ivec2(p.hi.x, p.lo.y)), p.weight.x);
    vec3 lower = mix(body_normal_of(side, ivec2(p.lo.x, p.hi.y)), body_normal_of(side, p.hi), p.weight.x);
    return normalize(mix(upper, lower, p.weight.y));
}

// Where on the screen the body ends around a pixel at a depth: away from the neighbours inside, towards those outside.
vec2 outward(ivec2 pixel, float d, vec2 along) {
    vec2 sum = vec2(0.0);
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            vec2 step = vec2(x, y), body = walls_at(clamp(pixel + ivec2(x, y), ivec2(0), ivec2(frame.size) - 1)).xy;
            if (d < body.x || d > body.y) sum += step / max(dot(step, step), 1.0);
        }
    }
    return dot(sum, sum) > 0.25 ? sum : along;
}

// Of a side wall at x: `inner` is the pixel that holds the ray where it is inside, `outer` the terms of g just across the wall, `across`
// the way on the screen that the ray takes outwards.
vec3 side_normal(ivec2 inner, vec2 outer, vec3 x, vec2 across) {
    // The plane through the eye along the edge on the screen.
    vec2 c = frame.pixel_scale * outward(inner, -x.z, across);
    vec3 edge = normalize(vec3(c, dot(c, x.xy) / -x.z));
    vec3 front = body_normal_of(SIDE_FRONT, inner), back = body_normal_of(SIDE_BACK, inner), sight = normalize(x);
    vec3 limb = g_of(outer) < HOLE ? (side_of(outer) == SIDE_FRONT ? front : back) : 0.5 * (front + back);
    limb -= dot(limb, sight) * sight;
    float weight = dot(limb, edge) > 0.0 ? min(dot(limb, limb), 1.0) : 0.0;
    return normalize(mix(edge, limb, weight));
}

struct Ball {
    vec3 center; // eye space
    float radius;
};

// The splash in front at a pixel, from the depths at which the pixel's ray enters and leaves it and the normal at the first.
Ball ball_at(ivec2 pixel, vec2 depths) {
    vec3 v = view_ray(vec2(pixel) + 0.5), n = decode_normal(texelFetch(splash_normal, ivec3(pixel, SIDE_FRONT), 0).x);
    float radius = (depths.y - depths.x) * dot(v, v) / max(-2.0 * dot(n, v), 1e-6);
    // Around the near plane it is the far normal.
    if (dot(n, v) >= 0.0) return Ball(depths.y * v - SPLASH_RADIUS * n, SPLASH_RADIUS);
    return Ball(depths.x * v - radius * n, radius);
}

// Where a ray enters and leaves a ball; false where it passes by.
bool meets_ball(Ball ball, vec3 x, vec3 dir, out vec2 t) {
    vec3 q = x - ball.center;
    float middle = -dot(q, dir);
    vec3 across = q + middle * dir;
    float square = ball.radius * ball.radius - dot(across, across);
    float half_chord = sqrt(max(square, 0.0));
    t = middle + vec2(-half_chord, half_chord);
    return square > 0.0;
}

// A pixel in which a ray may meet a wall.
struct Stop {
    ivec2 pixel;
    float s;      // where the ray comes into it; at least 1 where there is none
    float end;    // where it leaves it
    bvec2 meets;  // the body, a splash
    vec2 splash;  // depths at which the pixel's ray enters and leaves that
};

// Goes on along a line from s through tiles and pixels in which a ray stays on its side, inside the body or outside of all liquid,
// by their own depths.
Stop skip(ScreenLine line, bool inside, float nudge, float s) {
    vec2 along = line.end - line.start;
    bvec2 moves = greaterThan(abs(along), vec2(1e-6));
    vec2 per_pixel = 1.0 / mix(vec2(1.0), along, moves), ahead = vec2(greaterThan(along, vec2(0.0)));
    int level = WALL_TILE_BITS, below = int(frame.size.y);
    Stop stop = Stop(pixel_after(line, s, nudge), s, s, bvec2(false), vec2(0.0));
    float d = depth_at(line, s);
    bool stopped = false;
    for (int i = 0; i < MARCH_STEPS && !stopped && stop.s < 1.0; ++i) {
        ivec2 at = stop.pixel >> level;
        vec4 wall = walls_at(ivec2(at.x, level > 0 ? at.y + below : at.y));
        vec2 border = (vec2(at << level) + float(1 << level) * ahead - line.start) * per_pixel;
        float end = min(moves.x ? border.x : 1.0, moves.y ? border.y : 1.0);
        end = clamp(end, min(stop.s + nudge, 1.0), 1.0);
        float d_end = depth_at(line, end), shallow = min(d, d_end), deep = max(d, d_end);
        bool beside_body = level > 0 || deep < wall.x || shallow > wall.y, beside_splash = deep < wall.z || shallow > wall.w;
        bool free = inside ? shallow > wall.x && deep < wall.y : beside_body && beside_splash;
        stop.end = end;
        stop.splash = wall.zw;
        stop.meets = bvec2(inside || !beside_body, !inside && !beside_splash);
        stopped = !free && level == 0;
        if (free) {
            ivec2 next = pixel_after(line, end, nudge);
            bool same_tile = next >> WALL_TILE_BITS == stop.pixel >> WALL_TILE_BITS;
            level = same_tile ? level : WALL_TILE_BITS;
            stop.pixel = next;
            stop.s = end;
            d = d_end;
        } else {
            level = 0;
        }
    }
    return stop;
}

// A wall that a ray meets.
struct Wall {
    float t;
    vec3 normal; // outward
    int cls;
    bool side;   // a side wall
    vec2 beside; // of a side wall: from t to where the ray is certainly inside, and to where it is certainly outside
    Ball ball;   // of a splash
};

// A bracket around a wall: at a the ray is on its own side, at b on the other. March loops only find it, and keep little alive: what
// has to be known of the body there is its terms of g.
struct Bracket {
    float a;
    float b;
    vec2 at_a;
    vec2 at_b;
    bool own; // false: it has not been on its own side yet, and a is where it still counts as there
};

// |g| at a ray's start, with a minus where the front's term is the larger there.
float start_of(vec2 first) { return side_of(first) == SIDE_FRONT ? -abs(g_of(first)) : abs(g_of(first)); }

// Whether a ray that is a little on the other side of the front or back on which it has just started counts as on its own all the
// same: a map's depths and its normals do not put a surface at quite the same place. f is g inside and -g outside, of these terms;
// `start` is of the ray's.
bool overlooked(float f, vec2 terms, float start, float s, float pixel, float d) {
    bool started = s < START_PIXELS * pixel && abs(start) <= accepted_at(d);
    return started && (side_of(terms) == SIDE_FRONT) == (floatBitsToInt(start) < 0) && f >= 0.0 && f <= start_accepted_at(d);
}

// Samples g pixel by pixel from s on, until the ray has changed sides. Else s is where it is clear of the body's walls again
// beyond `alarmed`, or 1.
bool find_bracket(ScreenLine line, bool inside, float pixel, float alarmed, vec2 first, inout float s, out Bracket k) {
    float sign_of_side = inside ? 1.0 : -1.0, start = start_of(first), back = pixel;
    float at = clamp(0.5 * (s + alarmed), min(0.5 * pixel, 1.0), 1.0);
    vec2 along = line.end - line.start;
    k = Bracket(0.0, 0.0, first, first, false);
    // Further on, the pixels' own depths may have noticed the wall late.
    bool known = s <= START_PIXELS * pixel, crossed = false, clear = false;
    for (int i = 0; i < CROSS_STEPS && !crossed && !clear; ++i) {
        float d = depth_at(line, at);
        Body body = body_at(line.start + at * along, d);
        float f = sign_of_side * g_of(body.terms);
        bool beside = overlooked(f, body.terms, start, at, pixel, d);
        // On the far side of a thin body the other term is the larger.
        bool across = !inside && known && g_of(k.at_a) < HOLE && g_of(body.terms) < HOLE && side_of(body.terms) != side_of(k.at_a);
        if (beside || (f < 0.0 && !across)) {
            known = true;
            clear = at >= 1.0 || (at >= alarmed && -f > body.spread);
            // Where it was on its side before, that is where it will have crossed.
            if (!beside || !k.own) {
                k.a = at;
                k.at_a = body.terms;
            }
            k.own = k.own || !beside;
            s = at;
            at = min(at + pixel, 1.0);
        } else {
            k.b = at;
            k.at_b = body.terms;
            crossed = known;
            if (!crossed) {
                // Back to where the ray was on its side.
                at = max(at - back, 0.0);
                back *= 2.0;
                crossed = at <= START_PIXELS * pixel;
            }
        }
    }
    return crossed;
}

// Narrows a bracket, by regula falsi (Illinois) and every other step a halving, around a root of the term of g that is the larger at
// its outer end: `side`. A ray that has not been on its side yet started at a root, which is not the one that is looked for.
void narrow(ScreenLine line, bool inside, float pixel, int side, float start, inout Bracket k) {
    float sign_of_side = inside ? 1.0 : -1.0;
    bool kept_a = false, kept_b = false; // which end the last step left where it was
    float fa = min(sign_of_side * k.at_a[side], -1e-6), fb = max(sign_of_side * k.at_b[side], 1e-6);
    vec2 along = line.end - line.start;
    bool done = false;
    for (int i = 0; i < NARROW_STEPS && !done; ++i) {
        bool halve = !k.own || abs(fa) >= HOLE || abs(fb) >= HOLE || (i & 1) == 1;
        float at = halve ? 0.5 * (k.a + k.b) : k.b - fb * (k.b - k.a) / (fb - fa), d = depth_at(line, at);
        Body body = body_at(line.start + at * along, d);
        float f = sign_of_side * body.terms[side];
        if (f < 0.0 || (!k.own && overlooked(f, body.terms, start, at, pixel, d))) {
            k.own = k.own || f < 0.0;
            k.a = at;
            k.at_a = body.terms;
            fa = min(f, -1e-6);
            if (kept_b) fb *= 0.5;
            kept_b = true;
            kept_a = false;
        } else {
            k.b = at;
            k.at_b = body.terms;
            fb = f;
            if (kept_a) fa *= 0.5;
            kept_a = true;
            kept_b = false;
        }
        done = (k.own && abs(f) <= max(CONVERGED, CONVERGED_DEPTH * d)) || k.b - k.a <= min(1e-3 * pixel, 1e-6);
    }
}

// The wall in a bracket.
Wall body_wall(Ray ray, ScreenLine line, bool inside, float start, Bracket k) {
    float pixel = 1.0 / max(ray.span, 1e-6);
    int side = side_of(inside ? k.at_b : k.at_a);
    narrow(line, inside, pixel, side, start, k);
    // The line through both ends, if one is near the surface; else the end that is, or the middle.
    float d = depth_at(line, k.b), accepted = k.own ? accepted_at(d) : start_accepted_at(d);
    float ga = k.at_a[side], gb = k.at_b[side];
    bool near_a = abs(ga) <= accepted, near_b = abs(gb) <= accepted;
    float hit = near_a == near_b ? 0.5 * (k.a + k.b) : (near_a ? k.a : k.b);
    if ((near_a || near_b) && max(abs(ga), abs(gb)) < HOLE && ga != gb) hit = clamp(k.b - gb * (k.b - k.a) / (gb - ga), k.a, k.b);
    vec2 inner = inside ? k.at_a : k.at_b, outer = inside ? k.at_b : k.at_a;
    bool at_inner = abs(g_of(inner)) <= accepted, surface = at_inner || abs(g_of(outer)) <= accepted;
    vec2 along = line.end - line.start;
    Wall wall = Wall(t_at(ray, line, hit), vec3(0.0), CLASS_BODY, !surface, vec2(0.0), Ball(vec3(0.0), 0.0));
    if (surface) {
        int which = side_of(g_of(outer) < HOLE ? outer : inner);
        // On the border between two pixels, that of the one whose depth is met.
        float s_met = at_inner == inside ? k.a : k.b;
        vec2 met = line.start + s_met * along;
        bvec2 whole = body_at(met, depth_at(line, s_met)).whole;
        wall.normal = body_normal_at(which, which == SIDE_FRONT ? whole.x : whole.y, line.start + hit * along, nearest(met));
    } else {
        vec3 x = ray.origin + wall.t * ray.dir;
        wall.normal = side_normal(nearest(line.start + (inside ? k.a : k.b) * along), outer, x, inside ? along : -along);
        // Off the border between two pixels, so that a ray goes on from the one on its side.
        vec2 ends = vec2(t_at(ray, line, max(k.a - SIDE_NUDGE * pixel, 0.0)), t_at(ray, line, min(k.b + SIDE_NUDGE * pixel, 1.0))) - wall.t;
        wall.beside = inside ? ends : ends.yx;
    }
    return wall;
}

// The first wall that a ray inside the body, or outside of all liquid, meets. Without one the outcome says why.
bool find_wall(Ray ray, bool inside, out Wall wall, out int outcome) {
    ScreenLine line = screen_line(ray);
    float nudge = PIXEL_NUDGE / max(ray.span, 1e-6), s = 0.0, s_ball = -1.0; // where it comes into a pixel of a ball that it meets
    vec2 first = vec2(HOLE);
    if (HAS_BODY) first = body_at(line.start, depth_at(line, 0.0)).terms;
    Bracket k;
    bool crosses = false;
    for (int i = 0; i < WALL_TRIES && !crosses && s_ball < 0.0 && s < 1.0; ++i) {
        Stop stop = skip(line, inside, nudge, s);
        s = stop.s;
        if (HAS_SPLASH && stop.meets.y && s < 1.0) {
            vec2 t;
            if (meets_ball(ball_at(stop.pixel, stop.splash), ray.origin, ray.dir, t) && t.x > 1e-4) s_ball = s;
        }
        if (HAS_BODY && stop.meets.x && s < 1.0) crosses = find_bracket(line, inside, 1.0 / max(ray.span, 1e-6), stop.end, first, s, k);
        else s = stop.end;
    }
    outcome = OUTCOME_NOT_CONVERGED;
    wall = Wall(ray.reach, vec3(0.0), CLASS_BODY, false, vec2(0.0), Ball(vec3(0.0), 0.0));
    if (!crosses && s_ball < 0.0) {
        if (s >= 1.0) outcome = ray.leaves_view ? OUTCOME_LEFT_VIEW : (inside ? OUTCOME_NO_WALL : OUTCOME_HIT);
        return false;
    }
    if (crosses) wall = body_wall(ray, line, inside, start_of(first), k);
    if (HAS_SPLASH && s_ball >= 0.0) {
        ivec2 pixel = pixel_after(line, s_ball, nudge);
        Ball ball = ball_at(pixel, walls_at(pixel).zw);
        vec2 t;
        meets_ball(ball, ray.origin, ray.dir, t);
        if (!crosses || t.x < wall.t)
            wall = Wall(t.x, normalize(ray.origin + t.x * ray.dir - ball.center), CLASS_SPLASH, false, vec2(0.0), ball);
    }
    return true;
}
