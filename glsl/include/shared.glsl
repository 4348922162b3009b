// What the host and the shaders share. build.rs reads this file and makes Rust of it: each `struct` becomes a
// #[repr(C)] struct, each `#define NAME number` a constant. Members are float, uint, vec2, vec3, vec4, uvec4 and mat4, each
// where the one before it ends, so that std140, std430 and Rust lay them out alike; build.rs refuses what would leave a gap.

// Edge of a compute group of pixels, for passes without shared memory.
#define IMAGE_GROUP 8
// Size of a compute group of particles.
#define PARTICLE_GROUP 64

// Edge of a tile of walls, in pixels; a power of two, and which.
#define WALL_TILE 8
#define WALL_TILE_BITS 3
// Edge of a tile of the view that is drawn with a walk or without, in pixels.
#define VIEW_TILE 16
// Depth of what is not there.
#define FARTHEST 1.0e30

// Classes (Imai16 section 4.1) and sides: the layer of a two-layer map.
#define CLASS_SPLASH 0
#define CLASS_BODY 1
#define SIDE_FRONT 0
#define SIDE_BACK 1

// Hit patterns (Imai16 section 4.4): which volume the view ray enters first and second.
#define PATTERN_NONE 0
#define PATTERN_SPLASH 1
#define PATTERN_BODY 2
#define PATTERN_SPLASH_SPLASH 3
#define PATTERN_SPLASH_BODY 4
#define PATTERN_BODY_SPLASH 5
#define PATTERN_BODY_BODY 6

// How a pixel's walk ended.
// No particle covers the pixel.
#define OUTCOME_NO_LIQUID 0
// Every wall that the ray met was a surface or a ball.
#define OUTCOME_HIT 1
// The walk is complete, and one of its walls was a side wall.
#define OUTCOME_SIDE_WALL 2
// The ray left the view, or came before the near plane, inside the liquid or looking for a second volume.
#define OUTCOME_LEFT_VIEW 3
// The ray left the box around what is drawn inside the liquid.
#define OUTCOME_NO_WALL 4
// MARCH_STEPS, or another limit of steps, did not reach the end of the ray.
#define OUTCOME_NOT_CONVERGED 5
// One more internal reflection than a walk may have.
#define OUTCOME_REFLECTION_LIMIT 6
// The ray ended on the host's scene.
#define OUTCOME_SCENE 7

// Which particles a class draws on which side; bits of the cull pass's verdict.
#define VISIBLE_FRONT 1
#define VISIBLE_BACK 2
#define VISIBLE_BODY 4 // set where the particle belongs to the body

// Culling: particles that cover more pixels than this along an edge are always drawn and hide nothing.
#define LARGE 64
// Tiles of the view that one particle marks one by one, at most.
#define MOST_TILES 64
// Room for the rounding of a ray cast's discriminant, which is of order one. Compilers may round the same formula
// differently in different shaders.
#define SILHOUETTE 0.0001
// Room for the rounding of a ray cast's depth, in particle radii.
#define DEPTH_ROUNDING 0.001

// Items that one group of 64 sorts or compacts.
#define BLOCK 1024

// Words of the extent buffer.
// Smallest coordinates, as integers in the order of the floats.
#define EXTENT_LEAST 0
// Largest coordinates.
#define EXTENT_MOST 3
// First occupied cell.
#define EXTENT_FIRST_CELL 6
// Last occupied cell.
#define EXTENT_LAST_CELL 9
// Bits of each axis that a sort key needs.
#define EXTENT_BITS 12
// Passes of the sort.
#define EXTENT_PASSES 15
// For each of SORT_PASSES: the indirect dispatch of its blocks, then that of its rows.
#define EXTENT_DISPATCH 16
// Origin of the liquid's own space.
#define EXTENT_ORIGIN 136
// How many particles there are: what the device says of it, but no more than the host has room for.
#define EXTENT_COUNT 139
#define EXTENT_WORDS 140

// Bits of the key that one pass of the sort orders by.
#define DIGIT_BITS 5
// Values of so many bits.
#define DIGITS 32
// Passes that a key of three 31-bit cell coordinates needs.
#define SORT_PASSES 20

