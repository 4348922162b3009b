// The density field as bricks of nodes, where there is any (docs/methods.md, "Density field"). MARK enters the bricks that points reach
// in the directory, block by block, NUMBER numbers them, SCATTER adds each point's share to the nodes that it reaches, as whole numbers, whose
// sum does not hang on the order; LIST lists the balls in each brick: splashes that are alone, and particles in the field that it does not
// enclose; FINISH finds the cells that hold the surface, and puts together what a walk looks at in them.
#version 460
// Compiled with one of: MARK, NUMBER, SCATTER, LIST, FINISH
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "groups.glsl"
#include "cells.glsl"
#include "whole.glsl"
#include "field.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(push_constant) uniform PushBlock { FieldBuild build; };
#if defined(SCATTER) || defined(FINISH)
layout(set = 0, binding = 1, std430) readonly buffer HeadBlock { FieldHead head; };
#elif !defined(MARK)
layout(set = 0, binding = 1, std430) buffer HeadBlock { FieldHead head; };
#endif
#ifdef SCATTER
layout(set = 0, binding = 2, std430) readonly buffer TableBlock { uint at[]; } table;
#else
layout(set = 0, binding = 2, std430) buffer TableBlock { uint at[]; } table;
layout(set = 0, binding = 4, std430) buffer CounterBlock { uint at[]; } counters;
layout(constant_id = 0) const uint COUNTERS = 0; // slot of its first counter
const uint BRICKS = 0u, CELLS = 1u, BRICKS_LEFT_OUT = 2u, CELLS_LEFT_OUT = 3u, BALLS_LEFT_OUT = 4u;
#endif
#ifndef FINISH
// Positions; w: their number density as a part of a filled body's, negative for balls, 0 where there is nothing.
layout(set = 0, binding = 3, std430) readonly buffer PointBlock { vec4 at[]; } points;
#endif
#if !defined(MARK) && !defined(SCATTER)
layout(set = 0, binding = 6, std430) buffer RecordBlock { uint at[]; } records;
#endif
#if defined(SCATTER) || defined(LIST) || defined(FINISH)
layout(set = 0, binding = 7, std430) buffer NodeBlock { uint at[]; } nodes;
#endif

#if defined(MARK) || defined(NUMBER)
layout(set = 0, binding = 8, std430) readonly buffer ExtentBlock { uint at[]; } extent;
layout(constant_id = 1) const bool ORIGIN_ON_DEVICE = false; // the liquid's own space begins where the extent pass has found
#endif

#ifndef FINISH
#include "field_reach.glsl"

// The k-th of eight blocks that its bricks can be in.
ivec3 block_of(Reach r, uint k) { return field_brick(r.first) + ivec3(k & 1u, (k >> 1) & 1u, k >> 2); }
#endif

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
    Reach r = reach_of(points.at[i]);
    vec3 part;
    ivec3 base = block_of_node(origin_node(part)), blocks = field_brick(r.last) - field_brick(r.first);
    // The bricks that it reaches: three bits for each row along x, from the first brick's place in its block on.
    vec3 x = distances(r, 0), y = distances(r, 1), z = distances(r, 2);
    ivec3 from = r.first & (FIELD_BRICK - 1);
    uint rows[9];
    for (int k = 0; k < 9; ++k) {
        bvec3 reached = lessThan(x + y[k % 3] + z[k / 3], vec3(r.reach * r.reach));
        rows[k] = (uint(reached.x) | uint(reached.y) << 1 | uint(reached.z) << 2) << from.x;
    }
    for (uint b = 0u; b < 8u; ++b) {
        ivec3 ahead = ivec3(b & 1u, (b >> 1) & 1u, b >> 2);
        if (all(lessThanEqual(ahead, blocks))) {
            uvec2 bits = uvec2(0u);
            for (int k = 0; k < 9; ++k) {
                ivec2 at = from.yz + ivec2(k % 3, k / 3) - FIELD_BRICK * ahead.yz;
                bool in_block = ((at.x | at.y) & ~(FIELD_BRICK - 1)) == 0;
                uint local = field_local(ivec3(0, at)), row = rows[k] >> (FIELD_BRICK * ahead.x) & uint((1 << FIELD_BRICK) - 1);
                row = in_block ? row << (local & 31u) : 0u;
                bits |= local < 32u ? uvec2(row, 0u) : uvec2(0u, row);
            }
            if (bits != uvec2(0u)) enter(block_of(r, b), base, bits, 8u * i + b);
        }
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
    // The rectangle of groups that are one a brick.
    uint last = first + count - 1u;
    atomicMax(head.groups_x, min(last, MOST_GROUPS));
    atomicMax(head.groups_y, (last - 1u) / MOST_GROUPS + 1u);
}
#endif

