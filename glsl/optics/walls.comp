// What rays meet at each pixel, and in each tile of the view, in one texel: pixels above, tiles below them. A pixel has the
// body's interval (depths of front and back) and the depths at which its ray enters and leaves the splash in front; what there is
// none of is an empty range. A tile has the largest front and the smallest back of its pixels, between which a ray inside the
// body stays inside; and the range of all that is in it, before and behind which a ray outside stays outside.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
layout(local_size_x = WALL_TILE, local_size_y = WALL_TILE) in; // x: a column of a tile's pixels, y: which of the tiles in a row
layout(set = 0, binding = 1) uniform texture2DArray body_depth;
layout(set = 0, binding = 2) uniform texture2DArray splash_depth;
layout(set = 0, binding = 3, rgba32f) uniform writeonly image2D walls;
layout(constant_id = 0) const bool HAS_SPLASH = true;
layout(constant_id = 1) const bool HAS_BODY = true;
shared uint range[WALL_TILE][4];

// Front before back; a front around the near plane begins there, and any if `around` is 1. Where either is missing, nothing.
vec2 interval(float front, float back, float around) {
    if (front < 0.0 || around * front > 0.0) front = frame.near;
    return front > 0.0 && back > 0.0 ? vec2(min(front, back), max(front, back)) : vec2(FARTHEST, -FARTHEST);
}

void main() {
    int tile = int(gl_LocalInvocationID.y);
    bool first = gl_LocalInvocationID.x == 0u;
    if (first) {
        range[tile][0] = range[tile][3] = 0u;
        range[tile][1] = range[tile][2] = floatBitsToUint(FARTHEST);
    }
    barrier();
    ivec2 size = ivec2(frame.size), at = ivec2(gl_WorkGroupID.xy) * ivec2(WALL_TILE, 1) + ivec2(tile, 0);
    // Of a column: the largest front, the smallest back, and the range of all.
    vec4 column = vec4(0.0, FARTHEST, FARTHEST, 0.0);
    for (int row = 0; row < WALL_TILE; ++row) {
        ivec2 pixel = at * WALL_TILE + ivec2(gl_LocalInvocationID.x, row);
        if (any(greaterThanEqual(pixel, size))) continue;
        vec2 body = vec2(FARTHEST, -FARTHEST), splash = body;
        if (HAS_BODY)
            body = interval(texelFetch(body_depth, ivec3(pixel, SIDE_FRONT), 0).x, texelFetch(body_depth, ivec3(pixel, SIDE_BACK), 0).x, frame.eye_inside);
        if (HAS_SPLASH)
            splash = interval(texelFetch(splash_depth, ivec3(pixel, SIDE_FRONT), 0).x, texelFetch(splash_depth, ivec3(pixel, SIDE_BACK), 0).x, 0.0);
        imageStore(walls, pixel, vec4(body, splash));
        column.xw = max(column.xw, vec2(body.x, max(body.y, splash.y)));
        column.yz = min(column.yz, vec2(max(body.y, 0.0), min(body.x, splash.x)));
    }
    // Integer order equals float order for positive floats.
    atomicMax(range[tile][0], floatBitsToUint(column.x));
    atomicMin(range[tile][1], floatBitsToUint(column.y));
    atomicMin(range[tile][2], floatBitsToUint(column.z));
    atomicMax(range[tile][3], floatBitsToUint(column.w));
    barrier();
    if (first && at.x * WALL_TILE < size.x) {
        uvec4 found = uvec4(range[tile][0], range[tile][1], range[tile][2], range[tile][3]);
        imageStore(walls, at + ivec2(0, size.y), uintBitsToFloat(found));
    }
}
