// The density field as bricks of nodes, where there is any (docs/methods.md, "Density field"). MARK enters the bricks that points reach
// in the directory, NUMBER numbers them, SCATTER adds each point's share to the nodes that it reaches, as whole numbers, whose sum
// does not hang on the order, and lists the balls in each brick; LINK finds each brick's neighbours, FINISH which cells hold the surface.
#version 460
// Compiled with one of: MARK, NUMBER, SCATTER, LINK, FINISH
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "groups.glsl"
#include "cells.glsl"
#include "field.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(push_constant) uniform PushBlock { FieldBuild build; };
#ifndef MARK
layout(set = 0, binding = 1, std430) buffer HeadBlock { FieldHead head; };
#endif
layout(set = 0, binding = 2, std430) buffer TableBlock { uint at[]; } table;
#if defined(MARK) || defined(NUMBER) || defined(SCATTER)
// Positions; w: their number density as a part of a filled body's, negative for balls, 0 where there is nothing.
layout(set = 0, binding = 3, std430) readonly buffer PointBlock { vec4 at[]; } points;
layout(set = 0, binding = 4, std430) buffer CounterBlock { uint at[]; } counters;
layout(constant_id = 0) const uint COUNTERS = 0; // slot of its first counter
const uint BRICKS = 0u, BRICKS_LEFT_OUT = 1u, BALLS_LEFT_OUT = 2u;
#endif
#if !defined(MARK)
layout(set = 0, binding = 5, std430) buffer RecordBlock { uint at[]; } records;
#endif
#if defined(SCATTER) || defined(FINISH)
layout(set = 0, binding = 6, std430) buffer NodeBlock { uint at[]; } nodes;
#endif

#ifdef NUMBER
layout(set = 0, binding = 7, std430) readonly buffer ExtentBlock { uint at[]; } extent;
layout(constant_id = 1) const bool ORIGIN_ON_DEVICE = false; // the liquid's own space begins where the extent pass has found
#endif

#if defined(MARK) || defined(NUMBER) || defined(SCATTER)
// Node at or before a point, and how far beyond it that lies, in spacings.
ivec3 node_of(vec3 x, out vec3 part) {
    return ivec3(cell_of(x.x, build.spacing, part.x), cell_of(x.y, build.spacing, part.y), cell_of(x.z, build.spacing, part.z));
}

// How far a point reaches, in spacings: a particle of the body has a kernel, another is a ball.
float reach_of(vec4 point) { return point.w < 0.0 ? build.ball : build.reach; }

// The bricks of the cells with a node that a point reaches: from the first on, so many more each way, two at most.
ivec3 bricks_of(vec4 point, out ivec3 node, out vec3 part, out uvec3 more) {
    node = node_of(point.xyz, part);
    float reach = reach_of(point);
    ivec3 first = field_brick(node + ivec3(floor(part - reach)));
    more = uvec3(field_brick(node + ivec3(ceil(part + reach)) - 1) - first);
    return first;
}
// One of 27 bricks, as a step from the first.
uvec3 step_of(uint k) { return uvec3(k / 9u, k / 3u % 3u, k % 3u); }

// Whether a brick's cells lie nearer to a point than its reach.
bool reaches(ivec3 brick, ivec3 node, vec3 part, float reach) {
    vec3 low = vec3((brick << FIELD_BRICK_BITS) - node) - part, across = max(max(low, -low - float(FIELD_BRICK)), 0.0);
    return dot(across, across) < reach * reach;
}
#endif

#ifndef MARK
ivec3 field_place(uint number) {
    uint at = FIELD_RECORD * number + FIELD_PLACE;
    return ivec3(records.at[at], records.at[at + 1u], records.at[at + 2u]);
}

// The number of a brick; 0 where there is none. Until the end no slot has flags, and all are looked at.
uint number_of(ivec3 brick, out uint slot) {
    uint hash = field_hash(brick), tag = field_tag(hash);
    slot = hash & (build.slots - 1u);
    for (uint i = 0u; i < FIELD_PROBES; ++i) {
        uint word = table.at[slot];
        if (word == 0u) return 0u;
        if (word >> FIELD_TAG == tag && field_place(field_number(word)) == brick) return field_number(word);
        slot = (slot + 1u) & (build.slots - 1u);
    }
    return 0u;
}
#endif

