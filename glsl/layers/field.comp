// The density field as bricks of nodes, where there is any (docs/methods.md, "Density field"). MARK enters the bricks that points reach
// in the directory, block by block, and notes strays: points that are balls, and those that the field may not enclose. NUMBER numbers bricks,
// SCATTER adds each point's share to the nodes that it reaches, as whole numbers, whose sum does not hang on the order; LACK finds what strays
// lack to be enclosed, RAISE adds it, LIST lists the balls in each brick: strays that are none of the field's, or still not enclosed.
// Then field_cells.comp finds the cells that hold the surface.
#version 460
// Compiled with one of: MARK, NUMBER, SCATTER, LACK, RAISE, LIST
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "groups.glsl"
#include "cells.glsl"
#include "whole.glsl"
#include "field.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(push_constant) uniform PushBlock { FieldBuild build; };
#if defined(LACK) || defined(RAISE)
#define STRAYS
#endif
#if defined(SCATTER) || defined(STRAYS)
layout(set = 0, binding = 1, std430) readonly buffer HeadBlock { FieldHead head; };
#elif !defined(MARK)
layout(set = 0, binding = 1, std430) buffer HeadBlock { FieldHead head; };
#endif
#if defined(SCATTER) || defined(STRAYS)
layout(set = 0, binding = 2, std430) readonly buffer TableBlock { uint at[]; } table;
#else
layout(set = 0, binding = 2, std430) buffer TableBlock { uint at[]; } table;
layout(set = 0, binding = 4, std430) buffer CounterBlock { uint at[]; } counters;
layout(constant_id = 0) const uint COUNTERS = 0; // slot of its first counter
const uint BRICKS = 0u, BRICKS_LEFT_OUT = 2u, BALLS_LEFT_OUT = 4u;
#endif
// Positions; w: their number density as a part of a filled body's, negative for balls, 0 where there is nothing.
layout(set = 0, binding = 3, std430) readonly buffer PointBlock { vec4 at[]; } points;
#if defined(NUMBER) || defined(LIST)
layout(set = 0, binding = 6, std430) buffer RecordBlock { uint at[]; } records;
#endif
#if !defined(MARK) && !defined(NUMBER)
layout(set = 0, binding = 7, std430) buffer NodeBlock { uint at[]; } nodes;
#endif
#if defined(MARK) || defined(STRAYS) || defined(LIST)
layout(set = 0, binding = 9, std430) buffer StraysBlock { FieldStrays strays; };
// Of each stray the number of its point, and what that adds besides where its kernel is 1, as a float; where there will be cells.
layout(set = 0, binding = 10, std430) buffer StrayBlock { uvec2 at[]; } stray;
#endif

#if defined(MARK) || defined(NUMBER)
layout(set = 0, binding = 8, std430) readonly buffer ExtentBlock { uint at[]; } extent;
layout(constant_id = 1) const bool ORIGIN_ON_DEVICE = false; // the liquid's own space begins where the extent pass has found
#endif

#include "field_reach.glsl"

// Which of eight, two on each axis, lies how far ahead.
ivec3 ahead_of(uint k) { return ivec3(k & 1u, (k >> 1) & 1u, k >> 2); }
// The k-th of eight blocks that its bricks can be in.
ivec3 block_of(Reach r, uint k) { return field_brick(r.first) + ahead_of(k); }

// A bit for each of eight blocks that are not further ahead than a last one.
uint blocks_up_to(ivec3 ahead) {
    uint blocks = 1u;
    if (ahead.x > 0) blocks |= blocks << 1;
    if (ahead.y > 0) blocks |= blocks << 2;
    if (ahead.z > 0) blocks |= blocks << 4;
    return blocks;
}

uvec4 directory_texel(uint i) { return uvec4(table.at[4u * i], table.at[4u * i + 1u], table.at[4u * i + 2u], table.at[4u * i + 3u]); }
#include "field_directory.glsl"

