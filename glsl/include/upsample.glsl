// The front surface at a pixel of the picture, from maps of half its width and height (Cords08 section 5): bilinear, by hand,
// between pixels of one surface. Where some of the four have none, the rest make it up, and the weight of those is how much it covers.
struct Front {
    float depth;    // 0: no surface; negative: the near plane lies inside a particle
    vec3 normal;
    float coverage; // weight of those of the four that have a surface
    float speed;    // of the same pixels as the depth; 0 without a velocity map
};

Front upsampled(vec2 position) {
    vec2 q = 0.5 * position - 0.5, corner = floor(q), f = q - corner;
    ivec2 last = textureSize(body_depth, 0).xy - 1;
    ivec2 at[4];
    float depth[4], weight[4];
    float coverage = 0.0, most = 0.0, own = 0.0; // of the heaviest that has a surface
    uint own_normal = 0u;
    for (int k = 0; k < 4; ++k) {
        ivec2 step = ivec2(k & 1, k >> 1);
        at[k] = clamp(ivec2(corner) + step, ivec2(0), last);
        depth[k] = texelFetch(body_depth, ivec3(at[k], SIDE_FRONT), 0).x;
        vec2 factors = mix(1.0 - f, f, vec2(step));
        weight[k] = factors.x * factors.y;
        if (depth[k] == 0.0) continue;
        coverage += weight[k];
        if (weight[k] > most) {
            most = weight[k];
            own = depth[k];
            own_normal = texelFetch(body_normal, ivec3(at[k], SIDE_FRONT), 0).x;
        }
    }
    vec3 normal = decode_normal(own_normal);
    if (own <= 0.0) return Front(own, normal, coverage, 0.0);
    // No surface is made up between two: what a steep one changes from pixel to pixel of the maps, and no more.
    float jump = max(JUMP, 2.0 * STEEP * own / max(abs(frame.pixel_scale.x), abs(frame.pixel_scale.y)));
    float total = 0.0, rise = 0.0, fast = 0.0;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 4; ++k) {
        if (depth[k] <= 0.0 || abs(depth[k] - own) > jump) continue;
        total += weight[k];
        rise += weight[k] * (depth[k] - own);
#ifdef SPEED
        fast += weight[k] * texelFetch(speed, at[k], 0).x;
#endif
        sum += weight[k] * decode_normal(texelFetch(body_normal, ivec3(at[k], SIDE_FRONT), 0).x);
    }
    float size = length(sum);
    return Front(own + rise / total, size > 0.0 ? sum / size : normal, coverage, fast / total);
}
