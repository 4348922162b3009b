// The density field's own space: lengths are spacings of its nodes, places are counted from the first node of the block that has the
// origin of the liquid's own space.
layout(set = 0, binding = 1, std430) readonly buffer HeadBlock { FieldHead head; };

ivec3 base_block() { return ivec3(head.base_x, head.base_y, head.base_z); }
vec3 field_part() { return vec3(head.part_x, head.part_y, head.part_z); }

vec3 to_field(vec3 eye) {
    vec3 own = transpose(mat3(frame.view)) * (eye - frame.view[3].xyz);
    return own / push.spacing + field_part();
}
vec3 to_eye(vec3 x) { return mat3(frame.view) * ((x - field_part()) * push.spacing) + frame.view[3].xyz; }
vec3 dir_to_eye(vec3 dir) { return mat3(frame.view) * dir; }

// Nothing of a bound of depths in a tile of the view.
const uint INFINITE = 0x7f800000u;
