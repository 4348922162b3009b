// Exclusive prefix sums. `sums` holds rows of counts, one count for each block of items, and after the last row the total of
// each row. One group of PARTICLE_GROUP threads takes one row.
shared uint prefix_of[PARTICLE_GROUP];

// The sum of what the threads before this one pass in, and the total of all.
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
