// Where a ray outside the liquid meets it again.

// Of a bracket that has no surface at its start and one at its end, just before the ray: halves it until the ray is before
// the surface at the bracket's start, so that it holds a crossing. After EDGE_STEPS there is none.
void find_edge(Ray ray, Wall front, inout Bracket k) {
    for (int i = 0; k.fa >= 0.0 && i < EDGE_STEPS; ++i) {
        float m = 0.5 * (k.a + k.b), f = wall_distance(ray, front, m);
        bool passed = f >= 0.0 && f < HOLE;
        if (passed) {
            k.b = m;
            k.fb = f;
        } else {
            k.a = m;
            k.fa = f;
        }
    }
}

// The first crossing of a class's front map, from in front to behind and without a jump, between two screen-space
// parameters: looked for at even steps, then refined. Sets `jumped` where the ray passes behind a surface without crossing
// it.
bool crosses_front(Ray ray, int cls, float from, float to, out float t, inout bool jumped) {
    Wall front = Wall(cls, SIDE_FRONT, 1.0);
    Bracket k = Bracket(0.0, HOLE, 0.0, 0.0);
    t = 0.0;
    int steps = clamp(int(ceil((to - from) * ray.span / ENTRY_PIXELS)), 1, ENTRY_STEPS);
    for (int i = 0; i <= steps; ++i) {
        k.b = t_at(ray, mix(from, to, float(i) / float(steps)));
        k.fb = wall_distance(ray, front, k.b);
        // A surface that begins or ends between the samples may be crossed before it does.
        float sampled = k.b, f_sampled = k.fb, close = abs(ray.dir.z) * (k.b - k.a) + tolerance.jump;
        if (i > 0 && k.fa >= HOLE && k.fb >= 0.0 && k.fb < close) find_edge(ray, front, k);
        bool ends = k.fb >= HOLE && k.fa > -close;
        if (k.fa < 0.0 && k.fb >= 0.0 && (ends || k.fb < HOLE)) {
            float residual = refine(ray, front, k, t);
            if (residual <= (ends ? tolerance.converged : tolerance.accepted)) return true;
            jumped = jumped || !ends;
        }
        k.a = sampled;
        k.fa = f_sampled;
    }
    return false;
}

// The class of the nearest front surface that a ray meets within a pixel, or -1. `shallow`, `deep`: the depths that the ray
// takes there, with what is interpolated from the pixels around.
int meets_pixel(Ray ray, ivec2 pixel, float from, float to, float shallow, float deep, out float t, inout bool jumped) {
    float front_splash = HAS_SPLASH ? map_depth(CLASS_SPLASH, SIDE_FRONT, pixel) : 0.0;
    float front_body = HAS_BODY ? map_depth(CLASS_BODY, SIDE_FRONT, pixel) : 0.0;
    bool splash = front_splash >= shallow && front_splash <= deep, body = front_body >= shallow && front_body <= deep;
    float t_splash = 0.0, t_body = 0.0;
    splash = splash && crosses_front(ray, CLASS_SPLASH, from, to, t_splash, jumped);
    body = body && crosses_front(ray, CLASS_BODY, from, to, t_body, jumped);
    bool splash_first = splash && (!body || t_splash <= t_body);
    t = splash_first ? t_splash : t_body;
    return splash_first ? CLASS_SPLASH : (body ? CLASS_BODY : -1);
}

// The nearest front surface of either class that a ray outside meets, or -1. The outcome says where the ray left the view,
// or ran out of steps, before it left the liquid's box. Sets `jumped` where it passed behind a surface unseen.
int find_entry(Ray ray, out float t, out int outcome, out bool jumped) {
    jumped = false;
    float nudge = PIXEL_NUDGE / max(ray.span, 1e-6), slack = tolerance.jump;
    ScreenLine line = screen_line(ray);
    float s = 0.0;
    for (int i = 0; i < MARCH_STEPS && s < 1.0; ++i) {
        ivec2 pixel = pixel_after(line, s, nudge), tile = pixel / FRONT_TILE;
        float d = depth_at(line, s);
        // A tile whose surfaces all lie before or behind the ray is left at once.
        float end = leaves_square(line, tile * FRONT_TILE, FRONT_TILE, s + nudge), d_end = depth_at(line, end);
        float least = texelFetch(front_tiles, ivec3(tile, 0), 0).x, most = texelFetch(front_tiles, ivec3(tile, 1), 0).x;
        if (max(d, d_end) < least - slack || min(d, d_end) > most + slack) {
            s = end;
            continue;
        }
        // Pixel by pixel: its own depths tell whether a surface is near enough to look closely. What is interpolated
        // in a pixel is within the spread of its own.
        end = leaves_square(line, pixel, 1, s + nudge);
        d_end = depth_at(line, end);
        int met = meets_pixel(ray, pixel, s, end, min(d, d_end) - slack, max(d, d_end) + slack, t, jumped);
        if (met >= 0) {
            outcome = OUTCOME_HIT;
            return met;
        }
        s = end;
    }
    t = 0.0;
    outcome = s < 1.0 ? OUTCOME_NOT_CONVERGED : (ray.leaves_view ? OUTCOME_LEFT_VIEW : OUTCOME_HIT);
    return -1;
}