// Largest run of candidates for neighbours that is looked at whole; of a longer one evenly chosen candidates stand for all.
// A run of three cells holds 24 in liquid at rest, one of five 40.
#define CROWD 1024
// The same for a run of the relation table: 27 cells hold 216 in liquid at rest, and twice as wide 1728.
#define CROWD_RELATION 8192

// The eye is inside the body from this number density on, as a part of a filled body's: that of a flat surface.
#define EYE_INSIDE 0.5

// Particles that one invocation prepares together, one in each component of a vector.
#define SHAPE_RUN 4

// Neighbours whose largest variance is below this fraction of a filled body's lie on one spot: their spread says nothing about
// a shape.
#define DEGENERATE_VARIANCE 0.05

// Ellipsoids in place (docs/methods.md), in particle radii: semi-axes where neighbours spread alike along all,
#define ELLIPSOID_SIZE 1.55
// the shortest
#define ELLIPSOID_THIN 1.2
// and the longest.
#define ELLIPSOID_WIDE 2.0
// Of the way to its neighbours' mean a centre goes so much,
#define ELLIPSOID_SMOOTHING 0.1
// and so much of what that mean lies further to one side than under a flat surface: the particle protrudes.
#define ELLIPSOID_PULL 0.7
// Radius of a splash, in particle radii: its volume is a particle's, (2 r)^3.
#define SPLASH_RADIUS 1.24
// A body particle takes on its shape over so much density above the splash threshold, as parts of a filled body's; at the
// threshold it is the splash's ball.
#define SPLASH_FADE 0.15

// Plane fitting: pixels of one invocation, one below the other.
#define FIT_COLUMN 4
// The least |n.v|, both of unit length, for which eq. (5) of Imai16 is trusted.
#define FIT_GRAZING_LIMIT 0.01
// The longest update of a depth, in sigma: a particle radius of the default's. Windows on more than one surface ask for longer
// ones, which are cut to it: where they were not taken, depths of one pixel would stand out.
#define FIT_UPDATE_LIMIT 0.2

// Search for walls along a ray (walls.glsl). How far into the next pixel or tile a position is taken that lies on the edge between
// two, in pixels.
#define PIXEL_NUDGE 0.001
// How far beyond the box around what is drawn rays are followed, in particle radii.
#define BOX_MARGIN 2.0
// How far beside a side wall a ray goes on, in pixels: it lies on the border between two.
#define SIDE_NUDGE 0.01
// Tiles and pixels that are looked at before a wall may be met, at most.
#define MARCH_STEPS 1024
// Samples of g that look for a change of its sign, at most.
#define CROSS_STEPS 32
// ... and that narrow it.
#define NARROW_STEPS 24
// How often the two take turns, at most.
#define WALL_TRIES 16
// Pixels after its start on a wall within which a ray still counts as on its own side.
#define START_PIXELS 2.0
// Times that a ray goes straight on from splash to body or back, at most.
#define MOST_HAND_OVERS 16

// A wall is a surface where |g| is no larger than this, in particle radii,
#define ACCEPTED 0.05
// or than this part of what a pixel covers there, whichever is more.
#define ACCEPTED_PIXELS 0.1
// Depths of a footprint that differ by more are a jump, and not interpolated: in particle radii, or what a STEEP surface
// changes from pixel to pixel there, whichever is more.
#define JUMP 2.0
// Tangent of the angle against the view plane (81 degrees) of the steepest surface that counts as continuous.
#define STEEP 6.0
// A root is found where |g| is no larger than this, in particle radii,
#define CONVERGED 0.0002
// or than this fraction of the depth, where float32 has no finer steps.
#define CONVERGED_DEPTH 0.000001

// A ray meets the host's scene between two pixels where it lies no further behind the second one's depth than this fraction of
// it: a floor seen at 5 degrees falls off so much from row to row in a picture of 768 rows.
#define SCENE_BEHIND 0.01
// Liquid whose wall lies no further before the scene than this, in particle radii and along the wall's normal, wets it:
// particles stop a radius before a floor, and ellipsoids shrunk as YuTurk13 has it two and a half radii more.
#define WETTING_GAP 3.5
// Sine of the flattest ray for which that distance is measured along the normal.
#define WETTING_FLAT 0.02

