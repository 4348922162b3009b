// Which rectangle of pixels a work group has. Drivers on CPUs give each thread a run of groups, and liquid lies low in a view:
// rows are dealt so that every run has some from everywhere, in eight combs of every eighth row.
ivec2 pixel_group() {
    uint rows = gl_NumWorkGroups.y, i = gl_WorkGroupID.y;
    uint teeth = rows / 8u, longer = rows % 8u; // so many combs have a tooth more
    uint in_longer = longer * (teeth + 1u);
    bool long_comb = i < in_longer;
    if (long_comb) ++teeth;
    else i -= in_longer;
    uint comb = i / teeth + (long_comb ? 0u : longer);
    return ivec2(gl_WorkGroupID.x, i % teeth * 8u + comb);
}

// The invocation's pixel where groups are squares of that edge.
ivec2 own_pixel(int edge) { return pixel_group() * edge + ivec2(gl_LocalInvocationID.xy); }