#if defined(MARK) || defined(NUMBER)
// The node at or before the origin of the liquid's own space, and how far beyond it that lies; the block that has it.
ivec3 origin_node(out vec3 part) {
    vec3 origin = vec3(build.origin_x, build.origin_y, build.origin_z);
    if (ORIGIN_ON_DEVICE)
        origin = uintBitsToFloat(uvec3(extent.at[EXTENT_ORIGIN], extent.at[EXTENT_ORIGIN + 1], extent.at[EXTENT_ORIGIN + 2]));
    return node_of(origin, part);
}
ivec3 block_of_node(ivec3 node) { return field_brick(field_brick(node)); }

// Until far blocks are numbered their slots name in place of a key the point that entered them, and which of its eight blocks it is.
ivec3 block_named(uint name) { return block_of(reach_of(points.at[(name - FIELD_FAR) / 8u]), (name - FIELD_FAR) % 8u); }
#endif

#ifdef MARK
// Enters some of a block's bricks.
void enter(ivec3 block, ivec3 base, uvec2 bits, uint name) {
    uint mask = build.slots - 1u, slot = field_hash(block) & mask, key = field_key(block, base), own = key < FIELD_FAR ? key : FIELD_FAR | name;
    bool done = false;
    for (uint i = 0u; i < FIELD_PROBES && !done; ++i) {
        uint at = FIELD_SLOT * slot, found = table.at[at];
        if (found == 0u) found = atomicCompSwap(table.at[at], 0u, own);
        done = found == 0u || found == own;
        if (!done && own >= FIELD_FAR && found >= FIELD_FAR) done = block_named(found) == block;
        if (done) {
            at += FIELD_THERE;
            if ((bits.x & ~table.at[at]) != 0u) atomicOr(table.at[at], bits.x);
            if ((bits.y & ~table.at[at + 1u]) != 0u) atomicOr(table.at[at + 1u], bits.y);
        }
        slot = (slot + 1u) & mask;
    }
    if (!done) atomicAdd(counters.at[COUNTERS + BRICKS_LEFT_OUT], uint(bitCount(bits.x) + bitCount(bits.y)));
}

void main() {
    uint i = invocation();
    if (i >= build.count || points.at[i].w == 0.0) return;
    if (points.at[i].w < FIELD_SURE) {
        uint entry = atomicAdd(strays.count, 1u), group = entry / PARTICLE_GROUP;
        stray.at[entry] = uvec2(i, 0u);
        if (entry % PARTICLE_GROUP == 0u) {
            atomicMax(strays.groups_x, min(group + 1u, MOST_GROUPS));
            atomicMax(strays.groups_y, group / MOST_GROUPS + 1u);
            strays.groups_z = 1u;
        }
    }
    Reach r = reach_of(points.at[i]);
    vec3 part;
    ivec3 base = block_of_node(origin_node(part));
    // The bricks that it reaches: for each of three planes of them a bit a brick, four bits a row, sixteen a block; and the same in the
    // blocks ahead on x.
    const uint row_bits = uint((1 << FIELD_BRICK) - 1);
    vec3 x = distances(r, 0), y = distances(r, 1), z = distances(r, 2);
    ivec3 from = r.first & (FIELD_BRICK - 1);
    uvec3 planes = uvec3(0u), planes_ahead = uvec3(0u);
    for (int k = 0; k < 9; ++k) {
        bvec3 reached = lessThan(x + y[k % 3] + z[k / 3], vec3(r.reach * r.reach));
        uint row = (uint(reached.x) | uint(reached.y) << 1 | uint(reached.z) << 2) << from.x, place = uint(FIELD_BRICK * (from.y + k % 3));
        planes[k / 3] |= (row & row_bits) << place;
        planes_ahead[k / 3] |= row >> FIELD_BRICK << place;
    }
    uint left = blocks_up_to(field_brick(r.last) - field_brick(r.first));
    while (left != 0u) {
        uint b = field_next(left);
        uvec3 halves = ((b & 1u) == 0u ? planes : planes_ahead) >> (8u * (b & 2u)) & 0xffffu;
        uvec2 bits = uvec2(0u);
        for (int k = 0; k < 3; ++k) {
            int at = from.z + k - FIELD_BRICK * int(b >> 2);
            uint word = halves[k] << (16 * (at & 1));
            bits |= uvec2(at >> 1 == 0 ? word : 0u, at >> 1 == 1 ? word : 0u);
        }
        if (bits != uvec2(0u)) enter(block_of(r, b), base, bits, 8u * i + b);
    }
}
#endif

