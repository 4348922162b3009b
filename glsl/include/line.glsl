// A ray as the screen shows it, and how far it stays in the view and in the liquid's box.
struct Ray {
    vec3 origin;      // eye space
    vec3 dir;         // unit
    float reach;      // t at which it leaves the liquid's box, the view or the near plane
    float span;       // pixels between its ends on the screen
    bool leaves_view; // whether the view's border or the near plane is what ends it
};

ivec2 nearest(vec2 position) { return whole(clamp(floor(position), vec2(0.0), frame.size - 1.0)); }

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

// t at a screen-space parameter s, which runs evenly in pixels from 0 at the ray's start to 1 at its end: 1 / d is linear
// in s.
float t_at(Ray ray, ScreenLine line, float s) { return ray.reach * line.inverse_end * (s * depth_at(line, s)); }

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
    bool leaves_view = false;
    if (deepening < 0.0) {
        float t = max(d0 - frame.near, 0.0) / -deepening;
        leaves_view = t < reach;
        reach = min(reach, t);
    }
    // The view's border: pixel(t) = b + a x / d meets p where a (x0 + t wx) = (p - b) (d0 + t deepening).
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

// Whether a point is seen, as far as the view goes.
bool in_sight(vec3 x) {
    if (-x.z < frame.near) return false;
    vec2 p = project(x);
    return all(greaterThanEqual(p, vec2(0.0))) && all(lessThan(p, frame.size));
}

// A ray as far as it stays in the view and in the box around the liquid.
Ray trace(vec3 origin, vec3 dir) {
    mat3 from_eye = transpose(mat3(frame.view));
    vec3 o = from_eye * (origin - frame.view[3].xyz), w = from_eye * dir;
    // Smoothing may move surfaces a little beyond the box.
    vec3 far_side = mix(frame.bounds_min - BOX_MARGIN, frame.bounds_max + BOX_MARGIN, greaterThan(w, vec3(0.0)));
    vec3 t = mix((far_side - o) / w, vec3(1e30), lessThan(abs(w), vec3(1e-12)));
    return in_view(origin, dir, max(min(t.x, min(t.y, t.z)), 0.0));
}
