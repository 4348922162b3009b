// A particle's ellipsoid in eye space and what it covers (Sigg06; docs/methods.md, "Depth maps"). Sigg06 works in clip space;
// here coordinates are v = x/d, and measured from the centre, so that nothing large cancels.
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
    Ellipsoid e;
    e.center = (frame.view * vec4(p.center.xyz, 1.0)).xyz;
    e.sd = vec3(E[0][0], E[1][1], E[2][2]);
    e.sm = vec3(E[1][0], E[2][0], E[2][1]);
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
    float near = frame.near;
    float lo = c - half_width, hi = c + half_width;
    return vec2(lo / (lo < 0.0 ? near : far), hi / (hi > 0.0 ? near : far));
}

// Pixel rectangle (lo.xy, hi.xy) that holds every pixel centre the ellipsoid covers, clipped to the viewport;
// empty (lo >= hi) if there is none.
vec4 pixel_bounds(Ellipsoid e) {
    float dc = -e.center.z, reach = sqrt(e.sd.z), near = frame.near;
    if (dc + reach <= near) return vec4(1.0, 1.0, 0.0, 0.0);
    vec2 x, y;
    if (dc - reach > near) {
        x = tangent_interval(e.center.x, dc, e.sd.x, e.sm.y, e.sd.z);
        y = tangent_interval(e.center.y, dc, e.sd.y, e.sm.z, e.sd.z);
    } else {
        x = crossing_interval(e.center.x, sqrt(e.sd.x), dc + reach);
        y = crossing_interval(e.center.y, sqrt(e.sd.y), dc + reach);
    }
    vec2 a = frame.pixel_scale * vec2(x.x, y.x) + frame.pixel_origin;
    vec2 b = frame.pixel_scale * vec2(x.y, y.y) + frame.pixel_origin;
    // A hundredth of a pixel covers the rounding of a and b at 16384 pixels.
    vec2 lo = max(min(a, b) - 0.01, vec2(0.0));
    vec2 hi = min(max(a, b) + 0.01, frame.size);
    return vec4(lo, hi);
}

// G = S^-1 from S by cofactors: xx, yy, zz and xy, xz, yz.
void inverse_shape(Ellipsoid e, out vec3 diagonal, out vec3 mixed_part) {
    vec3 d = e.sd, m = e.sm;
    vec3 cofactor = vec3(d.y * d.z - m.z * m.z, d.x * d.z - m.y * m.y, d.x * d.y - m.x * m.x);
    vec3 cofactor_mixed = vec3(m.y * m.z - m.x * d.z, m.x * m.z - m.y * d.y, m.x * m.y - m.z * d.x);
    float det = d.x * cofactor.x + m.x * cofactor_mixed.x + m.y * cofactor_mixed.y;
    diagonal = cofactor / det;
    mixed_part = cofactor_mixed / det;
}

vec3 times_shape(vec3 diagonal, vec3 mixed_part, vec3 a) {
    return vec3(diagonal.x * a.x + mixed_part.x * a.y + mixed_part.y * a.z,
                mixed_part.x * a.x + diagonal.y * a.y + mixed_part.z * a.z,
                mixed_part.y * a.x + mixed_part.z * a.y + diagonal.z * a.z);
}

// An ellipsoid ready to be cast: its centre with z as depth, and G.
struct Cast {
    vec3 center;
    vec3 diagonal;
    vec3 mixed_part;
};

Cast cast_of(Ellipsoid e) {
    Cast c;
    c.center = vec3(e.center.xy, -e.center.z);
    inverse_shape(e, c.diagonal, c.mixed_part);
    return c;
}

// A point of the pixel's ray at depth dc + s is q + s v from the centre, q = dc v - c its offset at the centre's depth, and
// (q + s v)^T G (q + s v) = 1 is quadratic in s, a s^2 + 2 b s + c = 0, with coefficients of order one. Returns b^2 - a c.
float quadratic(Cast c, vec3 v, out vec3 q, out float a, out float b) {
    q = vec3(c.center.z * v.xy - c.center.xy, 0.0);
    vec3 gv = times_shape(c.diagonal, c.mixed_part, v), gq = times_shape(c.diagonal, c.mixed_part, q);
    a = dot(v, gv);
    b = dot(v, gq);
    return b * b - a * (dot(q, gq) - 1.0);
}

// Depths at which a ray (vx, vy, -1) enters and leaves, as splat.frag has them but for rounding. Where rounding could decide
// whether the ray hits at all, `slack` does: 1 says it does, -1 that it does not.
bool hits(Cast c, vec3 v, float slack, out float nearer, out float farther) {
    float a, b;
    vec3 q;
    float discriminant = quadratic(c, v, q, a, b);
    discriminant += slack * SILHOUETTE * (b * b + a);
    float root = sqrt(max(discriminant, 0.0)), inverse = 1.0 / a;
    nearer = c.center.z - (root + b) * inverse;
    farther = c.center.z + (root - b) * inverse;
    return discriminant >= 0.0;
}