#ifdef NUMBER
void main() {
    uint slot = invocation();
    if (slot >= build.slots) return;
    vec3 part;
    ivec3 node = origin_node(part), base = block_of_node(node);
    if (slot == 0u) {
        part += vec3(node - (base << (2 * FIELD_BRICK_BITS)));
        head.base_x = uint(base.x);
        head.base_y = uint(base.y);
        head.base_z = uint(base.z);
        head.part_x = part.x;
        head.part_y = part.y;
        head.part_z = part.z;
        head.groups_z = 1u;
    }
    uint at = FIELD_SLOT * slot, key = table.at[at];
    if (key == 0u) return;
    ivec3 block;
    if (key >= FIELD_FAR) {
        block = block_named(key);
        table.at[at] = field_key(block, base);
    } else {
        const uint mask = (1u << FIELD_KEY_BITS) - 1u;
        block = base - FIELD_KEY_BELOW + ivec3(uvec3(key - 1u, (key - 1u) >> FIELD_KEY_BITS, (key - 1u) >> (2 * FIELD_KEY_BITS)) & mask);
    }
    for (int a = 0; a < 3; ++a) table.at[at + FIELD_PLACE + a] = uint(block[a]);
    uvec2 there = uvec2(table.at[at + FIELD_THERE], table.at[at + FIELD_THERE + 1u]);
    uint count = uint(bitCount(there.x) + bitCount(there.y)), first = atomicAdd(head.bricks, count) + 1u;
    // Without room for all there are none.
    if (first + count > build.capacity) {
        table.at[at + FIELD_THERE] = 0u;
        table.at[at + FIELD_THERE + 1u] = 0u;
        atomicAdd(counters.at[COUNTERS + BRICKS_LEFT_OUT], count);
        return;
    }
    table.at[at + FIELD_FIRST_BRICK] = first;
    for (uint k = 0u, brick = first; k < FIELD_NODES; ++k)
        if (field_bit(there, k)) records.at[FIELD_RECORD * brick++ + FIELD_HOME] = FIELD_NODES * slot + k + 1u;
    atomicAdd(counters.at[COUNTERS + BRICKS], count);
    // The rectangle of groups that look at bricks.
    uint last = first + count - 1u, groups = (last * FIELD_LANES + PARTICLE_GROUP - 1u) / PARTICLE_GROUP;
    atomicMax(head.groups_x, min(groups, MOST_GROUPS));
    atomicMax(head.groups_y, (groups - 1u) / MOST_GROUPS + 1u);
}
#endif

