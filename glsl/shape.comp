// From neighbours to what is drawn: number density and class (Imai16 section 4.1), and for the body the ellipsoid of
// YuTurk13. One invocation takes SHAPE_RUN particles that follow each other in the sorted order, those of one column of cells
// together, one a component: what is looked up and read once serves all. Candidates are tested exactly, so that neighbours are
// the same set however they are found.
//
// Sorted cells: cells as wide as the support, so 5 x 5 runs of 5 cells. RELATION: one run of the relation table, whose
// cells are as wide as the reach.
#version 460
// Compiled with any of: NEIGHBOURS
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "groups.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
#include "positions.glsl"
layout(set = 0, binding = 3, std430) readonly buffer OrderBlock { uint at[]; } order;
layout(set = 0, binding = 4, std430) readonly buffer SortedBlock { float at[]; } sorted;
layout(set = 0, binding = 5, std430) writeonly buffer CenterBlock { float at[]; } centers;
layout(set = 0, binding = 6, std430) writeonly buffer DiagonalBlock { float at[]; } diagonals;
layout(set = 0, binding = 7, std430) writeonly buffer MixedBlock { float at[]; } mixed_parts;
layout(set = 0, binding = 8, std430) buffer CounterBlock { uint at[]; } counters;
layout(set = 0, binding = 9, std430) buffer ClassBlock { uint at[]; } last_classes; // 0 splash, 1 body, by input index
#ifdef NEIGHBOURS
layout(set = 0, binding = 10, std430) writeonly buffer NeighbourBlock { uint at[]; } neighbours;
#endif
layout(constant_id = 1) const bool KEEP_CLASSES = false;

uint count() { return prepare.source.x; }
vec3 sorted_position(uint k) { return vec3(sorted.at[3u * k], sorted.at[3u * k + 1u], sorted.at[3u * k + 2u]); }
uint order_at(uint place) {
    uint passes = extent.at[EXTENT_PASSES];
    return passes == 0u ? place : order.at[half_before(passes) + place];
}
uint input_index(uint k) { return RELATION ? k : order_at(k); }

#ifdef NEIGHBOURS
// A particle's share: its index, how many neighbours it has, and those of them that there is room for.
uint share() { return neighbours.at.length() / count(); }
void list(uint k, uint number) {
    neighbours.at[k * share()] = input_index(k);
    neighbours.at[k * share() + 1u] = number;
}
#endif

ivec3 place_cell(uint place) {
    if (!RELATION) return cell_of(sorted_position(place));
    uint entry = order_at(place);
    return cell_of(sorted_position(entry / 27u)) + entry_offset(entry);
}

bool before(ivec3 a, ivec3 b) { return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z; }

// First place whose cell is not before c (`inclusive`: not before or equal to).
uint search(ivec3 c, bool inclusive, uint low) {
    uint high = entries();
    while (low < high) {
        uint middle = low + (high - low) / 2u;
        ivec3 m = place_cell(middle);
        if (before(m, c) || (inclusive && m == c)) low = middle + 1u;
        else high = middle;
    }
    return low;
}

// The same among keys of one word: first place, not before `low`, whose key is not smaller than `key`. What is looked for is
// mostly near: strides grow from there.
uint search_key(uint key, uint low) {
    uint keys = free_half(), reach = 8u;
    while (low + reach < count() && order.at[keys + low + reach] < key) {
        low += reach;
        reach *= 4u;
    }
    uint high = min(low + reach, count());
    while (low < high) {
        uint middle = low + (high - low) / 2u;
        if (order.at[keys + middle] < key) low = middle + 1u;
        else high = middle;
    }
    return low;
}

