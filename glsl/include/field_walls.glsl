// Walls of the density field and of balls along a ray (docs/methods.md, "Walls in a field"). Lengths here are spacings of the
// field's nodes, as in field_space.glsl.
layout(set = 0, binding = 2, std430) readonly buffer TableBlock { uint at[]; } table;
layout(set = 0, binding = 3, std430) readonly buffer RecordBlock { uint at[]; } records;
layout(set = 0, binding = 4, std430) readonly buffer NodeBlock { uint at[]; } nodes;
layout(set = 0, binding = 5, std430) readonly buffer BallBlock { vec4 at[]; } balls;

const float NONE = 1e30; // t of what is not met

// The word of a brick's slot; 0 where there is none.
uint word_of(ivec3 brick) {
    uint hash = field_hash(brick), tag = field_tag(hash), slot = hash & (push.slots - 1u), word = 0u;
    bool there = false;
    for (uint i = 0u; i < FIELD_PROBES && !there; ++i) {
        word = table.at[slot];
        there = word == 0u;
        if (word >> FIELD_TAG == tag) {
            uint at = FIELD_RECORD * field_number(word) + FIELD_PLACE;
            there = ivec3(records.at[at], records.at[at + 1u], records.at[at + 2u]) == brick;
        }
        slot = (slot + 1u) & (push.slots - 1u);
    }
    return there ? word : 0u;
}

// What the field holds at a node of a brick or one further on along each axis, less the level.
float corner(uint number, ivec3 local) {
    ivec3 over = local >> FIELD_BRICK_BITS;
    uint step = uint(over.x | over.y << 1 | over.z << 2);
    if (step != 0u) number = records.at[FIELD_RECORD * number + step];
    return float(nodes.at[FIELD_NODES * number + field_local(local)]) - push.level;
}

// The corners of a cell: those with the smaller z, then those with the larger.
struct Cell { vec4 low; vec4 high; };
Cell cell_at(uint number, ivec3 local) {
    return Cell(vec4(corner(number, local), corner(number, local + ivec3(1, 0, 0)), corner(number, local + ivec3(0, 1, 0)), corner(number, local + ivec3(1, 1, 0))),
                vec4(corner(number, local + ivec3(0, 0, 1)), corner(number, local + ivec3(1, 0, 1)), corner(number, local + ivec3(0, 1, 1)), corner(number, local + ivec3(1))));
}

float trilinear(Cell c, vec3 f) {
    vec4 z = mix(c.low, c.high, f.z);
    vec2 y = mix(z.xy, z.zw, f.y);
    return mix(y.x, y.y, f.x);
}

// The field less its level at a place.
float field_at(vec3 x) {
    vec3 corner = floor(x);
    ivec3 node = base_node() + ivec3(corner);
    uint word = word_of(field_brick(node));
    return word == 0u ? -push.level : trilinear(cell_at(field_number(word), node & (FIELD_BRICK - 1)), x - corner);
}

// Some 4 x 4 x 4 nodes: the first one's place in its brick, and the numbers of that brick and of those next to it.
struct Nodes {
    ivec3 first;
    uint numbers[8];
};
float node_at(Nodes n, int x, int y, int z) {
    ivec3 node = n.first + ivec3(x, y, z), over = field_brick(node);
    return float(nodes.at[FIELD_NODES * n.numbers[over.x | over.y << 1 | over.z << 2] + field_local(node)]);
}

// The field's gradient at a place: central differences at the corners of its cell, interpolated as the field is.
vec3 gradient_at(vec3 x) {
    vec3 corner = floor(x), f = x - corner, e = 1.0 - f;
    ivec3 first = base_node() + ivec3(corner) - 1, brick = field_brick(first);
    Nodes n;
    n.first = first & (FIELD_BRICK - 1);
    // One by one where the first one's brick is not there.
    n.numbers[0] = field_number(word_of(brick));
    for (int k = 1; k < 8; ++k) n.numbers[k] = records.at[FIELD_RECORD * n.numbers[0] + k];
    for (int k = 1; k < 8 && n.numbers[0] == 0u; ++k) n.numbers[k] = field_number(word_of(brick + ivec3(k & 1, (k >> 1) & 1, k >> 2)));
    vec3 gradient = vec3(0.0);
    // Along x through the cell's corners.
    for (int k = 0; k < 4; ++k) {
        bool up_y = (k & 1) == 1, up_z = k > 1;
        int y = up_y ? 2 : 1, z = up_z ? 2 : 1;
        vec4 v = vec4(node_at(n, 0, y, z), node_at(n, 1, y, z), node_at(n, 2, y, z), node_at(n, 3, y, z));
        float weight_y = up_y ? f.y : e.y, weight_z = up_z ? f.z : e.z, middle = e.x * v.y + f.x * v.z;
        gradient.x += weight_y * weight_z * (e.x * (v.z - v.x) + f.x * (v.w - v.y));
        gradient.y += (up_y ? e.y : -f.y) * weight_z * middle;
        gradient.z += weight_y * (up_z ? e.z : -f.z) * middle;
    }
    // And before and behind it along y, then along z.
    for (int k = 0; k < 4; ++k) {
        bool behind = (k & 1) == 1, up = k > 1;
        int outer = behind ? 3 : 0, inner = up ? 2 : 1;
        float along_y = e.x * node_at(n, 1, outer, inner) + f.x * node_at(n, 2, outer, inner);
        float along_z = e.x * node_at(n, 1, inner, outer) + f.x * node_at(n, 2, inner, outer);
        gradient.y += (behind ? f.y : -e.y) * (up ? f.z : e.z) * along_y;
        gradient.z += (behind ? f.z : -e.z) * (up ? f.y : e.y) * along_z;
    }
    return gradient;
}