#if defined(LACK) || defined(LIST)
// What a particle lacks where it is, so that the field encloses it, in whole numbers of a node; none or less where it does. `own`: what the
// particle adds there itself, as a part of what it adds where its kernel is 1.
float lacks(vec4 point, ivec3 base, out float own) {
    Reach r = reach_of(point);
    // The bricks of the nodes around it, block by block: mostly they are one block's.
    uint numbers[8];
    ivec3 first_block = field_brick(field_brick(r.node));
    uint left = blocks_up_to(field_brick(field_brick(r.node + 1)) - first_block);
    while (left != 0u) {
        ivec3 block = first_block + ahead_of(field_next(left));
        uvec4 words;
        field_slot(block, base, build.slots, words);
        for (uint c = 0u; c < 8u; ++c) {
            ivec3 brick = field_brick(r.node + ahead_of(c));
            if (field_brick(brick) == block) numbers[c] = field_number(words, field_local(brick));
        }
    }
    // The field between them, and its gradient.
    float f = 0.0;
    vec3 gradient = vec3(0.0);
    own = 0.0;
    for (uint c = 0u; c < 8u; ++c) {
        ivec3 step = ahead_of(c), node = r.node + step;
        vec3 weights = mix(1.0 - r.part, r.part, bvec3(step)), away = vec3(step) - r.part;
        uint pair = nodes.at[FIELD_NODE_WORDS * numbers[c] + field_local(node) / 2u];
        float sum = float(int(pair >> (16 * (node.x & 1)) & 0xffffu)), weight = weights.x * weights.y * weights.z;
        float within = max(1.0 - dot(away, away) / (build.reach * build.reach), 0.0);
        f += weight * sum;
        own += weight * within * within;
        gradient += mix(vec3(-sum), vec3(sum), bvec3(step)) * weights.yzx * weights.zxy;
    }
    if (point.w < FIELD_TIP) f -= FIELD_BEYOND / SPLASH_RADIUS * build.ball * length(gradient);
    return float(build.level) - f;
}
#endif

#ifdef LACK
void main() {
    uint i = invocation();
    if (i >= strays.count) return;
    vec4 point = points.at[stray.at[i].x];
    if (point.w < 0.0) return;
    float own, lacking = lacks(point, ivec3(head.base_x, head.base_y, head.base_z), own) + FIELD_ENOUGH * float(build.level);
    if (lacking > 0.0) stray.at[i].y = floatBitsToUint(min(FIELD_RAISED * lacking / own, unit_of(point)));
}
#endif

#ifdef LIST
layout(set = 0, binding = 8, std430) writeonly buffer BallBlock { uvec2 at[]; } balls;

void main() {
    uint i = invocation();
    if (i >= strays.count) return;
    uvec2 entry = stray.at[i];
    vec4 point = points.at[entry.x];
    ivec3 base = ivec3(head.base_x, head.base_y, head.base_z);
    float own;
    if (point.w > 0.0 && (entry.y == 0u || lacks(point, base, own) <= 0.0)) return;
    Reach r = reach_of(vec4(point.xyz, -1.0));
    vec3 x = distances(r, 0), y = distances(r, 1), z = distances(r, 2);
    for (uint k = 0u; k < 8u; ++k) {
        ivec3 step = ahead_of(k), brick = r.first + step;
        bool reached = x[step.x] + y[step.y] + z[step.z] < r.reach * r.reach;
        uvec4 words;
        uint slot = field_slot(field_brick(brick), base, build.slots, words), local = field_local(brick), number = field_number(words, local);
        if (reached && number > 0u) {
            uint entry = atomicAdd(head.balls, 1u);
            if (entry >= build.ball_capacity) {
                atomicAdd(counters.at[COUNTERS + BALLS_LEFT_OUT], 1u);
            } else {
                atomicOr(table.at[FIELD_SLOT * slot + FIELD_BALLS + (local >> 5)], 1u << (local & 31u));
                uint next = atomicExchange(records.at[number * FIELD_RECORD + FIELD_FIRST_BALL], entry + 1u);
                balls.at[entry] = uvec2(field_packed_ball(vec3(r.node - (brick << FIELD_BRICK_BITS)) + r.part), next);
            }
        }
    }
}
#endif

#if defined(SCATTER) || defined(RAISE)
layout(constant_id = 1) const int ACROSS = 6; // nodes that a kernel can reach on an axis

const int BRICKS = (ACROSS + 2) / FIELD_BRICK + 1; // in which these can be

