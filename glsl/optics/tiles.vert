// The tiles of the view in which there may be liquid, or with EMPTY those in which there is none: a point each, or a quad (QUADS).
#version 460
// Compiled with any of: QUADS
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "bounds.glsl"
// For each tile the smallest depth of what may be in it, as bits of a float, and what else is known; the same of the whole view
// follows after the last.
layout(set = 0, binding = 11, std430) readonly buffer BoundBlock { uint at[]; } bounds;
layout(constant_id = 7) const bool EMPTY = false;
layout(constant_id = 8) const uint WORDS = 1; // of a tile's bounds
layout(constant_id = 9) const uint EDGE = 8;  // of a tile, in pixels

void main() {
    int edge = int(EDGE);
#ifdef QUADS
    int tile = gl_VertexIndex / 6, k = gl_VertexIndex % 6;
    vec2 corner = vec2(k == 1 || k == 3 || k == 4, k == 2 || k == 4 || k == 5);
#else
    int tile = gl_VertexIndex;
    gl_PointSize = float(EDGE);
    vec2 corner = vec2(0.5);
#endif
    ivec2 size = (ivec2(frame.size) + edge - 1) / edge;
    uint nearest = min(bounds.at[WORDS * uint(tile)], bounds.at[WORDS * uint(size.x * size.y)]);
    // Where the eye is inside a ray may start inside without a front.
    bool empty = all(bvec2(nearest == INFINITE, frame.eye_inside == 0.0));
    vec2 at = (vec2(tile % size.x, tile / size.x) + corner) * float(EDGE);
#ifndef QUADS
    // A point whose middle is beside the view is not drawn.
    at = min(at, frame.size - 0.5);
#endif
    gl_Position = empty == EMPTY ? vec4(2.0 * at / frame.size - 1.0, 0.5, 1.0) : vec4(2.0, 2.0, 0.5, 1.0);
}
