// Searches along a ray x(t) = x0 + t w in the four maps (methods: "Walk of one view ray").
// f is negative while the ray has not reached the wall yet: d - D for walls met going away, D - d coming back.

const float HOLE = 1e30; // f where the map has no surface

float map_depth(int cls, int side, ivec2 p) {
    if (cls == CLASS_SPLASH) return texelFetch(splash_depth, ivec3(p, side), 0).x;
    return texelFetch(body_depth, ivec3(p, side), 0).x;
}

vec3 map_normal(int cls, int side, ivec2 p) {
    if (cls == CLASS_SPLASH) return decode_normal(texelFetch(splash_normal, ivec3(p, side), 0).x);
    return decode_normal(texelFetch(body_normal, ivec3(p, side), 0).x);
}

// The four pixels around a position, and the weights of the upper corner.
struct Footprint {
    ivec2 lo;
    ivec2 hi;
    vec2 f;
};

Footprint footprint(vec2 pixel) {
    vec2 q = pixel - 0.5, b = floor(q);
    ivec2 last = ivec2(frame.viewport.xy) - 1;
    return Footprint(clamp(ivec2(b), ivec2(0), last), clamp(ivec2(b) + 1, ivec2(0), last), q - b);
}

ivec2 nearest(vec2 pixel) { return clamp(ivec2(floor(pixel)), ivec2(0), ivec2(frame.viewport.xy) - 1); }

// Bilinear where all four pixels have a surface without a jump between them, else the pixel itself; <= 0: nothing.
float sample_depth(int cls, int side, vec2 pixel, out bool smooth_here) {
    Footprint p = footprint(pixel);
    vec4 d = vec4(map_depth(cls, side, p.lo), map_depth(cls, side, ivec2(p.hi.x, p.lo.y)),
                  map_depth(cls, side, ivec2(p.lo.x, p.hi.y)), map_depth(cls, side, p.hi));
    float low = min(min(d.x, d.y), min(d.z, d.w)), high = max(max(d.x, d.y), max(d.z, d.w));
    smooth_here = low > 0.0 && high - low <= frame.search.z;
    if (!smooth_here) return map_depth(cls, side, nearest(pixel));
    // From the lowest corner, so that the interpolation rounds at the spread's size and not at the depth's.
    d -= low;
    return low + mix(mix(d.x, d.y, p.f.x), mix(d.z, d.w, p.f.x), p.f.y);
}

vec3 sample_normal(int cls, int side, vec2 pixel, out bool smooth_here) {
    sample_depth(cls, side, pixel, smooth_here);
    if (!smooth_here) return map_normal(cls, side, nearest(pixel));
    Footprint p = footprint(pixel);
    return normalize(mix(mix(map_normal(cls, side, p.lo), map_normal(cls, side, ivec2(p.hi.x, p.lo.y)), p.f.x),
                         mix(map_normal(cls, side, ivec2(p.lo.x, p.hi.y)), map_normal(cls, side, p.hi), p.f.x), p.f.y));
}

struct Ray {
    vec3 origin; // eye space
    vec3 dir;    // unit
    float reach; // t at which it leaves the liquid's box, the view or the near plane
    float span;  // pixels between its ends on the screen
    bool leaves; // whether the view's border is what ends it
};

// Position on the ray's way across the screen, evenly in pixels, to t (perspective: 1/d is linear on the screen).
float pixel_to_t(Ray ray, float share) {
    float d0 = -ray.origin.z, d1 = d0 - ray.reach * ray.dir.z;
    return ray.reach * share * d0 / mix(d1, d0, share);
}