// The run of places in the cells from `from` to `to`, which differ in z alone; it does not begin before `low`. Only of
// particles, and only where keys are one word, are there keys to look in.
uvec2 run_of(ivec3 from, ivec3 to, uint low) {
    if (RELATION || key_bits() > 32u) {
        uint begin = search(from, false, low);
        return uvec2(begin, search(to, true, begin));
    }
    ivec3 first = first_cell(), last = last_cell();
    from.z = max(from.z, first.z);
    to.z = min(to.z, last.z);
    if (any(lessThan(from.xy, first.xy)) || any(greaterThan(from.xy, last.xy)) || from.z > to.z) return uvec2(low, low);
    uint begin = search_key(sort_key(from).x, low), key = sort_key(to).x;
    // The last key of all has none after it.
    return uvec2(begin, key == 0xffffffffu ? count() : search_key(key + 1u, begin));
}

// In a crowd, every how many of its candidates one stands for all.
uint step_of(uvec2 run) {
    const uint most = RELATION ? CROWD_RELATION : CROWD;
    return max((run.y - run.x + most - 1u) / most, 1u);
}

// Whether b - a is shorter than the reach: ties of float32 decided to 2^-45 of the square.
bool nearer(vec3 a, vec3 b) {
    float reach = prepare.lengths.w;
    vec2 x = two_sum(b.x, -a.x), y = two_sum(b.y, -a.y), z = two_sum(b.z, -a.z);
    vec2 xx = two_product(x.x, x.x), yy = two_product(y.x, y.x), zz = two_product(z.x, z.x), rr = two_product(reach, reach);
    vec2 s = two_sum(xx.x, yy.x), t = two_sum(s.x, zz.x);
    precise float large = t.x - rr.x;
    precise float small = (s.y + t.y) + (xx.y + yy.y + zz.y - rr.y) + 2.0 * (x.x * x.y + y.x * y.y + z.x * z.y);
    return large + small < 0.0;
}

// The cubic spline without a branch: 2 (1 - q)^3 less 8 (1/2 - q)^3 where those are positive.
vec4 spline(vec4 q) {
    vec4 far = max(1.0 - q, 0.0), near = max(0.5 - q, 0.0);
    return 2.0 * far * far * far - 8.0 * near * near * near;
}

// Eigenvalues and eigenvectors (columns) of a symmetric matrix, in no order: cyclic Jacobi rotations.
void eigen(inout mat3 a, out mat3 v) {
    v = mat3(1.0);
    for (int sweep = 0; sweep < 6; ++sweep) {
        for (int k = 0; k < 3; ++k) {
            int p = k == 2 ? 1 : 0, q = k == 0 ? 1 : 2, r = 3 - p - q;
            float apq = a[p][q];
            if (apq == 0.0) continue;
            float theta = (a[q][q] - a[p][p]) / (2.0 * apq);
            float t = abs(theta) > 1e18 ? 0.0 : (theta < 0.0 ? -1.0 : 1.0) / (abs(theta) + sqrt(theta * theta + 1.0));
            float c = inversesqrt(t * t + 1.0), s = t * c;
            a[p][p] -= t * apq;
            a[q][q] += t * apq;
            a[p][q] = a[q][p] = 0.0;
            float rp = a[r][p], rq = a[r][q];
            a[r][p] = a[p][r] = c * rp - s * rq;
            a[r][q] = a[q][r] = s * rp + c * rq;
            vec3 vp = v[p], vq = v[q];
            v[p] = c * vp - s * vq;
            v[q] = s * vp + c * vq;
        }
    }
}

// A vector for each of the particles that are taken together.
struct Vectors { vec4 x, y, z; };
vec3 of(Vectors v, uint b) { return vec3(v.x[b], v.y[b], v.z[b]); }

// What is summed over the neighbours of each, offsets measured from it.
struct Sums {
    uvec4 number;
    vec4 density;
    vec4 weight;
    Vectors first;
    Vectors diagonal;
    Vectors mixed_part;
};

// Adds what is near, `many` times; a choice of numbers costs less than a branch that neighbouring invocations take differently.
void add(inout Sums s, bvec4 near, uint many, Vectors o, vec4 squared) {
    vec4 d = sqrt(mix(vec4(prepare.lengths.w * prepare.lengths.w), squared, near));
    vec4 q = d * (1.0 / prepare.lengths.w), w = float(many) * mix(vec4(0.0), 1.0 - q * q * q, near);
    s.number += many * uvec4(near);
    s.density += float(many) * spline(d * (1.0 / prepare.lengths.z));
    s.weight += w;
    vec4 x = w * o.x, y = w * o.y, z = w * o.z;
    s.first.x += x;
    s.first.y += y;
    s.first.z += z;
    s.diagonal.x += x * o.x;
    s.diagonal.y += y * o.y;
    s.diagonal.z += z * o.z;
    s.mixed_part.x += x * o.y;
    s.mixed_part.y += x * o.z;
    s.mixed_part.z += y * o.z;
}

