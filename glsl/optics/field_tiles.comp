// Between which depths a view ray can meet the density field's surface or a ball, for each tile of the view: what cells that hold
// some of the surface, and balls, cover. A bound is bits of a float, whose order is that of integers: the smallest depth, and how far the largest lies
// before infinity.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "groups.glsl"
#include "field.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(push_constant) uniform PushBlock {
    uint capacity; // bricks that there is room for
    float spacing; // of the nodes, in particle radii
    float ball;    // radius of a ball, in spacings
} push;
#include "field_space.glsl"
layout(set = 0, binding = 2, std430) readonly buffer TableBlock { uvec4 at[]; } table;
uvec4 directory_texel(uint i) { return table.at[i]; }
#include "field_directory.glsl"
layout(set = 0, binding = 3, std430) readonly buffer RecordBlock { uint at[]; } records;
layout(set = 0, binding = 4, std430) buffer TileBlock { uvec2 at[]; } tiles;

layout(set = 0, binding = 5, std430) readonly buffer BallBlock { uvec2 at[]; } balls;

// Takes what lies in a box, by its corners in the field, into the bounds of the tiles that it covers.
void cover(vec3 low, vec3 high) {
    float nearest = FARTHEST, farthest = 0.0;
    vec2 first = vec2(FARTHEST), last = vec2(-FARTHEST);
    vec3 corner_0 = to_eye(low), edges = (high - low) * push.spacing;
    mat3 turned = mat3(frame.view);
    for (int c = 0; c < 8; ++c) {
        vec3 corner = corner_0;
        if ((c & 1) != 0) corner += edges.x * turned[0];
        if ((c & 2) != 0) corner += edges.y * turned[1];
        if ((c & 4) != 0) corner += edges.z * turned[2];
        nearest = min(nearest, -corner.z);
        farthest = max(farthest, -corner.z);
        vec2 pixel = project(corner);
        first = min(first, pixel);
        last = max(last, pixel);
    }
    // What crosses the near plane has no such bounds on the screen.
    bool crosses = nearest <= frame.near;
    if (farthest < frame.near || (!crosses && (any(lessThan(last + 0.5, vec2(0.0))) || any(greaterThan(first - 0.5, frame.size))))) return;
    ivec2 size = (ivec2(frame.size) + FIELD_TILE - 1) / FIELD_TILE;
    ivec2 from = crosses ? ivec2(0) : whole(floor(clamp(first - 0.5, vec2(0.0), frame.size))) / FIELD_TILE;
    ivec2 to = crosses ? size - 1 : min(whole(floor(clamp(last + 0.5, vec2(-1.0), frame.size))) / FIELD_TILE, size - 1);
    uvec2 bounds = uvec2(floatBitsToUint(max(nearest, frame.near)), INFINITE - floatBitsToUint(farthest));
    for (int y = from.y; y <= to.y; ++y)
        for (int x = from.x; x <= to.x; ++x) {
            int tile = y * size.x + x;
            if (bounds.x < tiles.at[tile].x) atomicMin(tiles.at[tile].x, bounds.x);
            if (bounds.y < tiles.at[tile].y) atomicMin(tiles.at[tile].y, bounds.y);
        }
}

void main() {
    // Of a brick's invocations each takes eight cells: few hold some of the surface.
    uint number = invocation() / FIELD_LANES + 1u, k = invocation() % FIELD_LANES;
    if (number > min(head.bricks, push.capacity - 1u)) return;
    uint record = FIELD_RECORD * number, home = records.at[record + FIELD_HOME] - 1u;
    if (home == 0xffffffffu) return; // a number that no block has got
    ivec3 ahead = field_place(home / FIELD_NODES) - base_block();
    vec3 brick = vec3(FIELD_BRICK * (FIELD_BRICK * ahead + field_from_local(home)));
    uint surface = records.at[record + FIELD_CELLS + k / 4u] >> (8u * (k % 4u)) & 0xffu;
    uint entry = k == 0u ? records.at[record + FIELD_FIRST_BALL] : 0u, left = FIELD_MOST_BALLS;
    // Cells, then balls: one place in the code for both.
    while (surface != 0u || (entry != 0u && left > 0u)) {
        vec3 low, high;
        if (surface != 0u) {
            low = brick + vec3(field_from_local(8u * k + field_next(surface)));
            high = low + 1.0;
        } else {
            uvec2 ball = balls.at[entry - 1u];
            vec3 center = brick + field_ball(ball.x);
            low = center - push.ball;
            high = center + push.ball;
            entry = ball.y;
            --left;
        }
        cover(low, high);
    }
}
