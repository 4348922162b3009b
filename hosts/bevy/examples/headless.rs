//! A ball of liquid before Bevy's clear colour, without a window: the twelfth frame, as a PNG.
//!
//! ```sh
//! cargo run --manifest-path hosts/bevy/Cargo.toml --example headless -- water.png
//! ```

use bevy::{
    app::{PluginsState, ScheduleRunnerPlugin},
    camera::RenderTarget,
    core_pipeline::tonemapping::Tonemapping,
    prelude::*,
    render::{
        gpu_readback::{Readback, ReadbackComplete},
        render_resource::{TextureFormat, TextureUsages},
    },
    window::ExitCondition,
};
use meniscus_bevy::{DevicePlugin, Liquid, LiquidPlugin, liquid_camera};

const SIZE: [u32; 2] = [320, 240];
const RADIUS: f32 = 0.04;
const FRAMES: usize = 12;

#[derive(Default, Resource)]
struct Picture(Vec<u8>);

fn main() -> std::result::Result<(), Box<dyn std::error::Error>> {
    let file = std::env::args().nth(1).unwrap_or_else(|| "water.png".into());
    let mut app = App::new();
    app.add_plugins(DevicePlugin)
        .add_plugins(DefaultPlugins.set(WindowPlugin {
            primary_window: None,
            exit_condition: ExitCondition::DontExit,
            ..default()
        }))
        .add_plugins((ScheduleRunnerPlugin::run_once(), LiquidPlugin))
        .insert_resource(ClearColor(Color::linear_rgb(0.7, 0.3, 0.1)))
        .init_resource::<Picture>()
        .add_systems(Startup, setup);
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
    for _ in 0..FRAMES {
        app.update();
    }
    let picture = std::mem::take(&mut app.world_mut().resource_mut::<Picture>().0);
    let mut png = png::Encoder::new(std::fs::File::create(&file)?, SIZE[0], SIZE[1]);
    png.set_color(png::ColorType::Rgba);
    png.write_header()?.write_image_data(&picture)?;
    Ok(())
}

fn setup(mut commands: Commands, mut images: ResMut<Assets<Image>>) {
    let mut image = Image::new_target_texture(SIZE[0], SIZE[1], TextureFormat::Rgba8UnormSrgb, None);
    image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
    let image = images.add(image);
    commands
        .spawn(Readback::texture(image.clone()))
        .observe(|read: On<ReadbackComplete>, mut picture: ResMut<Picture>| picture.0.clone_from(&read.data));
    let axis = || (-6..=6).map(|i| 2.0 * RADIUS * i as f32);
    let lattice = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| Vec3::new(x, y, z))));
    let ball = lattice.filter(|p| p.length() < 12.0 * RADIUS);
    commands.spawn((
        liquid_camera(),
        Liquid::new(ball, RADIUS),
        RenderTarget::Image(image.into()),
        Tonemapping::None,
        Transform::from_xyz(0.0, 0.6, 2.2).looking_at(Vec3::ZERO, Vec3::Y),
    ));
}