// A ray up to t = reach, as far as it stays in the view.
Ray in_view(vec3 origin, vec3 dir, float reach) {
    float d0 = -origin.z, dd = -dir.z;
    if (dd < 0.0) reach = min(reach, max(d0 - frame.viewport.z, 0.0) / -dd);
    // The view's border: pixel(t) = b + a x / d meets p where a (x0 + t wx) = (p - b) (d0 + t dd).
    bool leaves = false;
    for (int axis = 0; axis < 2; ++axis) {
        for (int border = 0; border < 2; ++border) {
            float q = (float(border) * frame.viewport[axis] - frame.to_pixel[2 + axis]) / frame.to_pixel[axis];
            float speed = dir[axis] - q * dd, gap = q * d0 - origin[axis];
            bool outward = (speed > 0.0) == ((border == 1) == (frame.to_pixel[axis] > 0.0));
            float when = max(gap / speed, 0.0);
            if (speed != 0.0 && outward && when < reach) {
                reach = when;
                leaves = true;
            }
        }
    }
    Ray ray = Ray(origin, dir, reach, 0.0, leaves);
    ray.span = distance(project(origin), project(origin + reach * dir));
    return ray;
}

// A ray as far as it stays in the view and in the box around the liquid.
Ray trace(vec3 origin, vec3 dir) {
    mat3 from_eye = transpose(mat3(frame.view));
    vec3 o = from_eye * (origin - frame.view[3].xyz), w = from_eye * dir;
    vec3 far_side = mix(frame.bounds_min.xyz, frame.bounds_max.xyz, greaterThan(w, vec3(0.0)));
    vec3 t = mix((far_side - o) / w, vec3(1e30), lessThan(abs(w), vec3(1e-12)));
    return in_view(origin, dir, max(min(t.x, min(t.y, t.z)), 0.0));
}

// f at t. The difference of depths is formed before t enters, so that it rounds at its own size.
float wall_distance(Ray ray, int cls, int side, float t, float sense) {
    bool smooth_here;
    float d = sample_depth(cls, side, project(ray.origin + t * ray.dir), smooth_here);
    if (d <= 0.0) return HOLE;
    return sense * ((-ray.origin.z - d) - t * ray.dir.z);
}

// Where the line through two samples of f is zero; their middle where it is level.
float false_position(float a, float fa, float b, float fb) {
    return fb == fa ? 0.5 * (a + b) : b - fb * (b - a) / (fb - fa);
}

// Narrows a bracket (f(a) < 0 <= f(b)) by regula falsi (Illinois), by halving while f(b) is a hole. Returns |f|.
float refine(Ray ray, int cls, int side, float sense, float a, float fa, float b, float fb, out float t) {
    t = b;
    float f = fb, same = 0.0;
    bool hole = fb >= HOLE;
    for (int i = 0; i < REFINE_STEPS && abs(f) > frame.search.x; ++i) {
        // Every fourth step halves: where the map jumps, regula falsi alone creeps.
        t = hole || (i & 3) == 3 ? 0.5 * (a + b) : false_position(a, fa, b, fb);
        f = wall_distance(ray, cls, side, t, sense);
        if (f < 0.0) {
            a = t;
            fa = f;
            if (same < 0.0) fb *= 0.5;
            same = -1.0;
        } else {
            b = t;
            fb = f;
            hole = f >= HOLE;
            if (same > 0.0) fa *= 0.5;
            same = 1.0;
        }
    }
    // The tolerance only has to find the root; a last step from the bracket without evaluating puts t on it.
    if (abs(f) <= frame.search.x && !hole) t = false_position(a, fa, b, fb);
    return abs(f);
}

// How a ray stands in a volume between its two maps: the wall it runs towards and, behind its back, the other one.
struct Walls {
    int ahead;   // side of the map ahead: back for a ray going away, front for one coming back
    float sense; // sign of f for the wall ahead; the other wall has the opposite
};

// How much a continuous wall at depth d changes from pixel to pixel at most: less than the interpolated spread (more
// counts as a jump), and, but for its rim, no more than a steep plane.
float wall_slope(float d) { return min(frame.search.z, STEEP * d / abs(frame.to_pixel.x)); }

// Pixels a ray at depth d may go before a wall can come near that is `gap` deeper or nearer than it; `slope` is the
// ray's own change of depth a pixel.
float clear_pixels(float gap, float slope, float d) { return gap / (wall_slope(d) + slope); }

