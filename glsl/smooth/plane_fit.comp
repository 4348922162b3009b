// One iteration of plane fitting (Imai16 eqs. 2 to 5; docs/methods.md, "Smoothing") on the front (layer 0) and back
// (layer 1) of the body.
//
// Everything is measured from the pixel's own point p_i: p_j - p_i = d_j (v_j - v_i) + (d_j - d_i) v_i, and eq. (5)
// becomes d'_i = d_i + n.(mean p_j - p_i) / (n.v_i), in which nothing large cancels.
//
// An invocation has a column of four pixels, a component of each vector its own: what reading an entry of shared memory costs
// is shared by the four windows that hold it.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_control_flow_attributes : require
#include "shared.glsl"
#include "frame.glsl"
#include "normal.glsl"
#include "pixel_groups.glsl"
layout(local_size_x_id = 0, local_size_y_id = 1) in; // of columns
layout(constant_id = 2) const int HALF_WINDOW = 4; // window = 2 HALF_WINDOW + 1 pixels
layout(constant_id = 3) const bool EUCLIDEAN = false; // weights of |p_i - p_j| instead of eq. (2)
layout(constant_id = 5) const bool PROJECTED = false; // the window is as wide as a length at the pixel's depth
layout(push_constant) uniform PushBlock {
    float sigma; // of eq. (2), in particle radii
    float width; // of a projected window, in particle radii
} push;
layout(set = 0, binding = 1) uniform texture2DArray depth_in;
layout(set = 0, binding = 2) uniform utexture2DArray normal_raw;
layout(set = 0, binding = 3, r32f) uniform writeonly image2DArray depth_out;
layout(set = 0, binding = 4, std430) buffer CounterBlock { uint at[]; } counters; // normals that cancel, grazing rays, updates too long, windows clipped
layout(constant_id = 4) const uint COUNTERS = 0; // slot of its first counter

const float LOG2_E = 1.44269504;
const int WIDE = int(gl_WorkGroupSize.x) + 2 * HALF_WINDOW, TALL = int(gl_WorkGroupSize.y) * FIT_COLUMN + 2 * HALF_WINDOW;
const float NOWHERE = 1e15; // depth where there is no surface: so far off that its weight is 0
shared vec4 tile[WIDE * TALL]; // raw normal, depth
shared uint occupied;

// The window's pixels of a whole group, read once.
void load_tile(ivec2 origin, ivec2 size, int layer) {
    for (int y = int(gl_LocalInvocationID.y); y < TALL; y += int(gl_WorkGroupSize.y)) {
        for (int x = int(gl_LocalInvocationID.x); x < WIDE; x += int(gl_WorkGroupSize.x)) {
            ivec2 p = origin + ivec2(x, y);
            vec4 entry = vec4(0.0, 0.0, 0.0, NOWHERE);
            if (all(greaterThanEqual(p, ivec2(0))) && all(lessThan(p, size))) {
                float d = texelFetch(depth_in, ivec3(p, layer), 0).x;
                if (d > 0.0) entry = vec4(decode_normal(texelFetch(normal_raw, ivec3(p, layer), 0).x), d);
            }
            tile[y * WIDE + x] = entry;
        }
    }
}

// Sums over the windows of a column, of weights w.
struct Sums {
    vec4 nx, ny, nz;   // of w n_j
    vec4 across, down; // of w d_j (v_j - v_i)
    vec4 along;        // of w (d_j - d_i)
    vec4 total;        // of w
};

// Pixels to either side of each pixel that its window holds.
vec4 half_windows(vec4 own) {
    if (!PROJECTED) return vec4(HALF_WINDOW);
    vec4 wanted = ceil(0.5 * push.width * abs(frame.pixel_scale.y) / own);
    [[unroll]] for (int k = 0; k < FIT_COLUMN; ++k) {
        if (own[k] > 0.0 && wanted[k] > float(HALF_WINDOW)) atomicAdd(counters.at[COUNTERS + 3u], 1u);
    }
    return min(wanted, vec4(HALF_WINDOW));
}

