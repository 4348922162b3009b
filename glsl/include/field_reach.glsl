// Which nodes and bricks of the density field a point reaches. Of the push constants `build` is a FieldBuild.

// Node at or before a point, and how far beyond it that lies, in spacings.
ivec3 node_of(vec3 x, out vec3 part) {
    return ivec3(cell_of(x.x, build.spacing, part.x), cell_of(x.y, build.spacing, part.y), cell_of(x.z, build.spacing, part.z));
}

// A point among the bricks. A particle in the field reaches as far as its kernel, another is a ball.
struct Reach {
    ivec3 node;  // at or before it
    vec3 part;   // how far beyond that it lies, in spacings
    float reach; // in spacings
    ivec3 first; // of the bricks of the cells with a node that it reaches
    ivec3 last;  // two further on at most
};
Reach reach_of(vec4 point) {
    Reach r;
    r.node = node_of(point.xyz, r.part);
    r.reach = point.w < 0.0 ? build.ball : build.reach;
    r.first = field_brick(r.node + ivec3(floor(r.part - r.reach)));
    r.last = field_brick(r.node + ivec3(ceil(r.part + r.reach)) - 1);
    return r;
}

// How far three bricks along an axis, from the first on, lie from the point, squared; beyond the last one infinitely far. It reaches those
// of which the sum over the axes is less than its reach, squared.
vec3 distances(Reach r, int axis) {
    vec3 low = float((r.first[axis] << FIELD_BRICK_BITS) - r.node[axis]) - r.part[axis] + float(FIELD_BRICK) * vec3(0.0, 1.0, 2.0);
    vec3 across = max(max(low, -low - float(FIELD_BRICK)), 0.0);
    return mix(across * across, vec3(1e30), greaterThan(ivec3(0, 1, 2), ivec3(r.last[axis] - r.first[axis])));
}

// What a particle in the field adds where its kernel is 1, in whole numbers of a node.
float unit_of(vec4 point) {
    float rim = max(FIELD_RIM - FIELD_THINNED * (FIELD_RIM - point.w), FIELD_THIN);
    return min(build.unit / max(min(min(point.w, rim), FIELD_DENSEST), FIELD_CROWD * point.w), FIELD_MOST_SHARE);
}