#ifdef LIST
layout(set = 0, binding = 8, std430) writeonly buffer BallBlock { uvec2 at[]; } balls;

// Whether the field does not enclose one of its particles.
bool strays(vec4 point, Reach r, ivec3 base) {
    // The field where it is, between nodes, and its gradient.
    float f = 0.0;
    vec3 gradient = vec3(0.0);
    for (uint c = 0u; c < 8u; ++c) {
        ivec3 step = ivec3(c & 1u, (c >> 1) & 1u, c >> 2), node = r.node + step;
        vec3 weights = mix(1.0 - r.part, r.part, bvec3(step));
        uvec4 words;
        field_slot(field_brick(field_brick(node)), base, build.slots, words);
        uint number = field_number(words, field_local(field_brick(node)));
        uint pair = nodes.at[FIELD_NODE_WORDS * number + field_local(node) / 2u];
        float sum = float(int(pair >> (16 * (node.x & 1)) & 0xffffu));
        f += weights.x * weights.y * weights.z * sum;
        gradient += mix(vec3(-sum), vec3(sum), bvec3(step)) * weights.yzx * weights.zxy;
    }
    if (point.w < FIELD_TIP) f -= FIELD_BEYOND / SPLASH_RADIUS * build.ball * length(gradient);
    return f < float(build.level);
}

