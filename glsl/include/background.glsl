// What a ray that meets no more liquid brings back: the host's opaque scene where it meets that, else the environment.

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

// Linear depth of the host's scene; a huge value where it was cleared.
float scene_linear(ivec2 p) {
    float z = texelFetch(scene_depth, p, 0).x;
    return z == frame.scene.z ? 1e30 : frame.scene.y / (z + frame.scene.x);
}

bool scene_hides(ivec2 pixel, float depth) { return HAS_SCENE && scene_linear(pixel) < depth; }

// The background straight through a pixel.
vec3 behind(ivec2 pixel, vec3 dir) {
    if (HAS_SCENE && scene_linear(pixel) < 1e30) return texelFetch(scene_color, pixel, 0).rgb;
    return env_color(dir);
}

// Marches a pixel at a time until the ray passes behind the scene's depth; accepts the crossing where the ray is less
// than one step behind, so that things it passes far behind do not catch it.
vec3 background(vec3 x, vec3 dir) {
    if (!HAS_SCENE) return env_color(dir);
    float d0 = -x.z, dd = -dir.z;
    // The far end: the vanishing point for rays going away, the near plane for rays coming back.
    float reach = dd < 0.0 ? max(d0 - frame.viewport.z, 0.0) / -dd : 1e3 * d0;
    vec2 p0 = project(x), p1 = project(x + reach * dir);
    float k0 = 1.0 / d0, k1 = 1.0 / (d0 + reach * dd);
    float span = max(distance(p0, p1), 1.0), d_last = d0;
    for (float i = 1.0; i <= min(span, float(MARCH_STEPS)); ++i) {
        vec2 p = mix(p0, p1, i / span);
        if (any(lessThan(p, vec2(0.0))) || any(greaterThanEqual(p, frame.viewport.xy))) break;
        float d = 1.0 / mix(k0, k1, i / span), surface = scene_linear(ivec2(p));
        if (d >= surface && min(d, d_last) <= surface + abs(d - d_last) + 0.01 * surface)
            return texelFetch(scene_color, ivec2(p), 0).rgb;
        d_last = d;
    }
    return env_color(dir);
}
