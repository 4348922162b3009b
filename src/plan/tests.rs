//! What a plan refuses: mistakes of passes are found before anything is recorded.

use super::{Call, External, Groups, Home, Plan, Rendering, Target, Vertices};
use crate::{
    device::Limits,
    resources::ImageSpec,
    scene::Scene,
    shader::{CURVATURE_FLOW_COMP, NORMALS_COMP, PLANE_FIT_COMP, SPLAT_VERT, THICKNESS_FRAG, WALLS_COMP},
};
use ash::vk::{CompareOp, Format};

struct Maps {
    depth: Target,
    normal: Target,
    out: Target,
    walls: Target,
}

fn plan() -> (Plan, Maps) {
    let mut plan = Plan::new([8, 6]);
    plan.work_for(Home::View, "test");
    let depth = plan.map("depth", Format::R32_SFLOAT, 2);
    let normal = plan.map("normal", Format::R32_UINT, 2);
    let out = plan.map("out", Format::R32_SFLOAT, 2);
    let walls = plan.flat("walls", Format::R32G32B32A32_SFLOAT);
    (plan, Maps { depth, normal, out, walls })
}

fn tiles(m: &Maps) -> Call {
    reading(m).write("walls", m.walls)
}

fn reading(m: &Maps) -> Call {
    both(Call::compute(&WALLS_COMP)).read("body_depth", m.depth).read("splash_depth", m.depth)
}

fn both(call: Call) -> Call {
    call.constant("HAS_SPLASH", true).constant("HAS_BODY", true)
}

/// What is said of a dispatch.
fn said(call: impl FnOnce(&mut Plan, &Maps) -> Call) -> String {
    let (mut plan, maps) = plan();
    let call = call(&mut plan, &maps);
    plan.dispatch("pass", call, Groups::Direct([1, 1, 1]));
    plan.finish().err().map_or_else(String::new, |e| e.to_string())
}

#[track_caller]
fn refused(call: impl FnOnce(&mut Plan, &Maps) -> Call, why: &str) {
    let said = said(call);
    assert!(said.starts_with("pass pass: ") && said.contains(why), "\"{said}\" does not say \"{why}\"");
}

#[test]
fn names_have_to_be_the_shaders() {
    assert_eq!(said(|_, m| tiles(m)), "");
    refused(|_, m| tiles(m).read("body_dept", m.depth), "no shader has a binding body_dept");
    refused(|_, m| tiles(m).read("body_depth", m.depth), "body_depth is bound twice");
    refused(
        |_, m| both(Call::compute(&WALLS_COMP)).read("body_depth", m.depth).write("walls", m.walls),
        "nothing is bound to splash_depth",
    );
    refused(|_, m| tiles(m).constant("HAS_FOAM", true), "no shader has a constant HAS_FOAM");
    refused(|_, m| tiles(m).constant("HAS_BODY", true), "the constant HAS_BODY is set twice");
    refused(|_, m| tiles(m).push("sigma", 1.0), "no shader has a push constant sigma");
    refused(|_, m| tiles(m).push_all(&[1.0f32]), "4 bytes are pushed, the shaders have 0");
    let bare = |m: &Maps| {
        let call = Call::compute(&PLANE_FIT_COMP).constant("local_size_x", 8).constant("local_size_y", 8);
        let call = call.constant("EUCLIDEAN", true).constant("PROJECTED", true).counting(&["a", "b", "c", "d"]);
        call.read("depth_in", m.depth).read("normal_raw", m.normal).write("depth_out", m.out).push("width", 1.0)
    };
    let fit = |m: &Maps| bare(m).constant("HALF_WINDOW", 4);
    assert_eq!(said(|_, m| fit(m).push("sigma", 1.0)), "");
    refused(|_, m| fit(m), "the push constant sigma is not set");
    refused(|_, m| bare(m).push("sigma", 1.0), "the constant HALF_WINDOW is not set");
    refused(|_, m| bare(m).constant("HALF_WINDOW", true), "the constant HALF_WINDOW is Some(Int), not Bool");
    refused(|_, m| fit(m).push("sigma", 1), "the push constant sigma is Some(Float), not Uint");
    refused(|_, m| fit(m).push("width", 1.0), "the push constant width is set twice");
}

