// Floats as whole numbers by their bits: there are drivers that convert lane by lane.

// One without fraction, below 2^22 of either sign.
int whole(float f) { return floatBitsToInt(f + 12582912.0) - 0x4b400000; }
ivec2 whole(vec2 f) { return floatBitsToInt(f + 12582912.0) - 0x4b400000; }
ivec3 whole(vec3 f) { return floatBitsToInt(f + 12582912.0) - 0x4b400000; }

// The nearest to one from 0 on, below 2^23.
uint rounded(float f) { return floatBitsToUint(f + 8388608.0) & 0x7fffffu; }
uvec2 rounded(vec2 f) { return floatBitsToUint(f + 8388608.0) & 0x7fffffu; }
uvec4 rounded(vec4 f) { return floatBitsToUint(f + 8388608.0) & 0x7fffffu; }
