// Where a ray inside a volume leaves it.

// What a look along a ray up to a root finds: the secant method finds a wall, not necessarily the first.
const int CLEAR = 0;   // inside all the way
const int JUMPED = 1;  // inside, but the map ahead jumps: what stands there may hide an earlier wall
const int BLOCKED = 2; // outside somewhere, by either wall
int look_until(Ray ray, Wall ahead, Wall opposite, float t) {
    vec2 p0 = project(ray.origin), p1 = project(ray.origin + t * ray.dir);
    float d0 = -ray.origin.z, d1 = d0 - t * ray.dir.z, pixels = max(distance(p0, p1), 1e-6);
    float slope = abs(d1 - d0) / max(pixels, 1.0);
    float last_depth = map_depth(ahead.cls, ahead.side, nearest(p0)), stride = CHECK_PIXELS, walked = 0.0;
    int found = CLEAR;
    for (int i = 0; i < CHECK_STEPS && walked < pixels; ++i) {
        walked = min(walked + stride, pixels);
        float s = walked / pixels;
        ivec2 pixel = nearest(mix(p0, p1, s));
        float depth = map_depth(ahead.cls, ahead.side, pixel), behind = map_depth(opposite.cls, opposite.side, pixel);
        float d = d0 * d1 / mix(d1, d0, s);
        float gap = ahead.sense * (depth - d), gap_behind = behind > 0.0 ? ahead.sense * (d - behind) : HOLE;
        if (walked < pixels && (depth <= 0.0 || gap < -tolerance.accepted)) return BLOCKED;
        if (gap_behind < -tolerance.accepted) return BLOCKED;
        if (abs(depth - last_depth) > tolerance.jump * (1.0 + stride)) found = JUMPED;
        last_depth = depth;
        stride = clamp(clear_pixels(min(gap, gap_behind), slope, d), CHECK_PIXELS, CHECK_STRIDE);
    }
    return found;
}

// The secant method, from the two ends that a flat wall would give. False if it leaves the ray, meets a hole, does not
// converge, or finds a wall that is not the first.
bool secant(Ray ray, Wall ahead, Wall opposite, out float t, out int outcome) {
    outcome = OUTCOME_NOT_CONVERGED;
    t = 0.0;
    Bracket k = Bracket(0.0, wall_distance(ray, ahead, 0.0), 0.0, 0.0);
    if (k.fa >= 0.0) return false;
    k.b = min(-k.fa / max(abs(ray.dir.z), 1e-6), ray.reach);
    for (int i = 0; i < SECANT_STEPS; ++i) {
        k.fb = wall_distance(ray, ahead, k.b);
        float next = false_position(k);
        if (abs(k.fb) <= tolerance.converged) {
            t = next; // the tolerance only has to find the root; the last step puts t on it
            int found = look_until(ray, ahead, opposite, t);
            outcome = found == CLEAR ? OUTCOME_HIT : OUTCOME_PAST_JUMP;
            return found != BLOCKED;
        }
        if (k.fb >= HOLE || !(next > 0.0 && next <= ray.reach)) break;
        k = Bracket(k.b, k.fb, next, 0.0);
    }
    return false;
}

// What the march knows at one point of the ray.
struct Sample {
    float t;
    float depth;    // of the map ahead
    float ahead;    // f of the wall ahead
    float opposite; // f of the opposite wall
};

// By the depths of the pixel at s alone, without interpolation.
Sample sample_pixel(Ray ray, ScreenLine line, Wall ahead, Wall opposite, float s, float d) {
    ivec2 pixel = nearest(mix(line.start, line.end, s));
    float depth = map_depth(ahead.cls, ahead.side, pixel), behind = map_depth(opposite.cls, opposite.side, pixel);
    float f = depth > 0.0 ? ahead.sense * (d - depth) : HOLE, f_behind = behind > 0.0 ? ahead.sense * (behind - d) : HOLE;
    return Sample(t_at(ray, s), depth, f, f_behind);
}

// The hit in a bracket; where there is none, the ray ends in a hole at the bracket's start.
int hit_in(Ray ray, Wall wall, Bracket bracket, int outcome, out float t) {
    if (refine(ray, wall, bracket, t) <= tolerance.accepted) return outcome;
    t = bracket.a;
    return OUTCOME_HOLE;
}