void write(uint k, vec3 center, vec3 diagonal, vec3 mixed_part) {
    for (uint a = 0u; a < 3u; ++a) {
        centers.at[3u * k + a] = center[a];
        diagonals.at[3u * k + a] = diagonal[a];
        mixed_parts.at[3u * k + a] = mixed_part[a];
    }
}

const uint LARGEST_RUNS = 25u;
uint tally[COUNTERS - COUNT_SPLASH];
void note(uint what) { ++tally[what - COUNT_SPLASH]; }

// Class and ellipsoid of particle k at x from its sums, those of component b.
void finish(uint k, vec3 x, Sums s, uint b) {
    vec3 origin = uintBitsToFloat(uvec3(extent.at[EXTENT_ORIGIN], extent.at[EXTENT_ORIGIN + 1], extent.at[EXTENT_ORIGIN + 2]));
    float unit = 1.0 / prepare.lengths.y;
    vec3 center = unit * (x - origin);
    float relative = s.density[b] / prepare.classes.z;
    bool body = relative >= prepare.classes.x;
    if (KEEP_CLASSES) {
        uint i = input_index(k);
        uint last = max(last_classes.at[i], 1u - prepare.options.z); // without last classes as if all had been body
        body = body && (relative >= prepare.classes.y || last != 0u);
        last_classes.at[i] = body ? 1u : 0u;
    }
    if (!body) {
        note(COUNT_SPLASH);
        write(k, center, vec3(-1.0, 1.0, 1.0), vec3(0.0));
        return;
    }
    note(COUNT_BODY);
    if (s.number[b] <= prepare.options.x + 1u) {
        note(COUNT_FEW_NEIGHBOURS);
        write(k, center, vec3(1.0), vec3(0.0));
        return;
    }
    vec3 mean = of(s.first, b) / s.weight[b], d = of(s.diagonal, b) / s.weight[b] - mean * mean;
    vec3 m = of(s.mixed_part, b) / s.weight[b] - mean.xxy * mean.yzz;
    mat3 a = unit * unit * mat3(d.x, m.x, m.y, m.x, d.y, m.z, m.y, m.z, d.z), v;
    eigen(a, v);
    vec3 variance = vec3(a[0][0], a[1][1], a[2][2]);
    float most = max(variance.x, max(variance.y, variance.z)), least = most * prepare.shape.y;
    if (most < DEGENERATE_SHARE * prepare.shape.w) {
        note(COUNT_DEGENERATE);
        write(k, center, vec3(1.0), vec3(0.0));
        return;
    }
    if (min(variance.x, min(variance.y, variance.z)) < least) note(COUNT_CLAMPED_RATIO);
    vec3 wanted = max(variance, vec3(least)) / prepare.shape.w;
    if (most / prepare.shape.w > prepare.shape.z) note(COUNT_CLAMPED_LONG);
    vec3 axes = min(wanted, vec3(prepare.shape.z)), l = axes * axes;
    // S = V diag(l) V^T
    vec3 r0 = vec3(v[0].x, v[1].x, v[2].x), r1 = vec3(v[0].y, v[1].y, v[2].y), r2 = vec3(v[0].z, v[1].z, v[2].z);
    write(k, center + prepare.shape.x * unit * mean, vec3(dot(r0 * r0, l), dot(r1 * r1, l), dot(r2 * r2, l)),
          vec3(dot(r0 * r1, l), dot(r0 * r2, l), dot(r1 * r2, l)));
}

