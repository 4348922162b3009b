// Whether the eye is inside the body: the liquid's number density there (docs/methods.md, "Preparation"), as a part of a filled
// body's, from the particles in the sorted order. One group.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
#include "positions.glsl"
#include "runs.glsl"
#include "spline.glsl"
layout(set = 0, binding = 0, std430) buffer FrameBlock { Frame frame; };

// Sorted cells are as wide as the support: 3 x 3 runs of 3 cells hold all particles within it. One run of the relation table does.
const uint RUNS = RELATION_TABLE ? 1u : 9u;
shared uvec2 runs[9];
shared float sums[PARTICLE_GROUP];

SPLINE(float)

void main() {
    uint t = gl_LocalInvocationIndex;
    vec3 origin = uintBitsToFloat(uvec3(extent.at[EXTENT_ORIGIN], extent.at[EXTENT_ORIGIN + 1], extent.at[EXTENT_ORIGIN + 2]));
    vec3 eye = origin - prepare.radius * (transpose(mat3(frame.view)) * frame.view[3].xyz);
    ivec3 cell = cell_of(eye);
    if (t < RUNS) {
        if (RELATION_TABLE) runs[t] = run_of(cell, cell, 0u);
        else runs[t] = run_of(cell + ivec3(t / 3u, t % 3u, 0) - 1, cell + ivec3(t / 3u, t % 3u, 2) - 1, 0u);
    }
    barrier();
    float sum = 0.0;
    for (uint r = 0u; r < RUNS; ++r) {
        uvec2 run = runs[r];
        uint step = step_of(run);
        for (uint j = run.x + t * step; j < run.y; j += PARTICLE_GROUP * step) {
            vec3 offset = sorted_position(RELATION_TABLE ? entry_at(j) / 27u : j) - eye;
            float squared = dot(offset, offset);
            if (squared < prepare.support * prepare.support) sum += float(min(step, run.y - j)) * spline(sqrt(squared) / prepare.support);
        }
    }
    sums[t] = sum;
    barrier();
    if (t > 0u) return;
    // Always in the same order, so that the same frame has the same bits.
    float density = 0.0;
    for (uint k = 0u; k < PARTICLE_GROUP; ++k) density += sums[k];
    frame.eye_inside = density >= EYE_INSIDE * prepare.filled_density ? 1.0 : 0.0;
}
