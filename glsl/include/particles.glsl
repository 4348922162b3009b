// Particles as drawn, and which invocation has which. A particle is three arrays of three floats: 16-byte elements
// would outgrow a storage buffer's guaranteed range a third sooner.
layout(set = 0, binding = 1, std430) readonly buffer CenterBlock { float at[]; } centers;
layout(set = 0, binding = 2, std430) readonly buffer DiagonalBlock { float at[]; } diagonals; // xx < 0: a splash; 0: nothing to draw
layout(set = 0, binding = 3, std430) readonly buffer MixedBlock { float at[]; } mixed;

// Whether particle i is the one before it once more: crowds on one spot are drawn once.
bool repeats(uint i) {
    if (i == 0u) return false;
    bool same = true;
    for (uint k = 3u * i; k < 3u * i + 3u; ++k) {
        same = same && centers.at[k] == centers.at[k - 3u] && diagonals.at[k] == diagonals.at[k - 3u] && mixed.at[k] == mixed.at[k - 3u];
    }
    return same;
}

// Whether particle i is drawn at all, with its class.
bool particle(uint i, out Particle p, out int cls) {
    vec3 d = vec3(diagonals.at[3u * i], diagonals.at[3u * i + 1u], diagonals.at[3u * i + 2u]);
    cls = d.x < 0.0 ? CLASS_SPLASH : CLASS_BODY;
    p.center = vec4(centers.at[3u * i], centers.at[3u * i + 1u], centers.at[3u * i + 2u], 0.0);
    p.shape_diagonal = vec4(abs(d.x), d.yz, 0.0);
    p.shape_mixed = vec4(mixed.at[3u * i], mixed.at[3u * i + 1u], mixed.at[3u * i + 2u], 0.0);
    return d.x != 0.0;
}