void main() {
    uint i = invocation();
#ifdef RAISE
    if (i >= strays.count || stray.at[i].y == 0u) return;
    vec4 point = points.at[stray.at[i].x];
    float unit = uintBitsToFloat(stray.at[i].y);
#else
    if (i >= build.count || points.at[i].w <= 0.0) return;
    vec4 point = points.at[i];
    float unit = unit_of(point);
#endif
    Reach r = reach_of(point);
    ivec3 base = ivec3(head.base_x, head.base_y, head.base_z);
    float per_square = 1.0 / (build.reach * build.reach);
    // Nodes from the first that it can reach on, in spacings from the point, and among those of its bricks.
    ivec3 low = ivec3(floor(r.part - build.reach)) + 1, first = field_brick(r.node + low), at = r.node + low - (first << FIELD_BRICK_BITS);
    vec3 offset = vec3(low) - r.part;
    // The numbers of these, x before y before z, block by block: mostly they are one block's.
    uint numbers[BRICKS * BRICKS * BRICKS];
    for (int k = 0; k < BRICKS * BRICKS * BRICKS; ++k) numbers[k] = 0u;
    ivec3 first_block = field_brick(first), last = field_brick(r.node + ivec3(floor(r.part + build.reach)));
    uint left = blocks_up_to(field_brick(last) - first_block);
    while (left != 0u) {
        ivec3 block = first_block + ahead_of(field_next(left));
        uvec4 words;
        field_slot(block, base, build.slots, words);
        for (int k = 0; k < BRICKS * BRICKS * BRICKS; ++k) {
            ivec3 brick = first + ivec3(k % BRICKS, k / BRICKS % BRICKS, k / (BRICKS * BRICKS));
            if (field_brick(brick) == block) numbers[k] = field_number(words, field_local(brick));
        }
    }
    // Two nodes that share a word at a time, from the word of the first on; how near those of a word are to the point on x.
    int word = at.x >> 1;
    float from = offset.x - float(at.x & 1), nearest[ACROSS / 2 + 1];
    for (int pair = 0; pair <= ACROSS / 2; ++pair) {
        float x = min(abs(from + float(2 * pair)), abs(from + float(2 * pair + 1)));
        nearest[pair] = 1.0 - x * x * per_square;
    }
    for (int z = 0; z < ACROSS; ++z) {
        uint plane[BRICKS * BRICKS];
        for (int k = 0; k < BRICKS * BRICKS * BRICKS; ++k) {
            if (k / (BRICKS * BRICKS) == (at.z + z) >> FIELD_BRICK_BITS) plane[k % (BRICKS * BRICKS)] = numbers[k];
        }
        // The words that it reaches, a bit each, four for a row.
        float dz = offset.z + float(z);
        uint reached = 0u;
        for (int y = 0; y < ACROSS; ++y) {
            float dy = offset.y + float(y), across = (dy * dy + dz * dz) * per_square;
            for (int pair = 0; pair <= ACROSS / 2; ++pair) reached |= uint(nearest[pair] > across) << (4 * y + pair);
        }
        while (reached != 0u) {
            int k = int(field_next(reached)), y = k >> 2, pair = k & 3;
            vec2 x = from + float(2 * pair) + vec2(0.0, 1.0);
            float dy = offset.y + float(y);
            vec2 within = max(1.0 - (x * x + (dy * dy + dz * dz)) * per_square, 0.0);
            uvec2 share = rounded(unit * within * within);
            ivec3 own = ivec3(2 * (word + pair), at.yz + ivec2(y, z)), brick = own >> FIELD_BRICK_BITS;
            int which = brick.x + BRICKS * brick.y;
            uint number = plane[0];
            for (int b = 1; b < BRICKS * BRICKS; ++b) number = which == b ? plane[b] : number;
            // Without a number there was no room for the brick.
            if (number > 0u) atomicAdd(nodes.at[FIELD_NODE_WORDS * number + field_local(own) / 2u], share.x | share.y << 16);
        }
    }
}
#endif
