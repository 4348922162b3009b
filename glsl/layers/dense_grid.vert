// The body's particles as sprites of a dense grid, once for each four slices that they reach: a point, or a quad of two triangles
// where points are too small (QUADS). Four slices are a tile of the image.
#version 460
// Compiled with any of: QUADS
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "cells.glsl"
#include "field.glsl"
layout(push_constant) uniform PushBlock { FieldBuild build; };
layout(set = 0, binding = 1, std430) readonly buffer BoxBlock { int at[]; } box;
layout(set = 0, binding = 2, std430) readonly buffer PointBlock { vec4 at[]; } points;
#include "field_reach.glsl"
layout(constant_id = 1) const int BRICKS_X = 1; // of the grid, along each axis
layout(constant_id = 2) const int BRICKS_Y = 1;
layout(constant_id = 3) const int BRICKS_Z = 1;
layout(constant_id = 4) const int COLUMNS = 1;  // tiles beside each other in the image
layout(constant_id = 5) const int ROWS = 1;     // and above each other
layout(constant_id = 6) const int SPRITES = 3;  // of a particle: tiles that a kernel can reach
layout(location = 0) flat out ivec3 node; // at or before the particle: its texel, and its slice from the tile's first on
layout(location = 1) flat out vec3 part;  // how far beyond that it lies, in spacings
layout(location = 2) flat out float unit;

// Vertices may snap to sixteenths of a texel.
const float SNAP = 0.125;

void main() {
#ifdef QUADS
    int sprite = gl_VertexIndex / 6, corner = gl_VertexIndex % 6;
#else
    int sprite = gl_VertexIndex;
    gl_PointSize = 1.0;
#endif
    vec4 point = points.at[sprite / SPRITES];
    Reach r = reach_of(point);
    ivec3 first = ivec3(box.at[0], box.at[1], box.at[2]), bricks = ivec3(BRICKS_X, BRICKS_Y, BRICKS_Z);
    // The bricks of the nodes that it reaches on z: its tiles.
    int z = field_brick(r.node + ivec3(floor(r.part - r.reach)) + 1).z + sprite % SPRITES;
    bool inside = point.w > 0.0 && all(lessThan(r.last - first, bricks)) && z <= r.last.z;
    z -= first.z;
    ivec2 tile = ivec2(z % COLUMNS, z / COLUMNS) * bricks.xy;
    node = ivec3(FIELD_BRICK * (tile - first.xy) + r.node.xy, r.node.z - FIELD_BRICK * (z + first.z));
    part = r.part;
    unit = unit_of(point);
    vec2 center = vec2(node.xy) + part.xy + 0.5;
#ifdef QUADS
    center += (r.reach + SNAP) * vec2(corner == 1 || corner == 2 || corner == 4 ? 1.0 : -1.0, corner == 2 || corner >= 4 ? 1.0 : -1.0);
#else
    gl_PointSize = 2.0 * (r.reach + SNAP);
#endif
    // What is not inside lies beyond the view.
    vec2 size = vec2(FIELD_BRICK * bricks.xy * ivec2(COLUMNS, ROWS));
    gl_Position = vec4(inside ? center * 2.0 / size - 1.0 : vec2(2.0), 0.5, 1.0);
}