#[test]
fn kinds_have_to_be_the_shaders() {
    // A map of normals holds integers.
    refused(
        |_, m| {
            both(Call::compute(&WALLS_COMP))
                .read("body_depth", m.normal)
                .read("splash_depth", m.depth)
                .write("walls", m.walls)
        },
        "and normal is not",
    );
    // Two images for each other.
    let swapped = |m: &Maps| Call::compute(&NORMALS_COMP[1]).read("depth_in", m.normal).read("normal_raw", m.depth);
    refused(
        |plan, m| swapped(m).write("normal_out", plan.map("n", Format::R32_UINT, 2)).counting(&["x"]),
        "depth_in is",
    );
    refused(|plan, m| tiles(m).update("frame", plan.buffer("b", 4)), "frame");
    let buffer = |plan: &mut Plan| plan.buffer("b", 4);
    refused(
        |plan, m| {
            both(Call::compute(&WALLS_COMP))
                .read("body_depth", buffer(plan))
                .read("splash_depth", m.depth)
                .write("walls", m.walls)
        },
        "and b is not",
    );
    // Without layers, where the shader has an array.
    refused(
        |plan, m| {
            both(Call::compute(&WALLS_COMP))
                .read("body_depth", plan.flat("flat", Format::R32_SFLOAT))
                .read("splash_depth", m.depth)
                .write("walls", m.walls)
        },
        "and flat is not",
    );
    refused(
        |_, m| {
            both(Call::compute(&WALLS_COMP))
                .write("body_depth", m.depth)
                .read("splash_depth", m.depth)
                .write("walls", m.walls)
        },
        "sampled images are read",
    );
}

#[test]
fn storage_images_have_the_shaders_format() {
    let other = |plan: &mut Plan| plan.flat("wide", Format::R32G32_SFLOAT);
    refused(|plan, m| reading(m).write("walls", other(plan)), "and wide is not");
}

#[test]
fn a_step_does_not_read_what_it_writes() {
    let flow = |m: &Maps| {
        let call = Call::compute(&CURVATURE_FLOW_COMP).read("depth_in", m.depth).counting(&["a", "b"]);
        call.push("time_step", 1.0).push("jump", 1.0)
    };
    assert_eq!(said(|_, m| flow(m).write("depth_out", m.out)), "");
    refused(|_, m| flow(m).write("depth_out", m.depth), "depth is written in one step and used in it once more");
}

#[test]
fn attachments_fit_together() {
    let say = |draw: &dyn Fn(&mut Plan, &Maps) -> Rendering| {
        let (mut plan, maps) = plan();
        let rendering = draw(&mut plan, &maps);
        // No draw at all: what is drawn into is looked at all the same.
        plan.render("pass", rendering, Vec::<(Call, Vertices)>::new());
        plan.finish().err().map_or_else(String::new, |e| e.to_string())
    };
    assert_eq!(say(&|_, m| Rendering::into(m.depth, 1).and(m.normal, 0)), "");
    assert!(say(&|_, m| Rendering::into(m.depth, 2)).contains("depth is no attachment"));
    assert!(say(&|p, _| Rendering::into(p.buffer("b", 4), 0)).contains("b is no attachment"));
    let small = |p: &mut Plan| {
        let spec =
            ImageSpec { format: Format::R32_SFLOAT, size: [4, 3], layers: 1, array: false, usage: Default::default() };
        p.image("small", spec)
    };
    assert_eq!(say(&|p, _| Rendering::into(small(p), 0)), "");
    assert!(say(&|p, m| Rendering::into(small(p), 0).and(m.depth, 0)).contains("different sizes"));
    let test = |p: &mut Plan| p.flat("test", Format::D32_SFLOAT);
    assert!(
        say(&|p, _| {
            let (into, test) = (small(p), test(p));
            Rendering::into(into, 0).testing(test, 0.0, CompareOp::GREATER)
        })
        .contains("different sizes")
    );
}

