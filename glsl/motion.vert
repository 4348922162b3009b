// A quad around each particle, as far as surface moves with it (motion.frag).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
layout(constant_id = 0) const bool VELOCITIES = false; // or where particles were
layout(constant_id = 1) const bool COUNTED = false;    // the device knows how many there are
layout(set = 0, binding = 1, std430) readonly buffer PositionBlock { float at[]; } positions;
layout(set = 0, binding = 2, std430) readonly buffer BeforeBlock { float at[]; } before;
layout(set = 0, binding = 4, std430) readonly buffer CountBlock { uint at[]; } device_count; // with COUNTED
layout(push_constant) uniform PushBlock { Moving moving; };
layout(location = 0) flat out vec3 center; // eye space, in particle radii
layout(location = 1) flat out vec3 moved;  // since the frame before

vec3 to_eye(vec4 world) { return vec3(dot(moving.eye_x, world), dot(moving.eye_y, world), dot(moving.eye_z, world)); }

// Where x/d of a ball begins and ends, for one that is before the eye.
vec2 extent(float x, float d) {
    float square = d * d - MOTION_REACH * MOTION_REACH;
    float root = MOTION_REACH * sqrt(max(x * x + square, 0.0));
    return vec2(x * d - root, x * d + root) / square;
}

void main() {
    uint i = gl_VertexIndex / 6u, k = gl_VertexIndex % 6u;
    uint p = (moving.first_words & 0xffu) + i * moving.word_stride, b = (moving.first_words >> 8 & 0xffu) + i * moving.before_stride;
    vec3 now = vec3(positions.at[p], positions.at[p + 1u], positions.at[p + 2u]);
    vec3 then = vec3(before.at[b], before.at[b + 1u], before.at[b + 2u]);
    center = to_eye(vec4(now, 1.0));
    moved = to_eye(vec4(VELOCITIES ? moving.seconds * then : now - then, 0.0));
    float d = -center.z;
    vec2 corner = vec2(k == 1u || k == 3u || k == 4u, k == 2u || k == 4u || k == 5u);
    vec2 x = extent(center.x, d), y = extent(center.y, d);
    vec2 a = frame.pixel_scale * vec2(x.x, y.x) + frame.pixel_origin, c = frame.pixel_scale * vec2(x.y, y.y) + frame.pixel_origin;
    // Around the eye it may be anywhere in the view; a pixel more each way, as vertices may snap.
    bool around = d <= 1.001 * MOTION_REACH;
    vec2 low = around ? vec2(0.0) : min(a, c) - 1.0, high = around ? frame.size : max(a, c) + 1.0;
    vec2 at = clamp(mix(low, high, corner), vec2(-1.0), frame.size + 1.0);
    // Not where there is none, or any of it is no number.
    bool there = (!COUNTED || i < device_count.at[moving.first_words >> 16]) && d > -MOTION_REACH && dot(center, center) < 1e30 && dot(moved, moved) < 1e30;
    gl_Position = there ? vec4(2.0 * at / frame.size - 1.0, 0.5, 1.0) : vec4(2.0, 2.0, 0.5, 1.0);
}
