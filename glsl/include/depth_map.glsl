// The depth map that is smoothed, or whose normals are made: linear depth in particle radii, layer 0 the nearest fronts, layer 1 the
// farthest backs. 0: no surface. Negative: the eye is inside.
layout(set = 0, binding = 1) uniform texture2DArray depth_in;

// 0 outside the image.
float depth_at(ivec2 p, int layer) {
    if (any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, ivec2(frame.size)))) return 0.0;
    return texelFetch(depth_in, ivec3(p, layer), 0).x;
}

// Pixels that a length covers which is seen across the view axis at this depth. Pixels are taken to be square.
float projected(float size, float depth) { return size * (abs(frame.pixel_scale.y) / depth); }
