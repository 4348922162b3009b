// The host's opaque scene, pixel by pixel, and what is seen past the liquid.
#ifdef SCENE
layout(set = 0, binding = 8) uniform texture2D scene_color; // the host's opaque scene, linear
layout(set = 0, binding = 9) uniform texture2D scene_depth; // its depth buffer

const float CLEARED = 1e30; // linear depth where the host drew nothing

float scene_linear(ivec2 p) {
    float z = texelFetch(scene_depth, p, 0).x;
    return z == frame.scene_cleared ? CLEARED : frame.scene_z_offset / (z + frame.scene_z_scale);
}

bool scene_hides(ivec2 pixel, float depth) { return scene_linear(pixel) < depth; }

vec3 scene_light(ivec2 pixel) { return texelFetch(scene_color, pixel, 0).rgb; }

// Light from where a ray ends that meets neither liquid nor scene.
vec3 infinitely_far(vec3 dir) {
    if (HOST_BACKGROUND && dir.z < 0.0) {
        // The host's own sky, where it is in the view.
        vec2 p = project(dir);
        if (all(greaterThanEqual(p, vec2(0.0))) && all(lessThan(p, frame.size)) && scene_linear(ivec2(p)) == CLEARED)
            return scene_light(ivec2(p));
    }
    return env_color(dir);
}

// The background straight through a pixel.
vec3 behind(ivec2 pixel, vec3 dir) { return scene_linear(pixel) < CLEARED ? scene_light(pixel) : env_color(dir); }
#else
bool scene_hides(ivec2 pixel, float depth) { return false; }
vec3 infinitely_far(vec3 dir) { return env_color(dir); }
vec3 behind(ivec2 pixel, vec3 dir) { return env_color(dir); }
#endif
