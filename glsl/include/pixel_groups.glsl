// Which rectangle of pixels a work group has. Drivers on CPUs give each thread a run of groups, and liquid lies low in a view:
// rows are dealt so that every run has some from everywhere, in eight combs of every eighth row.
ivec2 pixel_group() {
    uint rows = gl_NumWorkGroups.y, i = gl_WorkGroupID.y;
    uint teeth = rows / 8u, longer = rows % 8u; // so many combs have a tooth more
    uint in_longer = longer * (teeth + 1u);
    bool long_comb = i < in_longer;
    if (long_comb) ++teeth;
    else i -= in_longer;
    // Whole numbers divide lane by lane on CPUs; so small ones are exact as floats.
    uint before = uint(whole(floor((float(int(i)) + 0.5) / float(int(teeth)))));
    return ivec2(gl_WorkGroupID.x, (i - before * teeth) * 8u + before + (long_comb ? 0u : longer));
}

// The invocation's pixel where groups are squares of that edge.
ivec2 own_pixel(int edge) { return pixel_group() * edge + ivec2(gl_LocalInvocationID.xy); }
