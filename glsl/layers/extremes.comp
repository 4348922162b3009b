// What peeling left, as maps of sides: nearest front, farthest back.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared.glsl"
layout(local_size_x = IMAGE_GROUP, local_size_y = IMAGE_GROUP) in;
layout(set = 0, binding = 1) uniform texture2D peeled; // -front, back; -infinity and 0 where there is nothing
layout(set = 0, binding = 2, r32f) uniform writeonly image2DArray depth_out;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    int layer = int(gl_WorkGroupID.z);
    if (any(greaterThanEqual(pixel, imageSize(depth_out).xy))) return;
    vec2 found = texelFetch(peeled, pixel, 0).xy;
    bool nothing = found.y == 0.0;
    imageStore(depth_out, ivec3(pixel, layer), vec4(nothing ? 0.0 : layer == SIDE_FRONT ? -found.x : found.y));
}
