//! The one system.

use crate::Liquid;
use bevy::{
    platform::collections::HashMap,
    prelude::*,
    render::{
        renderer::{RenderAdapter, RenderContext, ViewQuery},
        view::{ExtractedView, ViewDepthTexture, ViewTarget},
    },
};
use meniscus_wgpu::{
    Frame, Scene, camera,
    meniscus::{Background, Equirect, prepare},
};
use std::sync::{Arc, Mutex, PoisonError};

/// Bevy submits a frame when the one before the last is done.
const FRAMES_IN_FLIGHT: u32 = 4;

/// A renderer for each camera, as long as the application lives.
#[derive(Default, Resource)]
pub(crate) struct Drawn(Mutex<HashMap<Entity, Renderer>>);

struct Renderer {
    liquid: meniscus_wgpu::Liquid,
    given: Option<Liquid>,
}

/// Draws a camera's liquid.
pub(crate) fn draw(
    view: ViewQuery<(&ExtractedView, &ViewTarget, &ViewDepthTexture, &Liquid)>,
    adapter: Res<RenderAdapter>,
    drawn: Res<Drawn>,
    mut context: RenderContext,
) -> Result {
    let entity = view.entity();
    let (view, target, depth, liquid) = view.into_inner();
    let mut drawn = drawn.0.lock().unwrap_or_else(PoisonError::into_inner);
    if !drawn.contains_key(&entity) {
        let device = context.render_device().wgpu_device();
        // SAFETY: Bevy opened the device with what `DevicePlugin` added.
        let mut made =
            unsafe { meniscus_wgpu::Liquid::new(&adapter, device, target.main_texture_format(), FRAMES_IN_FLIGHT) }?;
        // SAFETY: Bevy submits it with this frame, before it.
        context.add_command_buffer(unsafe { made.set_environment(&Equirect::procedural_sky()) }?);
        drawn.insert(entity, Renderer { liquid: made, given: None });
    }
    let Some(renderer) = drawn.get_mut(&entity) else {
        return Ok(());
    };
    renderer.give(liquid)?;

    // Bevy has a camera's picture twice: what is refracted is read from one, and the liquid drawn into a copy of it.
    let picture = target.post_process_write();
    context.command_encoder().copy_texture_to_texture(
        picture.source_texture.as_image_copy(),
        picture.destination_texture.as_image_copy(),
        picture.source_texture.size(),
    );
    let projection = view.clip_from_view;
    let camera = camera(
        view.world_from_view.to_matrix().inverse().to_cols_array_2d(),
        projection.to_cols_array_2d(),
        // Bevy's perspective projections are infinite, with reversed depth: their near plane is this element.
        projection.w_axis.z,
    );
    let frame = Frame {
        camera: &camera,
        settings: &liquid.settings,
        output: picture.destination,
        scene: Some(Scene { color: picture.source, depth: depth.view(), cleared_depth: 0.0 }),
        background: Background::Host,
    };
    // SAFETY: Bevy keeps a camera's textures while frames use them, and submits command buffers in this order.
    for commands in unsafe { renderer.liquid.record(&frame, |input| input) }? {
        context.add_command_buffer(commands);
    }
    Ok(())
}

impl Renderer {
    /// Prepares particles that are others than before.
    fn give(&mut self, liquid: &Liquid) -> Result {
        let same = |given: &Liquid| Arc::ptr_eq(&given.positions, &liquid.positions) && given.radius == liquid.radius;
        if !self.given.as_ref().is_some_and(same) {
            let input = prepare::Input::new(&liquid.positions, liquid.radius);
            self.liquid.renderer().set_particles(&prepare::prepare(&input, &Default::default())?.0)?;
            self.liquid.renderer().set_points(&prepare::points(&input, &Default::default())?)?;
            self.given = Some(liquid.clone());
        }
        Ok(())
    }
}
