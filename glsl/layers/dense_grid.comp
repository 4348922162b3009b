// The density field on a dense grid (docs/methods.md, "A dense grid"): CORNER finds the box of bricks that the particles in the field
// reach, whose first corner is the grid's; dense_grid.vert and dense_grid.frag add up the shares; GATHER takes the sums to the
// sparse bricks, as whole numbers.
#version 460
// Compiled with one of: CORNER, GATHER
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "groups.glsl"
#include "field.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(push_constant) uniform PushBlock { FieldBuild build; };
// The first brick on each axis, and the negative of the last.
layout(set = 0, binding = 1, std430) buffer BoxBlock { int at[]; } box;

#ifdef CORNER
layout(set = 0, binding = 2, std430) readonly buffer PointBlock { vec4 at[]; } points;
#include "cells.glsl"
#include "field_reach.glsl"
shared int least[6];

void main() {
    uint i = invocation(), k = gl_LocalInvocationIndex;
    if (k < 6u) least[k] = DENSE_GRID_EMPTY;
    barrier();
    vec4 point = points.at[min(i, build.count - 1u)];
    if (i < build.count && point.w > 0.0) {
        Reach r = reach_of(point);
        for (int axis = 0; axis < 3; ++axis) {
            atomicMin(least[axis], r.first[axis]);
            atomicMin(least[3 + axis], -r.last[axis]);
        }
    }
    barrier();
    if (k < 6u && least[k] != DENSE_GRID_EMPTY) atomicMin(box.at[k], least[k]);
}
#endif

#ifdef GATHER
layout(set = 0, binding = 2, std430) readonly buffer HeadBlock { FieldHead head; };
layout(set = 0, binding = 3, std430) readonly buffer TableBlock { uint at[]; } table;
layout(set = 0, binding = 4, std430) buffer CounterBlock { uint at[]; } counters;
layout(set = 0, binding = 5, std430) readonly buffer RecordBlock { uint at[]; } records;
layout(set = 0, binding = 6, std430) writeonly buffer NodeBlock { uint at[]; } nodes;
layout(set = 0, binding = 7) uniform texture2D grid;
layout(constant_id = 0) const uint COUNTERS = 0; // slot of its first counter
layout(constant_id = 1) const int BRICKS_X = 1;  // of the grid, along each axis
layout(constant_id = 2) const int BRICKS_Y = 1;
layout(constant_id = 3) const int BRICKS_Z = 1;
layout(constant_id = 4) const int COLUMNS = 1; // tiles beside each other in the image

uvec4 whole(vec4 sums) { return uvec4(min(sums, 65535.0) + 0.5); }

// One invocation for each two nodes beside each other on x, in each of a brick's four slices.
void main() {
    uint i = invocation(), number = i / 8u + 1u, k = i % 8u;
    ivec3 first = ivec3(box.at[0], box.at[1], box.at[2]), bricks = ivec3(BRICKS_X, BRICKS_Y, BRICKS_Z);
    if (i < 3u && first[i] != DENSE_GRID_EMPTY)
        atomicAdd(counters.at[COUNTERS + i], uint(max(1 - box.at[3u + i] - first[i] - bricks[i], 0)) * FIELD_BRICK);
    if (number > min(head.bricks, build.capacity - 1u)) return;
    uint home = records.at[FIELD_RECORD * number + FIELD_HOME] - 1u, place = FIELD_SLOT * (home / FIELD_NODES) + FIELD_PLACE;
    if (home == 0xffffffffu) return; // a number that no block has got
    ivec3 block = ivec3(table.at[place], table.at[place + 1u], table.at[place + 2u]);
    ivec3 own = (block << FIELD_BRICK_BITS) + field_from_local(home) - first;
    if (any(lessThan(own, ivec3(0))) || any(greaterThanEqual(own, bricks))) return;
    ivec2 tile = ivec2(own.z % COLUMNS, own.z / COLUMNS) * bricks.xy;
    ivec2 texel = FIELD_BRICK * (tile + own.xy) + ivec2(2u * (k & 1u), k >> 1);
    uvec4 even = whole(texelFetch(grid, texel, 0)), odd = whole(texelFetch(grid, texel + ivec2(1, 0), 0));
    for (uint z = 0u; z < FIELD_BRICK; ++z) nodes.at[FIELD_NODE_WORDS * number + 8u * z + k] = even[z] | odd[z] << 16;
}
#endif
