// Particles in the sorted order (sort.comp), and the runs of it that hold all of them in some cells. Whoever includes this has
// positions.glsl before it.
layout(set = 0, binding = 3, std430) readonly buffer OrderBlock { uint at[]; } order;
layout(set = 0, binding = 4, std430) readonly buffer SortedBlock { vec4 at[]; } sorted;

vec3 sorted_position(uint k) { return sorted.at[k].xyz; }
uint entry_at(uint rank) { // the sort's result
    uint passes = extent.at[EXTENT_PASSES];
    return passes == 0u ? rank : order.at[half_before(passes) + rank];
}

ivec3 cell_at(uint rank) {
    if (!RELATION_TABLE) return cell_of(sorted_position(rank));
    uint entry = entry_at(rank);
    return cell_of(sorted_position(entry / 27u)) + entry_offset(entry);
}

bool before(ivec3 a, ivec3 b) { return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z; }

// First rank, not before `low`, whose cell is not before c; with `inclusive`, whose cell is after c.
uint search(ivec3 c, bool inclusive, uint low) {
    uint high = entries();
    while (low < high) {
        uint middle = low + (high - low) / 2u;
        ivec3 m = cell_at(middle);
        if (before(m, c) || (inclusive && m == c)) low = middle + 1u;
        else high = middle;
    }
    return low;
}

// The same among keys of one word: first rank, not before `low`, whose key is not smaller than `key`. It is mostly near, so
// strides grow from there.
uint search_key(uint key, uint low) {
    uint keys = free_half(), count = particles(), reach = 8u;
    while (low + reach < count && order.at[keys + low + reach] < key) {
        low += reach;
        reach *= 4u;
    }
    uint high = min(low + reach, count);
    while (low < high) {
        uint middle = low + (high - low) / 2u;
        if (order.at[keys + middle] < key) low = middle + 1u;
        else high = middle;
    }
    return low;
}

// The run of ranks in the cells from `from` to `to`, which differ in z alone; it does not begin before `low`. Keys are there
// to look in only of particles, and only where a key is one word.
uvec2 run_of(ivec3 from, ivec3 to, uint low) {
    if (RELATION_TABLE || key_bits() > 32u) {
        uint begin = search(from, false, low);
        return uvec2(begin, search(to, true, begin));
    }
    ivec3 first = first_cell(), last = last_cell();
    from.z = max(from.z, first.z);
    to.z = min(to.z, last.z);
    if (any(lessThan(from.xy, first.xy)) || any(greaterThan(from.xy, last.xy)) || from.z > to.z) return uvec2(low, low);
    uint begin = search_key(sort_key(from).x, low), key = sort_key(to).x;
    // The last key of all has none after it.
    return uvec2(begin, key == 0xffffffffu ? particles() : search_key(key + 1u, begin));
}

// How many candidates of a run one of them stands for: 1 but in a crowd.
uint step_of(uvec2 run) {
    const uint most = RELATION_TABLE ? CROWD_RELATION : CROWD;
    return max((run.y - run.x + most - 1u) / most, 1u);
}
