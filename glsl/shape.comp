// From neighbours to what is drawn: number density and class (Imai16 section 4.1), and for the body an ellipsoid, in place or
// as YuTurk13 has it (docs/methods.md, "Preparation").
//
// One invocation takes AT_ONCE particles that follow each other in the sorted order. Those of them that lie in the same cell,
// or in the next along z, are taken together, each in a component of a vector: what is looked up and read once serves all, which
// CPUs gain by. ALONE: it takes one, with a fourth of the registers.
//
// Candidates for neighbours come in runs of the sorted order. Sorted cells are as wide as the support, so 3 x 3 runs of 3
// cells (with YuTurk13's reach 5 x 5 of 5) hold all candidates. With RELATION_TABLE cells are as wide as the reach, and one run of the table holds them all.
// Either way candidates are tested exactly, so that the neighbours are the same set.
//
// POINTS: a density field asks for number densities, and for no ellipsoids.
#version 460
// Compiled with any of: NEIGHBOURS, KEEP_CLASSES, POINTS, ALONE
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "groups.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
#include "positions.glsl"
#include "runs.glsl"
#include "spline.glsl"
#include "whole.glsl"
#ifdef POINTS
// Positions; w: their number density as a part of a filled body's, negative for balls, 0 where there is nothing.
layout(set = 0, binding = 12, std430) writeonly buffer PointBlock { vec4 at[]; } points;
#else
layout(set = 0, binding = 5, std430) writeonly buffer CenterBlock { float at[]; } centers;
layout(set = 0, binding = 6, std430) writeonly buffer DiagonalBlock { float at[]; } diagonals;
layout(set = 0, binding = 7, std430) writeonly buffer MixedBlock { float at[]; } mixed;
layout(constant_id = 2) const bool YU_TURK = false; // which fit
#endif
layout(set = 0, binding = 8, std430) buffer CounterBlock { uint at[]; } counters;
#ifdef KEEP_CLASSES
layout(set = 0, binding = 9, std430) buffer ClassBlock { uint at[]; } last_classes; // 0 splash, 1 body, by id or input index
layout(set = 0, binding = 11, std430) readonly buffer IdBlock { uint at[]; } ids; // with BY_ID
layout(constant_id = 3) const bool BY_ID = false;
#endif
#ifdef NEIGHBOURS
layout(set = 0, binding = 10, std430) writeonly buffer NeighbourBlock { uint at[]; } neighbours;
#endif
layout(constant_id = 1) const uint COUNTERS = 0; // slot of its first counter

// A number, a whole number or a condition of each particle that is taken at once, and that of one of them.
#ifdef ALONE
#define AT_ONCE 1
#define EACH float
#define EACH_UINT uint
#define EACH_BOOL bool
#define OF(each, c) each
#define LESS(a, b) ((a) < (b))
#else
#define AT_ONCE SHAPE_RUN
#define EACH vec4
#define EACH_UINT uvec4
#define EACH_BOOL bvec4
#define OF(each, c) each[c]
#define LESS(a, b) lessThan(a, b)
#endif

uint input_index(uint k) { return RELATION_TABLE ? k : entry_at(k); }

#ifdef NEIGHBOURS
// Words of a particle's list: its index, how many neighbours it has, and those of them that there is room for.
uint list_words() { return neighbours.at.length() / prepare.count; }
void begin_list(uint k, uint number) {
    neighbours.at[k * list_words()] = input_index(k);
    neighbours.at[k * list_words() + 1u] = number;
}
#endif

// Whether neighbours are counted or listed, so that ties have to be decided: what sums add of those as far as the reach is nothing.
#if defined(NEIGHBOURS)
#define COUNTS true
#elif defined(POINTS)
#define COUNTS false
#else
#define COUNTS YU_TURK
#endif

// Whether b - a is shorter than the reach: ties of float32 decided to 2^-45 of the square.
bool nearer(vec3 a, vec3 b) {
    float reach = prepare.reach;
    vec2 x = two_sum(b.x, -a.x), y = two_sum(b.y, -a.y), z = two_sum(b.z, -a.z);
    vec2 xx = two_product(x.x, x.x), yy = two_product(y.x, y.x), zz = two_product(z.x, z.x), rr = two_product(reach, reach);
    vec2 s = two_sum(xx.x, yy.x), t = two_sum(s.x, zz.x);
    precise float large = t.x - rr.x;
    precise float small = (s.y + t.y) + (xx.y + yy.y + zz.y - rr.y) + 2.0 * (x.x * x.y + y.x * y.y + z.x * z.y);
    return large + small < 0.0;
}

SPLINE(EACH)

#ifndef POINTS
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

#endif

// A vector for each of the particles that are taken together.
struct Vectors { EACH x, y, z; };
vec3 of(Vectors v, uint b) { return vec3(OF(v.x, b), OF(v.y, b), OF(v.z, b)); }