#if defined(MARK) || defined(NUMBER)
// Until bricks are numbered a slot names the point that entered its brick, and which of 27 from that point's first on it is.
ivec3 brick_named(uint name) {
    ivec3 node;
    vec3 part;
    uvec3 more;
    return bricks_of(points.at[(name - 1u) / 27u], node, part, more) + ivec3(step_of((name - 1u) % 27u));
}
#endif

#ifdef MARK
// Enters a brick, unless it is there.
void enter(ivec3 brick, uint name) {
    uint mask = build.slots - 1u, slot = field_hash(brick) & mask;
    for (uint i = 0u; i < FIELD_PROBES; ++i) {
        uint found = table.at[slot];
        if (found == 0u) found = atomicCompSwap(table.at[slot], 0u, name);
        if (found == 0u || brick_named(found) == brick) return;
        slot = (slot + 1u) & mask;
    }
    atomicAdd(counters.at[COUNTERS + BRICKS_LEFT_OUT], 1u);
}

void main() {
    uint i = invocation();
    if (i >= build.count || points.at[i].w == 0.0) return;
    vec4 point = points.at[i];
    ivec3 node;
    vec3 part;
    uvec3 more;
    ivec3 first = bricks_of(point, node, part, more);
    for (uint k = 0u; k < 27u; ++k) {
        uvec3 step = step_of(k);
        ivec3 brick = first + ivec3(step);
        if (all(lessThanEqual(step, more)) && reaches(brick, node, part, reach_of(point))) enter(brick, 27u * i + k + 1u);
    }
}
#endif

#ifdef NUMBER
void main() {
    uint slot = invocation();
    if (slot >= build.slots) return;
    if (slot == 0u) {
        vec3 origin = vec3(build.origin_x, build.origin_y, build.origin_z), part;
        if (ORIGIN_ON_DEVICE)
            origin = uintBitsToFloat(uvec3(extent.at[EXTENT_ORIGIN], extent.at[EXTENT_ORIGIN + 1], extent.at[EXTENT_ORIGIN + 2]));
        ivec3 node = node_of(origin, part);
        head.base_x = uint(node.x);
        head.base_y = uint(node.y);
        head.base_z = uint(node.z);
        head.part_x = part.x;
        head.part_y = part.y;
        head.part_z = part.z;
        head.groups_z = 1u;
    }
    uint name = table.at[slot];
    if (name == 0u) return;
    ivec3 brick = brick_named(name);
    uint tag = field_tag(field_hash(brick)) << FIELD_TAG, number = atomicAdd(head.bricks, 1u) + 1u;
    if (number >= build.capacity) {
        table.at[slot] = tag;
        atomicAdd(counters.at[COUNTERS + BRICKS_LEFT_OUT], 1u);
        return;
    }
    table.at[slot] = tag | number;
    uint record = number * FIELD_RECORD;
    records.at[record] = slot;
    for (int a = 0; a < 3; ++a) records.at[record + FIELD_PLACE + a] = uint(brick[a]);
    atomicAdd(counters.at[COUNTERS + BRICKS], 1u);
    // The rectangle of groups that are one a brick.
    atomicMax(head.groups_x, min(number, MOST_GROUPS));
    atomicMax(head.groups_y, (number - 1u) / MOST_GROUPS + 1u);
}
#endif

#ifdef SCATTER
layout(set = 0, binding = 8, std430) writeonly buffer BallBlock { vec4 at[]; } balls; // center, from its brick's first node on, in spacings; the next, from 1 on

// Enters a ball in the list of each brick that it reaches.
void list_ball(ivec3 first, uvec3 more, ivec3 node, vec3 part) {
    for (uint k = 0u; k < 27u; ++k) {
        uvec3 step = step_of(k);
        ivec3 brick = first + ivec3(step);
        if (any(greaterThan(step, more)) || !reaches(brick, node, part, build.ball)) continue;
        uint slot, number = number_of(brick, slot);
        if (number == 0u) continue;
        uint entry = atomicAdd(head.balls, 1u);
        if (entry >= build.ball_capacity) {
            atomicAdd(counters.at[COUNTERS + BALLS_LEFT_OUT], 1u);
            continue;
        }
        atomicOr(table.at[slot], uint(FIELD_BALLS) << FIELD_FLAGS);
        uint next = atomicExchange(records.at[number * FIELD_RECORD + FIELD_FIRST_BALL], entry + 1u);
        balls.at[entry] = vec4(vec3(node - (brick << FIELD_BRICK_BITS)) + part, uintBitsToFloat(next));
    }
}

