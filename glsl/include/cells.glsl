// Whole cells in which coordinates lie (Im16 section III): unbounded, and exact.
bool finite(vec3 x) { return !any(isnan(x)) && !any(isinf(x)); }

// p + e = a b exactly (Dekker): what rounding leaves of a product.
vec2 two_product(float a, float b) {
    precise float p = a * b;
    precise float sa = 4097.0 * a, ha = sa - (sa - a), la = a - ha;
    precise float sb = 4097.0 * b, hb = sb - (sb - b), lb = b - hb;
    precise float e = ((ha * hb - p) + ha * lb + la * hb) + la * lb;
    return vec2(p, e);
}

// s + e = a + b exactly (Knuth).
vec2 two_sum(float a, float b) {
    precise float s = a + b, t = s - a;
    precise float e = (a - (s - t)) + (b - t);
    return vec2(s, e);
}

// floor(x / edge), exactly: a rounded quotient, mended by its exact remainder; and how far into that cell x lies, in parts of its
// edge. Beyond 2^29 cells all is one cell.
int cell_of(float x, float edge, out float part) {
    part = 0.0;
    float q = floor(x / edge);
    if (!(abs(q) < float(FURTHEST_CELL))) return q < 0.0 ? -FURTHEST_CELL : FURTHEST_CELL;
    vec2 p = two_product(q, edge);
    precise float rest = (x - p.x) - p.y, above = (rest - edge);
    int cell = int(q);
    float inside = rest;
    if (rest < 0.0) {
        --cell;
        inside = rest + edge;
    } else if (above >= 0.0) {
        ++cell;
        inside = above;
    }
    part = clamp(inside / edge, 0.0, 1.0);
    return cell;
}

int cell_of(float x, float edge) {
    float part;
    return cell_of(x, edge, part);
}
