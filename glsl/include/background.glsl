// What a ray that meets no more liquid brings back: the host's opaque scene where it meets that, else what is infinitely
// far away.
#ifdef SCENE
// Where a ray first meets the scene, pixel by pixel: it reaches the pixel's depth within the pixel, or it comes into the pixel
// a little behind that depth and was in front of the scene until there, so that the surface lies between two pixels. Where it
// comes in further behind, it passes behind an object.
bool meets_scene(Ray ray, out float t, out ivec2 pixel) {
    ScreenLine line = screen_line(ray);
    float nudge = PIXEL_NUDGE / max(ray.span, 1e-6), s = 0.0;
    bool in_front = true;
    int most = int(frame.size.x + frame.size.y) + 4; // no line crosses more pixels
    for (int i = 0; i < most && s < 1.0; ++i) {
        pixel = pixel_after(line, s, nudge);
        float end = leaves_square(line, pixel, 1, s + nudge);
        float d = depth_at(line, s), d_end = depth_at(line, end), surface = scene_linear(pixel);
        float behind = d - surface;
        bool between = in_front && behind > 0.0 && behind <= surface * max(SCENE_BEHIND, STEEP / abs(frame.pixel_scale.x));
        if (between || (behind <= 0.0 && surface <= d_end && surface < CLEARED)) {
            float k0 = line.inverse_start, k1 = line.inverse_end;
            // At infinity rounding may leave nothing of 1 / d.
            t = t_at(ray, line, between || k1 == k0 ? s : clamp((1.0 / surface - k0) / (k1 - k0), s, end));
            return true;
        }
        in_front = d_end <= surface;
        s = end;
    }
    t = ray.reach;
    return false;
}

vec3 background(vec3 x, vec3 dir) {
    float t;
    ivec2 pixel;
    return meets_scene(in_view(x, dir, 1e20), t, pixel) ? scene_light(pixel) : infinitely_far(dir);
}
#else
vec3 background(vec3 x, vec3 dir) { return env_color(dir); }
#endif
