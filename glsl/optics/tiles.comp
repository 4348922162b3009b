// The range of front depths, both classes together, in each tile of the view: where a ray outside the liquid need not
// look for a surface (search.glsl: find_entry). Layer 0 holds the smallest, layer 1 the largest; an empty tile is an
// empty range. Integer order equals float order for positive floats.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
#include "frame.glsl"
layout(local_size_x = FRONT_TILE, local_size_y = FRONT_TILE) in;
layout(set = 0, binding = 1) uniform texture2DArray body_depth;
layout(set = 0, binding = 2) uniform texture2DArray splash_depth;
layout(set = 0, binding = 3, r32f) uniform writeonly image2DArray front_tiles;
layout(constant_id = 0) const bool HAS_SPLASH = true;
layout(constant_id = 1) const bool HAS_BODY = true;
shared uint low;
shared uint high;

void add(float depth) {
    if (depth > 0.0) {
        atomicMin(low, floatBitsToUint(depth));
        atomicMax(high, floatBitsToUint(depth));
    }
}

void main() {
    if (gl_LocalInvocationIndex == 0u) {
        low = floatBitsToUint(1e30);
        high = 0u;
    }
    barrier();
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (all(lessThan(pixel, ivec2(frame.size)))) {
        if (HAS_BODY) add(texelFetch(body_depth, ivec3(pixel, SIDE_FRONT), 0).x);
        if (HAS_SPLASH) add(texelFetch(splash_depth, ivec3(pixel, SIDE_FRONT), 0).x);
    }
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        imageStore(front_tiles, ivec3(gl_WorkGroupID.xy, 0), vec4(uintBitsToFloat(low)));
        imageStore(front_tiles, ivec3(gl_WorkGroupID.xy, 1), vec4(uintBitsToFloat(high)));
    }
}
