// What happens to light at one water surface.

// Reflectance. `air` and `water` are the cosines on either side of the interface.
float fresnel(float air, float water, float ior, bool exact) {
    if (exact) {
        float s = (air - ior * water) / (air + ior * water);
        float p = (ior * air - water) / (ior * air + water);
        return 0.5 * (s * s + p * p);
    }
    // Schlick, always with the cosine in air: leaving water that is the cosine of the transmitted angle.
    float r0 = (ior - 1.0) / (ior + 1.0);
    float x = 1.0 - air;
    return r0 * r0 + (1.0 - r0 * r0) * x * x * x * x * x;
}

// Encodes linear light as sRGB (IEC 61966-2-1), clamped to 0..1.
vec3 encode_srgb(vec3 c) {
    c = clamp(c, 0.0, 1.0);
    return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}
