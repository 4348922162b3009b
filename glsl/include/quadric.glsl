// A particle's ellipsoid in eye space and what it covers (Sigg06, in the eye's own tangent coordinates v = x/d
// instead of clip space, and measured from the centre, so that nothing large cancels).
struct Ellipsoid {
    vec3 center; // eye space
    vec3 sd;     // S = A A^T: xx, yy, zz
    vec3 sm;     // xy, xz, yz
};

Ellipsoid to_eye(Particle p) {
    mat3 R = mat3(frame.view);
    vec3 d = p.shape_diagonal.xyz, m = p.shape_mixed.xyz;
    mat3 S = mat3(d.x, m.x, m.y, m.x, d.y, m.z, m.y, m.z, d.z);
    mat3 E = R * S * transpose(R);
    float r2 = frame.viewport.w * frame.viewport.w;
    Ellipsoid e;
    e.center = (frame.view * vec4(p.center.xyz, 1.0)).xyz;
    e.sd = r2 * vec3(E[0][0], E[1][1], E[2][2]);
    e.sm = r2 * vec3(E[1][0], E[2][0], E[2][1]);
    return e;
}

// Interval of x/d over the ellipsoid for one lateral axis: the two planes through the eye that touch it.
// A plane x = v d has the normal n = (1, 0, v), touches where (n.c)^2 = n^T S n, and with v = c/dc + u, n.c = -u dc:
// u^2 (dc^2 - szz) - 2 u (sxz + c/dc szz) - (sxx + 2 c/dc sxz + (c/dc)^2 szz) = 0.
vec2 tangent_interval(float c, float dc, float sxx, float sxz, float szz) {
    float v = c / dc;
    float alpha = sxx + v * (2.0 * sxz + v * szz);
    float beta = sxz + v * szz;
    float gamma = dc * dc - szz;
    float root = sqrt(max(beta * beta + gamma * alpha, 0.0));
    return vec2(v + (beta - root) / gamma, v + (beta + root) / gamma);
}

// Interval of x/d where the ellipsoid crosses the near plane: from its bounding box beyond that plane.
vec2 crossing_interval(float c, float half_width, float far) {
    float near = frame.viewport.z;
    float lo = c - half_width, hi = c + half_width;
    return vec2(lo / (lo < 0.0 ? near : far), hi / (hi > 0.0 ? near : far));
}

// Pixel rectangle (lo.xy, hi.xy) that holds every pixel centre the ellipsoid covers, clipped to the viewport;
// empty (lo >= hi) if there is none.
vec4 pixel_bounds(Ellipsoid e) {
    float dc = -e.center.z, reach = sqrt(e.sd.z), near = frame.viewport.z;
    if (dc + reach <= near) return vec4(1.0, 1.0, 0.0, 0.0);
    vec2 x, y;
    if (dc - reach > near) {
        x = tangent_interval(e.center.x, dc, e.sd.x, e.sm.y, e.sd.z);
        y = tangent_interval(e.center.y, dc, e.sd.y, e.sm.z, e.sd.z);
    } else {
        x = crossing_interval(e.center.x, sqrt(e.sd.x), dc + reach);
        y = crossing_interval(e.center.y, sqrt(e.sd.y), dc + reach);
    }
    vec2 a = frame.to_pixel.xy * vec2(x.x, y.x) + frame.to_pixel.zw;
    vec2 b = frame.to_pixel.xy * vec2(x.y, y.y) + frame.to_pixel.zw;
    // A hundredth of a pixel covers the rounding of a and b at 16384 pixels.
    vec2 lo = max(min(a, b) - 0.01, vec2(0.0));
    vec2 hi = min(max(a, b) + 0.01, frame.viewport.xy);
    return vec4(lo, hi);
}
