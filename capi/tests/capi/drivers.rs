//! Every Vulkan driver there is.

use renderer::{
    ash::{self, vk},
    device,
};

/// Names of the usable drivers, each as programs are told to pick it. MENISCUS_DRIVERS (comma-separated parts of names) says which.
pub fn all() -> Vec<String> {
    let mut labels = Vec::new();
    // SAFETY: the loader stays loaded, and the instance is destroyed after its last use.
    unsafe {
        let entry = ash::Entry::load().expect("a Vulkan loader: run ./setup.sh");
        let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&app);
        let instance = entry.create_instance(&info, None).expect("an instance");
        for physical in instance.enumerate_physical_devices().expect("devices") {
            if device::check(&instance, physical, 0).is_err() {
                continue;
            }
            let mut driver = vk::PhysicalDeviceDriverProperties::default();
            let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
            instance.get_physical_device_properties2(physical, &mut properties);
            let text = |s: Result<&std::ffi::CStr, _>| s.map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
            let (name, version) = (text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str()));
            labels.push(format!("{name} {version}").trim().to_owned());
        }
        instance.destroy_instance(None);
    }
    let wanted = std::env::var("MENISCUS_DRIVERS").unwrap_or_default();
    let wanted: Vec<_> = wanted.split(',').map(str::trim).filter(|w| !w.is_empty()).collect();
    for w in &wanted {
        assert!(
            labels.iter().any(|l| l.contains(w)),
            "MENISCUS_DRIVERS calls for \"{w}\", which is none of {labels:?}"
        );
    }
    labels.retain(|l| wanted.is_empty() || wanted.iter().any(|w| l.contains(w)));
    assert!(!labels.is_empty(), "no usable Vulkan device: run ./setup.sh");
    labels
}