// What a look along the way to t finds: the secant method finds a wall, not necessarily the first.
const int CLEAR = 0;    // inside all the way
const int JUMPED = 1;   // inside, but the map ahead jumps: what stands there may hide another wall
const int BLOCKED = 2;  // outside somewhere, by either wall
int look_until(Ray ray, int cls, Walls walls, float t) {
    vec2 p0 = project(ray.origin), p1 = project(ray.origin + t * ray.dir);
    float d0 = -ray.origin.z, d1 = d0 - t * ray.dir.z, pixels = max(distance(p0, p1), 1e-6);
    float slope = abs(d1 - d0) / max(pixels, 1.0);
    float before = map_depth(cls, walls.ahead, nearest(p0)), stride = CHECK_PIXELS, at = 0.0;
    int found = CLEAR;
    for (int i = 0; i < CHECK_STEPS && at < pixels; ++i) {
        at = min(at + stride, pixels);
        float share = at / pixels;
        ivec2 pixel = nearest(mix(p0, p1, share));
        float wall = map_depth(cls, walls.ahead, pixel), other = map_depth(cls, 1 - walls.ahead, pixel);
        float d = d0 * d1 / mix(d1, d0, share);
        float gap = walls.sense * (wall - d), other_gap = other > 0.0 ? walls.sense * (d - other) : HOLE;
        if (at < pixels && (wall <= 0.0 || gap < -frame.search.y)) return BLOCKED;
        if (other_gap < -frame.search.y) return BLOCKED;
        if (abs(wall - before) > frame.search.z * (1.0 + stride)) found = JUMPED;
        before = wall;
        stride = clamp(clear_pixels(min(gap, other_gap), slope, d), CHECK_PIXELS, CHECK_STRIDE);
    }
    return found;
}

