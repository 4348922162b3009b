// The density field's directory: which bricks there are. An open-addressed table of one word a slot; the bricks' whole coordinates are
// in their records.

uint field_hash(ivec3 brick) {
    uint h = uint(brick.x) * 0x9e3779b1u ^ uint(brick.y) * 0x85ebca77u ^ uint(brick.z) * 0xc2b2ae3du;
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    return h ^ (h >> 13);
}
uint field_tag(uint hash) { return hash >> FIELD_TAG == 0u ? 1u : hash >> FIELD_TAG; }
uint field_number(uint word) { return word & uint(FIELD_MOST_BRICKS); }
bool field_has(uint word, uint flag) { return ((word >> FIELD_FLAGS) & flag) != 0u; }

// Of a node or cell, the brick that has it, and which of its nodes that is.
ivec3 field_brick(ivec3 node) { return node >> FIELD_BRICK_BITS; }
uint field_local(ivec3 node) {
    uvec3 l = uvec3(node) & uint(FIELD_BRICK - 1);
    return l.x | l.y << FIELD_BRICK_BITS | l.z << (2 * FIELD_BRICK_BITS);
}
