// Walls of the density field and of balls along a ray (docs/methods.md, "Walls in a field"). Lengths here are spacings of the
// field's nodes, as in field_space.glsl.
//
// Where the device has texel buffers as large as the field's buffers these are read as such: that takes less of a CPU's time. Otherwise something
// small is bound in their place.
layout(set = 0, binding = 2, std430) readonly buffer TableBlock { uvec4 at[]; } table;
layout(set = 0, binding = 4, std430) readonly buffer RecordBlock { uvec4 at[]; } records;
layout(set = 0, binding = 5, std430) readonly buffer CellBlock { uvec4 at[]; } cells;
layout(set = 0, binding = 13) uniform utextureBuffer table_texels;
layout(set = 0, binding = 14) uniform utextureBuffer record_texels;
layout(set = 0, binding = 15) uniform utextureBuffer cell_texels;
layout(set = 0, binding = 16) uniform utextureBuffer ball_texels;
layout(constant_id = 6) const bool TEXELS = false;
layout(set = 0, binding = 12, std430) readonly buffer BallBlock { uvec4 at[]; } balls; // two in each
uvec4 directory_texel(uint i) {
    if (TEXELS) return texelFetch(table_texels, int(i));
    return table.at[i];
}
uvec4 record_texel(uint i) {
    if (TEXELS) return texelFetch(record_texels, int(i));
    return records.at[i];
}
uvec4 cell_texel(uint i) {
    if (TEXELS) return texelFetch(cell_texels, int(i));
    return cells.at[i];
}
// The ball of an entry in a brick's list, from 1 on.
uvec2 ball_entry(uint entry) {
    uvec4 two;
    if (TEXELS) two = texelFetch(ball_texels, int((entry - 1u) / 2u));
    else two = balls.at[(entry - 1u) / 2u];
    return (entry & 1u) != 0u ? two.xy : two.zw;
}
#include "field_directory.glsl"

const float NONE = 1e30; // t of what is not met
const float BRICK_EDGE = float(FIELD_BRICK), BLOCK_EDGE = float(FIELD_BRICK * FIELD_BRICK);

// Of a brick the cells that hold the surface, the number of the first of these and its first ball, each where FIELD_RECORD says.
uvec4 brick_words(uint brick) { return record_texel(brick * (uint(FIELD_RECORD) / 4u)); }
uvec2 brick_inside(uint brick) { return record_texel(brick * (uint(FIELD_RECORD) / 4u) + 1u).xy; }

// A block where a ray is: its first node, and of its bricks the first one's number, those that there are, that hold the surface, and into
// which balls reach.
struct Block {
    vec3 low;
    uint first;
    uvec2 there;
    uvec2 surfaces;
    uvec2 balls;
};
// Read once: CPUs read a buffer lane by lane.
ivec3 base = base_block();
const Block NOWHERE = Block(vec3(NONE), 0u, uvec2(0u), uvec2(0u), uvec2(0u));
void look_up(inout Block b, vec3 x) {
    vec3 low = BLOCK_EDGE * floor(x / BLOCK_EDGE);
    if (low != b.low) {
        b.low = low;
        uvec4 words;
        uint slot = field_slot(base + whole(b.low / BLOCK_EDGE), base, push.slots, words);
        b.first = words[FIELD_FIRST_BRICK];
        b.there = field_there(words);
        words = directory_texel(FIELD_SLOT_TEXELS * slot + FIELD_SURFACE / 4u);
        b.surfaces = words.xy;
        b.balls = words.zw;
    }
}

// A cell or brick among those of its brick or block, by how far from that one's first it lies, as bits count them.
uint local_of(vec3 from_first) { return uint(whole(dot(from_first, vec3(1.0, BRICK_EDGE, BRICK_EDGE * BRICK_EDGE)))); }

// The k-th half of a cell's words: what its corners hold and their gradients along x, or those along y and z. Of each a byte of each
// corner, in the first word of those with the smaller z, in the second of those with the larger.
uvec4 cell_words(uint cell, uint k) { return cell_texel(cell * (uint(FIELD_CELL_RECORD) / 4u) + k); }
float trilinear(vec4 low, vec4 high, vec3 f) {
    vec4 z = mix(low, high, f.z);
    vec2 y = mix(z.xy, z.zw, f.y);
    return mix(y.x, y.y, f.x);
}
vec4 held(uint word) { return vec4(uvec4(word, word >> 8, word >> 16, word >> 24) & 0xffu) - (float(FIELD_HALF) - 0.5); }
vec4 slope(uint word) { return vec4(ivec4(word << 24, word << 16, word << 8, word) >> 24); }