#ifdef POINTS
// What is summed over the neighbours of each: whole numbers, so that the order of the input does not show.
struct Sums { EACH_UINT density; };
const float DENSITY_ONE = 262144.0;
const uint MOST_AT_ONCE = 4096u, MOST_DENSITY = 0x7fffffffu;

void add(inout Sums s, EACH_BOOL near, uint many, Vectors o, EACH squared) {
    EACH_UINT weight = rounded(spline(sqrt(squared) * (1.0 / prepare.support)) * DENSITY_ONE);
    s.density = min(s.density + min(many, MOST_AT_ONCE) * weight, MOST_DENSITY);
}
#else
// What is summed over the neighbours of each, offsets measured from it.
struct Sums {
    EACH_UINT number;
    EACH density;
    EACH weight;
    Vectors first;
    Vectors diagonal;
    Vectors mixed_part;
};

// Adds what is near, `many` times; a choice of numbers costs less than a branch that neighbouring invocations take differently.
void add(inout Sums s, EACH_BOOL near, uint many, Vectors o, EACH squared) {
    EACH d = sqrt(mix(EACH(prepare.reach * prepare.reach), squared, near));
    EACH q = d * (1.0 / prepare.reach), w = float(many) * mix(EACH(0.0), 1.0 - q * q * q, near);
    s.number += many * EACH_UINT(near);
    s.density += float(many) * spline(d * (1.0 / prepare.support));
    s.weight += w;
    EACH x = w * o.x, y = w * o.y, z = w * o.z;
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

#endif

#ifndef POINTS
void write(uint k, vec3 center, vec3 diagonal, vec3 mixed_part) {
    for (uint a = 0u; a < 3u; ++a) {
        centers.at[3u * k + a] = center[a];
        diagonals.at[3u * k + a] = diagonal[a];
        mixed.at[3u * k + a] = mixed_part[a];
    }
}

#endif

// What has been counted here, added up once at the end.
// What becomes of particles; counted as such from COUNTERS on.
const uint SPLASH = 0u, BODY = 1u, FEW_NEIGHBOURS = 2u, DEGENERATE = 3u, CLAMPED_LONG = 4u, CLAMPED_RATIO = 5u,
           ID_OUT_OF_RANGE = 6u, FATES = 7u;
uint tally[FATES];
void note(uint what) { ++tally[what]; }

// Whether particle k, of this fraction of a filled body's density, belongs to the body; keeps its class for the next frame.
bool classify(uint k, float relative) {
    bool body = relative >= prepare.splash_below;
#ifdef KEEP_CLASSES
    uint own = input_index(k);
    if (BY_ID) own = ids.at[prepare.first_id_word + own * prepare.id_word_stride];
    if (own >= prepare.kept_classes) {
        note(ID_OUT_OF_RANGE);
        return body;
    }
    body = body && (relative >= prepare.keep_below || last_classes.at[own] != 0u);
    last_classes.at[own] = body ? 1u : 0u;
#endif
    return body;
}

#ifndef POINTS
void write_sphere(uint k, vec3 center, uint why) {
    note(why);
    // The sign says which class.
    const float ball = SPLASH_RADIUS * SPLASH_RADIUS;
    write(k, center, why == SPLASH ? vec3(-ball, ball, ball) : vec3(1.0), vec3(0.0));
}

// The particle whose semi-axes are v's columns, so long: S = V diag(lengths^2) V^T.
void write_ellipsoid(uint k, vec3 center, mat3 v, vec3 lengths) {
    vec3 l = lengths * lengths;
    vec3 r0 = vec3(v[0].x, v[1].x, v[2].x), r1 = vec3(v[0].y, v[1].y, v[2].y), r2 = vec3(v[0].z, v[1].z, v[2].z);
    write(k, center, vec3(dot(r0 * r0, l), dot(r1 * r1, l), dot(r2 * r2, l)),
          vec3(dot(r0 * r1, l), dot(r0 * r2, l), dot(r1 * r2, l)));
}

// Variances of a particle's neighbours around their mean, in r squared, along the columns of v; from sums, those of component b.
vec3 variances_of(Sums s, uint b, vec3 mean, out mat3 v) {
    float unit = 1.0 / prepare.radius;
    vec3 d = of(s.diagonal, b) / OF(s.weight, b) - mean * mean;
    vec3 m = of(s.mixed_part, b) / OF(s.weight, b) - mean.xxy * mean.yzz;
    mat3 a = unit * unit * mat3(d.x, m.x, m.y, m.x, d.y, m.z, m.y, m.z, d.z);
    eigen(a, v);
    return vec3(a[0][0], a[1][1], a[2][2]);
}

// The ellipsoid in place of particle k; center in radii. `above`: its density above where no class is kept any more, as a part
// of a filled body's: below that it is the splash's ball, so that a class that changes changes no shape.
void write_in_place(uint k, vec3 center, float above, Sums s, uint b) {
    vec3 mean = of(s.first, b) / OF(s.weight, b);
    mat3 v;
    vec3 variance = max(variances_of(s, b, mean, v), 0.0) / prepare.filled_variance + DEGENERATE_VARIANCE;
    vec3 wanted = ELLIPSOID_SIZE * sqrt(variance * pow(variance.x * variance.y * variance.z, -1.0 / 3.0));
    if (max(wanted.x, max(wanted.y, wanted.z)) > ELLIPSOID_WIDE) note(CLAMPED_LONG);
    if (min(wanted.x, min(wanted.y, wanted.z)) < ELLIPSOID_THIN) note(CLAMPED_RATIO);
    float share = clamp(above / SPLASH_FADE, 0.0, 1.0);
    vec3 lengths = mix(vec3(SPLASH_RADIUS), clamp(wanted, ELLIPSOID_THIN, ELLIPSOID_WIDE), share);
    mean /= prepare.radius;
    float protrudes = 1.0 - prepare.flat_offset / max(length(mean), prepare.flat_offset);
    write_ellipsoid(k, center + share * (ELLIPSOID_SMOOTHING + ELLIPSOID_PULL * protrudes) * mean, v, lengths);
}

// YuTurk13's.
void write_yu_turk(uint k, vec3 center, Sums s, uint b) {
    vec3 mean = of(s.first, b) / OF(s.weight, b);
    mat3 v;
    vec3 variance = variances_of(s, b, mean, v);
    float most = max(variance.x, max(variance.y, variance.z)), least = most * prepare.least_ratio;
    if (most < DEGENERATE_VARIANCE * prepare.filled_variance) {
        write_sphere(k, center, DEGENERATE);
        return;
    }
    if (min(variance.x, min(variance.y, variance.z)) < least) note(CLAMPED_RATIO);
    vec3 wanted = max(variance, vec3(least)) / prepare.filled_variance;
    if (most / prepare.filled_variance > prepare.longest_axis) note(CLAMPED_LONG);
    write_ellipsoid(k, center + prepare.smoothing / prepare.radius * mean, v, min(wanted, vec3(prepare.longest_axis)));
}

#endif

#ifdef POINTS
// Class and density of particle k at x from its sum, that of component b.
void finish(uint k, vec3 x, Sums s, uint b) {
    float relative = float(OF(s.density, b)) / (DENSITY_ONE * prepare.filled_density);
    bool body = classify(k, relative);
    note(body ? BODY : SPLASH);
    points.at[k] = vec4(x, body || relative >= FIELD_JOINS ? relative : -relative);
}
#else
// Class and ellipsoid of particle k at x from its sums, those of component b.
void finish(uint k, vec3 x, Sums s, uint b) {
    vec3 origin = uintBitsToFloat(uvec3(extent.at[EXTENT_ORIGIN], extent.at[EXTENT_ORIGIN + 1], extent.at[EXTENT_ORIGIN + 2]));
    float unit = 1.0 / prepare.radius;
    vec3 center = unit * (x - origin);
    float relative = OF(s.density, b) / prepare.filled_density;
    if (!classify(k, relative)) {
        write_sphere(k, center, SPLASH);
        return;
    }
    note(BODY);
    if (!YU_TURK) write_in_place(k, center, relative - prepare.keep_below, s, b);
    else if (OF(s.number, b) <= prepare.min_neighbours + 1u) write_sphere(k, center, FEW_NEIGHBOURS);
    else write_yu_turk(k, center, s, b);
}

#endif

// Particles that are taken together: those ranked from `from` to before `next`.
struct Batch {
    uint from;
    uint next;
    Vectors x;  // their positions; a component without a particle repeats the first, and is not written
    ivec3 cell; // of the first
    int top;    // z of the last one's cell
};

// The particle at `from` and those that follow in the same cell or the next: their candidates are nearly the same. `to`: where
// the invocation's own end.
Batch batch_of(uint from, uint to, vec3 x) {
    Batch b = Batch(from, from + 1u, Vectors(EACH(x.x), EACH(x.y), EACH(x.z)), cell_of(x), 0);
    b.top = b.cell.z;
    for (uint c = 1u; c < AT_ONCE; ++c) {
        if (RELATION_TABLE || b.next == to) break;
        x = sorted_position(b.next);
        ivec3 own = cell_of(x);
        if (!finite(x) || own.xy != b.cell.xy || own.z > b.cell.z + 1) break;
        ++b.next;
        b.top = own.z;
        OF(b.x.x, c) = x.x;
        OF(b.x.y, c) = x.y;
        OF(b.x.z, c) = x.z;
    }
    return b;
}

// The runs that hold all candidates of a batch; those of sorted cells are not empty.
const uint LARGEST_RUNS = 25u;
uvec2 runs[LARGEST_RUNS];
uint find_runs(Batch b) {
    if (RELATION_TABLE) {
        runs[0] = run_of(b.cell, b.cell, 0u);
        return 1u;
    }
    uint number = 0u, begin = 0u;
    int around = int(prepare.cells_around);
    for (int i = -around; i <= around; ++i) {
        for (int j = -around; j <= around; ++j) {
            uvec2 run = run_of(b.cell + ivec3(i, j, -around), ivec3(b.cell.xy + ivec2(i, j), b.top + around), begin);
            begin = run.y;
            if (run.y > run.x) runs[number++] = run;
        }
    }
    return number;
}

// Offsets of candidate y from a batch's particles, their squares, and which are shorter than the reach.
EACH_BOOL neighbours_of(Batch b, vec3 y, out Vectors offset, out EACH squared) {
    float limit = prepare.reach * prepare.reach;
    offset = Vectors(y.x - b.x.x, y.y - b.x.y, y.z - b.x.z);
    squared = offset.x * offset.x + offset.y * offset.y + offset.z * offset.z;
    EACH_BOOL near = LESS(squared, EACH(limit));
    if (COUNTS) {
        EACH_BOOL tie = LESS(abs(squared - limit), EACH(4.1e-6 * limit));
        for (uint c = 0u; c < AT_ONCE; ++c) {
            if (OF(tie, c)) OF(near, c) = nearer(of(b.x, c), y);
        }
    }
    return near;
}

#ifdef NEIGHBOURS
uint listed[AT_ONCE]; // how many neighbours each particle of the batch has
void list(Batch b, EACH_BOOL near, uint candidate) {
    for (uint c = 0u; b.from + c < b.next; ++c) {
        if (!OF(near, c)) continue;
        uint word = 2u + listed[c]++;
        if (word < list_words()) neighbours.at[(b.from + c) * list_words() + word] = input_index(candidate);
    }
}
#endif

// The sums over a batch's neighbours, from the candidates in `number` runs.
Sums sum_over(Batch b, uint number) {
#ifdef POINTS
    Sums s = Sums(EACH_UINT(0u));
#else
    Vectors none = Vectors(EACH(0.0), EACH(0.0), EACH(0.0));
    Sums s = Sums(EACH_UINT(0u), EACH(0.0), EACH(0.0), none, none, none);
#endif
    // One loop over all runs: invocations whose runs differ in length stay together.
    uint run = 0u, j = runs[0].x, end = runs[0].y, step = step_of(runs[0]);
    while (true) {
        if (j >= end) {
            if (++run == number) break;
            j = runs[run].x;
            end = runs[run].y;
            step = step_of(runs[run]);
        }
        uint candidate = RELATION_TABLE ? entry_at(j) / 27u : j;
        Vectors offset;
        EACH squared;
        EACH_BOOL near = neighbours_of(b, sorted_position(candidate), offset, squared);
#ifdef NEIGHBOURS
        // All are listed; those that the sums leave out count nothing.
        list(b, near, candidate);
        add(s, near, (j - runs[run].x) % step == 0u ? min(step, end - j) : 0u, offset, squared);
        ++j;
#else
        add(s, near, min(step, end - j), offset, squared);
        j += step;
#endif
    }
    return s;
}

void main() {
    for (uint c = 0u; c < FATES; ++c) tally[c] = 0u;
    uint first = invocation() * AT_ONCE, next = min(first, particles()), to = min(first + AT_ONCE, particles());
#ifdef POINTS
    // Those that are not there; who reads points goes through as many as there may be.
    for (uint k = max(first, to); k < min(first + AT_ONCE, prepare.count); ++k) points.at[k] = vec4(0.0);
#endif
    while (next < to) {
        uint from = next++;
        vec3 x = sorted_position(from);
#ifdef NEIGHBOURS
        for (uint c = 0u; c < AT_ONCE; ++c) listed[c] = 0u;
#endif
        if (!finite(x)) {
#ifdef POINTS
            points.at[from] = vec4(0.0);
#else
            write(from, vec3(0.0), vec3(0.0), vec3(0.0));
#endif
#ifdef NEIGHBOURS
            begin_list(from, 0u);
#endif
            continue;
        }
        Batch b = batch_of(from, to, x);
        next = b.next;
        Sums s = sum_over(b, find_runs(b));
        for (uint c = 0u; c < AT_ONCE; ++c) {
            if (from + c == next) break;
#ifdef NEIGHBOURS
            begin_list(from + c, listed[c]);
#endif
            finish(from + c, of(b.x, c), s, c);
        }
    }
    for (uint c = 0u; c < FATES; ++c) {
        if (tally[c] > 0u) atomicAdd(counters.at[COUNTERS + c], tally[c]);
    }
}
