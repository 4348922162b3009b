// Exclusive prefix sums of the counts that blocks of items left in `sums`: rows of `length` counts, one row a group of
// PARTICLE_GROUP; the rows' totals follow the last row.
shared uint prefix_of[PARTICLE_GROUP];

// Each thread's exclusive prefix of what the group's threads pass in.
uint group_prefix(uint value, out uint total) {
    uint t = gl_LocalInvocationIndex;
    prefix_of[t] = value;
    barrier();
    for (uint reach = 1u; reach < PARTICLE_GROUP; reach *= 2u) {
        uint below = t >= reach ? prefix_of[t - reach] : 0u;
        barrier();
        prefix_of[t] += below;
        barrier();
    }
    total = prefix_of[PARTICLE_GROUP - 1];
    return prefix_of[t] - value;
}

void scan_row(uint row, uint length, uint rows) {
    uint chunk = (length + PARTICLE_GROUP - 1u) / PARTICLE_GROUP; // counts a thread
    uint from = row * length + min(gl_LocalInvocationIndex * chunk, length);
    uint to = row * length + min((gl_LocalInvocationIndex + 1u) * chunk, length);
    uint sum = 0u, total;
    for (uint i = from; i < to; ++i) sum += sums.at[i];
    sum = group_prefix(sum, total);
    for (uint i = from; i < to; ++i) {
        uint count = sums.at[i];
        sums.at[i] = sum;
        sum += count;
    }
    if (gl_LocalInvocationIndex == 0u) sums.at[rows * length + row] = total;
}
