//! `Auto` on frames of a device: what is too slow gives way, and nothing is compiled for it.

use crate::support::{Choose, SKY, camera, each_driver, imai16, random_cloud};
use glam::Vec3;
use meniscus::{
    FrameInput, Method,
    ash::vk,
    auto::{Auto, Why},
    host::Session,
};

#[test]
fn a_budget_that_nothing_fits_leads_to_the_last_choice() {
    each_driver(|driver| {
        let size = [64, 48];
        let mut session = Session::new(driver.gpu(), size, &SKY).expect("a session");
        session
            .renderer
            .set_particles(&random_cloud(7, 1.0, Vec3::splat(-6.0), Vec3::splat(6.0), 12, 40))
            .expect("particles");
        let camera = camera(Vec3::new(2.0, 3.0, 18.0), Vec3::ZERO, size);
        let choices = ["imai16", "imai14", "green10"].map(|n| (n, Method::preset(n).expect("it is published")));
        let mut auto = Auto::new(1e-6, choices).expect("valid");
        let mut settings = imai16().refractions(4);
        let input = FrameInput::new(0, &camera, &settings, vk::ImageView::null());
        let made = auto.warm_up(&mut session.renderer, &input).expect("compiled");
        assert!(made > 3, "{}: {made}", driver.name);
        let pipelines = session.renderer.pipelines();
        let mut said = Vec::new();
        for _ in 0..20 {
            let pick = auto.pick();
            settings.method = *auto.method(pick);
            let input = FrameInput::new(0, &camera, &settings, vk::ImageView::null());
            let times = session.frame(&input).expect("a frame").expect("timestamps");
            let counters = session.counters().expect("counters");
            said.extend(auto.observe(pick, &times, &counters).cloned());
        }
        let was: Vec<_> = said
            .iter()
            .map(|why| match why {
                Why::TooSlow { was, ms, .. } if *ms > 0.0 => was.as_str(),
                other => panic!("{}: {other}", driver.name),
            })
            .collect();
        assert!(was == ["imai16", "imai14"] || was == ["imai16"], "{}: {was:?}", driver.name);
        assert_ne!(auto.name(auto.pick()), "imai16", "{}", driver.name);
        assert_eq!(session.renderer.pipelines(), pipelines, "{}: something was compiled", driver.name);
        session.end();
    });
}
