// The host's opaque scene, pixel by pixel, and what is seen past the liquid.
#include "scene_depth.glsl"
#ifdef SCENE
layout(set = 0, binding = 8) uniform texture2D scene_color; // the host's opaque scene, linear

vec3 scene_light(ivec2 pixel) { return texelFetch(scene_color, pixel + ivec2(frame.scene_origin), 0).rgb; }

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
vec3 infinitely_far(vec3 dir) { return env_color(dir); }
vec3 behind(ivec2 pixel, vec3 dir) { return env_color(dir); }
#endif
