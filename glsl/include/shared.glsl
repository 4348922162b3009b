// What the host and the shaders share. build.rs reads this file and makes Rust of it: each `struct` becomes a
// #[repr(C)] struct, each `#define NAME number` a constant. Members are mat4, vec4 and uvec4 only, so that std140,
// std430 and Rust lay them out alike; build.rs refuses anything else.

// Compute group edge for image passes without shared memory, and group size for particle passes.
#define IMAGE_GROUP 8
#define PARTICLE_GROUP 64

// Edge of a tile of front depths, in pixels.
#define FRONT_TILE 16

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

// How a pixel's walk ended. Past a jump: every surface was found, but on the way to one the map ahead jumped, and an
// unseen wall may stand before it, or beside it, where it is not interpolated. Other wall: every surface was found, one of
// them across the ray's way. Scene: the ray ended on the host's scene.
#define OUTCOME_NO_LIQUID 0
#define OUTCOME_HIT 1
#define OUTCOME_LEFT_VIEW 2
#define OUTCOME_HOLE 3
#define OUTCOME_NOT_CONVERGED 4
#define OUTCOME_REFLECTION_LIMIT 5
#define OUTCOME_PAST_JUMP 6
#define OUTCOME_OTHER_WALL 7
#define OUTCOME_SCENE 8

// Which particles a class draws on which side; bits of the cull pass's verdict.
#define VISIBLE_FRONT 1
#define VISIBLE_BACK 2
#define VISIBLE_BODY 4 // set where the particle belongs to the body

// Culling: particles of more pixels an edge are always drawn and hide nothing; room for the rounding of a discriminant of
// order one, and of a depth in particle radii. Compilers may round the same formula differently in different shaders.
#define LARGE 64
#define SILHOUETTE 0.0001
#define DEPTH_ROUNDING 0.001

// Items that one group of 64 sorts or compacts.
#define BLOCK 1024

// Slots of the counter buffer: guards and culling, summed over the frame.
#define COUNT_SPLASH_FRONT 0
#define COUNT_SPLASH_BACK 1
#define COUNT_BODY_FRONT 2
#define COUNT_BODY_BACK 3
#define COUNT_FIT_ZERO_NORMAL 4
#define COUNT_FIT_GRAZING 5
#define COUNT_FIT_UNBOUNDED 6
#define COUNT_NORMAL_DEGENERATE 7
#define COUNT_LARGE_SPLASH 8
#define COUNT_LARGE_BODY 9
// Of the preparation: classes, and how ellipsoids came about.
#define COUNT_SPLASH 10
#define COUNT_BODY 11
#define COUNT_NOT_FINITE 12
#define COUNT_FEW_NEIGHBOURS 13
#define COUNT_DEGENERATE 14
#define COUNT_CLAMPED_LONG 15
#define COUNT_CLAMPED_RATIO 16
#define COUNTERS 17

// Words of the extent buffer: smallest and largest coordinates (as integers in the order of the floats), the occupied
// cells (first, last), bits of each axis that a sort key needs, passes of the sort, for each pass that there could
// be the indirect dispatches of its blocks and of its rows, and the origin of the liquid's own space.
#define EXTENT_LEAST 0
#define EXTENT_MOST 3
#define EXTENT_FIRST_CELL 6
#define EXTENT_LAST_CELL 9
#define EXTENT_BITS 12
#define EXTENT_PASSES 15
#define EXTENT_DISPATCH 16
#define EXTENT_ORIGIN 136
#define EXTENT_WORDS 139

// A sort pass orders by so many bits; keys of three 31-bit cell coordinates need so many passes at most.
#define DIGIT_BITS 5
#define DIGITS 32
#define SORT_PASSES 20

// Of a run of more candidates for neighbours than this (of those in a particle's cell of the relation table), evenly chosen
// ones stand for all: a run of five cells holds 40 in liquid at rest, and the 27 cells 1728.
#define CROWD 1024
#define CROWD_RELATION 8192

// Particles one invocation prepares, one a component of a vector.
#define SHAPE_RUN 4

// Below this share of the filled body's variance neighbours lie on one spot: their spread says nothing about a shape.
#define DEGENERATE_SHARE 0.05

// Plane fitting: below this |n.v| eq. (5) is not trusted; an update longer than this many sigma is not taken.
#define FIT_GRAZING_LIMIT 0.01
#define FIT_UPDATE_LIMIT 4.0