// One particle, as drawn: eye-independent, in the liquid's own space (src/space.rs: lengths in particle radii). In memory it
// is three arrays of three floats, with the class as a sign (see particles.glsl).
struct Particle {
    vec4 center;         // xyz: position
    vec4 shape_diagonal; // xx, yy, zz of S = A A^T, A's columns the semi-axes
    vec4 shape_mixed;    // xy, xz, yz of S
};

// One frame's parameters. All lengths are in particle radii. Eye space looks down -z; d = -z is the linear depth; a view
// ray is v = (vx, vy, -1).
struct Frame {
    mat4 view;            // the liquid's space to eye space: a rotation or reflection, and a shift
    mat4 eye_to_env;      // rotation from eye space to the environment map's space (+y up)
    vec2 pixel_scale;     // pixel = pixel_scale * v.xy + pixel_origin; either scale may be negative
    vec2 pixel_origin;
    vec2 size;            // of the view, in pixels
    float near;           // depth before which no liquid is drawn
    float ior;            // index of refraction of the liquid against air
    vec3 absorption;      // coefficient for red, green and blue
    float eye_inside;     // 1 if the eye is inside the body, else 0
    vec3 bounds_min;      // box around everything drawn, in the liquid's space
    uint count;           // particles
    vec3 bounds_max;
    uint largest_point;   // edge of the largest point that the device draws, in pixels
    float scene_z_scale;  // the host's scene: the projection's element (3, 3)
    float scene_z_offset; // the projection's element (3, 4), over the radius
    float scene_cleared;  // value of the depth buffer where nothing was drawn
    uint quads_only;      // 1 to draw no points
    // The renderer's own environment map (environment.glsl): texels a radian,
    vec2 environment_per_radian;
    float environment_columns;
    float environment_scale; // and the light of a step of the largest exponent
    vec2 output_origin; // where the view begins in what the host draws into, in pixels
    vec2 scene_origin;  // and in its scene
};

// Indirect draws of one class and side, two VkDrawIndirectCommand: one of points and one of quads.
struct Draws {
    uint point_vertices;
    uint point_instances;
    uint point_first_vertex;
    uint point_first_instance;
    uint quad_vertices;
    uint quad_instances;
    uint quad_first_vertex;
    uint quad_first_instance;
};

// Groups of one dispatch on each axis: what Vulkan guarantees of maxComputeWorkGroupCount.
#define MOST_GROUPS 65535
// Cells of device-prepared particles are counted to either side of the origin up to this one; what lies further out is taken
// to lie there.
#define FURTHEST_CELL 536870912

// Push constants of the preparation. Lengths are world units times a power of two that brings the radius into 1..2: that
// rounds nothing, and squares of lengths stay within float32 at any scale.
struct Prepare {
    uint count;                // particles that there may be
    uint first_word;           // where positions begin in their buffer
    uint word_stride;          // words from one position to the next
    uint entries_per_particle; // in the sort: 1, or 27 of the relation table
    float cell_edge;
    float radius;              // particle radius r
    float support;             // h, of the number density's kernel
    float reach;               // of the neighbours that shape ellipsoids: h, or YuTurk13's 2 h
    float splash_below;        // a splash has less than this fraction of a filled body's density
    float keep_below;          // below this fraction the last frame's class is kept; from here on shapes fade in
    float filled_density;      // sum of a filled body's weights
    float unit_scale;          // the power of two
    float smoothing;           // lambda of YuTurk13
    float least_ratio;         // 1 / largest ratio of semi-axes
    float longest_axis;        // longest semi-axis, in r
    float filled_variance;     // of a filled body's neighbours, in r squared
    float flat_offset;         // how far below a flat surface's particle the mean of its neighbours lies, in r
    uint min_neighbours;       // with no more YuTurk13's particle stays a sphere
    uint sort_pass;
    uint cells_around;         // cells to either side of a particle's own that hold neighbours
    uint first_id_word;        // where ids begin in their buffer
    uint id_word_stride;       // words from one id to the next
    uint kept_classes;         // classes that are kept: one for each id, or for each particle
    uint count_word;           // where the number of particles lies in its buffer
    uint least_count;          // at least so many there are: all, where the device has no say
};

