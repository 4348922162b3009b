// The tiles of the view in which there may be liquid, or with EMPTY those in which there is none: a point each, or a quad (QUADS).
#version 460
// Compiled with any of: QUADS
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
layout(set = 0, binding = 11, std430) readonly buffer BoundBlock { uvec2 at[]; } bounds; // field_tiles.comp
layout(constant_id = 5) const bool EMPTY = false;

void main() {
#ifdef QUADS
    int tile = gl_VertexIndex / 6, k = gl_VertexIndex % 6;
    vec2 corner = vec2(k == 1 || k == 3 || k == 4, k == 2 || k == 4 || k == 5);
#else
    int tile = gl_VertexIndex;
    gl_PointSize = float(FIELD_TILE);
    vec2 corner = vec2(0.5);
#endif
    int across = (int(frame.size.x) + FIELD_TILE - 1) / FIELD_TILE;
    bool empty = bounds.at[tile].x == 0x7f800000u;
    vec2 at = (vec2(tile % across, tile / across) + corner) * float(FIELD_TILE);
#ifndef QUADS
    // A point whose middle is beside the view is not drawn.
    at = min(at, frame.size - 0.5);
#endif
    gl_Position = empty == EMPTY ? vec4(2.0 * at / frame.size - 1.0, 0.5, 1.0) : vec4(2.0, 2.0, 0.5, 1.0);
}
