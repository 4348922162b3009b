// Of a density field that field.comp has summed up the cells that hold the surface, and what a walk looks at in them (docs/methods.md, "Density
// field"): of each corner what it holds, and its gradient.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "groups.glsl"
#include "whole.glsl"
#include "field.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(push_constant) uniform PushBlock { FieldBuild build; };
layout(set = 0, binding = 1, std430) readonly buffer HeadBlock { FieldHead head; };
layout(set = 0, binding = 2, std430) buffer TableBlock { uint at[]; } table;
layout(set = 0, binding = 4, std430) buffer CounterBlock { uint at[]; } counters;
layout(set = 0, binding = 6, std430) buffer RecordBlock { uint at[]; } records;
layout(set = 0, binding = 7, std430) readonly buffer NodeBlock { uint at[]; } nodes;
layout(set = 0, binding = 8, std430) writeonly buffer CellBlock { uint at[]; } cells;
layout(constant_id = 0) const uint COUNTERS = 0; // slot of the first of the field's counters
const uint CELLS = 1u, CELLS_LEFT_OUT = 3u;

uvec4 directory_texel(uint i) { return uvec4(table.at[4u * i], table.at[4u * i + 1u], table.at[4u * i + 2u], table.at[4u * i + 3u]); }
#include "field_directory.glsl"

// A group takes several bricks, FIELD_LANES invocations each. Of a brick's nodes those up to two before and beyond them on x, and one before and two
// beyond on the other axes, as rows of words of two each, in rooms of a power of two; and the corners of its cells.
const uint BRICKS_AT_ONCE = PARTICLE_GROUP / FIELD_LANES, AROUND = FIELD_BRICK + 3u, ROW_WORDS = 4u, ROW_ROOM = 8u, CORNERS = FIELD_BRICK + 1u;
const uint WORDS = ROW_WORDS * ROW_ROOM * AROUND, ALL_CORNERS = CORNERS * CORNERS * CORNERS;
shared uint numbers[BRICKS_AT_ONCE][27]; // of the bricks around it
shared uint sums[BRICKS_AT_ONCE][WORDS];
shared uint corners[BRICKS_AT_ONCE][ALL_CORNERS]; // four bytes each: what it holds, and its gradient
shared uint found[BRICKS_AT_ONCE][2];             // whether there are corners outside, and inside
shared uint surface[BRICKS_AT_ONCE][2];           // one bit for each cell that holds some
shared uint inside[BRICKS_AT_ONCE][2];            // one for each node that is inside
shared uint first_cell[BRICKS_AT_ONCE];
uint own; // which of the group's bricks it is

uint corner_at(uvec3 place) { return place.x + CORNERS * (place.y + CORNERS * place.z); }
// By products, since whole numbers divide lane by lane on CPUs; i below 1024.
uvec3 corner_from(uint i) {
    uint y = i * 205u >> 10, z = y * 205u >> 10;
    return uvec3(i - CORNERS * y, y - CORNERS * z, z);
}
uint sum_index(uvec3 word) { return word.x + ROW_WORDS * (word.y + ROW_ROOM * word.z); }

// Reads the i-th word around the brick, the first of which begins two nodes before the brick's own. Whether corners of its cells among these are
// outside, and inside.
bvec2 read_sums(uint i) {
    uvec3 word = uvec3(i, i / ROW_WORDS, i / (ROW_WORDS * ROW_ROOM)) & uvec3(ROW_WORDS - 1u, ROW_ROOM - 1u, ROW_ROOM - 1u);
    uvec3 at = uvec3(2u * word.x, word.yz + 1u) + FIELD_BRICK - 2u, brick = at >> FIELD_BRICK_BITS;
    uint number = numbers[own][brick.x + 3u * (brick.y + 3u * brick.z)], both = nodes.at[FIELD_NODE_WORDS * number + field_local(ivec3(at)) / 2u];
    sums[own][i] = both;
    bvec2 within = greaterThanEqual(uvec2(both & 0xffffu, both >> 16), uvec2(build.level));
    bool corner = word.x > 0u && all(greaterThan(word.yz, uvec2(0u))) && all(lessThanEqual(word.yz, uvec2(CORNERS))), pair = word.x + 1u < ROW_WORDS;
    return bvec2(corner && (!within.x || (pair && !within.y)), corner && (within.x || (pair && within.y)));
}