void main() {
    uint i = invocation();
    if (i >= build.count || points.at[i].w == 0.0) return;
    vec4 point = points.at[i];
    ivec3 node;
    vec3 part;
    uvec3 more;
    ivec3 first = bricks_of(point, node, part, more);
    if (point.w < 0.0) {
        list_ball(first, more, node, part);
        return;
    }
    uint numbers[27];
    for (uint k = 0u; k < 27u; ++k) {
        uint slot;
        numbers[k] = all(lessThanEqual(step_of(k), more)) ? number_of(first + ivec3(step_of(k)), slot) : 0u;
    }
    float unit = build.unit / max(min(point.w, FIELD_DENSEST), FIELD_CROWD * point.w), per_reach = 1.0 / build.reach;
    // Nodes from the first that it can reach on, in spacings from the point, and among those of its bricks.
    ivec3 low = ivec3(floor(part - build.reach)) + 1, at = node + low - (first << FIELD_BRICK_BITS);
    vec3 offset = vec3(low) - part;
    const int across = int(ceil(2.0 * build.reach));
    for (int z = 0; z < across; ++z) {
        for (int y = 0; y < across; ++y) {
            vec2 yz = offset.yz + vec2(y, z);
            float row = dot(yz, yz);
            ivec2 row_at = at.yz + ivec2(y, z), row_brick = field_brick(ivec3(row_at, 0)).xy;
            if (row >= build.reach * build.reach) continue;
            for (int x = 0; x < across; ++x) {
                float dx = offset.x + float(x), q = sqrt(row + dx * dx) * per_reach, far = max(1.0 - q, 0.0), near = max(0.5 - q, 0.0);
                uint share = uint(unit * (2.0 * far * far * far - 8.0 * near * near * near) + 0.5);
                ivec3 own = ivec3(at.x + x, row_at);
                uint number = numbers[9 * field_brick(own).x + 3 * row_brick.x + row_brick.y];
                // Without a number there was no room for the brick.
                if (share > 0u && number > 0u) atomicAdd(nodes.at[FIELD_NODES * number + field_local(own)], share);
            }
        }
    }
}
#endif

#ifdef LINK
void main() {
    // One group a brick, of which seven have a neighbour each.
    uint number = group_index() + 1u, k = gl_LocalInvocationIndex;
    if (number > min(head.bricks, build.capacity - 1u) || k == 0u || k >= 8u) return;
    uint slot, next = number_of(field_place(number) + ivec3(k & 1u, (k >> 1) & 1u, k >> 2), slot);
    records.at[number * FIELD_RECORD + k] = next;
}
#endif

#ifdef FINISH
void main() {
    uint number = group_index() + 1u, k = gl_LocalInvocationIndex;
    if (number > min(head.bricks, build.capacity - 1u)) return;
    ivec3 cell = ivec3(k & 3u, (k >> FIELD_BRICK_BITS) & 3u, k >> (2 * FIELD_BRICK_BITS));
    uint inside = 0u, record = number * FIELD_RECORD;
    for (uint c = 0u; c < 8u; ++c) {
        ivec3 node = cell + ivec3(c & 1u, (c >> 1) & 1u, c >> 2), over = field_brick(node);
        uint step = uint(over.x | over.y << 1 | over.z << 2), own = step == 0u ? number : records.at[record + step];
        if (nodes.at[FIELD_NODES * own + field_local(node)] >= build.level) ++inside;
    }
    uint flags = 0u;
    if (inside > 0u) flags |= FIELD_INSIDE;
    if (inside > 0u && inside < 8u) {
        flags |= FIELD_SURFACE;
        atomicOr(records.at[record + FIELD_CELLS + (k >> 5)], 1u << (k & 31u));
    }
    if (flags != 0u) atomicOr(table.at[records.at[record]], flags << FIELD_FLAGS);
}
#endif
