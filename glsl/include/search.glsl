// Searches for walls along a ray x(t) = x0 + t w in the four maps (docs/methods.md, "Searches along a ray").
//
// f(t) is the distance in depth by which the ray has passed a wall: d - D for a wall met going away from the eye, D - d for
// one met coming back. It is negative before the wall.

const float HOLE = 1e30; // f where the map has no surface

// How exactly walls have to be met. All of it follows from the box around what is drawn, which the host knows of particles
// that it prepared itself, and the extent pass of those that the device prepares.
struct Tolerance {
    float converged; // |f| of a root
    float accepted;  // |f| of a hit, at most
    float jump;      // depths of a footprint that differ by more are not interpolated
};

Tolerance tolerance_of_frame() {
    vec3 middle = 0.5 * (frame.bounds_min + frame.bounds_max), extent = frame.bounds_max - frame.bounds_min;
    // Summed in the twin's order, so that both find the same jumps.
    precise vec3 m = middle.x * frame.view[0].xyz + middle.y * frame.view[1].xyz + middle.z * frame.view[2].xyz + frame.view[3].xyz;
    precise float distance_of_middle = sqrt(m.x * m.x + m.y * m.y + m.z * m.z);
    // What a pixel covers there: where particles are hardly larger, their own size says nothing of what a map can tell apart.
    float pixel = distance_of_middle / max(abs(frame.pixel_scale.x), abs(frame.pixel_scale.y));
    float converged = max(CONVERGED, CONVERGED_DEPTH * (distance_of_middle + 0.5 * length(extent)));
    float accepted = max(max(ACCEPTED, ACCEPTED_PIXELS * pixel), converged);
    return Tolerance(converged, accepted, max(JUMP, STEEP * pixel));
}

Tolerance tolerance = tolerance_of_frame();

float map_depth(int cls, int side, ivec2 pixel) {
    if (cls == CLASS_SPLASH) return texelFetch(splash_depth, ivec3(pixel, side), 0).x;
    return texelFetch(body_depth, ivec3(pixel, side), 0).x;
}

vec3 map_normal(int cls, int side, ivec2 pixel) {
    if (cls == CLASS_SPLASH) return decode_normal(texelFetch(splash_normal, ivec3(pixel, side), 0).x);
    return decode_normal(texelFetch(body_normal, ivec3(pixel, side), 0).x);
}

// The four pixels around a position, and the weights of the upper corner.
struct Footprint {
    ivec2 lo;
    ivec2 hi;
    vec2 weight;
};

Footprint footprint(vec2 position) {
    vec2 q = position - 0.5, corner = floor(q);
    ivec2 last = ivec2(frame.size) - 1;
    return Footprint(clamp(ivec2(corner), ivec2(0), last), clamp(ivec2(corner) + 1, ivec2(0), last), q - corner);
}

ivec2 nearest(vec2 position) { return clamp(ivec2(floor(position)), ivec2(0), ivec2(frame.size) - 1); }

// Bilinear where all four pixels of the footprint have a surface without a jump between them, else the pixel's own; not
// above 0 where there is nothing.
float sample_depth(int cls, int side, vec2 position, out bool whole) {
    Footprint p = footprint(position);
    vec4 d = vec4(map_depth(cls, side, p.lo), map_depth(cls, side, ivec2(p.hi.x, p.lo.y)),
                  map_depth(cls, side, ivec2(p.lo.x, p.hi.y)), map_depth(cls, side, p.hi));
    float low = min(min(d.x, d.y), min(d.z, d.w)), high = max(max(d.x, d.y), max(d.z, d.w));
    whole = low > 0.0 && high - low <= tolerance.jump;
    if (!whole) return map_depth(cls, side, nearest(position));
    // From the lowest corner, so that the interpolation rounds at the spread's size and not at the depth's.
    d -= low;
    return low + mix(mix(d.x, d.y, p.weight.x), mix(d.z, d.w, p.weight.x), p.weight.y);
}

vec3 sample_normal(int cls, int side, vec2 position, out bool whole) {
    sample_depth(cls, side, position, whole);
    if (!whole) return map_normal(cls, side, nearest(position));
    Footprint p = footprint(position);
    vec3 lower = mix(map_normal(cls, side, p.lo), map_normal(cls, side, ivec2(p.hi.x, p.lo.y)), p.weight.x);
    vec3 upper = mix(map_normal(cls, side, ivec2(p.lo.x, p.hi.y)), map_normal(cls, side, p.hi), p.weight.x);
    return normalize(mix(lower, upper, p.weight.y));
}

struct Ray {
    vec3 origin;      // eye space
    vec3 dir;         // unit
    float reach;      // t at which it leaves the liquid's box, the view or the near plane
    float span;       // pixels between its ends on the screen
    bool leaves_view; // whether the view's border is what ends it
};

// t at a screen-space parameter s, which runs evenly in pixels from 0 at the ray's start to 1 at its end: 1 / d is linear
// in s.
float t_at(Ray ray, float s) {
    float d0 = -ray.origin.z, d1 = d0 - ray.reach * ray.dir.z;
    return ray.reach * s * d0 / mix(d1, d0, s);
}

// A ray on the screen: pixel positions and 1 / d at its ends.
struct ScreenLine {
    vec2 start;
    vec2 end;
    float inverse_start;
    float inverse_end;
};

ScreenLine screen_line(Ray ray) {
    return ScreenLine(project(ray.origin), project(ray.origin + ray.reach * ray.dir), -1.0 / ray.origin.z,
                      1.0 / (-ray.origin.z - ray.reach * ray.dir.z));
}