// Where a ray inside a volume leaves it. First the secant method from the two ends that a flat wall would give;
// if that leaves the ray, meets a hole or does not converge, a march of a pixel a step, then regula falsi.
// A ray can also leave through the other wall: the map behind its back, which then lies across its way.
// `came_from`: the map off which the ray was reflected, or -1: there f starts at zero, and the secant would stay.
// Returns an outcome; t is the hit, or the last point known to be inside; `side` the map that was hit.
int find_exit(Ray ray, int cls, int came_from, out float t, out int side) {
    Walls walls = ray.dir.z <= 0.0 ? Walls(SIDE_BACK, 1.0) : Walls(SIDE_FRONT, -1.0);
    side = walls.ahead;
    t = 0.0;
    bool on_wall = came_from == walls.ahead;
    float fa = wall_distance(ray, cls, side, 0.0, walls.sense);
    if (!on_wall && fa < 0.0) {
        float a = 0.0, b = min(-fa / max(abs(ray.dir.z), 1e-6), ray.reach), fb = 0.0;
        for (int i = 0; i < SECANT_STEPS; ++i) {
            fb = wall_distance(ray, cls, side, b, walls.sense);
            float next = false_position(a, fa, b, fb);
            if (abs(fb) <= frame.search.x) {
                t = next; // the tolerance only has to find the root; the last step puts t on it
                int found = look_until(ray, cls, walls, t);
                if (found == BLOCKED) break;
                return found == CLEAR ? OUTCOME_HIT : OUTCOME_PAST_JUMP;
            }
            if (fb >= HOLE || !(next > 0.0 && next <= ray.reach)) break;
            a = b;
            fa = fb;
            b = next;
        }
    }
    // The march: a pixel a stride near a wall, more where none can come near.
    float fine = min(EXIT_PIXELS / max(ray.span, 1e-6), 1.0);
    float slope = ray.reach * abs(ray.dir.z) / max(ray.span, 1.0); // depth a pixel
    vec2 p0 = project(ray.origin), p1 = project(ray.origin + ray.reach * ray.dir);
    float k0 = -1.0 / ray.origin.z, k1 = 1.0 / (-ray.origin.z - ray.reach * ray.dir.z);
    bool inside = !on_wall, jumped = false;
    float at = 0.0, last = 0.0, f_last = -1.0, other_last = -1.0, wall_last = 0.0;
    // Off a wall the first sample is close to it: within two pixels the ray is inside or it is nowhere.
    float stride = on_wall ? 0.05 * fine : fine;
    for (int i = 0; i < MARCH_STEPS && at < 1.0; ++i) {
        float way = min(at + stride, 1.0);
        ivec2 pixel = nearest(mix(p0, p1, way));
        float d = 1.0 / mix(k0, k1, way), next = pixel_to_t(ray, way);
        float wall = map_depth(cls, walls.ahead, pixel), behind = map_depth(cls, 1 - walls.ahead, pixel);
        float f = wall > 0.0 ? walls.sense * (d - wall) : HOLE;
        float other = behind > 0.0 ? walls.sense * (behind - d) : HOLE;
        // A pixel's own depth tells which walls are near enough to look closely.
        float close = 0.5 * wall_slope(d);
        bool near = f > -close, other_near = other > -close && other < HOLE;
        if (stride > fine && (near || other_near)) {
            stride = fine;
            continue;
        }
        float gap = min(-f, other < HOLE ? -other : HOLE);
        if (near) f = wall_distance(ray, cls, walls.ahead, next, walls.sense);
        if (other_near) other = wall_distance(ray, cls, 1 - walls.ahead, next, -walls.sense);
        if (other > frame.search.y && other < HOLE) {
            if (refine(ray, cls, 1 - walls.ahead, -walls.sense, last, min(other_last, 0.0), next, other, t) <= frame.search.y) {
                side = 1 - walls.ahead;
                return OUTCOME_OTHER_WALL;
            }
            t = last;
            return OUTCOME_HOLE;
        }
        if (f < 0.0) {
            jumped = jumped || (wall_last > 0.0 && abs(wall - wall_last) > frame.search.z * (1.0 + EXIT_PIXELS * stride / fine));
            inside = true;
            last = next;
            f_last = f;
            other_last = other < HOLE ? other : -1.0;
            wall_last = wall;
        } else if (inside) {
            float residual = refine(ray, cls, walls.ahead, walls.sense, last, f_last, next, f, t);
            if (residual <= frame.search.y) return jumped ? OUTCOME_PAST_JUMP : OUTCOME_HIT;
            t = last;
            return OUTCOME_HOLE;
        } else if (way >= 2.0 * fine) {
            return OUTCOME_HOLE;
        }
        at = way;
        stride = fine * clamp(clear_pixels(gap, slope, d) / EXIT_PIXELS, 1.0, EXIT_STRIDE / EXIT_PIXELS);
    }
    t = last;
    if (at < 1.0) return OUTCOME_NOT_CONVERGED;
    return ray.leaves ? OUTCOME_LEFT_VIEW : OUTCOME_HOLE;
}

// The share of the way at which a line leaves a square of pixels; after `least`, and 1 at most.
float leaves_cell(vec2 p0, vec2 way, ivec2 corner, int size, float least) {
    vec2 edge = vec2(corner) + float(size) * vec2(greaterThan(way, vec2(0.0)));
    vec2 share = mix((edge - p0) / way, vec2(1.0), lessThan(abs(way), vec2(1e-6)));
    return clamp(min(share.x, share.y), min(least, 1.0), 1.0);
}

