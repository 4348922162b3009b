// The density field's directory: which blocks of bricks there are, in an open-addressed table.

uint field_hash(ivec3 block) {
    uint h = uint(block.x) * 0x9e3779b1u ^ uint(block.y) * 0x85ebca77u ^ uint(block.z) * 0xc2b2ae3du;
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    return h ^ (h >> 13);
}
uint field_key(ivec3 block, ivec3 base) {
    uvec3 k = uvec3(block - base + FIELD_KEY_BELOW);
    bool near = ((k.x | k.y | k.z) >> FIELD_KEY_BITS) == 0u;
    return near ? (k.x | k.y << FIELD_KEY_BITS | k.z << (2 * FIELD_KEY_BITS)) + 1u : FIELD_FAR | field_hash(block) >> 1;
}

// Of a node or cell, the brick that has it, and which of its nodes that is; in the same way a brick's block, and its place in that.
ivec3 field_brick(ivec3 node) { return node >> FIELD_BRICK_BITS; }
uint field_local(ivec3 node) {
    uvec3 l = uvec3(node) & uint(FIELD_BRICK - 1);
    return l.x | l.y << FIELD_BRICK_BITS | l.z << (2 * FIELD_BRICK_BITS);
}
ivec3 field_from_local(uint k) { return ivec3(k, k >> FIELD_BRICK_BITS, k >> (2 * FIELD_BRICK_BITS)) & (FIELD_BRICK - 1); }

// The lowest of some bits, which it is taken out of.
uint field_next(inout uint bits) {
    uint k = uint(findLSB(bits));
    bits &= bits - 1u;
    return k;
}
bool field_bit(uvec2 bits, uint k) { return ((k < 32u ? bits.x : bits.y) >> (k & 31u) & 1u) != 0u; }
// How many bits there are before one.
uint field_before(uvec2 bits, uint k) {
    uint below = (1u << (k & 31u)) - 1u;
    return uint(bitCount(k < 32u ? bits.x & below : bits.x) + bitCount(k < 32u ? 0u : bits.y & below));
}

// The center of a ball, in spacings from its brick's first node on.
uint field_packed_ball(vec3 center) {
    uvec3 q = uvec3((center + float(FIELD_BALL_BELOW)) * float(FIELD_BALL_STEPS) + 0.5);
    return q.x | q.y << FIELD_BALL_BITS | q.z << (2 * FIELD_BALL_BITS);
}
vec3 field_ball(uint word) {
    uvec3 q = uvec3(word, word >> FIELD_BALL_BITS, word >> (2 * FIELD_BALL_BITS)) & ((1u << FIELD_BALL_BITS) - 1u);
    return vec3(q) / float(FIELD_BALL_STEPS) - float(FIELD_BALL_BELOW);
}
