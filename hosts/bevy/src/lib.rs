//! meniscus in Bevy: [`DevicePlugin`] has Bevy open a device that meniscus can use, and one system of [`LiquidPlugin`] draws
//! particles over and through what a camera sees, after opaque and transparent passes and before tone mapping.
//!
//! ```text
//! App::new()
//!     .add_plugins(DevicePlugin)           // before Bevy's own
//!     .add_plugins(DefaultPlugins)
//!     .add_plugins(LiquidPlugin);
//! commands.spawn((liquid_camera(), Liquid::new(positions, radius)));
//! ```
//!
//! What wgpu knows of textures, and how it stays true, is said in [`meniscus_wgpu`].

mod draw;

use bevy::{
    camera::{CameraMainTextureUsages, Hdr},
    core_pipeline::{Core3dSystems, schedule::Core3d},
    prelude::*,
    render::{
        RenderApp,
        extract_component::{ExtractComponent, ExtractComponentPlugin},
        render_resource::TextureUsages,
        renderer::raw_vulkan_init::RawVulkanInitSettings,
    },
};
use meniscus_wgpu::meniscus::{self, Settings};
use std::sync::Arc;

pub use meniscus_wgpu;

/// Has Bevy enable what meniscus needs on the device that it opens. Add it before Bevy's own plugins.
pub struct DevicePlugin;

impl Plugin for DevicePlugin {
    fn build(&self, app: &mut App) {
        let mut settings = app.world_mut().get_resource_or_init::<RawVulkanInitSettings>();
        // SAFETY: features are added, and only where the adapter has them.
        unsafe {
            settings.add_create_device_callback(|args, adapter, _| match meniscus_wgpu::check(adapter) {
                Ok(()) => meniscus_wgpu::enable(args),
                Err(e) => error!("no liquid on this device: {e}"),
            });
        }
    }
}

/// Draws the [`Liquid`] of each camera that has one. Add it after Bevy's own plugins.
pub struct LiquidPlugin;

impl Plugin for LiquidPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(ExtractComponentPlugin::<Liquid>::default());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<draw::Drawn>()
            .add_systems(Core3d, draw::draw.after(Core3dSystems::MainPass).before(Core3dSystems::EarlyPostProcess));
    }
}

/// Particles, as the camera that this is a component of sees them. Cheap to clone: given anew, they are prepared anew.
#[derive(Clone, Component, ExtractComponent)]
pub struct Liquid {
    positions: Arc<[meniscus::glam::Vec3]>,
    radius: f32,
    /// Method, liquid and drawing.
    pub settings: Settings,
}

impl Liquid {
    /// Particles of one radius, in Bevy's world.
    pub fn new(positions: impl IntoIterator<Item = Vec3>, radius: f32) -> Liquid {
        // Bevy's glam is another version of the same.
        let positions = positions.into_iter().map(|p| p.to_array().into()).collect();
        Liquid { positions, radius, settings: Settings::default() }
    }
}

/// What a camera of [`Liquid`] is: of linear colours, which can be copied, and of one sample a pixel, whose depth can be read.
pub fn liquid_camera() -> impl Bundle {
    let depth = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
    (
        Camera3d { depth_texture_usages: depth.into(), ..default() },
        CameraMainTextureUsages::default().with(TextureUsages::COPY_DST),
        Hdr,
        Msaa::Off,
    )
}
