// One iteration of plane fitting (Imai16 eqs. 2 to 5; docs/methods.md, "Smoothing") on the front (layer 0) and back
// (layer 1) of the body.
//
// Everything is measured from the pixel's own point p_i: p_j - p_i = d_j (v_j - v_i) + (d_j - d_i) v_i, and eq. (5)
// becomes d'_i = d_i + n.(mean p_j - p_i) / (n.v_i), in which nothing large cancels.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
#include "normal.glsl"
layout(local_size_x_id = 0, local_size_y_id = 1) in; // a square tile
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

const int TILE = int(gl_WorkGroupSize.x);
const int EDGE = TILE + 2 * HALF_WINDOW;
shared vec4 tile[EDGE * EDGE]; // raw normal, depth (0: no surface)
shared uint occupied;

// The window's pixels of a whole group, read once.
void load_tile(ivec2 origin, ivec2 size, int layer) {
    for (int k = int(gl_LocalInvocationIndex); k < EDGE * EDGE; k += TILE * TILE) {
        ivec2 p = origin + ivec2(k % EDGE, k / EDGE);
        vec4 entry = vec4(0.0);
        if (all(greaterThanEqual(p, ivec2(0))) && all(lessThan(p, size))) {
            float d = texelFetch(depth_in, ivec3(p, layer), 0).x;
            if (d > 0.0) entry = vec4(decode_normal(texelFetch(normal_raw, ivec3(p, layer), 0).x), d);
        }
        tile[k] = entry;
    }
}

// Sums over a pixel's window, of weights w.
struct Sums {
    vec3 normal;
    vec2 lateral; // of w d_j (v_j - v_i)
    float along;  // of w (d_j - d_i)
    float total;  // of w
};

// Pixels to either side of a pixel that its window holds.
int half_window(float own) {
    if (!PROJECTED) return HALF_WINDOW;
    float wanted = ceil(0.5 * push.width * abs(frame.pixel_scale.y) / own);
    if (wanted > float(HALF_WINDOW)) atomicAdd(counters.at[COUNTERS + 3u], 1u);
    return int(min(wanted, float(HALF_WINDOW)));
}

Sums sum_window(vec3 v, float own) {
    int reach = half_window(own);
    vec2 step = 1.0 / frame.pixel_scale;
    float inverse = 1.0 / (push.sigma * push.sigma);
    ivec2 home = ivec2(gl_LocalInvocationID.xy) + HALF_WINDOW;
    Sums s = Sums(vec3(0.0), vec2(0.0), 0.0, 0.0);
    for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
            vec4 entry = tile[(home.y + y) * EDGE + home.x + x];
            if (entry.w <= 0.0) continue;
            float rise = entry.w - own;
            vec2 shift = entry.w * step * vec2(x, y);
            float square = rise * rise;
            if (EUCLIDEAN) {
                vec3 apart = vec3(shift, 0.0) + rise * v;
                square = dot(apart, apart);
            }
            float w = exp(-square * inverse);
            s.normal += w * entry.xyz;
            s.lateral += w * shift;
            s.along += w * rise;
            s.total += w;
        }
    }
    return s;
}

// The pixel's depth on the plane of eqs. (3) and (4), or its own where eq. (5) is not to be trusted.
float fitted(Sums s, vec3 v, float own) {
    float length_sum = length(s.normal);
    if (length_sum < 1e-6 * s.total) {
        atomicAdd(counters.at[COUNTERS], 1u);
        return own;
    }
    vec3 n = s.normal / length_sum;
    float facing = dot(n, v);
    float update = (dot(n.xy, s.lateral) + facing * s.along) / (facing * s.total);
    if (abs(facing) < FIT_GRAZING_LIMIT * length(v)) {
        atomicAdd(counters.at[COUNTERS + 1u], 1u);
        return own;
    }
    if (!(abs(update) <= FIT_UPDATE_LIMIT * push.sigma) || own + update < frame.near) {
        atomicAdd(counters.at[COUNTERS + 2u], 1u);
        return own;
    }
    return own + update;
}

void main() {
    ivec2 size = ivec2(frame.size);
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    int layer = int(gl_WorkGroupID.z);
    if (gl_LocalInvocationIndex == 0u) occupied = 0u;
    float own = 0.0; // negative (the eye is inside) and zero (nothing) pass through unchanged
    if (all(lessThan(pixel, size))) own = texelFetch(depth_in, ivec3(pixel, layer), 0).x;
    barrier();
    if (own > 0.0) occupied = 1u;
    barrier();
    if (occupied == 0u) {
        if (all(lessThan(pixel, size))) imageStore(depth_out, ivec3(pixel, layer), vec4(own));
        return;
    }
    load_tile(ivec2(gl_WorkGroupID.xy) * TILE - HALF_WINDOW, size, layer);
    barrier();
    if (any(greaterThanEqual(pixel, size))) return;
    float result = own;
    if (own > 0.0) {
        vec3 v = view_ray(vec2(pixel) + 0.5);
        result = fitted(sum_window(v, own), v, own);
    }
    imageStore(depth_out, ivec3(pixel, layer), vec4(result));
}