// The density field (docs/methods.md, "Density field"). Nodes along an edge of a brick, as a power of two, and in all of it; as many
// bricks are a block's.
#define FIELD_BRICK_BITS 2
#define FIELD_BRICK 4
#define FIELD_NODES 64
// Invocations that look at one brick together, where all bricks are looked at.
#define FIELD_LANES 8
// What a filled body's density is in the whole numbers that are added up at nodes, of 16 bits each: two nodes beside each other on x share
// a word.
#define FIELD_ONE 8192
#define FIELD_NODE_WORDS 32
// What a node holds in a cell that the walk looks at: a byte, FIELD_HALF at the level, and its gradient, a byte on each axis, which ends at
// FIELD_STEEPEST, in filled bodies a spacing.
#define FIELD_HALF 128
#define FIELD_STEEPEST 0.75
// A particle whose number density exceeds that of a filled body so many times counts as one of so much,
#define FIELD_DENSEST 1.2
// unless that is less than this part of its own: crowds, whose sum would outgrow a node (2.5 in a body however dense, and 4.4
// around particles on one spot under the narrowest kernel; a node has room for 8).
#define FIELD_CROWD 0.4
// Splashes from this number density on, as a part of a filled body's, belong to the field as the body does: pairs and rows in reach of each other.
#define FIELD_JOINS 0.35
// Below the number density FIELD_RIM particles lie at the edge of a sheet. They count as less dense than they are, down to FIELD_THIN: the
// surface would draw back there.
#define FIELD_RIM 0.65
#define FIELD_THIN 0.42
#define FIELD_THINNED 3.3
// From the number density FIELD_SURE on the field encloses a particle. Below FIELD_TIP, at corners and ends of threads, it has to go on
// beyond the particle for FIELD_BEYOND radii.
#define FIELD_SURE 0.8
#define FIELD_TIP 0.52
#define FIELD_BEYOND 0.6
// Who is not enclosed by FIELD_ENOUGH of the level more adds FIELD_RAISED of what that lacks: its neighbours along an edge lack as much.
#define FIELD_ENOUGH 0.02
#define FIELD_RAISED 0.45
// The most that one particle adds to a node: below it whatever density the host says.
#define FIELD_MOST_SHARE 32767.0
// What the box of a dense grid's bricks is without any.
#define DENSE_GRID_EMPTY 2147483647
// Slots of the directory that are looked at for one block, at most.
#define FIELD_PROBES 128
// Words of a slot of the directory, which has one more than its slots, without anything: a block's key, 0 where the slot is free; the number of
// its first brick, after which its others follow; one bit for each brick that there is; one for each of whose cells some hold
// the surface; one for each into which balls reach; its coordinates. Readers find four words at once.
#define FIELD_SLOT 12
#define FIELD_FIRST_BRICK 1
#define FIELD_THERE 2
#define FIELD_SURFACE 4
#define FIELD_BALLS 6
#define FIELD_PLACE 8
// A key is 1 more than coordinates from the base block on and this far below, in so many bits each; or where they do not fit FIELD_FAR, and
// the hash's upper bits: then coordinates are to be compared.
#define FIELD_KEY_BELOW 512
#define FIELD_KEY_BITS 10
#define FIELD_FAR 2147483648
// Numbers of bricks end here: a node is found by a word.
#define FIELD_MOST_BRICKS 67108863
// Words of a brick's record: one bit for each of its cells that holds the surface; the number of the first of these, after which the others
// follow; its first ball, from 1 on; one bit for each node that is inside; 1 more than its block's slot times FIELD_NODES plus its place in that.
#define FIELD_RECORD 8
#define FIELD_CELLS 0
#define FIELD_FIRST_CELL 2
#define FIELD_FIRST_BALL 3
#define FIELD_INSIDE 4
#define FIELD_HOME 6
// Words of a cell's record: a byte of each of its corners in two words each, x before y before z: what it holds, its gradient along x, y and z.
#define FIELD_CELL_RECORD 8
// Words of a ball in a brick: its center from FIELD_BALL_BELOW before the brick's first node on, in so many steps a spacing, in FIELD_BALL_BITS bits on
// each axis; the next ball of the brick, from 1 on.
#define FIELD_BALL 2
#define FIELD_BALL_BELOW 1
#define FIELD_BALL_BITS 10
#define FIELD_BALL_STEPS 128
// Edge of a tile of the view for which it is known between which depths the field is, in pixels.
#define FIELD_TILE 8
// Blocks and bricks that a ray is followed through in one go, at most.
#define FIELD_STEPS 4096
// Balls of one brick that are looked at.
#define FIELD_MOST_BALLS 4096
// Halvings that narrow a root, of the way through a cell, before it is taken from a straight line.
#define FIELD_HALVINGS 9
// How far from its wall a ray goes on, on its own side, in spacings.
#define FIELD_NUDGE 0.002
// What rounding leaves of a ball's square, as a part of it, and of the way from one to itself, in spacings.
#define BALL_ROUNDING 0.001
#define BALL_START 0.001

