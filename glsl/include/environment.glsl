// What is infinitely far away: the environment map. CUBE: the host's, a cube.
#ifdef CUBE
layout(set = 0, binding = 6) uniform textureCube environment; // linear
layout(set = 0, binding = 7) uniform sampler environment_sampler; // nearest
#else
layout(constant_id = 16) const bool OWN_ENVIRONMENT = true; // the renderer's own map, and not the host's
layout(set = 0, binding = 6) uniform texture2D environment; // the host's, equirectangular, linear
layout(set = 0, binding = 7) uniform utexture2D footprints; // of our own's texels: src/environment/footprints.rs
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
    ivec2 p = whole(b);
    return mix(mix(env_texel(p, size, axis, side), env_texel(p + ivec2(1, 0), size, axis, side), f.x),
               mix(env_texel(p + ivec2(0, 1), size, axis, side), env_texel(p + ivec2(1, 1), size, axis, side), f.x), f.y);
}
#else
vec3 env_texel(ivec2 p, ivec2 size) {
    p.x = p.x < 0 ? p.x + size.x : (p.x >= size.x ? p.x - size.x : p.x);
    return texelFetch(environment, ivec2(p.x, clamp(p.y, 0, size.y - 1)), 0).rgb;
}

// atan(w.z, w.x), and acos(w.y) of a direction: minimax polynomials, off by 2e-6 and 5e-6 radians, in half the instructions. Straight
// up and down, where atan is undefined, the first is what it may be.
vec2 angles_of(vec3 w) {
    const float PI = 3.14159265359;
    vec3 a = abs(w);
    float t = min(a.x, a.z) / max(max(a.x, a.z), 1e-30), s = t * t;
    float around = t * (0.99997726 + s * (-0.33262347 + s * (0.19354346 + s * (-0.11643287 + s * (0.05265332 - s * 0.01172120)))));
    around = a.z > a.x ? 0.5 * PI - around : around;
    around = w.x < 0.0 ? PI - around : around;
    float y = min(a.y, 1.0);
    float polar = sqrt(1.0 - y) * (1.5707915 + y * (-0.21428061 + y * (0.08563838 + y * (-0.03761822 + y * 0.00973297))));
    return vec2(w.z < 0.0 ? -around : around, w.y < 0.0 ? PI - polar : polar);
}

// What a texel of a footprint adds with a weight, over the map's scale: three mantissas of 9 bits, and above them an exponent
// of 5, whose place in the word is four bits above that in a float.
vec3 footprint_part(uint texel, float weight) {
    float step = weight * uintBitsToFloat((texel >> 4 & 0x0f800000u) | 0x30000000u); // 2^-31 to 1
    return step * vec3(ivec3(texel & 511u, texel >> 9 & 511u, texel >> 18 & 511u));
}

// Equirectangular lookup, bilinear by hand: samplers interpolate with few bits, and differently on each driver.
vec3 env_color(vec3 dir) {
    vec3 w = mat3(frame.eye_to_env) * dir;
    vec2 angles = angles_of(w);
    if (OWN_ENVIRONMENT) {
        vec2 q = angles * frame.environment_per_radian + vec2(0.5 * frame.environment_columns - 0.5, -0.5);
        q.y = max(q.y, 0.0); // the first row ends at the pole; the footprints of the last one end there
        vec2 b = floor(q), f = q - b;
        ivec2 p = whole(vec2(b.x < 0.0 ? frame.environment_columns - 1.0 : b.x, b.y));
        uvec4 texels = texelFetch(footprints, p, 0);
        vec2 right = vec2(1.0 - f.x, f.x), upper = right * (1.0 - f.y), lower = right * f.y;
        vec3 light = footprint_part(texels.x, upper.x) + footprint_part(texels.y, upper.y);
        return (light + footprint_part(texels.z, lower.x) + footprint_part(texels.w, lower.y)) * frame.environment_scale;
    }
    ivec2 size = textureSize(environment, 0);
    vec2 uv = angles * vec2(0.15915494309, 0.31830988618) + vec2(0.5, 0.0);
    vec2 q = uv * vec2(size) - 0.5, b = floor(q), f = q - b;
    ivec2 p = whole(b);
    return mix(mix(env_texel(p, size), env_texel(p + ivec2(1, 0), size), f.x),
               mix(env_texel(p + ivec2(0, 1), size), env_texel(p + ivec2(1, 1), size), f.x), f.y);
}
#endif