// Search along a ray: secant steps; pixels from sample to sample where an earlier wall is looked for, least and most, and
// how many samples at most; pixels from sample to sample in a pixel with a front near the ray, and samples at most; how
// far into the next pixel its address is taken; pixels from sample to sample of the march to an exit, least and most;
// steps of a march at most; refinements of a bracket, and of the place where a surface begins.
#define SECANT_STEPS 10
#define CHECK_PIXELS 1.0
#define CHECK_STRIDE 8.0
#define CHECK_STEPS 64
#define ENTRY_PIXELS 0.125
#define ENTRY_STEPS 12
#define PIXEL_NUDGE 0.001
#define EXIT_PIXELS 1.0
#define EXIT_STRIDE 16.0
#define MARCH_STEPS 1024
#define REFINE_STEPS 24
#define EDGE_STEPS 10

// The host's scene: as a share of its depth, how far behind it a ray may come to lie from one pixel to the next and still
// meet it; a floor seen at 5 degrees falls off so much in a picture of 768 rows. And how near before it, in particle radii,
// the liquid's wall may lie and still wet it: particles stop a radius before a floor, and ellipsoids shrunk as YuTurk13 has
// it two and a half radii more.
#define SCENE_BEHIND 0.01
#define WETTED 3.5
// Sine of the flattest ray for which that distance is measured across the wall.
#define WETTED_FLAT 0.02

// Tangent of the steepest surface (81 degrees against the view plane) for which strides are made short.
#define STEEP 6.0

// Largest |f| of an accepted hit, in particle radii and in what a pixel covers in the middle of the liquid, whichever is
// more; largest spread of the depths around a sample that is still interpolated, in radii (in pixels: STEEP).
#define ACCEPTED 0.05
#define ACCEPTED_PIXELS 0.1
#define JUMP 2.0

// One particle, as drawn: eye-independent, in the liquid's own space (src/space.rs: lengths in particle radii). In memory it is three arrays of three floats, with the class as a sign (see particles.glsl).
struct Particle {
    vec4 center;         // xyz: position
    vec4 shape_diagonal; // xx, yy, zz of S = A A^T, A's columns the semi-axes
    vec4 shape_mixed;    // xy, xz, yz of S
};

// One frame's parameters. All lengths are in particle radii. Eye space looks down -z; d = -z is the linear depth; a view
// ray is v = (vx, vy, -1).
struct Frame {
    mat4 view;         // the liquid's space to eye space: a rotation or reflection, and a shift
    mat4 eye_to_env;   // rotation from eye space to the environment map's space (+y up)
    vec4 to_pixel;     // ax, ay, bx, by: pixel = a * v.xy + b
    vec4 viewport;     // width, height in pixels; near plane; unused
    vec4 smoothing;    // sigma; largest update; grazing limit; unused
    vec4 search;       // converged |f|; accepted |f|; largest depth spread that is interpolated; index of refraction
    vec4 absorption;   // rgb coefficient; w unused
    vec4 bounds_min;   // box around everything drawn
    vec4 bounds_max;
    vec4 scene;        // host scene: P22, P23 over the radius, cleared depth value; w: 1 if the eye is inside the body
    uvec4 particles;   // count; unused; largest point size in pixels; 1 to draw quads only
};

// Indirect draws of one class and side: points, then quads (VkDrawIndirectCommand each).
struct Draws {
    uvec4 points; // vertices, instances, first vertex, first instance
    uvec4 quads;
};

// Push constants of the preparation. Lengths are world units times a power of two that brings the radius into 1..2: that
// rounds nothing, and squares of lengths stay within float32 at any scale.
struct Prepare {
    uvec4 source;   // particles; where positions begin and how far apart they are, in words; entries a particle has in the sort
    vec4 lengths;   // edge of a cell; particle radius r; support h; reach of the neighbours that shape ellipsoids, 2 h
    vec4 classes;   // splash below this share of the filled body's density; last class kept below this one; sum of a filled body's weights; the power of two
    vec4 shape;     // lambda; 1 / largest ratio of semi-axes; longest semi-axis and variance of a filled body in r and its square
    uvec4 options;  // fewest neighbours; pass of the sort; 1 if last classes are there; cells to either side that hold neighbours
};

// Push constants of the splat pass.
struct Splat {
    uvec4 what; // class, side, 2 unused
};