// The field less its level, in no unit, at a place in a cell.
float field_in(uint cell, vec3 f) {
    uvec4 words = cell_words(cell, 0u);
    return trilinear(held(words.x), held(words.y), f);
}
// Its gradient, in no unit.
vec3 gradient_in(uint cell, vec3 f) {
    uvec4 first = cell_words(cell, 0u), second = cell_words(cell, 1u);
    return vec3(trilinear(slope(first.z), slope(first.w), f), trilinear(slope(second.x), slope(second.y), f),
                trilinear(slope(second.z), slope(second.w), f));
}

// A wall that a ray meets.
struct Wall {
    float t;
    int cls;     // of the volume whose wall it is
    vec3 place;  // center of a ball; or the first node of the cell in which a wall of the body lies
    uint cell;   // that cell's number
    uint ball;   // the first of the brick in which that is
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

// One of a brick's balls around a place, if there is one; on its sphere does not count. Of several always the same: they are listed in
// the order in which the device came to them, which is another from frame to frame.
bool ball_around(vec3 x, uint entry, out vec3 center) {
    const uint none = 0xffffffffu;
    vec3 brick = BRICK_EDGE * floor(x / BRICK_EDGE);
    uint least = none;
    for (uint i = 0u; i < FIELD_MOST_BALLS && entry != 0u; ++i) {
        uvec2 ball = ball_entry(entry);
        vec3 at = brick + field_ball(ball.x), q = x - at;
        if (ball.x < least && dot(q, q) < push.ball * push.ball * (1.0 - BALL_ROUNDING)) {
            least = ball.x;
            center = at;
        }
        entry = ball.y;
    }
    return least != none;
}

// A cubic, by its coefficients.
float cubic_at(vec4 c, float t) { return c.x + t * (c.y + t * (c.z + t * c.w)); }

// Whether h, `side` times the field less its level along a ray's way through a cell, falls through zero there: from a place where it is not
// above zero, after it has been. It is a cubic, known by four values; and the bracket of the first such place, as parts of the way.
bool falls(vec4 h, inout bool own, out vec4 c, out vec2 bracket) {
    c = vec4(h.x, 0.5 * (-11.0 * h.x + 18.0 * h.y - 9.0 * h.z + 2.0 * h.w), 4.5 * (2.0 * h.x - 5.0 * h.y + 4.0 * h.z - h.w),
             4.5 * (-h.x + 3.0 * h.y - 3.0 * h.z + h.w));
    // Between its extrema a cubic is monotone.
    float b = c.z, disc = b * b - 3.0 * c.w * c.y, q = -(b + (b < 0.0 ? -1.0 : 1.0) * sqrt(max(disc, 0.0)));
    vec2 extrema = vec2(abs(c.w) > 1e-20 ? q / (3.0 * c.w) : 1.0, abs(q) > 1e-20 ? c.y / q : 1.0);
    extrema = clamp(disc > 0.0 ? extrema : vec2(1.0), 0.0, 1.0);
    float ends[3] = float[](min(extrema.x, extrema.y), max(extrema.x, extrema.y), 1.0);
    bracket = vec2(0.0);
    own = own || h.x > 0.0;
    bool found = own && h.x < 0.0;
    for (int i = 0; i < 3 && !found; ++i) {
        bracket = vec2(bracket.y, ends[i]);
        float value = i == 2 ? h.w : cubic_at(c, ends[i]);
        found = own && value < 0.0;
        own = own || value > 0.0;
    }
    return found;
}

// Where a cubic falls through zero in its bracket.
float root_of(vec4 c, vec2 bracket) {
    for (int i = 0; i < FIELD_HALVINGS; ++i) {
        float middle = 0.5 * (bracket.x + bracket.y);
        if (cubic_at(c, middle) < 0.0) bracket.y = middle;
        else bracket.x = middle;
    }
    // So near it is as good as straight.
    float before = cubic_at(c, bracket.x), behind = cubic_at(c, bracket.y);
    return mix(bracket.x, bracket.y, clamp(before / max(before - behind, 1e-20), 0.0, 1.0));
}

// The nearest ball of a brick that a ray from outside meets before `wall`.
void meet_balls(uint entry, vec3 brick, vec3 x, vec3 dir, inout Wall wall) {
    for (uint i = 0u; i < FIELD_MOST_BALLS && entry != 0u; ++i) {
        uvec2 ball = ball_entry(entry);
        vec3 center = brick + field_ball(ball.x);
        vec2 t;
        if (meets_ball(center, x, dir, t) && t.x > BALL_START && t.x < wall.t) wall = Wall(t.x, CLASS_SPLASH, center, 0u, 0u);
        entry = ball.y;
    }
}

// A ray on its way through the lattice.
struct Course {
    vec3 x;
    vec3 dir;
    vec3 per_dir;
    vec3 ahead; // 1 on axes along which it goes up, else 0
    float t;
    vec3 cell;  // in which it is there: its first node
};

// Places among 4 x 4 x 4 cubes, in a byte each, and what a step adds to them; whoever has left them has set one of these bits.
const uint AXIS_Y = 1u << 8, AXIS_Z = 1u << 16, BEYOND = 0xfcfcfcu;

// Which of the 64 is at a place.
uint cube_number(uint place) { return (place | place >> 6 | place >> 12) & 63u; }

// Takes a ray through 4 x 4 x 4 cubes of an edge, a power of two so that no place is rounded, from the first one's first node on: from its
// own cube until it comes to one of those that `stops` has, by its number k, or leaves them. Says whether it came to one. Each step
// goes up or down one axis as the ray does, so that there are few, whatever its numbers are.
bool cross_cubes(inout Course c, bool go, vec3 low, float edge, uvec2 stops, out uint k, inout bool first) {
    float per_edge = 1.0 / edge;
    vec3 cube = edge * floor(c.cell * per_edge);
    vec3 next = (cube + edge * c.ahead - c.x) * c.per_dir, between = edge * abs(c.per_dir);
    uvec3 up = uvec3(1u, AXIS_Y, AXIS_Z), ways = mix(0u - up, up, greaterThan(c.ahead, vec3(0.0)));
    uint begin = uint(whole(dot((cube - low) * per_edge, vec3(1.0, float(AXIS_Y), float(AXIS_Z))))), place = begin;
    float t = c.t;
    bool look = go && !field_bit(stops, cube_number(place));
    while (look) {
        bool is_x = next.x <= next.y && next.x <= next.z, is_y = !is_x && next.y <= next.z;
        t = is_x ? next.x : is_y ? next.y : next.z;
        place += is_x ? ways.x : is_y ? ways.y : ways.z;
        next += vec3(is_x ? between.x : 0.0, is_y ? between.y : 0.0, is_x || is_y ? 0.0 : between.z);
        look = (place & BEYOND) == 0u && !field_bit(stops, cube_number(place));
    }
    k = cube_number(place);
    if (place != begin) {
        uint above = place + (1u + AXIS_Y + AXIS_Z); // so that none is negative
        cube = low + edge * (vec3(uvec3(above, above >> 8, above >> 16) & 0xffu) - 1.0);
        c.t = max(c.t, t);
        c.cell = clamp(floor(c.x + c.t * c.dir), cube, cube + (edge - 1.0));
        first = false;
    }
    return go && (place & BEYOND) == 0u;
}

// `side` times the field less its level along a ray's way through the cell in which it is: at its beginning, after a third and two thirds, and at its
// end, which is when the ray leaves the cell, and on which axes.
vec4 along_cell(Course c, float side, uint cell, out float end, out bvec3 axes) {
    uvec4 corners = cell_words(cell, 0u);
    vec4 low = held(corners.x), high = held(corners.y);
    vec3 border = (c.cell + c.ahead - c.x) * c.per_dir;
    float out_of = min(border.x, min(border.y, border.z));
    end = max(out_of, c.t);
    axes = equal(border, vec3(out_of));
    vec3 from = c.x + c.t * c.dir - c.cell, way = (end - c.t) * c.dir;
    return side * vec4(trilinear(low, high, from), trilinear(low, high, from + way / 3.0), trilinear(low, high, from + way * (2.0 / 3.0)),
                       trilinear(low, high, from + way));
}

// The first wall that a ray meets from x on, from t to `reach`: of the field from within it, or from outside of all liquid of whichever
// comes first. Without one its t is NONE, and `stopped` says whether steps ran out.
Wall find_wall(inout Block block, vec3 x, vec3 dir, bool inside, float t, float reach, out bool stopped) {
    Wall wall = Wall(NONE, CLASS_BODY, vec3(0.0), 0u, 0u);
    float side = inside ? 1.0 : -1.0;
    vec3 per_dir = 1.0 / mix(dir, vec3(1e-20), lessThan(abs(dir), vec3(1e-20)));
    Course c = Course(x, dir, per_dir, vec3(greaterThan(per_dir, vec3(0.0))), t, floor(x + t * dir));
    // Whether it has been on its side: so far, and when it came into the cell where it meets the field's wall.
    bool own = false, before = false, first = true, met = false;
    uint cell = 0u, ball = 0u;
    uint steps = 0u;
    while (!met && c.t < min(reach, wall.t) && steps < FIELD_STEPS) {
        // On to a brick that holds the surface, from outside also to one into which balls reach; or to the next block.
        ++steps;
        look_up(block, c.cell);
        uvec2 stops = inside ? block.surfaces : block.surfaces | block.balls;
        // Through a block without any at once: as if it were the first of 4 x 4 x 4 blocks, which stop at every other.
        bool through = stops == uvec2(0u);
        if (through) stops = uvec2(~1u, ~0u);
        uint k;
        bool stop = cross_cubes(c, true, block.low, through ? BLOCK_EDGE : BRICK_EDGE, stops, k, first) && !through;
        uvec4 words = stop ? brick_words(block.first + field_before(block.there, k)) : uvec4(0u);
        uvec2 surface = stop && field_bit(block.surfaces, k) ? words.xy : uvec2(0u);
        vec3 brick = BRICK_EDGE * floor(c.cell / BRICK_EDGE);
        ball = words[FIELD_FIRST_BALL];
        if (!inside) meet_balls(ball, brick, x, dir, wall);
        // In it from cell to cell of those that hold the surface: CPUs do without looking up block and brick each time.
        bool in_brick = true;
        while (in_brick) {
            in_brick = cross_cubes(c, stop, brick, 1.0, surface, k, first) && c.t < min(reach, wall.t);
            if (in_brick) {
                cell = words[FIELD_FIRST_CELL] + field_before(surface, k);
                own = own || !first;
                before = own;
                float end;
                bvec3 axes;
                vec4 h = along_cell(c, side, cell, end, axes), cubic;
                vec2 bracket;
                // A ray that does not come to its side in the cell in which it starts is through at once.
                met = falls(h, own, cubic, bracket) || !own;
                if (!met) {
                    c.t = end;
                    c.cell = mix(c.cell, c.cell + 2.0 * c.ahead - 1.0, axes);
                }
                first = false;
                in_brick = !met && BRICK_EDGE * floor(c.cell / BRICK_EDGE) == brick;
            }
        }
    }
    stopped = !met && c.t < min(reach, wall.t);
    if (met) {
        // Looked at again, and not carried along.
        float end;
        bvec3 axes;
        vec4 h = along_cell(c, side, cell, end, axes), cubic;
        vec2 bracket;
        if (falls(h, before, cubic, bracket)) c.t = mix(c.t, end, root_of(cubic, bracket));
        if (c.t < min(reach, wall.t)) wall = Wall(c.t, CLASS_BODY, c.cell, cell, ball);
    }
    return wall;
}

// Whether a place is in the field; and the first ball of the brick there.
bool in_field(inout Block block, vec3 x, out uint ball) {
    look_up(block, x);
    vec3 cell = floor(x), brick = BRICK_EDGE * floor(cell / BRICK_EDGE);
    uint k = local_of((brick - block.low) / BRICK_EDGE), local = local_of(cell - brick);
    // A brick that is not there is number 0, with nothing in it.
    uint number = field_bit(block.there, k) ? block.first + field_before(block.there, k) : 0u;
    uvec4 words = brick_words(number);
    ball = words[FIELD_FIRST_BALL];
    if (!field_bit(words.xy, local)) return field_bit(brick_inside(number), local);
    return field_in(words[FIELD_FIRST_CELL] + field_before(words.xy, local), x - cell) >= 0.0;
}

// The outward normal of a wall at x; against `dir` where the field has none.
vec3 normal_at(Wall wall, vec3 x, vec3 dir) {
    vec3 outward = wall.cls == CLASS_SPLASH ? x - wall.place : -gradient_in(wall.cell, clamp(x - wall.place, 0.0, 1.0));
    float square = dot(outward, outward);
    return square > 0.0 ? outward * inversesqrt(square) : -dir;
}
