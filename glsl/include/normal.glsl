// Unit vectors in 32 bits: octahedral map, two signed 16-bit fractions (largest error about 0.004 degrees).
vec2 octahedral_wrap(vec2 v) { return (1.0 - abs(v.yx)) * vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0); }

uint encode_normal(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    if (n.z < 0.0) p = octahedral_wrap(p);
    // packSnorm2x16 rounds differently from driver to driver; this does not.
    ivec2 q = whole(floor(clamp(p, -1.0, 1.0) * 32767.0 + 0.5));
    return (uint(q.x) & 0xffffu) | (uint(q.y) << 16);
}

vec3 decode_normal(uint e) {
    vec2 p = vec2(float(int(e << 16) >> 16), float(int(e) >> 16)) * (1.0 / 32767.0);
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (n.z < 0.0) n.xy = octahedral_wrap(n.xy);
    return normalize(n);
}
