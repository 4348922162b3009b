// Which particles can show: inside the view, and on some pixel not certainly behind the body's own bounds (occlude).
// Also counts those larger than a point can be. TILES: also says in which tiles of the view anything shows.
#version 460
// Compiled with any of: TILES
#extension GL_GOOGLE_include_directive : require
#include "shared.glsl"
#include "frame.glsl"
#include "quadric.glsl"
#include "particles.glsl"
#include "groups.glsl"
#include "bounds.glsl"
layout(local_size_x = PARTICLE_GROUP) in;
layout(set = 0, binding = 4, std430) readonly buffer BoundBlock { uvec2 at[]; } bounds; // of front and back
layout(set = 0, binding = 5, std430) buffer VisibleBlock { uint at[]; } visible;
layout(set = 0, binding = 6, std430) buffer LargeBlock { uint at[]; } large; // particles larger than a point, by class
#ifdef TILES
layout(set = 0, binding = 7, std430) buffer TileBlock { uint at[]; } tiles; // 0 where something may show; after the last: anywhere
#endif
layout(constant_id = 0) const bool OCCLUSION_CULLING = true;
layout(constant_id = 1) const bool BACK_SIDES = true;

#ifdef TILES
// Notes that a particle shows within these pixels. One more each way: draws cover half a pixel more, and the ray cast rounds.
void mark(ivec2 lo, ivec2 hi) {
    ivec2 size = (ivec2(frame.size) + VIEW_TILE - 1) / VIEW_TILE;
    ivec2 from = max(lo - 1, ivec2(0)) / VIEW_TILE, to = min(hi + 1, ivec2(frame.size) - 1) / VIEW_TILE, many = to - from + 1;
    // Walking the tiles of large ones would cost more than it saves.
    if (many.x * many.y > MOST_TILES) from = to = ivec2(0, size.y);
    for (int y = from.y; y <= to.y; ++y)
        for (int x = from.x; x <= to.x; ++x) {
            int tile = y * size.x + x;
            if (tiles.at[tile] != 0u) tiles.at[tile] = 0u;
        }
}
#endif

void main() {
    uint i = invocation();
    if (i >= frame.count) return;
    Particle p;
    int cls;
    if (!particle(i, p, cls) || repeats(i)) {
        visible.at[i] = 0u;
        return;
    }
    Ellipsoid e = to_eye(p);
    vec4 box = pixel_bounds(e);
    ivec2 lo = whole(ceil(box.xy - 0.5)), hi = whole(floor(box.zw - 0.5));
    uint wanted = BACK_SIDES ? (VISIBLE_FRONT | VISIBLE_BACK) : VISIBLE_FRONT;
    uint verdict = all(lessThanEqual(lo, hi)) ? wanted : 0u;
    float near = -e.center.z - sqrt(e.sd.z), far = -e.center.z + sqrt(e.sd.z);
    // Few particles are larger than 64 pixels, and those show; walking their pixels would cost more than drawing them.
    if (OCCLUSION_CULLING && cls == CLASS_BODY && verdict != 0u && near > frame.near && all(lessThan(hi - lo, ivec2(LARGE)))) {
        verdict = 0u;
        uint width = uint(frame.size.x);
        vec2 scale = frame.pixel_scale, origin = frame.pixel_origin;
        Cast c = cast_of(e);
        uvec2 best = uvec2(front_bound(max(near - DEPTH_ROUNDING, 0.0)), back_bound(far + DEPTH_ROUNDING));
        for (int y = lo.y; y <= hi.y && verdict != wanted; ++y) {
            for (int x = lo.x; x <= hi.x && verdict != wanted; ++x) {
                uvec2 bound = bounds.at[uint(y) * width + uint(x)];
                bool front = best.x <= bound.x, back = BACK_SIDES && best.y <= bound.y;
                // Only then the surface itself.
                float nearer, farther;
                if (!(front || back) || !hits(c, view_ray(vec2(x, y) + 0.5, origin, scale), 1.0, nearer, farther)) continue;
                if (front && front_bound(max(nearer - DEPTH_ROUNDING, 0.0)) <= bound.x) verdict |= VISIBLE_FRONT;
                if (back && back_bound(farther + DEPTH_ROUNDING) <= bound.y) verdict |= VISIBLE_BACK;
            }
        }
    }
    visible.at[i] = verdict | (cls == CLASS_BODY ? VISIBLE_BODY : 0u);
#ifdef TILES
    if (verdict != 0u) mark(lo, hi);
#endif
    // One pixel more than the box, for the centre's rounding.
    float size = max(box.z - box.x, box.w - box.y) + 1.0;
    if (verdict != 0u && size > float(frame.largest_point)) atomicAdd(large.at[cls], 1u);
}