// A wall that a ray meets.
struct Wall {
    float t;
    int cls;     // of the volume whose wall it is
    vec3 center; // of a ball
};

// Where a ray enters and leaves a ball; false where it passes by.
bool meets_ball(vec3 center, vec3 x, vec3 dir, out vec2 t) {
    vec3 q = x - center;
    float middle = -dot(q, dir);
    vec3 across = q + middle * dir;
    float square = push.ball * push.ball - dot(across, across), half_chord = sqrt(max(square, 0.0));
    t = middle + vec2(-half_chord, half_chord);
    return square > 0.0;
}

// The ball around a place, if there is one; on its sphere does not count.
bool ball_around(vec3 x, out vec3 center) {
    ivec3 brick = field_brick(base_node() + ivec3(floor(x)));
    uint word = word_of(brick), entry = 0u;
    if (field_has(word, FIELD_BALLS)) entry = records.at[FIELD_RECORD * field_number(word) + FIELD_FIRST_BALL];
    vec3 corner = vec3((brick << FIELD_BRICK_BITS) - base_node());
    bool found = false;
    for (uint i = 0u; i < FIELD_MOST_BALLS && entry != 0u && !found; ++i) {
        vec4 ball = balls.at[entry - 1u];
        center = corner + ball.xyz;
        vec3 q = x - center;
        found = dot(q, q) < push.ball * push.ball * (1.0 - BALL_ROUNDING);
        entry = floatBitsToUint(ball.w);
    }
    return found;
}

// The first root in a cell, as a part of the ray's way through it, at which h, `side` times the field less its level, falls through
// zero; from a place where it is not above zero, after it has been. Along the way the field is a cubic, known by four values.
bool falls(vec4 h, inout bool own, out float root) {
    float c0 = h.x, c1 = 0.5 * (-11.0 * h.x + 18.0 * h.y - 9.0 * h.z + 2.0 * h.w),
          c2 = 4.5 * (2.0 * h.x - 5.0 * h.y + 4.0 * h.z - h.w), c3 = 4.5 * (-h.x + 3.0 * h.y - 3.0 * h.z + h.w);
    // Between its extrema a cubic is monotone.
    float b = c2, disc = b * b - 3.0 * c3 * c1, q = -(b + (b < 0.0 ? -1.0 : 1.0) * sqrt(max(disc, 0.0)));
    vec2 extrema = vec2(abs(c3) > 1e-20 ? q / (3.0 * c3) : 1.0, abs(q) > 1e-20 ? c1 / q : 1.0);
    extrema = clamp(disc > 0.0 ? extrema : vec2(1.0), 0.0, 1.0);
    float ends[3] = float[](min(extrema.x, extrema.y), max(extrema.x, extrema.y), 1.0);
    float from = 0.0, to = 0.0;
    own = own || h.x > 0.0;
    bool found = own && h.x < 0.0;
    for (int i = 0; i < 3 && !found; ++i) {
        from = to;
        to = ends[i];
        float value = i == 2 ? h.w : c0 + to * (c1 + to * (c2 + to * c3));
        found = own && value < 0.0;
        own = own || value > 0.0;
    }
    for (int i = 0; i < FIELD_HALVINGS && found; ++i) {
        float middle = 0.5 * (from + to);
        if (c0 + middle * (c1 + middle * (c2 + middle * c3)) < 0.0) to = middle;
        else from = middle;
    }
    root = 0.5 * (from + to);
    return found;
}