// The sums of a column whose pixels have the depths `own` and the rays (ray_x, ray_y, -1).
Sums sum_windows(ivec2 home, vec4 own, float ray_x, vec4 ray_y) {
    vec4 reach = half_windows(own);
    vec2 step = 1.0 / frame.pixel_scale;
    float scale = -LOG2_E / (push.sigma * push.sigma);
    Sums s = Sums(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    for (int y = -HALF_WINDOW; y < HALF_WINDOW + FIT_COLUMN; ++y) {
        vec4 below = float(y) - vec4(0.0, 1.0, 2.0, 3.0); // of each pixel
        vec4 outside = mix(vec4(0.0), vec4(-NOWHERE), greaterThan(abs(below), reach));
        vec4 across = vec4(0.0), along = vec4(0.0), total = vec4(0.0);
        [[unroll]] for (int x = -HALF_WINDOW; x <= HALF_WINDOW; ++x) {
            vec4 entry = tile[(home.y + y) * WIDE + home.x + x];
            vec4 rise = entry.w - own;
            vec4 square = rise * rise;
            if (EUCLIDEAN) {
                vec4 right = entry.w * step.x * float(x) + rise * ray_x, up = entry.w * step.y * below + rise * ray_y;
                square += right * right + up * up;
            }
            vec4 exponent = fma(square, vec4(scale), outside);
            if (PROJECTED) exponent = mix(exponent, vec4(-NOWHERE), greaterThan(vec4(abs(x)), reach));
            vec4 w = exp2(exponent);
            s.nx = fma(w, entry.xxxx, s.nx);
            s.ny = fma(w, entry.yyyy, s.ny);
            s.nz = fma(w, entry.zzzz, s.nz);
            across = fma(w, vec4(entry.w * float(x)), across);
            along = fma(w, rise, along);
            total += w;
        }
        s.across += step.x * across;
        s.down += step.y * below * fma(own, total, along);
        s.along += along;
        s.total += total;
    }
    return s;
}

// The depth of a column's pixel k on the plane of eqs. (3) and (4), no further from its own than eq. (5) is to be trusted.
float fitted(Sums s, int k, vec3 v, float own) {
    vec3 normal = vec3(s.nx[k], s.ny[k], s.nz[k]);
    float length_sum = length(normal);
    if (length_sum < 1e-6 * s.total[k]) {
        atomicAdd(counters.at[COUNTERS], 1u);
        return own;
    }
    vec3 n = normal / length_sum;
    float facing = dot(n, v);
    float update = (n.x * s.across[k] + n.y * s.down[k] + facing * s.along[k]) / (facing * s.total[k]);
    if (abs(facing) < FIT_GRAZING_LIMIT * length(v)) {
        atomicAdd(counters.at[COUNTERS + 1u], 1u);
        return own;
    }
    float limit = FIT_UPDATE_LIMIT * push.sigma, cut = clamp(update, -limit, limit);
    bool before = own + cut < frame.near;
    if (abs(update) > limit || before) atomicAdd(counters.at[COUNTERS + 2u], 1u);
    return before ? own : own + cut;
}

void main() {
    ivec2 size = ivec2(frame.size), corner = pixel_group() * ivec2(gl_WorkGroupSize.xy) * ivec2(1, FIT_COLUMN);
    ivec2 home = ivec2(gl_LocalInvocationID.xy) * ivec2(1, FIT_COLUMN); // in the tile
    ivec2 pixel = corner + home;
    int layer = int(gl_WorkGroupID.z);
    if (gl_LocalInvocationIndex == 0u) occupied = 0u;
    vec4 own = vec4(0.0); // negative (the eye is inside) and zero (nothing) pass through unchanged
    [[unroll]] for (int k = 0; k < FIT_COLUMN; ++k) {
        ivec2 p = pixel + ivec2(0, k);
        if (all(lessThan(p, size))) own[k] = texelFetch(depth_in, ivec3(p, layer), 0).x;
    }
    barrier();
    if (any(greaterThan(own, vec4(0.0)))) occupied = 1u;
    barrier();
    vec4 result = own;
    if (occupied != 0u) {
        load_tile(corner - HALF_WINDOW, size, layer);
        barrier();
        vec2 ray = view_ray(vec2(pixel) + 0.5).xy;
        vec4 ray_y = ray.y + vec4(0.0, 1.0, 2.0, 3.0) / frame.pixel_scale.y;
        Sums s = sum_windows(home + HALF_WINDOW, own, ray.x, ray_y);
        [[unroll]] for (int k = 0; k < FIT_COLUMN; ++k) {
            if (own[k] > 0.0) result[k] = fitted(s, k, vec3(ray.x, ray_y[k], -1.0), own[k]);
        }
    }
    [[unroll]] for (int k = 0; k < FIT_COLUMN; ++k) {
        ivec2 p = pixel + ivec2(0, k);
        if (all(lessThan(p, size))) imageStore(depth_out, ivec3(p, layer), vec4(result[k]));
    }
}
