// The first wall of a density field and of balls that a pixel's view ray meets.
layout(set = 0, binding = 10, std430) readonly buffer TileBlock { uvec2 at[]; } tiles; // field_tiles.comp

const int AIR = -1; // beside the classes: what a ray is in

// From the near plane, at x in the field. Where that lies in the liquid the ray is `within` it from the start, of a ball with this
// center, and t is 0; where there is nothing to meet, t is NONE.
Wall first_wall(inout Block block, ivec2 pixel, vec3 x, vec3 dir, vec3 eye_dir, inout int within, inout vec3 center, out bool stopped) {
    // From where to where the ray can meet liquid.
    uvec2 bounds = tiles.at[(pixel.y / FIELD_TILE) * ((int(frame.size.x) + FIELD_TILE - 1) / FIELD_TILE) + pixel.x / FIELD_TILE];
    float per_depth = 1.0 / (-eye_dir.z * push.spacing);
    vec2 range = vec2((uintBitsToFloat(bounds.x) - frame.near) * per_depth, (uintBitsToFloat(INFINITE - bounds.y) - frame.near) * per_depth);
    // An invocation beside the tile has nothing to look for, and drivers on CPUs may give it no bounds, and wait for it.
    if (bounds.x == INFINITE || gl_HelperInvocation) range = vec2(NONE, 0.0);
    stopped = false;
    // The near plane may lie in the liquid.
    if (range.x <= 0.0 && range.y >= 0.0) {
        uint ball;
        if (in_field(block, x, ball)) within = CLASS_BODY;
        else if (ball_around(x, ball, center)) within = CLASS_SPLASH;
    }
    Wall wall = Wall(0.0, CLASS_BODY, vec3(0.0), 0u, 0u);
    if (within == AIR) wall = find_wall(block, x, dir, false, max(range.x, 0.0), range.y + FIELD_NUDGE, stopped);
    return wall;
}
