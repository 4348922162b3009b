// What a particle adds to a node in each of four slices, by blending (Iwasaki06; docs/methods.md, "A dense grid").
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
layout(push_constant) uniform PushBlock { FieldBuild build; };
layout(location = 0) flat in ivec3 node;
layout(location = 1) flat in vec3 part;
layout(location = 2) flat in float unit;
layout(location = 0) out vec4 out_shares;

void main() {
    vec2 across = vec2(ivec2(gl_FragCoord.xy) - node.xy) - part.xy;
    vec4 along = vec4(0.0, 1.0, 2.0, 3.0) - float(node.z) - part.z;
    vec4 within = max(1.0 - (dot(across, across) + along * along) / (build.reach * build.reach), 0.0);
    out_shares = unit * within * within;
}
