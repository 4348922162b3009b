// Positions as the caller's buffer holds them, and the whole cells they lie in (Im16 section III): unbounded, and exact.
layout(set = 0, binding = 1, std430) readonly buffer PositionBlock { float at[]; } positions;
layout(set = 0, binding = 2, std430) buffer ExtentBlock { uint at[]; } extent;
layout(push_constant) uniform PushBlock { Prepare prepare; };
// A constant and not a branch on prepare.entries_per_particle: see optics/walk.frag on branches that only uniforms decide.
layout(constant_id = 0) const bool RELATION_TABLE = false; // the sort orders entries of the relation table, not particles

vec3 position(uint i) {
    uint at = prepare.first_word + i * prepare.word_stride;
    return prepare.unit_scale * vec3(positions.at[at], positions.at[at + 1u], positions.at[at + 2u]);
}

#include "cells.glsl"

ivec3 first_cell() { return ivec3(extent.at[EXTENT_FIRST_CELL], extent.at[EXTENT_FIRST_CELL + 1], extent.at[EXTENT_FIRST_CELL + 2]); }
ivec3 last_cell() { return ivec3(extent.at[EXTENT_LAST_CELL], extent.at[EXTENT_LAST_CELL + 1], extent.at[EXTENT_LAST_CELL + 2]); }

// A position's cell; one that is not finite counts as in the last cell, where the sort keeps it out of the way.
ivec3 cell_of(vec3 x) {
    if (!finite(x)) return last_cell();
    return ivec3(cell_of(x.x, prepare.cell_edge), cell_of(x.y, prepare.cell_edge), cell_of(x.z, prepare.cell_edge));
}

uint particles() { return extent.at[EXTENT_COUNT]; }

// What the sort orders: particles, or entries of the relation table.
uint entries() { return particles() * (RELATION_TABLE ? 27u : 1u); }
uint blocks() { return (entries() + BLOCK - 1u) / BLOCK; }

// The order buffer has two halves, and each pass of the sort reads one and writes the other. Where the half begins that a pass
// reads; with the number of passes, where the half begins that holds the result.
uint half_before(uint pass) { return (pass & 1u) * entries(); }

// Which of the 27 cells around a particle's own an entry of the relation table stands for.
ivec3 entry_offset(uint entry) {
    uint k = entry % 27u;
    return ivec3(k / 9u, k / 3u % 3u, k % 3u) - 1;
}

// The cell of sort entry e: a particle, or (relation table) a particle in one of 27 cells.
ivec3 entry_cell(uint e) {
    if (RELATION_TABLE) return cell_of(position(e / 27u)) + entry_offset(e);
    return cell_of(position(e));
}

// Appends the lowest `bits` of a value to a key of three words, which has `length` bits so far.
void append(inout uvec3 key, inout uint length, uint value, uint bits) {
    uint word = length >> 5, shift = length & 31u;
    if (bits > 0u) {
        key[word] |= value << shift;
        if (shift > 0u && word < 2u) key[word + 1u] |= value >> (32u - shift);
    }
    length += bits;
}

// A cell's sort key, relative to the first: z in the lowest bits, then y, then x.
uvec3 sort_key(ivec3 whole) {
    uvec3 cell = uvec3(whole - first_cell()), key = uvec3(0u);
    uint length = 0u;
    append(key, length, cell.z, extent.at[EXTENT_BITS + 2]);
    append(key, length, cell.y, extent.at[EXTENT_BITS + 1]);
    append(key, length, cell.x, extent.at[EXTENT_BITS]);
    return key;
}

uint key_bits() { return extent.at[EXTENT_BITS] + extent.at[EXTENT_BITS + 1] + extent.at[EXTENT_BITS + 2]; }

// Where the half of the order begins that is free once the sort is done.
uint free_half() { return half_before(extent.at[EXTENT_PASSES] + 1u); }
