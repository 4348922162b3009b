// The box of all positions, and what follows from it: the frame's origin and bounds, the cells it occupies, how many bits of
// them the sort has to look at, and so how many of its passes run. REDUCE runs over the particles, PLAN once.
#version 460
// Compiled with one of: REDUCE, PLAN
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "groups.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
#include "positions.glsl"
layout(set = 0, binding = 0, std430) buffer FrameBlock { Frame frame; };
layout(set = 0, binding = 3, std430) buffer CounterBlock { uint at[]; } counters;
layout(set = 0, binding = 4, std430) readonly buffer CountBlock { uint at[]; } device_count; // or anything, where the host knows
layout(constant_id = 1) const uint COUNTERS = 0; // slot of its first counter

// How many particles there are.
uint live() { return min(prepare.count, max(device_count.at[prepare.count_word], prepare.least_count)); }

// Integers in the order of the floats.
uint ordered(float x) {
    uint u = floatBitsToUint(x);
    return (u & 0x80000000u) != 0u ? ~u : u | 0x80000000u;
}
float unordered(uint u) { return uintBitsToFloat((u & 0x80000000u) != 0u ? u & 0x7fffffffu : ~u); }

shared uint box[6];

#ifdef REDUCE
void main() {
    if (gl_LocalInvocationIndex < 6u) box[gl_LocalInvocationIndex] = gl_LocalInvocationIndex < 3u ? 0xffffffffu : 0u;
    barrier();
    uint block = group_index(), count = live(), lost = 0u;
    uvec3 least = uvec3(0xffffffffu), most = uvec3(0u);
    for (uint k = 0u; k < BLOCK / PARTICLE_GROUP; ++k) {
        uint i = block * BLOCK + k * PARTICLE_GROUP + gl_LocalInvocationIndex;
        if (i >= count) break;
        vec3 x = position(i);
        if (!finite(x)) {
            ++lost;
            continue;
        }
        uvec3 u = uvec3(ordered(x.x), ordered(x.y), ordered(x.z));
        least = min(least, u);
        most = max(most, u);
    }
    for (int a = 0; a < 3; ++a) {
        atomicMin(box[a], least[a]);
        atomicMax(box[3 + a], most[a]);
    }
    if (lost > 0u) atomicAdd(counters.at[COUNTERS], lost);
    barrier();
    uint t = gl_LocalInvocationIndex;
    if (t < 3u) atomicMin(extent.at[EXTENT_LEAST + t], box[t]);
    else if (t < 6u) atomicMax(extent.at[EXTENT_LEAST + t], box[t]);
}
#else
void main() {
    if (gl_GlobalInvocationID.x != 0u) return;
    vec3 low = vec3(0.0), high = vec3(0.0);
    if (extent.at[EXTENT_LEAST] <= extent.at[EXTENT_MOST]) {
        low = vec3(unordered(extent.at[0]), unordered(extent.at[1]), unordered(extent.at[2]));
        high = vec3(unordered(extent.at[3]), unordered(extent.at[4]), unordered(extent.at[5]));
    }
    uint count = live();
    extent.at[EXTENT_COUNT] = frame.count = count;
    // The table enters particles into the cells around theirs, too.
    int more = RELATION_TABLE ? 1 : 0;
    uint bits = 0u;
    for (int a = 0; a < 3; ++a) {
        int first = cell_of(low[a], prepare.cell_edge) - more, last = cell_of(high[a], prepare.cell_edge) + more;
        extent.at[EXTENT_FIRST_CELL + a] = uint(first);
        extent.at[EXTENT_LAST_CELL + a] = uint(last - more);
        uint axis = uint(findMSB(uint(last - first)) + 1);
        extent.at[EXTENT_BITS + a] = axis;
        bits += axis;
    }
    uint passes = (bits + DIGIT_BITS - 1u) / DIGIT_BITS;
    extent.at[EXTENT_PASSES] = passes;
    uint groups = blocks(), rows = max((groups + MOST_GROUPS - 1u) / MOST_GROUPS, 1u);
    for (uint p = 0u; p < SORT_PASSES; ++p) {
        uint at = EXTENT_DISPATCH + 6u * p, on = p < passes ? 1u : 0u;
        extent.at[at] = on * ((groups + rows - 1u) / rows);
        extent.at[at + 1u] = rows;
        extent.at[at + 2u] = 1u;
        extent.at[at + 3u] = on * DIGITS;
        extent.at[at + 4u] = 1u;
        extent.at[at + 5u] = 1u;
    }
    // The liquid's own space: one particle's position is its origin (src/space.rs).
    vec3 origin = position(count / 2u);
    if (count == 0u || !finite(origin)) origin = 0.5 * low + 0.5 * high;
    for (int a = 0; a < 3; ++a) extent.at[EXTENT_ORIGIN + a] = floatBitsToUint(origin[a]);
    float unit = 1.0 / prepare.radius, room = max(prepare.longest_axis, SPLASH_RADIUS);
    frame.view[3].xyz = unit * (mat3(frame.view) * origin + frame.view[3].xyz);
    // Room for ellipsoids around the outermost centres.
    frame.bounds_min = unit * (low - origin) - room;
    frame.bounds_max = unit * (high - origin) + room;
}
#endif
