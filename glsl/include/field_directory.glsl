// Looks blocks of the density field up in its directory, of which `directory_texel(i)` gives the i-th four words.
const uint FIELD_SLOT_TEXELS = uint(FIELD_SLOT) / 4u;

// The slot of a block, and its first four words; that of one which is not there has nothing in it.
uint field_slot(ivec3 block, ivec3 base, uint slots, out uvec4 words) {
    uint key = field_key(block, base), slot = field_hash(block) & (slots - 1u), found = slots;
    bool done = false;
    for (uint i = 0u; i < FIELD_PROBES && !done; ++i) {
        words = directory_texel(FIELD_SLOT_TEXELS * slot);
        bool same = words.x == key;
        // A loop, since drivers on CPUs may run a branch for all invocations that go together where none takes it.
        for (bool far = same && key >= FIELD_FAR; far; far = false)
            same = ivec3(directory_texel(FIELD_SLOT_TEXELS * slot + FIELD_PLACE / 4u).xyz) == block;
        if (same) found = slot;
        done = same || words.x == 0u;
        slot = (slot + 1u) & (slots - 1u);
    }
    if (found == slots) words = uvec4(0u);
    return found;
}
// Of those four words one bit for each brick that there is.
uvec2 field_there(uvec4 words) { return words.zw; }
