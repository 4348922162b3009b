// Lists of the particles to draw, class by class and side by side, in the order of the particle arrays: the order of
// drawing decides ties of depth, so atomics will not do. Splashes fill their side's half of the list from its start, the
// body from its end. Three dispatches: COUNT (each block's particles of each list), SCAN (where each block's begin),
// SCATTER (the lists, and the indirect draws of them).
#version 460
// Compiled with one of: COUNT, SCAN, SCATTER
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "groups.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(set = 0, binding = 1, std430) readonly buffer VisibleBlock { uint at[]; } visible;
layout(set = 0, binding = 2, std430) buffer SumBlock { uint at[]; } sums;
layout(set = 0, binding = 3, std430) buffer DrawnBlock { uint at[]; } drawn;
layout(set = 0, binding = 4, std430) buffer DrawBlock { Draws at[]; } draws;
layout(set = 0, binding = 5, std430) buffer CounterBlock { uint at[]; } counters; // particles of each list
layout(set = 0, binding = 6, std430) readonly buffer LargeBlock { uint at[]; } large;
layout(constant_id = 0) const uint COUNTERS = 0; // slot of its first counter
#include "prefix.glsl"

const uint LISTS = 4u; // class * 2 + side
const uint ITEMS = BLOCK / PARTICLE_GROUP;

uint blocks() { return (frame.count + BLOCK - 1u) / BLOCK; }

// Which lists a particle is in, as bits.
uint lists_of(uint i) {
    uint v = visible.at[i];
    return (v & (VISIBLE_FRONT | VISIBLE_BACK)) << ((v & VISIBLE_BODY) != 0u ? 2u : 0u);
}

void main() {
#ifdef SCAN
    scan_row(gl_WorkGroupID.x, blocks(), LISTS);
#else
    uint block = group_index(), count = frame.count;
    // Where there are none the first block says so: what the last frame drew is not drawn again.
    if (block >= max(blocks(), 1u)) return;
    uint from = min(block * BLOCK + gl_LocalInvocationIndex * ITEMS, count), to = min(from + ITEMS, count);
    uint mine[LISTS] = uint[](0u, 0u, 0u, 0u);
    for (uint i = from; i < to; ++i) {
        uint lists = lists_of(i);
        for (uint l = 0u; l < LISTS; ++l) mine[l] += (lists >> l) & 1u;
    }
    for (uint l = 0u; l < LISTS; ++l) {
        uint total, before = group_prefix(mine[l], total);
        barrier();
#ifdef COUNT
        if (gl_LocalInvocationIndex == 0u) sums.at[l * blocks() + block] = total;
#else
        mine[l] = sums.at[l * blocks() + block] + before;
#endif
    }
#ifdef SCATTER
    for (uint i = from; i < to; ++i) {
        uint lists = lists_of(i);
        for (uint l = 0u; l < LISTS; ++l) {
            if (((lists >> l) & 1u) == 0u) continue;
            uint rank = mine[l]++;
            drawn.at[(l & 1u) * count + (l < 2u ? rank : count - 1u - rank)] = i;
        }
    }
    // One particle larger than a point can be moves its whole class to quads, so that the order of drawing, and with it
    // the image, is the same either way.
    if (block == 0u && gl_LocalInvocationIndex < LISTS) {
        uint l = gl_LocalInvocationIndex, n = sums.at[LISTS * blocks() + l];
        bool quads = (frame.quads_only | large.at[l / 2u]) != 0u;
        draws.at[l] = Draws(quads ? 0u : n, 1u, 0u, 0u, 4u, quads ? n : 0u, 0u, 0u);
        counters.at[COUNTERS + l] = n;
    }
#endif
#endif
}
