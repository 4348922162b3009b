//! The view by tiles: what light does in those that may have liquid is drawn there alone, and what is seen past the liquid in the
//! others (`glsl/optics/tiles.vert`, `tiles.frag`).

use super::{environment, walk::variant};
use crate::{
    input::Background,
    plan::{Call, External, Plan, Target, Vertices},
    scene::Scene,
    shader::{Shader, TILES_FRAG, TILES_VERT, VIEW_VERT},
};
use ash::vk;

/// What is known of each tile of the view, and after the last of the whole view: a buffer.
#[derive(Clone, Copy)]
pub(crate) struct Tiles {
    /// So many words a tile. The first is the smallest depth that may have liquid, as bits of a float: infinity where there
    /// is none.
    pub bounds: Target,
    pub words: u32,
    /// Edge of a tile in pixels.
    pub edge: u32,
}

impl Tiles {
    /// Tiles of the view without liquid; `pass` fills them with that.
    pub fn empty(plan: &mut Plan, pass: &'static str, name: &'static str, words: u32, edge: u32) -> Tiles {
        let number: u64 = plan.size().map(|s| u64::from(s.div_ceil(edge))).iter().product();
        let bounds = plan.buffer(name, 4 * u64::from(words) * (number + 1));
        plan.fill(pass, bounds, 0, vk::WHOLE_SIZE, f32::INFINITY.to_bits());
        Tiles { bounds, words, edge }
    }

    /// A draw of the tiles that may have liquid, or of those that are `empty`.
    pub fn draw(&self, plan: &Plan, scene: &Scene, fragment: &'static Shader, empty: bool) -> (Call, Vertices) {
        let points = scene.points && !scene.settings.drawing.quads_only;
        let call = Call::draw(&TILES_VERT[usize::from(!points)], fragment)
            .read("bounds", self.bounds)
            .constant("EMPTY", empty)
            .constant("WORDS", self.words)
            .constant("EDGE", self.edge);
        let [across, down] = plan.size().map(|s| s.div_ceil(self.edge));
        match points {
            true => (call.topology(vk::PrimitiveTopology::POINT_LIST), Vertices::Direct(across * down)),
            false => (call, Vertices::Direct(6 * across * down)),
        }
    }
}

/// The draw of what is seen where there is no liquid: in empty tiles, or without tiles everywhere. The host's picture stays
/// where it is.
pub(super) fn past(plan: &mut Plan, scene: &Scene, tiles: Option<&Tiles>) -> Option<(Call, Vertices)> {
    if scene.background == Background::Host {
        return None;
    }
    let fragment = &TILES_FRAG[variant(scene)];
    let (call, vertices) = match tiles {
        Some(tiles) => tiles.draw(plan, scene, fragment, true),
        None => (Call::draw(&VIEW_VERT, fragment), Vertices::Direct(3)),
    };
    let call = environment::seen_by(plan, scene, call).constant("ENCODE_SRGB", scene.encode_srgb());
    Some((with_scene(plan, scene, call), vertices))
}

/// The same call with the host's scene, where there is one.
pub(super) fn with_scene(plan: &mut Plan, scene: &Scene, call: Call) -> Call {
    match scene.has_scene {
        true => call
            .read("scene_color", plan.given(External::SceneColor))
            .read("scene_depth", plan.given(External::SceneDepth)),
        false => call,
    }
}
