// Between which depths a view ray can meet the density field's surface or a ball, for each tile of the view: what bricks that hold
// some of either cover. A bound is bits of a float, whose order is that of integers: the smallest depth, and how far the largest lies
// before infinity.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "groups.glsl"
#include "field.glsl"
layout(local_size_x = PARTICLE_GROUP) in; // one group a brick
layout(push_constant) uniform PushBlock {
    uint capacity; // bricks that there is room for
    float spacing; // of the nodes, in particle radii
} push;
#include "field_space.glsl"
layout(set = 0, binding = 2, std430) readonly buffer TableBlock { uint at[]; } table;
layout(set = 0, binding = 3, std430) readonly buffer RecordBlock { uint at[]; } records;
layout(set = 0, binding = 4, std430) buffer TileBlock { uvec2 at[]; } tiles;

void main() {
    uint number = group_index() + 1u, record = FIELD_RECORD * number;
    if (number > min(head.bricks, push.capacity - 1u)) return;
    if (!field_has(table.at[records.at[record]], FIELD_SURFACE | FIELD_BALLS)) return;
    uint place = record + FIELD_PLACE;
    vec3 low = vec3((ivec3(records.at[place], records.at[place + 1u], records.at[place + 2u]) << FIELD_BRICK_BITS) - base_node());
    float nearest = FARTHEST, farthest = 0.0;
    vec2 first = vec2(FARTHEST), last = vec2(-FARTHEST);
    for (int k = 0; k < 8; ++k) {
        vec3 corner = to_eye(low + float(FIELD_BRICK) * vec3(k & 1, (k >> 1) & 1, k >> 2));
        nearest = min(nearest, -corner.z);
        farthest = max(farthest, -corner.z);
        vec2 pixel = project(corner);
        first = min(first, pixel);
        last = max(last, pixel);
    }
    if (farthest < frame.near) return;
    // What crosses the near plane has no such bounds on the screen.
    bool crosses = nearest <= frame.near;
    ivec2 size = (ivec2(frame.size) + FIELD_TILE - 1) / FIELD_TILE;
    ivec2 from = crosses ? ivec2(0) : ivec2(floor(clamp(first - 0.5, vec2(0.0), frame.size))) / FIELD_TILE;
    ivec2 to = crosses ? size - 1 : min(ivec2(floor(clamp(last + 0.5, vec2(-1.0), frame.size))) / FIELD_TILE, size - 1);
    if (!crosses && (any(lessThan(last + 0.5, vec2(0.0))) || any(greaterThan(first - 0.5, frame.size)))) return;
    uvec2 bounds = uvec2(floatBitsToUint(max(nearest, frame.near)), INFINITE - floatBitsToUint(farthest));
    int across = to.x - from.x + 1, all = across * (to.y - from.y + 1);
    for (int k = int(gl_LocalInvocationIndex); k < all; k += PARTICLE_GROUP) {
        uint tile = uint((from.y + k / across) * size.x + from.x + k % across);
        if (bounds.x < tiles.at[tile].x) atomicMin(tiles.at[tile].x, bounds.x);
        if (bounds.y < tiles.at[tile].y) atomicMin(tiles.at[tile].y, bounds.y);
    }
}
