// What is infinitely far away: the environment map.
#ifdef CUBE
layout(set = 0, binding = 6) uniform textureCube environment; // linear
layout(set = 0, binding = 7) uniform sampler environment_sampler; // nearest
#else
layout(set = 0, binding = 6) uniform texture2D environment; // equirectangular, linear
#endif

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