/// A fragment shader writes each colour that is attached, of its type, and no other.
#[test]
fn attachments_are_the_shaders() {
    let say = |into: &dyn Fn(&mut Plan, &Maps) -> Rendering, call: fn(Call) -> Call| {
        let (mut plan, maps) = plan();
        let rendering = into(&mut plan, &maps);
        let bounds = plan.given(External::Centers);
        let draw = call(Call::draw(&SPLAT_VERT[0], &THICKNESS_FRAG[0])).read("order", bounds);
        plan.render("pass", rendering, vec![(draw, Vertices::Direct(3))]);
        plan.finish().err().map_or_else(String::new, |e| e.to_string())
    };
    // The right attachments: what is missing is told next.
    assert!(say(&|_, m| Rendering::into(m.depth, 0), |c| c).contains("no shader has a binding order"));
    assert!(say(&|_, m| Rendering::into(m.normal, 0), |c| c).contains("to colour 0, which is R32_UINT"));
    let two = |_: &mut Plan, m: &Maps| Rendering::into(m.depth, 0).and(m.out, 0);
    assert!(say(&two, |c| c).contains("does not write colour 1, which is attached"));
    let none = |_: &mut Plan, _: &Maps| Rendering { colors: Vec::new(), depth: None };
    assert!(say(&none, |c| c).contains("writes colour 0, which is not attached"));
    assert!(say(&|_, m| Rendering::into(m.depth, 0), |c| c.counting(&["a"])).contains("only dispatches count"));
}

#[test]
fn no_two_resources_share_a_name() {
    let (mut plan, _) = plan();
    plan.map("depth", Format::R32_SFLOAT, 1);
    let said = plan.finish().err().expect("refused").to_string();
    assert!(said.contains("two resources have this name"), "{said}");
}

/// Of some GPU.
const LIMITS: Limits = Limits {
    point_size: 64.0,
    image_size: 4096,
    timestamp_period: None,
    timestamp_mask: 0,
    storage_size: 1 << 30,
    texels_size: 1 << 20,
    memory: 1 << 32,
    cpu: false,
};

/// Every preset and every member with its defaults can be planned, with and without particles and a scene.
#[test]
fn every_method_has_a_plan() {
    use crate::{Settings, frame, layers::Layers, optics::Optics, smooth::Smooth};
    let (mut planned, mut refused) = (0, 0);
    for layers in Layers::all() {
        for smooth in Smooth::all() {
            for optics in Optics::all() {
                let settings = Settings::from(crate::Method { layers, smooth, optics });
                if settings.validate().is_err() {
                    refused += 1;
                    continue;
                }
                for classes in [[0, 0], [3, 0], [0, 3], [2, 5]] {
                    for has_scene in [false, true] {
                        let scene = Scene { has_scene, ..Scene::new(&settings, [16, 9], classes, &LIMITS) };
                        let plan = frame::plan(&scene).unwrap_or_else(|e| panic!("{settings:?}: {e}"));
                        assert!(!plan.steps.is_empty() && plan.descriptors().0 as usize >= plan.recipes().len());
                        planned += 1;
                    }
                }
            }
        }
    }
    assert!(planned > 300 && refused > 10, "{planned}, {refused}");
}

/// Four particles an invocation where that is a CPU's, one on GPUs; and what is asked for.
#[test]
fn devices_take_as_many_particles_at_once_as_suits_them() {
    use crate::{AtOnce, Settings, frame, prepare::DevicePositions, renderer::Amount};
    let positions = DevicePositions::packed(ash::vk::Buffer::null(), 1000, 1.0);
    for (at_once, cpu, four) in [
        (AtOnce::ByDevice, true, true),
        (AtOnce::ByDevice, false, false),
        (AtOnce::Four, false, true),
        (AtOnce::One, true, false),
    ] {
        let (mut settings, limits) = (Settings::default(), Limits { cpu, ..LIMITS });
        settings.drawing.at_once = at_once;
        let mut scene = Scene::new(&settings, [16, 9], [0, 0], &limits);
        Amount::OnDevice(&positions).fill(&mut scene).expect("positions");
        let plan = frame::plan(&scene).expect("a frame");
        let names: Vec<_> = plan.recipes().iter().map(|r| r.name()).filter(|n| n.starts_with("shape.comp")).collect();
        assert!(names.len() == 1 && names[0].contains("ALONE") != four, "{at_once:?}, {cpu}: {names:?}");
    }
}