// The first crossing of a class's front map, from in front to behind and without a jump, between two shares of the ray's
// way across the screen: looked for at even steps, then refined. Sets `jumped` where the ray passes behind a surface
// without crossing it.
bool crosses_front(Ray ray, int cls, float from, float to, out float t, inout bool jumped) {
    float a = 0.0, fa = HOLE;
    t = 0.0;
    int steps = clamp(int(ceil((to - from) * ray.span / ENTRY_PIXELS)), 1, ENTRY_STEPS);
    for (int k = 0; k <= steps; ++k) {
        float b = pixel_to_t(ray, mix(from, to, float(k) / float(steps)));
        float fb = wall_distance(ray, cls, SIDE_FRONT, b, 1.0);
        // A surface that begins or ends between the samples may be crossed before it does.
        float last = b, f_last = fb, close = abs(ray.dir.z) * (b - a) + frame.search.z;
        bool begins = k > 0 && fa >= HOLE && fb >= 0.0 && fb < close;
        for (int i = 0; begins && fa >= 0.0 && i < EDGE_STEPS; ++i) {
            float m = 0.5 * (a + b), f = wall_distance(ray, cls, SIDE_FRONT, m, 1.0);
            bool behind = f >= 0.0 && f < HOLE;
            if (behind) {
                b = m;
                fb = f;
            } else {
                a = m;
                fa = f;
            }
        }
        bool ends = fb >= HOLE && fa > -close;
        if (fa < 0.0 && fb >= 0.0 && (ends || fb < HOLE)) {
            float residual = refine(ray, cls, SIDE_FRONT, 1.0, a, fa, b, fb, t);
            if (residual <= (ends ? frame.search.x : frame.search.y)) return true;
            jumped = jumped || !ends;
        }
        a = last;
        fa = f_last;
    }
    return false;
}

// The nearest front surface of either class that a ray outside meets, or -1. The outcome says where
// the ray left the view, or ran out of steps, before it left the liquid's box. Sets `jumped` where it passed behind a
// surface unseen.
int find_entry(Ray ray, out float t, out int outcome, out bool jumped) {
    jumped = false;
    float nudge = PIXEL_NUDGE / max(ray.span, 1e-6), slack = frame.search.z;
    vec2 p0 = project(ray.origin), p1 = project(ray.origin + ray.reach * ray.dir), way = p1 - p0;
    float k0 = -1.0 / ray.origin.z, k1 = 1.0 / (-ray.origin.z - ray.reach * ray.dir.z);
    float at = 0.0;
    for (int i = 0; i < MARCH_STEPS && at < 1.0; ++i) {
        ivec2 pixel = nearest(p0 + min(at + nudge, 1.0) * way), tile = pixel / FRONT_TILE;
        float d_at = 1.0 / mix(k0, k1, at);
        // A tile whose surfaces all lie before or behind the ray's way through it is left at once.
        float end = leaves_cell(p0, way, tile * FRONT_TILE, FRONT_TILE, at + nudge), d_end = 1.0 / mix(k0, k1, end);
        float least = texelFetch(front_tiles, ivec3(tile, 0), 0).x, most = texelFetch(front_tiles, ivec3(tile, 1), 0).x;
        if (max(d_at, d_end) < least - slack || min(d_at, d_end) > most + slack) {
            at = end;
            continue;
        }
        // Pixel by pixel: its own depths tell whether a surface is near enough to look closely. What is interpolated
        // in a pixel is within the spread of its own.
        end = leaves_cell(p0, way, pixel, 1, at + nudge);
        d_end = 1.0 / mix(k0, k1, end);
        float front_splash = HAS_SPLASH ? map_depth(CLASS_SPLASH, SIDE_FRONT, pixel) : 0.0;
        float front_body = HAS_BODY ? map_depth(CLASS_BODY, SIDE_FRONT, pixel) : 0.0;
        float from = min(d_at, d_end) - slack, to = max(d_at, d_end) + slack;
        bool splash = front_splash >= from && front_splash <= to, body = front_body >= from && front_body <= to;
        if (splash || body) {
            float t_splash = 0.0, t_body = 0.0;
            splash = splash && crosses_front(ray, CLASS_SPLASH, at, end, t_splash, jumped);
            body = body && crosses_front(ray, CLASS_BODY, at, end, t_body, jumped);
            if (splash || body) {
                bool first = splash && (!body || t_splash <= t_body);
                t = first ? t_splash : t_body;
                outcome = OUTCOME_HIT;
                return first ? CLASS_SPLASH : CLASS_BODY;
            }
        }
        at = end;
    }
    t = 0.0;
    outcome = at < 1.0 ? OUTCOME_NOT_CONVERGED : (ray.leaves ? OUTCOME_LEFT_VIEW : OUTCOME_HIT);
    return -1;
}