// How many reflected rays of a pixel wait to be followed, and the least light for which one does, as a part of the pixel's.
#define REFLECTIONS_WAITING 4
#define REFLECTION_LEAST 0.015625

// Push constants of the passes that build it. Points and lengths are in the units of the preparation (Prepare).
struct FieldBuild {
    uint count;         // points
    uint capacity;      // bricks that there is room for, number 0 among them, which is empty
    uint slots;         // of the directory, a power of two
    uint cell_capacity; // cells that hold the surface that there is room for
    uint ball_capacity; // entries of balls in bricks
    float spacing;      // from node to node
    float reach;        // support of the kernel, in spacings
    float unit;         // of a weight of 1, in whole numbers of a node
    float ball;         // radius of a ball, in spacings
    uint level;         // the surface's, in whole numbers
    float origin_x;     // of the liquid's own space, unless the device has found it
    float origin_y;
    float origin_z;
};

// What the field's readers know of it.
struct FieldHead {
    uint groups_x; // one group for each brick
    uint groups_y;
    uint groups_z;
    uint bricks;   // there are, number 0 not counted
    uint balls;    // entries of balls in bricks
    uint base_x;   // block that has the origin of the liquid's own space, as integers
    uint base_y;
    uint base_z;
    float part_x;  // how far beyond that block's first node the origin lies, in spacings
    float part_y;
    float part_z;
};

// Strays: points that are balls, and those that the field may not enclose.
struct FieldStrays {
    uint groups_x; // one invocation for each
    uint groups_y;
    uint groups_z;
    uint count;
};

// How a look-up is moved: by the normal times T; to where the bent ray's direction vanishes, with an index that grows with T;
// by the bent ray's lateral components.
#define LOOKUP_NORMAL 0
#define LOOKUP_INDEX 1
#define LOOKUP_BENT 2

// Push constants of the splat pass.
struct Splat {
    uint cls;  // which class is drawn
    uint side; // and which side of it
};

// How far from its center a particle moves the surface, in particle radii: surface lies within about two of the nearest.
#define MOTION_REACH 3.0

// Push constants of the pass that finds how the first surface moves.
struct Moving {
    vec4 eye_x;         // from the world to eye space in particle radii
    vec4 eye_y;
    vec4 eye_z;
    uint first_words;   // a byte each: where positions begin in their buffer, what was before in its own, and the number in its
    uint word_stride;   // words from one position to the next
    uint before_stride; // and of what was before
    float seconds;      // that velocities count for
};

// Push constants of motion vectors.
struct Motions {
    vec4 then_x; // from eye space in particle radii to the frame before's clip space
    vec4 then_y;
    vec4 then_w;
    vec4 now;    // this frame's projection without jitter: scales and shifts of x/d and y/d
};