// The nearest ball of a brick that a ray from outside meets before `wall`.
void meet_balls(uint entry, vec3 corner, vec3 x, vec3 dir, inout Wall wall) {
    for (uint i = 0u; i < FIELD_MOST_BALLS && entry != 0u; ++i) {
        vec4 ball = balls.at[entry - 1u];
        vec3 center = corner + ball.xyz;
        vec2 t;
        if (meets_ball(center, x, dir, t) && t.x > BALL_START && t.x < wall.t) wall = Wall(t.x, CLASS_SPLASH, center);
        entry = floatBitsToUint(ball.w);
    }
}

// The first wall that a ray meets from x on, from t to `reach`: of the field from within it, or from outside of all liquid of whichever
// comes first. Without one its t is NONE, and `stopped` says whether steps ran out. Loops within loops, and no branches with
// fetches: drivers on CPUs may run branches for all invocations that go together, but loops only while one goes on.
Wall find_wall(vec3 x, vec3 dir, bool inside, float t, float reach, out bool stopped) {
    Wall wall = Wall(NONE, CLASS_BODY, vec3(0.0));
    float side = inside ? 1.0 : -1.0;
    vec3 per_dir = 1.0 / mix(dir, vec3(1e-20), lessThan(abs(dir), vec3(1e-20)));
    ivec3 ahead = ivec3(greaterThan(per_dir, vec3(0.0))), base = base_node(), cell = base + ivec3(floor(x + t * dir));
    bool own = false, first = true, met = false;
    uint steps = 0u;
    while (!met && t < min(reach, wall.t) && steps < FIELD_STEPS) {
        // On to a cell that holds the surface, brick by brick, and in those that hold some of it cell by cell.
        bool at_surface = false;
        uint number = 0u;
        vec3 border;
        while (!at_surface && t < min(reach, wall.t) && steps < FIELD_STEPS) {
            ++steps;
            ivec3 brick = field_brick(cell), corner = brick << FIELD_BRICK_BITS;
            uint word = word_of(brick);
            number = field_number(word);
            uint record = FIELD_RECORD * number;
            bool surface = field_has(word, FIELD_SURFACE);
            uvec2 cells = uvec2(0u);
            if (surface) cells = uvec2(records.at[record + FIELD_CELLS], records.at[record + FIELD_CELLS + 1u]);
            uint ball = 0u;
            if (!inside && field_has(word, FIELD_BALLS)) ball = records.at[record + FIELD_FIRST_BALL];
            meet_balls(ball, vec3(corner - base), x, dir, wall);
            int edge = surface ? 1 : FIELD_BRICK;
            bool within = true;
            while (within && !at_surface) {
                uint local = field_local(cell);
                at_surface = surface && ((local < 32u ? cells.x : cells.y) >> (local & 31u) & 1u) != 0u;
                ivec3 low = surface ? cell : corner;
                border = (vec3(low + edge * ahead - base) - x) * per_dir;
                if (!at_surface) {
                    float out_of = min(border.x, min(border.y, border.z));
                    t = max(t, out_of);
                    ivec3 next = clamp(base + ivec3(floor(x + t * dir)), low, low + edge - 1);
                    cell = mix(next, low + edge * ahead - (1 - ahead), equal(border, vec3(out_of)));
                    within = field_brick(cell) == brick;
                    first = false;
                }
            }
        }
        if (at_surface) {
            Cell c = cell_at(number, cell & (FIELD_BRICK - 1));
            float out_of = min(border.x, min(border.y, border.z)), end = max(out_of, t);
            vec3 from = x + t * dir - vec3(cell - base), along = (end - t) * dir;
            vec4 h = side * vec4(trilinear(c, from), trilinear(c, from + along / 3.0), trilinear(c, from + along * (2.0 / 3.0)), trilinear(c, from + along));
            own = own || !first;
            float root;
            met = falls(h, own, root);
            // A ray that does not come to its side in the cell in which it starts is through at once.
            if (!met && !own) {
                met = true;
                root = 0.0;
            }
            first = false;
            if (met) t = mix(t, end, root);
            else cell = mix(cell, cell + 2 * ahead - 1, equal(border, vec3(out_of)));
            t = met ? t : end;
        }
    }
    stopped = !met && t < min(reach, wall.t);
    if (met && t < min(reach, wall.t)) wall = Wall(t, CLASS_BODY, vec3(0.0));
    return wall;
}

// The outward normal of a wall at x; against `dir` where the field has none.
vec3 normal_at(Wall wall, vec3 x, vec3 dir) {
    vec3 outward = wall.cls == CLASS_SPLASH ? x - wall.center : -gradient_at(x);
    float square = dot(outward, outward);
    return square > 0.0 ? outward * inversesqrt(square) : -dir;
}
