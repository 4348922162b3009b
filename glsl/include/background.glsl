// What a ray that meets no more liquid brings back: the host's opaque scene where it meets that, else what is infinitely
// far away.

#ifdef CUBE
vec3 env_texel(ivec2 p, float size, int axis, float side) {
    // A texel beyond the face's edge is the one next to that edge on the neighbouring face.
    vec2 q = clamp((2.0 * vec2(p) + 1.0) / size - 1.0, -1.0, 1.0);
    bool beyond_u = abs(q.x) == 1.0;
    if (beyond_u) q.y = clamp(q.y, 1.0 / size - 1.0, 1.0 - 1.0 / size); // past a corner there is no texel
    vec3 dir;
    dir[axis] = side * (beyond_u || abs(q.y) == 1.0 ? 1.0 - 1.0 / size : 1.0);
    dir[(axis + 1) % 3] = q.x;
    dir[(axis + 2) % 3] = q.y;
    return textureLod(samplerCube(environment, environment_sampler), dir, 0.0).rgb;
}

// Cube lookup, bilinear by hand and across edges: samplers interpolate with few bits, and not every format.
vec3 env_color(vec3 dir) {
    vec3 w = mat3(frame.eye_to_env) * dir, a = abs(w);
    int axis = a.x >= a.y && a.x >= a.z ? 0 : (a.y >= a.z ? 1 : 2);
    float size = float(textureSize(environment, 0).x), side = w[axis] < 0.0 ? -1.0 : 1.0;
    vec2 on_face = vec2(w[(axis + 1) % 3], w[(axis + 2) % 3]) / a[axis];
    vec2 q = (0.5 * on_face + 0.5) * size - 0.5, b = floor(q), f = q - b;
    ivec2 p = ivec2(b);
    return mix(mix(env_texel(p, size, axis, side), env_texel(p + ivec2(1, 0), size, axis, side), f.x),
               mix(env_texel(p + ivec2(0, 1), size, axis, side), env_texel(p + ivec2(1, 1), size, axis, side), f.x), f.y);
}
#else
vec3 env_texel(ivec2 p, ivec2 size) {
    p.x = p.x < 0 ? p.x + size.x : (p.x >= size.x ? p.x - size.x : p.x);
    return texelFetch(environment, ivec2(p.x, clamp(p.y, 0, size.y - 1)), 0).rgb;
}

// Equirectangular lookup, bilinear by hand: samplers interpolate with few bits, and differently on each driver.
vec3 env_color(vec3 dir) {
    vec3 w = mat3(frame.eye_to_env) * dir;
    ivec2 size = textureSize(environment, 0);
    float around = w.x == 0.0 && w.z == 0.0 ? 0.0 : atan(w.z, w.x); // undefined straight up and down
    vec2 uv = vec2(around * 0.15915494309 + 0.5, acos(clamp(w.y, -1.0, 1.0)) * 0.31830988618);
    vec2 q = uv * vec2(size) - 0.5, b = floor(q), f = q - b;
    ivec2 p = ivec2(b);
    return mix(mix(env_texel(p, size), env_texel(p + ivec2(1, 0), size), f.x),
               mix(env_texel(p + ivec2(0, 1), size), env_texel(p + ivec2(1, 1), size), f.x), f.y);
}
#endif

#ifdef SCENE
const float CLEARED = 1e30; // linear depth where the host drew nothing

float scene_linear(ivec2 p) {
    float z = texelFetch(scene_depth, p, 0).x;
    return z == frame.scene_cleared ? CLEARED : frame.scene_z_offset / (z + frame.scene_z_scale);
}

bool scene_hides(ivec2 pixel, float depth) { return scene_linear(pixel) < depth; }

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
            t = t_at(ray, between || k1 == k0 ? s : clamp((1.0 / surface - k0) / (k1 - k0), s, end));
            return true;
        }
        in_front = d_end <= surface;
        s = end;
    }
    t = ray.reach;
    return false;
}

vec3 scene_light(ivec2 pixel) { return texelFetch(scene_color, pixel, 0).rgb; }

// Light from where a ray ends that meets neither liquid nor scene.
vec3 infinitely_far(vec3 dir) {
    if (HOST_BACKGROUND && dir.z < 0.0) {
        // The host's own sky, where it is in the view.
        vec2 p = project(dir);
        if (all(greaterThanEqual(p, vec2(0.0))) && all(lessThan(p, frame.size)) && scene_linear(ivec2(p)) == CLEARED)
            return scene_light(ivec2(p));
    }
    return env_color(dir);
}

// The background straight through a pixel.
vec3 behind(ivec2 pixel, vec3 dir) { return scene_linear(pixel) < CLEARED ? scene_light(pixel) : env_color(dir); }

vec3 background(vec3 x, vec3 dir) {
    float t;
    ivec2 pixel;
    return meets_scene(in_view(x, dir, 1e20), t, pixel) ? scene_light(pixel) : infinitely_far(dir);
}
#else
bool scene_hides(ivec2 pixel, float depth) { return false; }
vec3 behind(ivec2 pixel, vec3 dir) { return env_color(dir); }
vec3 background(vec3 x, vec3 dir) { return env_color(dir); }
#endif
