// The frame's uniform block and what follows from it. Every pass binds it at 0.
layout(set = 0, binding = 0, std140) uniform FrameBlock { Frame frame; };
#include "whole.glsl"

// Direction v = (vx, vy, -1) of the view ray through a pixel position (pixel centres at +0.5): x = v d.
// Loops over pixels read the frame's origin and scale once, before them.
vec3 view_ray(vec2 pixel, vec2 origin, vec2 scale) { return vec3((pixel - origin) / scale, -1.0); }
vec3 view_ray(vec2 pixel) { return view_ray(pixel, frame.pixel_origin, frame.pixel_scale); }

// Pixel position on which an eye-space point with d > 0 lies.
vec2 project(vec3 x) { return frame.pixel_scale * (x.xy / -x.z) + frame.pixel_origin; }