// The sums of the nodes before one, of itself, and behind it on x, by its place from the brick's first on.
uvec3 sums_along(uvec3 node) {
    uint i = sum_index(uvec3((node.x + 1u) / 2u, node.yz + 1u)), first = sums[own][i], second = sums[own][i + 1u];
    return (node.x & 1u) == 0u ? uvec3(first >> 16, second & 0xffffu, second >> 16) : uvec3(first & 0xffffu, first >> 16, second & 0xffffu);
}

// Scharr's weights for a derivative across: of the nodes beside, of those between. Whole numbers, as the sums are, and together less than a float
// rounds.
const float BESIDE = 3.0, BETWEEN = 10.0, ALL_WEIGHTS = (2.0 * BESIDE + BETWEEN) * (2.0 * BESIDE + BETWEEN);

// A node, by its place from the brick's first on.
uint packed_node(uvec3 node) {
    // By a quotient that is near, since whole numbers divide lane by lane on CPUs.
    uint above = sums_along(node).y * FIELD_HALF, held = rounded(float(int(above)) / float(int(build.level)));
    if (held * build.level > above) --held;
    vec3 gradient = vec3(0.0);
    for (int k = 0; k < 9; ++k) {
        ivec2 aside = ivec2(k % 3, k / 3) - 1;
        vec3 row = vec3(ivec3(sums_along(uvec3(node.x, node.yz + uvec2(aside)))));
        vec2 weight = mix(vec2(BESIDE), vec2(BETWEEN), equal(aside, ivec2(0)));
        float smoothed = dot(row, vec3(BESIDE, BETWEEN, BESIDE));
        gradient += vec3(weight.x * weight.y * (row.z - row.x), smoothed * weight.yx * vec2(aside));
    }
    gradient /= 2.0 * ALL_WEIGHTS * FIELD_STEEPEST * FIELD_ONE;
    // What is steeper keeps its direction.
    gradient /= max(1.0, max(abs(gradient.x), max(abs(gradient.y), abs(gradient.z))));
    uvec3 slope = uvec3(whole(127.0 * gradient)) & 0xffu;
    return min(held, 255u) | slope.x << 8 | slope.y << 16 | slope.z << 24;
}

// Which nodes of a row of corners are inside, a bit each: all, of two beside each other both, and either of them.
uvec3 row_of(uint y, uint z) {
    uint row = 0u;
    for (uint x = 0u; x < CORNERS; ++x) row |= (corners[own][corner_at(uvec3(x, y, z))] & FIELD_HALF) / FIELD_HALF << x;
    return uvec3(row, row & row >> 1, row | row >> 1) & ((1u << FIELD_BRICK) - 1u);
}

// The k-th bytes of four words.
uint bytes(uvec4 words, uint k) {
    uvec4 b = words >> (8u * k) & 0xffu;
    return b.x | b.y << 8 | b.z << 16 | b.w << 24;
}
void write_cell(uint cell, uint local) {
    uint first = corner_at(uvec3(field_from_local(local))), word = FIELD_CELL_RECORD * cell;
    for (uint z = 0u; z < 2u; ++z) {
        uvec4 four = uvec4(corners[own][first], corners[own][first + 1u], corners[own][first + CORNERS], corners[own][first + CORNERS + 1u]);
        for (uint b = 0u; b < 4u; ++b) cells.at[word + 2u * b + z] = bytes(four, b);
        first += CORNERS * CORNERS;
    }
}

