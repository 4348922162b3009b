// The frame's uniform block and what follows from it. Every pass binds it at 0.
layout(set = 0, binding = 0, std140) uniform FrameBlock { Frame frame; };

// A float without fraction as a whole number, below 2^22 of either sign: there are drivers that convert lane by lane.
int whole(float f) { return floatBitsToInt(f + 12582912.0) - 0x4b400000; }
ivec2 whole(vec2 f) { return floatBitsToInt(f + 12582912.0) - 0x4b400000; }
ivec3 whole(vec3 f) { return floatBitsToInt(f + 12582912.0) - 0x4b400000; }

// Direction v = (vx, vy, -1) of the view ray through a pixel position (pixel centres at +0.5): x = v d.
// Loops over pixels read the frame's origin and scale once, before them.
vec3 view_ray(vec2 pixel, vec2 origin, vec2 scale) { return vec3((pixel - origin) / scale, -1.0); }
vec3 view_ray(vec2 pixel) { return view_ray(pixel, frame.pixel_origin, frame.pixel_scale); }

// Pixel position on which an eye-space point with d > 0 lies.
vec2 project(vec3 x) { return frame.pixel_scale * (x.xy / -x.z) + frame.pixel_origin; }