void main() {
    uint i = invocation();
    vec4 point = points.at[min(i, build.count - 1u)];
    bool ball = i < build.count && point.w < 0.0;
    ivec3 base = ivec3(head.base_x, head.base_y, head.base_z);
    Reach r = reach_of(vec4(point.xyz, -1.0));
    if (i < build.count && point.w > 0.0 && point.w < FIELD_SURE) ball = strays(point, r, base);
    vec3 x = distances(r, 0), y = distances(r, 1), z = distances(r, 2);
    for (uint k = 0u; ball && k < 8u; ++k) {
        ivec3 step = ivec3(k & 1u, (k >> 1) & 1u, k >> 2), brick = r.first + step;
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

#ifdef SCATTER
layout(constant_id = 1) const int ACROSS = 6; // nodes that a kernel can reach on an axis

// Of the three bricks along each axis those in which a row of nodes lies.
uvec3 one_of(uvec3 first, uvec3 second, uvec3 third, int which) { return which == 0 ? first : which == 1 ? second : third; }

// A block's first brick, and which it has.
uvec3 known_block(ivec3 block, ivec3 base) {
    uvec4 words;
    field_slot(block, base, build.slots, words);
    return uvec3(words[FIELD_FIRST_BRICK], field_there(words));
}

void main() {
    uint i = invocation();
    if (i >= build.count || points.at[i].w <= 0.0) return;
    vec4 point = points.at[i];
    Reach r = reach_of(point);
    ivec3 base = ivec3(head.base_x, head.base_y, head.base_z), blocks = field_brick(r.last) - field_brick(r.first);
    uvec3 known[8];
    for (uint b = 0u; b < 8u; ++b) {
        known[b] = uvec3(0u);
        if (all(lessThanEqual(ivec3(b & 1u, (b >> 1) & 1u, b >> 2), blocks)))
            known[b] = known_block(block_of(r, b), base);
    }
    // The numbers of its bricks, by x, in rows by y and z.
    uvec3 numbers[9];
    for (int k = 0; k < 9; ++k) {
        ivec3 row = r.first + ivec3(0, k % 3, k / 3);
        bvec2 ahead = notEqual(field_brick(row).yz, field_brick(r.first).yz);
        uvec3 near = ahead.y ? (ahead.x ? known[6] : known[4]) : (ahead.x ? known[2] : known[0]);
        uvec3 far = ahead.y ? (ahead.x ? known[7] : known[5]) : (ahead.x ? known[3] : known[1]);
        for (int x = 0; x < 3; ++x) {
            ivec3 brick = row + ivec3(x, 0, 0);
            uvec3 block = field_brick(brick).x == field_brick(r.first).x ? near : far;
            bool there = all(lessThanEqual(brick, r.last)) && field_bit(block.yz, field_local(brick));
            numbers[k][x] = there ? block.x + field_before(block.yz, field_local(brick)) : 0u;
        }
    }
    float unit = unit_of(point), per_reach = 1.0 / build.reach;
    // Nodes from the first that it can reach on, in spacings from the point, and among those of its bricks.
    ivec3 low = ivec3(floor(r.part - build.reach)) + 1, at = r.node + low - (r.first << FIELD_BRICK_BITS);
    vec3 offset = vec3(low) - r.part;
    for (int z = 0; z < ACROSS; ++z) {
        int z_brick = (at.z + z) >> FIELD_BRICK_BITS;
        uvec3 plane[3];
        for (int y = 0; y < 3; ++y) plane[y] = one_of(numbers[y], numbers[3 + y], numbers[6 + y], z_brick);
        for (int y = 0; y < ACROSS; ++y) {
            vec2 yz = offset.yz + vec2(y, z);
            float row = dot(yz, yz);
            ivec2 row_at = at.yz + ivec2(y, z);
            if (row >= build.reach * build.reach) continue;
            uvec3 row_numbers = one_of(plane[0], plane[1], plane[2], row_at.x >> FIELD_BRICK_BITS);
            // Two nodes that share a word at a time, from the one that the first shares its word with.
            for (int pair = 0; pair <= ACROSS / 2; ++pair) {
                ivec3 own = ivec3((at.x & ~1) + 2 * pair, row_at);
                vec2 dx = offset.x + float(own.x - at.x) + vec2(0.0, 1.0), q = sqrt(row + dx * dx) * per_reach;
                vec2 far = max(1.0 - q, 0.0), near = max(0.5 - q, 0.0);
                vec2 weight = min(unit * (2.0 * far * far * far - 8.0 * near * near * near), FIELD_MOST_SHARE);
                uvec2 share = rounded(weight);
                int b = own.x >> FIELD_BRICK_BITS;
                uint number = b == 0 ? row_numbers.x : b == 1 ? row_numbers.y : row_numbers.z, both = share.x | share.y << 16;
                // Without a number there was no room for the brick.
                if (both > 0u && number > 0u) atomicAdd(nodes.at[FIELD_NODE_WORDS * number + field_local(own) / 2u], both);
            }
        }
    }
}
#endif

#ifdef FINISH
layout(set = 0, binding = 8, std430) writeonly buffer CellBlock { uint at[]; } cells;

// Of a brick's nodes, those up to one before and two beyond them on each axis; and of the corners of its cells.
const uint AROUND = FIELD_BRICK + 3u, CORNERS = FIELD_BRICK + 1u;
shared uint numbers[27];                          // of the bricks around it
shared uint sums[AROUND * AROUND * AROUND];
shared uint corners[CORNERS * CORNERS * CORNERS]; // four bytes each: what it holds, and its gradient
shared uint found[2];                             // whether there are corners outside, and inside
shared uint surface[4];                           // one bit for each cell that holds some; one for each node that is inside
shared uint first_cell;

uint corner_at(uvec3 local) { return local.x + CORNERS * (local.y + CORNERS * local.z); }
uint sum_index(uvec3 node) { return node.x + AROUND * (node.y + AROUND * node.z); }
int sum_at(ivec3 node) { return int(sums[sum_index(uvec3(node))]); }

void find_brick(ivec3 own, ivec3 step) {
    ivec3 brick = own + step;
    uvec4 words;
    field_slot(field_brick(brick), ivec3(head.base_x, head.base_y, head.base_z), build.slots, words);
    numbers[step.x + 1 + 3 * (step.y + 1 + 3 * (step.z + 1))] = field_number(words, field_local(brick));
}

// Reads the sum of a node, by its place around the brick.
uint read_sum(uvec3 node) {
    uvec3 at = node + FIELD_BRICK - 1u, brick = at >> FIELD_BRICK_BITS;
    uint word = nodes.at[FIELD_NODE_WORDS * numbers[brick.x + 3u * (brick.y + 3u * brick.z)] + field_local(ivec3(at)) / 2u];
    uint sum = word >> (16u * (at.x & 1u)) & 0xffffu;
    sums[sum_index(node)] = sum;
    return sum;
}

// A node, by its place around the brick.
uint packed_node(ivec3 node) {
    uint held = min(uint(sum_at(node)) * FIELD_HALF / build.level, 255u);
    vec3 gradient = vec3(sum_at(node + ivec3(1, 0, 0)) - sum_at(node - ivec3(1, 0, 0)), sum_at(node + ivec3(0, 1, 0)) - sum_at(node - ivec3(0, 1, 0)),
                         sum_at(node + ivec3(0, 0, 1)) - sum_at(node - ivec3(0, 0, 1))) / (2.0 * FIELD_STEEPEST * FIELD_ONE);
    // What is steeper keeps its direction.
    gradient /= max(1.0, max(abs(gradient.x), max(abs(gradient.y), abs(gradient.z))));
    return held | packSnorm4x8(vec4(gradient, 0.0)) << 8;
}

// The k-th bytes of four words.
uint bytes(uvec4 words, uint k) {
    uvec4 b = words >> (8u * k) & 0xffu;
    return b.x | b.y << 8 | b.z << 16 | b.w << 24;
}

// One group a brick, one invocation a cell.
void main() {
    uint number = group_index() + 1u, k = gl_LocalInvocationIndex, record = FIELD_RECORD * number;
    if (number > min(head.bricks, build.capacity - 1u)) return;
    uint home = records.at[record + FIELD_HOME] - 1u, slot = home / FIELD_NODES;
    if (home == 0xffffffffu) return; // a number that no block has got
    ivec3 own = (field_place(slot) << FIELD_BRICK_BITS) + field_from_local(home);
    if (k < 8u) find_brick(own, ivec3(k & 1u, (k >> 1) & 1u, k >> 2));
    if (k < 4u) surface[k] = 0u;
    if (k < 2u) found[k] = 0u;
    barrier();
    for (uint i = k; i < CORNERS * CORNERS * CORNERS; i += FIELD_NODES) {
        uint inside = uint(read_sum(uvec3(i % CORNERS, i / CORNERS % CORNERS, i / (CORNERS * CORNERS)) + 1u) >= build.level);
        if (found[inside] == 0u) found[inside] = 1u;
    }
    barrier();
    if (found[0] + found[1] == 1u) {
        if (k < 2u) records.at[record + FIELD_INSIDE + k] = found[1] * 0xffffffffu;
        return;
    }
    ivec3 step = ivec3(k % 3u, k / 3u % 3u, k / 9u) - 1;
    if (k < 27u && any(lessThan(step, ivec3(0)))) find_brick(own, step);
    barrier();
    for (uint i = k; i < AROUND * AROUND * AROUND; i += FIELD_NODES) {
        uvec3 node = uvec3(i % AROUND, i / AROUND % AROUND, i / (AROUND * AROUND));
        if (any(equal(node, uvec3(0u))) || any(equal(node, uvec3(AROUND - 1u)))) read_sum(node);
    }
    barrier();
    for (uint i = k; i < CORNERS * CORNERS * CORNERS; i += FIELD_NODES)
        corners[i] = packed_node(ivec3(i % CORNERS, i / CORNERS % CORNERS, i / (CORNERS * CORNERS)) + 1);
    barrier();
    uint first = corner_at(uvec3(field_from_local(k)));
    uvec4 low = uvec4(corners[first], corners[first + 1u], corners[first + CORNERS], corners[first + CORNERS + 1u]);
    first += CORNERS * CORNERS;
    uvec4 high = uvec4(corners[first], corners[first + 1u], corners[first + CORNERS], corners[first + CORNERS + 1u]);
    uint all_inside = (low.x & low.y & low.z & low.w & high.x & high.y & high.z & high.w) & FIELD_HALF,
         any_inside = (low.x | low.y | low.z | low.w | high.x | high.y | high.z | high.w) & FIELD_HALF;
    bool here = all_inside != any_inside;
    if (here) atomicOr(surface[k >> 5], 1u << (k & 31u));
    if ((low.x & FIELD_HALF) != 0u) atomicOr(surface[2u + (k >> 5)], 1u << (k & 31u));
    barrier();
    if (k < 2u) records.at[record + FIELD_INSIDE + k] = surface[2u + k];
    uvec2 bits = uvec2(surface[0], surface[1]);
    if (k == 0u) {
        uint count = field_before(bits, FIELD_NODES - 1u) + uint(field_bit(bits, FIELD_NODES - 1u));
        first_cell = atomicAdd(counters.at[COUNTERS + CELLS], count); // its numbers follow from the count
        // Without room for all there are none.
        if (first_cell + count > build.cell_capacity) {
            atomicAdd(counters.at[COUNTERS + CELLS_LEFT_OUT], count);
            first_cell = build.cell_capacity;
        } else {
            uint local = home % FIELD_NODES;
            atomicOr(table.at[FIELD_SLOT * slot + FIELD_SURFACE + (local >> 5)], 1u << (local & 31u));
            records.at[record + FIELD_FIRST_CELL] = first_cell;
            records.at[record + FIELD_CELLS] = bits.x;
            records.at[record + FIELD_CELLS + 1u] = bits.y;
        }
    }
    barrier();
    if (!here || first_cell == build.cell_capacity) return;
    uint cell = FIELD_CELL_RECORD * (first_cell + field_before(bits, k));
    for (uint b = 0u; b < 4u; ++b) {
        cells.at[cell + 2u * b] = bytes(low, b);
        cells.at[cell + 2u * b + 1u] = bytes(high, b);
    }
}
#endif
