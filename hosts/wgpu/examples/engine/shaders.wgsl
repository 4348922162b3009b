// Rectangles in pixels, each of one depth and one colour.
struct Rect {
    @location(0) low: vec2<f32>,
    @location(1) span: vec2<f32>,
    @location(2) color: vec4<f32>,
    @location(3) depth: f32,
}

struct Drawn {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) color: vec4<f32>,
}

override width: f32;
override height: f32;

@vertex
fn rect(@builtin(vertex_index) index: u32, r: Rect) -> Drawn {
    let corner = vec2<f32>(f32(index & 1u), f32(index >> 1u));
    let pixel = r.low + corner * r.span;
    let ndc = 2.0 * pixel / vec2<f32>(width, height) - 1.0;
    return Drawn(vec4<f32>(ndc.x, -ndc.y, r.depth, 1.0), r.color);
}

@fragment
fn fill(d: Drawn) -> @location(0) vec4<f32> {
    return d.color;
}

@group(0) @binding(0) var scene: texture_2d<f32>;

@vertex
fn whole(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn copy(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    return textureLoad(scene, vec2<i32>(at.xy), 0);
}