float depth_at(ScreenLine line, float s) { return 1.0 / mix(line.inverse_start, line.inverse_end, s); }

// The pixel that a line comes into at s: a nudge further on, because s lies on the edge between two.
ivec2 pixel_after(ScreenLine line, float s, float nudge) {
    return nearest(line.start + min(s + nudge, 1.0) * (line.end - line.start));
}

// The s at which a line leaves a square of pixels; after `least`, and 1 at most.
float leaves_square(ScreenLine line, ivec2 corner, int edge, float least) {
    vec2 along = line.end - line.start;
    vec2 border = vec2(corner) + float(edge) * vec2(greaterThan(along, vec2(0.0)));
    vec2 s = mix((border - line.start) / along, vec2(1.0), lessThan(abs(along), vec2(1e-6)));
    return clamp(min(s.x, s.y), min(least, 1.0), 1.0);
}

// A ray up to t = reach, as far as it stays in the view.
Ray in_view(vec3 origin, vec3 dir, float reach) {
    float d0 = -origin.z, deepening = -dir.z;
    if (deepening < 0.0) reach = min(reach, max(d0 - frame.near, 0.0) / -deepening);
    // The view's border: pixel(t) = b + a x / d meets p where a (x0 + t wx) = (p - b) (d0 + t deepening).
    bool leaves_view = false;
    for (int axis = 0; axis < 2; ++axis) {
        for (int border = 0; border < 2; ++border) {
            float q = (float(border) * frame.size[axis] - frame.pixel_origin[axis]) / frame.pixel_scale[axis];
            float speed = dir[axis] - q * deepening, gap = q * d0 - origin[axis];
            bool outward = (speed > 0.0) == ((border == 1) == (frame.pixel_scale[axis] > 0.0));
            float t = max(gap / speed, 0.0);
            if (speed != 0.0 && outward && t < reach) {
                reach = t;
                leaves_view = true;
            }
        }
    }
    Ray ray = Ray(origin, dir, reach, 0.0, leaves_view);
    ray.span = distance(project(origin), project(origin + reach * dir));
    return ray;
}

// A ray as far as it stays in the view and in the box around the liquid.
Ray trace(vec3 origin, vec3 dir) {
    mat3 from_eye = transpose(mat3(frame.view));
    vec3 o = from_eye * (origin - frame.view[3].xyz), w = from_eye * dir;
    vec3 far_side = mix(frame.bounds_min, frame.bounds_max, greaterThan(w, vec3(0.0)));
    vec3 t = mix((far_side - o) / w, vec3(1e30), lessThan(abs(w), vec3(1e-12)));
    return in_view(origin, dir, max(min(t.x, min(t.y, t.z)), 0.0));
}

// One side of a volume as a ray meets it.
struct Wall {
    int cls;
    int side;
    float sense; // f = sense * (d - D)
};

// f at t. The difference of depths is formed before t enters, so that it rounds at its own size.
float wall_distance(Ray ray, Wall wall, float t) {
    bool whole;
    float d = sample_depth(wall.cls, wall.side, project(ray.origin + t * ray.dir), whole);
    if (d <= 0.0) return HOLE;
    return wall.sense * ((-ray.origin.z - d) - t * ray.dir.z);
}

// Two points of a ray with f there. Where a root is to be narrowed down, f(a) < 0 <= f(b).
struct Bracket {
    float a;
    float fa;
    float b;
    float fb;
};

// Where the line through a bracket's ends is zero; their middle where it is level.
float false_position(Bracket k) { return k.fb == k.fa ? 0.5 * (k.a + k.b) : k.b - k.fb * (k.b - k.a) / (k.fb - k.fa); }

// Narrows a bracket by regula falsi (Illinois), by halving while f(b) is a hole. Returns |f| at t.
float refine(Ray ray, Wall wall, Bracket k, out float t) {
    t = k.b;
    float f = k.fb, kept = 0.0; // the sign of f at the end that was moved last
    bool hole = k.fb >= HOLE;
    for (int i = 0; i < REFINE_STEPS && abs(f) > tolerance.converged; ++i) {
        // Every fourth step halves: where the map jumps, regula falsi alone creeps.
        t = hole || (i & 3) == 3 ? 0.5 * (k.a + k.b) : false_position(k);
        f = wall_distance(ray, wall, t);
        if (f < 0.0) {
            k.a = t;
            k.fa = f;
            if (kept < 0.0) k.fb *= 0.5;
            kept = -1.0;
        } else {
            k.b = t;
            k.fb = f;
            hole = f >= HOLE;
            if (kept > 0.0) k.fa *= 0.5;
            kept = 1.0;
        }
    }
    // The tolerance only has to find the root; a last step from the bracket without evaluating puts t on it.
    if (abs(f) <= tolerance.converged && !hole) t = false_position(k);
    return abs(f);
}

// How much a continuous wall at depth d changes from pixel to pixel at most: less than the interpolated spread (more
// counts as a jump), and, but for its rim, no more than a steep plane.
float wall_slope(float d) { return min(tolerance.jump, STEEP * d / abs(frame.pixel_scale.x)); }

// Pixels a ray at depth d may go before a wall can come near that is `gap` deeper or nearer than it; `slope` is the
// ray's own change of depth a pixel.
float clear_pixels(float gap, float slope, float d) { return gap / (wall_slope(d) + slope); }

#include "exit.glsl"
#include "entry.glsl"