void main() {
    for (uint c = 0u; c < COUNTERS - COUNT_SPLASH; ++c) tally[c] = 0u;
    uint next = min(invocation() * SHAPE_RUN, count()), to = min(next + SHAPE_RUN, count());
    while (next < to) {
        uint from = next++;
        vec3 x = sorted_position(from);
        if (!finite(x)) {
            write(from, vec3(0.0), vec3(0.0), vec3(0.0));
#ifdef NEIGHBOURS
            list(from, 0u);
#endif
            continue;
        }
        // Those that follow in the same cell or the next: their candidates are nearly the same. Components without a particle
        // of their own repeat the first and are not written.
        Vectors p = Vectors(x.xxxx, x.yyyy, x.zzzz);
        ivec3 cell = cell_of(x);
        int top = cell.z;
        for (uint b = 1u; b < SHAPE_RUN; ++b) {
            if (RELATION || next == to) break;
            x = sorted_position(next);
            ivec3 own = cell_of(x);
            if (!finite(x) || own.xy != cell.xy || own.z > cell.z + 1) break;
            ++next;
            top = own.z;
            p.x[b] = x.x;
            p.y[b] = x.y;
            p.z[b] = x.z;
        }
        uvec2 runs[LARGEST_RUNS];
        uint number = 0u;
        if (RELATION) {
            runs[number++] = run_of(cell, cell, 0u);
        } else {
            int around = int(prepare.options.w);
            uint begin = 0u;
            for (int i = -around; i <= around; ++i) {
                for (int j = -around; j <= around; ++j) {
                    uvec2 run = run_of(cell + ivec3(i, j, -around), ivec3(cell.xy + ivec2(i, j), top + around), begin);
                    begin = run.y;
                    if (run.y > run.x) runs[number++] = run;
                }
            }
        }
        Vectors none = Vectors(vec4(0.0), vec4(0.0), vec4(0.0));
        Sums s = Sums(uvec4(0u), vec4(0.0), vec4(0.0), none, none, none);
        // One loop over all runs: invocations whose runs differ in length stay together.
        float limit = prepare.lengths.w * prepare.lengths.w;
        uint run = 0u, j = runs[0].x, end = runs[0].y, step = step_of(runs[0]);
#ifdef NEIGHBOURS
        uint listed[SHAPE_RUN];
        for (uint b = 0u; b < SHAPE_RUN; ++b) listed[b] = 0u;
#endif
        while (true) {
            if (j >= end) {
                if (++run == number) break;
                j = runs[run].x;
                end = runs[run].y;
                step = step_of(runs[run]);
            }
            uint other = RELATION ? order_at(j) / 27u : j;
            vec3 y = sorted_position(other);
            Vectors o = Vectors(y.x - p.x, y.y - p.y, y.z - p.z);
            vec4 squared = o.x * o.x + o.y * o.y + o.z * o.z;
            bvec4 near = lessThan(squared, vec4(limit)), tie = lessThanEqual(abs(squared - limit), vec4(4e-6 * limit));
            if (any(tie)) {
                for (uint b = 0u; b < SHAPE_RUN; ++b) {
                    if (tie[b]) near[b] = nearer(of(p, b), y);
                }
            }
#ifdef NEIGHBOURS
            // All are listed; those that the sums leave out count nothing.
            for (uint b = 0u; from + b < next; ++b) {
                if (!near[b]) continue;
                uint place = 2u + listed[b]++;
                if (place < share()) neighbours.at[(from + b) * share() + place] = input_index(other);
            }
            add(s, near, (j - runs[run].x) % step == 0u ? min(step, end - j) : 0u, o, squared);
            ++j;
#else
            add(s, near, min(step, end - j), o, squared);
            j += step;
#endif
        }
        for (uint b = 0u; b < SHAPE_RUN; ++b) {
            if (from + b == next) break;
#ifdef NEIGHBOURS
            list(from + b, listed[b]);
#endif
            finish(from + b, of(p, b), s, b);
        }
    }
    for (uint c = 0u; c < COUNTERS - COUNT_SPLASH; ++c) {
        if (tally[c] > 0u) atomicAdd(counters.at[COUNT_SPLASH + c], tally[c]);
    }
}
