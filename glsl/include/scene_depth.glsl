// The depth of the host's opaque scene, pixel by pixel.
#ifdef SCENE
layout(set = 0, binding = 9) uniform texture2D scene_depth; // the host's depth buffer

const float CLEARED = 1e30; // linear depth where the host drew nothing

float scene_linear(ivec2 p) {
    float z = texelFetch(scene_depth, p + ivec2(frame.scene_origin), 0).x;
    return z == frame.scene_cleared ? CLEARED : frame.scene_z_offset / (z + frame.scene_z_scale);
}

bool scene_hides(ivec2 pixel, float depth) { return scene_linear(pixel) < depth; }
#else
bool scene_hides(ivec2 pixel, float depth) { return false; }
#endif
