// What rays meet at each pixel, and in each tile of the view, in one texel: pixels above, tiles below them. A pixel has the
// body's interval (depths of front and back) and the depths at which its ray enters and leaves the splash in front; what there is
// none of is an empty range. A tile has the largest front and the smallest back of its pixels, between which a ray inside the
// body stays inside; and the range of all that is in it, before and behind which a ray outside stays outside.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
layout(local_size_x = WALL_TILE, local_size_y = WALL_TILE) in;
layout(set = 0, binding = 1) uniform texture2DArray body_depth;
layout(set = 0, binding = 2) uniform texture2DArray splash_depth;
layout(set = 0, binding = 3, rgba32f) uniform writeonly image2D walls;
layout(constant_id = 0) const bool HAS_SPLASH = true;
layout(constant_id = 1) const bool HAS_BODY = true;
shared uint range[4];

// Front before back; a front around the near plane begins there, and any if `around` is 1. Where either is missing, nothing.
vec2 interval(float front, float back, float around) {
    if (front < 0.0 || around * front > 0.0) front = frame.near;
    return front > 0.0 && back > 0.0 ? vec2(min(front, back), max(front, back)) : vec2(FARTHEST, -FARTHEST);
}

// Integer order equals float order for positive floats.
void add(vec2 body, vec2 splash) {
    atomicMax(range[0], floatBitsToUint(body.x));
    atomicMin(range[1], floatBitsToUint(max(body.y, 0.0)));
    atomicMin(range[2], floatBitsToUint(min(body.x, splash.x)));
    atomicMax(range[3], floatBitsToUint(max(max(body.y, splash.y), 0.0)));
}

void main() {
    uint far = floatBitsToUint(FARTHEST);
    if (gl_LocalInvocationIndex == 0u) {
        range[0] = range[3] = 0u;
        range[1] = range[2] = far;
    }
    barrier();
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = ivec2(frame.size);
    if (all(lessThan(pixel, size))) {
        vec2 body = vec2(FARTHEST, -FARTHEST), splash = body;
        if (HAS_BODY)
            body = interval(texelFetch(body_depth, ivec3(pixel, SIDE_FRONT), 0).x, texelFetch(body_depth, ivec3(pixel, SIDE_BACK), 0).x, frame.eye_inside);
        if (HAS_SPLASH)
            splash = interval(texelFetch(splash_depth, ivec3(pixel, SIDE_FRONT), 0).x, texelFetch(splash_depth, ivec3(pixel, SIDE_BACK), 0).x, 0.0);
        imageStore(walls, pixel, vec4(body, splash));
        add(body, splash);
    }
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        vec4 tile = uintBitsToFloat(uvec4(range[0], range[1], range[2], range[3]));
        imageStore(walls, ivec2(gl_WorkGroupID.xy) + ivec2(0, size.y), tile);
    }
}