void main() {
    own = gl_LocalInvocationIndex / FIELD_LANES;
    uint lane = gl_LocalInvocationIndex % FIELD_LANES, number = invocation() / FIELD_LANES + 1u;
    if (number > min(head.bricks, build.capacity - 1u)) number = 0u;
    // A number that no block has got is nothing, as is the empty brick's.
    uint record = FIELD_RECORD * number, home = records.at[record + FIELD_HOME] - 1u, slot = home / FIELD_NODES;
    bool there = home != 0xffffffffu;
    if (lane < 2u) {
        found[own][lane] = 0u;
        surface[own][lane] = 0u;
        inside[own][lane] = 0u;
    }
    for (uint i = there ? lane : 27u; i < 27u; i += FIELD_LANES) {
        ivec3 brick = (field_place(slot) << FIELD_BRICK_BITS) + field_from_local(home) + ivec3(i % 3u, i / 3u % 3u, i / 9u) - 1;
        uvec4 words;
        field_slot(field_brick(brick), ivec3(head.base_x, head.base_y, head.base_z), build.slots, words);
        numbers[own][i] = field_number(words, field_local(brick));
    }
    barrier();
    bvec2 some = bvec2(false);
    for (uint i = there ? lane : WORDS; i < WORDS; i += FIELD_LANES) {
        bvec2 more = read_sums(i);
        some = bvec2(some.x || more.x, some.y || more.y);
    }
    if (some.x) found[own][0] = 1u;
    if (some.y) found[own][1] = 1u;
    barrier();
    bool mixed = found[own][0] + found[own][1] == 2u;
    if (there && !mixed && lane < 2u) records.at[record + FIELD_INSIDE + lane] = found[own][1] * 0xffffffffu;
    for (uint i = mixed ? lane : ALL_CORNERS; i < ALL_CORNERS; i += FIELD_LANES) corners[own][i] = packed_node(corner_from(i));
    barrier();
    // Two rows of its cells, and the nodes before these.
    uint holding = 0u, within = 0u;
    for (uint i = mixed ? 0u : 2u; i < 2u; ++i) {
        uvec2 at = uvec2(2u * (lane % 2u) + i, lane / 2u);
        uvec3 a = row_of(at.x, at.y), b = row_of(at.x + 1u, at.y), c = row_of(at.x, at.y + 1u), d = row_of(at.x + 1u, at.y + 1u);
        holding |= ((a.z | b.z | c.z | d.z) & ~(a.y & b.y & c.y & d.y)) << (FIELD_BRICK * i);
        within |= a.x << (FIELD_BRICK * i);
    }
    if (mixed) {
        atomicOr(surface[own][lane / 4u], holding << (8u * (lane % 4u)));
        atomicOr(inside[own][lane / 4u], within << (8u * (lane % 4u)));
    }
    barrier();
    if (mixed && lane < 2u) records.at[record + FIELD_INSIDE + lane] = inside[own][lane];
    uvec2 bits = uvec2(surface[own][0], surface[own][1]);
    if (mixed && lane == 0u) {
        uint count = uint(bitCount(bits.x) + bitCount(bits.y)), first = atomicAdd(counters.at[COUNTERS + CELLS], count); // its numbers follow from the count
        // Without room for all there are none.
        if (first + count > build.cell_capacity) {
            atomicAdd(counters.at[COUNTERS + CELLS_LEFT_OUT], count);
            first = build.cell_capacity;
        } else {
            uint local = home % FIELD_NODES;
            atomicOr(table.at[FIELD_SLOT * slot + FIELD_SURFACE + (local >> 5)], 1u << (local & 31u));
            records.at[record + FIELD_FIRST_CELL] = first;
            records.at[record + FIELD_CELLS] = bits.x;
            records.at[record + FIELD_CELLS + 1u] = bits.y;
        }
        first_cell[own] = first;
    }
    barrier();
    if (!mixed || first_cell[own] == build.cell_capacity) return;
    uint cell = first_cell[own] + field_before(bits, 8u * lane);
    while (holding != 0u) write_cell(cell++, 8u * lane + field_next(holding));
}
