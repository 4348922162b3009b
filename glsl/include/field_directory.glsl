// Looks blocks of the density field up in its directory, of which `directory_texel(i)` gives the i-th four words.
const uint FIELD_SLOT_TEXELS = uint(FIELD_SLOT) / 4u;

// Where a slot's block lies.
ivec3 field_place(uint slot) { return ivec3(directory_texel(FIELD_SLOT_TEXELS * slot + FIELD_PLACE / 4u).xyz); }

// The slot of a block, and its first four words; that of one which is not there has nothing in it.
uint field_slot(ivec3 block, ivec3 base, uint slots, out uvec4 words) {
    uint key = field_key(block, base), slot = field_hash(block) & (slots - 1u), found = slots;
    bool done = false;
    for (uint i = 0u; i < FIELD_PROBES && !done; ++i) {
        words = directory_texel(FIELD_SLOT_TEXELS * slot);
        bool same = words.x == key;
        if (same && key >= FIELD_FAR) same = field_place(slot) == block;
        if (same) found = slot;
        done = same || words.x == 0u;
        slot = (slot + 1u) & (slots - 1u);
    }
    if (found == slots) words = uvec4(0u);
    return found;
}
// Of those four words one bit for each brick that there is.
uvec2 field_there(uvec4 words) { return words.zw; }
// And the number of one of them, by its place in the block; 0, which is an empty brick's, where it is not there.
uint field_number(uvec4 words, uint local) {
    return field_bit(field_there(words), local) ? words[FIELD_FIRST_BRICK] + field_before(field_there(words), local) : 0u;
}
