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

vec3 sample_normal(int cls, int side, vec2 pixel) {
    bool smooth_here;
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

Ray trace(vec3 origin, vec3 dir) {
    // Leave the box around the liquid (world space).
    mat3 to_world = transpose(mat3(frame.view));
    vec3 o = to_world * (origin - frame.view[3].xyz), w = to_world * dir;
    vec3 far_side = mix(frame.bounds_min.xyz, frame.bounds_max.xyz, greaterThan(w, vec3(0.0)));
    vec3 t = mix((far_side - o) / w, vec3(1e30), lessThan(abs(w), vec3(1e-12)));
    float reach = max(min(t.x, min(t.y, t.z)), 0.0);
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

// f at t. The difference of depths is formed before t enters, so that it rounds at its own size.
float wall_distance(Ray ray, int cls, int side, float t, float sense) {
    bool smooth_here;
    float d = sample_depth(cls, side, project(ray.origin + t * ray.dir), smooth_here);
    if (d <= 0.0) return HOLE;
    return sense * ((-ray.origin.z - d) - t * ray.dir.z);
}

// Narrows a bracket (f(a) < 0 <= f(b)) by regula falsi (Illinois), by halving while f(b) is a hole. Returns |f|.
float refine(Ray ray, int cls, int side, float sense, float a, float fa, float b, float fb, out float t) {
    t = b;
    float f = fb, same = 0.0;
    bool hole = fb >= HOLE;
    for (int i = 0; i < REFINE_STEPS && abs(f) > frame.search.x; ++i) {
        // Every fourth step halves: where the map jumps, regula falsi alone creeps.
        t = hole || (i & 3) == 3 ? 0.5 * (a + b) : b - fb * (b - a) / (fb - fa);
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
    if (abs(f) <= frame.search.x && !hole) t = b - fb * (b - a) / (fb - fa);
    return abs(f);
}

// Whether a ray stays inside up to t, looked at every few pixels: the secant method finds a wall, not the first.
bool inside_until(Ray ray, int cls, int side, float sense, float t) {
    vec2 p0 = project(ray.origin), p1 = project(ray.origin + t * ray.dir);
    float d0 = -ray.origin.z, d1 = d0 - t * ray.dir.z;
    float steps = clamp(ceil(distance(p0, p1) / CHECK_PIXELS), 1.0, float(CHECK_STEPS));
    for (float i = 1.0; i < steps; ++i) {
        float share = i / steps;
        float wall = map_depth(cls, side, nearest(mix(p0, p1, share)));
        float d = d0 * d1 / mix(d1, d0, share);
        if (wall <= 0.0 || sense * (d - wall) > frame.search.y) return false;
    }
    return true;
}

// Where a ray inside a volume leaves it. First the secant method from the two ends that a flat wall would give;
// if that leaves the ray, meets a hole or does not converge, a march of about a pixel a step, then regula falsi.
// Returns an outcome; t is the hit, or the last point known to be inside.
int find_exit(Ray ray, int cls, bool from_wall, out float t) {
    int side = ray.dir.z <= 0.0 ? SIDE_BACK : SIDE_FRONT;
    float sense = side == SIDE_BACK ? 1.0 : -1.0, speed = abs(ray.dir.z);
    t = 0.0;
    float fa = wall_distance(ray, cls, side, 0.0, sense);
    if (!from_wall && fa < 0.0) {
        float a = 0.0, b = min(-fa / max(speed, 1e-6), ray.reach), fb = 0.0;
        for (int i = 0; i < SECANT_STEPS; ++i) {
            fb = wall_distance(ray, cls, side, b, sense);
            float next = fb == fa ? b : b - fb * (b - a) / (fb - fa);
            if (abs(fb) <= frame.search.x) {
                t = next; // the tolerance only has to find the root; the last step puts t on it
                if (inside_until(ray, cls, side, sense, t)) return OUTCOME_HIT;
                break;
            }
            if (fb >= HOLE || !(next > 0.0 && next <= ray.reach)) break;
            a = b;
            fa = fb;
            b = next;
        }
    }
    bool inside = !from_wall;
    float steps = clamp(ceil(ray.span), 1.0, float(MARCH_STEPS));
    float share = min(1.0 / max(ray.span, 1e-6), 1.0);
    // Off a wall the first sample is close to it: within the first pixel the ray is inside or it is nowhere.
    float first = from_wall ? 0.05 * share : 0.0;
    float last = 0.0, f_last = -1.0;
    for (float i = from_wall ? 0.0 : 1.0; i <= steps; ++i) {
        float next = pixel_to_t(ray, min(max(i * share, first), 1.0));
        float f = wall_distance(ray, cls, side, next, sense);
        if (f < 0.0) {
            inside = true;
            last = next;
            f_last = f;
        } else if (inside) {
            float residual = refine(ray, cls, side, sense, last, f_last, next, f, t);
            if (residual <= frame.search.y) return OUTCOME_HIT;
            t = last;
            return OUTCOME_HOLE;
        } else if (i >= 2.0) {
            return OUTCOME_HOLE;
        }
    }
    t = last;
    if (ray.span > float(MARCH_STEPS)) return OUTCOME_NOT_CONVERGED;
    return ray.leaves ? OUTCOME_LEFT_VIEW : OUTCOME_HOLE;
}

// A crossing of one class's front map within one step of a march, from in front to behind, without a jump.
bool crosses_front(Ray ray, int cls, float a, float b, out float t) {
    float fa = wall_distance(ray, cls, SIDE_FRONT, a, 1.0), fb = wall_distance(ray, cls, SIDE_FRONT, b, 1.0);
    t = b;
    if (!(fa < 0.0) || !(fb >= 0.0)) return false;
    return refine(ray, cls, SIDE_FRONT, 1.0, a, fa, b, fb, t) <= frame.search.y;
}

// The nearest front surface of either class that a ray outside meets, or -1. Sets `unknown` where the ray left the
// view, or ran out of steps, before it left the liquid's box.
int find_entry(Ray ray, out float t, out bool unknown) {
    float steps = clamp(ceil(ray.span), 1.0, float(MARCH_STEPS));
    float share = ray.span > float(MARCH_STEPS) ? 1.0 / ray.span : 1.0 / steps;
    unknown = ray.leaves || ray.span > float(MARCH_STEPS);
    vec2 p0 = project(ray.origin), p1 = project(ray.origin + ray.reach * ray.dir);
    float k0 = -1.0 / ray.origin.z, k1 = 1.0 / (-ray.origin.z - ray.reach * ray.dir.z);
    // Last f of each class; positive where there is no surface, so that only a way from in front counts.
    vec2 before = vec2(HOLE);
    float last = 0.0;
    for (float i = 0.0; i <= steps; ++i) {
        ivec2 pixel = nearest(mix(p0, p1, i * share));
        float d = 1.0 / mix(k0, k1, i * share);
        vec2 now = vec2(HOLE);
        if (HAS_SPLASH) {
            float front = map_depth(CLASS_SPLASH, SIDE_FRONT, pixel);
            if (front > 0.0) now.x = d - front;
        }
        if (HAS_BODY) {
            float front = map_depth(CLASS_BODY, SIDE_FRONT, pixel);
            if (front > 0.0) now.y = d - front;
        }
        float next = pixel_to_t(ray, i * share);
        bvec2 crossing = bvec2(before.x < 0.0 && now.x >= 0.0 && now.x < HOLE, before.y < 0.0 && now.y >= 0.0 && now.y < HOLE);
        if (any(crossing)) {
            float t_splash, t_body;
            bool splash = crossing.x && crosses_front(ray, CLASS_SPLASH, last, next, t_splash);
            bool body = crossing.y && crosses_front(ray, CLASS_BODY, last, next, t_body);
            if (splash || body) {
                bool first = splash && (!body || t_splash <= t_body);
                t = first ? t_splash : t_body;
                unknown = false;
                return first ? CLASS_SPLASH : CLASS_BODY;
            }
        }
        before = now;
        last = next;
    }
    t = 0.0;
    return -1;
}
