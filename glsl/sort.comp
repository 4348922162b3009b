// Stable radix sort of particles (or of relation table entries) by the cell they lie in, lexicographically: x, then y,
// then z. A pass sorts by DIGIT_BITS of the key: COUNT (each block's entries of each digit), SCAN (where they go),
// SCATTER. Only the passes that the occupied cells need are dispatched (extent). Only indices move; entries of the same cell
// stay in the order of the input. Keys of one word are made by the first COUNT and wait where the sorted positions will be, which
// GATHER at last copies into that order; longer ones, and those of the relation table, are made anew by each pass.
#version 460
// Compiled with one of: COUNT, SCAN, SCATTER, GATHER
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "groups.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
#include "positions.glsl"
layout(set = 0, binding = 3, std430) buffer OrderBlock { uint at[]; } order; // two halves, read and written in turns
layout(set = 0, binding = 4, std430) buffer SumBlock { uint at[]; } sums;
layout(set = 0, binding = 5, std430) buffer SortedBlock { uint at[]; } sorted; // keys; at last bits of positions, four words each
#include "prefix.glsl"

const uint ITEMS = BLOCK / PARTICLE_GROUP;

// The entry that is ranked so before this pass; the first pass finds the input's order.
uint entry_at(uint rank, uint pass) { return pass == 0u ? rank : order.at[half_before(pass) + rank]; }

uint digit_of(uint entry, bool kept) {
    uvec3 key = uvec3(kept ? sorted.at[entry] : 0u, 0u, 0u);
    if (!kept) key = sort_key(entry_cell(entry));
    uint from = prepare.sort_pass * DIGIT_BITS, word = from >> 5, shift = from & 31u;
    uint bits = key[word] >> shift;
    if (shift > 32u - DIGIT_BITS && word < 2u) bits |= key[word + 1u] << (32u - shift);
    return bits & (DIGITS - 1u);
}

#if defined(COUNT) || defined(SCATTER)
shared uint counts[DIGITS * PARTICLE_GROUP]; // by digit, then thread
#endif

void main() {
#ifdef SCAN
    scan_row(gl_WorkGroupID.x, blocks(), DIGITS);
#elif defined(GATHER)
    uint k = invocation();
    if (k >= particles()) return;
    // The relation table is looked up from particles in the order of the input.
    uint i = RELATION_TABLE ? k : entry_at(k, extent.at[EXTENT_PASSES]);
    vec3 x = position(i);
    for (uint a = 0u; a < 3u; ++a) sorted.at[4u * k + a] = floatBitsToUint(x[a]);
    // Where keys are one word they are there for later passes, too, in the half of the order that is free now: look-ups are faster for it.
    if (!RELATION_TABLE && key_bits() <= 32u) order.at[free_half() + k] = sort_key(cell_of(x)).x;
#else
    uint block = group_index(), t = gl_LocalInvocationIndex, pass = prepare.sort_pass;
    if (block >= blocks()) return;
    for (uint d = 0u; d < DIGITS; ++d) counts[d * PARTICLE_GROUP + t] = 0u;
    uint from = min(block * BLOCK + t * ITEMS, entries()), to = min(from + ITEMS, entries());
    bool one_word = !RELATION_TABLE && key_bits() <= 32u;
#ifdef COUNT
    for (uint i = from; i < to && one_word && pass == 0u; ++i) sorted.at[i] = sort_key(entry_cell(i)).x;
#endif
    uint digits[ITEMS];
    for (uint i = from; i < to; ++i) {
        uint d = digit_of(entry_at(i, pass), one_word);
        digits[i - from] = d;
        ++counts[d * PARTICLE_GROUP + t];
    }
    barrier();
#ifdef COUNT
    if (t < DIGITS) {
        uint sum = 0u;
        for (uint k = 0u; k < PARTICLE_GROUP; ++k) sum += counts[t * PARTICLE_GROUP + k];
        sums.at[t * blocks() + block] = sum;
    }
#else
    // Where each thread's entries of each digit go: after all smaller digits, earlier blocks and earlier threads.
    uint total, base = group_prefix(t < DIGITS ? sums.at[DIGITS * blocks() + t] : 0u, total);
    if (t < DIGITS) {
        base += sums.at[t * blocks() + block];
        for (uint k = 0u; k < PARTICLE_GROUP; ++k) {
            uint count = counts[t * PARTICLE_GROUP + k];
            counts[t * PARTICLE_GROUP + k] = base;
            base += count;
        }
    }
    barrier();
    uint half_at = half_before(pass + 1u);
    for (uint i = from; i < to; ++i) {
        uint entry = entry_at(i, pass);
        order.at[half_at + counts[digits[i - from] * PARTICLE_GROUP + t]++] = entry;
    }
#endif
#endif
}