// What the march meets between two samples: an outcome, or -1 where the ray runs on.
int met_between(Ray ray, Wall ahead, Wall opposite, Sample last, Sample next, bool inside, bool jumped, out float t, inout int side) {
    if (next.opposite > tolerance.accepted && next.opposite < HOLE) {
        Bracket bracket = Bracket(last.t, min(last.opposite, 0.0), next.t, next.opposite);
        int outcome = hit_in(ray, opposite, bracket, OUTCOME_OPPOSITE_WALL, t);
        if (outcome != OUTCOME_HOLE) side = opposite.side;
        return outcome;
    }
    if (next.ahead < 0.0 || !inside) return -1;
    Bracket bracket = Bracket(last.t, last.ahead, next.t, next.ahead);
    return hit_in(ray, ahead, bracket, jumped ? OUTCOME_PAST_JUMP : OUTCOME_HIT, t);
}

// March: a pixel a stride near a wall, more where none can come near, then regula falsi. `on_wall`: the ray starts on the
// wall ahead, not before it.
int march(Ray ray, Wall ahead, Wall opposite, bool on_wall, out float t, out int side) {
    side = ahead.side;
    float fine = min(EXIT_PIXELS / max(ray.span, 1e-6), 1.0);      // a pixel
    float slope = ray.reach * abs(ray.dir.z) / max(ray.span, 1.0); // depth a pixel
    ScreenLine line = screen_line(ray);
    bool inside = !on_wall, jumped = false;
    Sample last = Sample(0.0, 0.0, -1.0, -1.0);
    // Off a wall the first sample is close to it: within two pixels the ray is inside or it is nowhere.
    float s = 0.0, stride = on_wall ? 0.05 * fine : fine;
    for (int i = 0; i < MARCH_STEPS && s < 1.0; ++i) {
        float next_s = min(s + stride, 1.0), d = depth_at(line, next_s);
        Sample next = sample_pixel(ray, line, ahead, opposite, next_s, d);
        // A pixel's own depth tells which walls are near enough to look closely.
        float close = 0.5 * wall_slope(d);
        bool near = next.ahead > -close, near_opposite = next.opposite > -close && next.opposite < HOLE;
        if (stride > fine && (near || near_opposite)) {
            stride = fine;
            continue;
        }
        float gap = min(-next.ahead, next.opposite < HOLE ? -next.opposite : HOLE);
        if (near) next.ahead = wall_distance(ray, ahead, next.t);
        if (near_opposite) next.opposite = wall_distance(ray, opposite, next.t);
        int met = met_between(ray, ahead, opposite, last, next, inside, jumped, t, side);
        if (met >= 0) return met;
        if (next.ahead < 0.0) {
            float most = tolerance.jump * (1.0 + EXIT_PIXELS * stride / fine);
            jumped = jumped || (last.depth > 0.0 && abs(next.depth - last.depth) > most);
            inside = true;
            last = next;
            if (last.opposite >= HOLE) last.opposite = -1.0;
        } else if (next_s >= 2.0 * fine) {
            t = 0.0;
            return OUTCOME_HOLE;
        }
        s = next_s;
        stride = fine * clamp(clear_pixels(gap, slope, d) / EXIT_PIXELS, 1.0, EXIT_STRIDE / EXIT_PIXELS);
    }
    t = last.t;
    if (s < 1.0) return OUTCOME_NOT_CONVERGED;
    return ray.leaves_view ? OUTCOME_LEFT_VIEW : OUTCOME_HOLE;
}

// Where a ray inside a volume leaves it: by the wall ahead, the back map for a ray that goes away from the eye and the front
// map for one that comes back, or by the opposite wall, where that lies across the ray.
// `came_from`: the map off which the ray was reflected, or -1: there f starts at zero, and the secant method would stay.
// Returns an outcome; t is the hit, or the last point known to be inside; `side` the map that was hit.
int find_exit(Ray ray, int cls, int came_from, out float t, out int side) {
    bool away = ray.dir.z <= 0.0;
    Wall ahead = away ? Wall(cls, SIDE_BACK, 1.0) : Wall(cls, SIDE_FRONT, -1.0);
    Wall opposite = Wall(cls, 1 - ahead.side, -ahead.sense);
    bool on_wall = came_from == ahead.side;
    int outcome;
    side = ahead.side;
    if (!on_wall && secant(ray, ahead, opposite, t, outcome)) return outcome;
    return march(ray, ahead, opposite, on_wall, t, side);
}
