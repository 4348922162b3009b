//! The images of a window: made for its size, made anew when that changes.

use super::error::{ViewError, failed};
use ash::vk;
use meniscus::host::{DeviceInfo, Gpu, HostError, Instance};
use raw_window_handle::{HandleError, HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle};
use std::{ffi::CStr, num::NonZeroU32, ptr::NonNull};
use winit::window::Window;

/// What is drawn to a window.
pub struct Surface<'a> {
    loader: ash::khr::surface::Instance,
    handle: vk::SurfaceKHR,
    /// It outlives the surface.
    _window: &'a Window,
}

impl<'a> Surface<'a> {
    pub fn new(instance: &Instance, window: &'a Window) -> Result<Surface<'a>, ViewError> {
        let (display, handle) = handles(window)?;
        let (entry, instance) = instance.handles();
        // SAFETY: instance, window and display are alive, and the instance has the extensions that the display asks for.
        let handle = unsafe { ash_window::create_surface(entry, instance, display, handle, None) };
        let loader = ash::khr::surface::Instance::new(entry, instance);
        Ok(Surface { loader, handle: handle.map_err(failed("surface"))?, _window: window })
    }

    /// The best device that presents here, or the first that is called so.
    pub fn pick(&self, instance: &Instance, wanted: Option<&str>) -> Result<DeviceInfo, ViewError> {
        let best = instance.pick(wanted)?;
        let refusal = match self.refusal(&best) {
            None => return Ok(best),
            Some(why) => ViewError::NoPresent { device: best.label(), why },
        };
        let fits = |d: &DeviceInfo| d.refusal.is_none() && self.refusal(d).is_none();
        let others = if wanted.is_some() { Vec::new() } else { instance.devices()? };
        others.into_iter().find(fits).ok_or(refusal)
    }

    /// Why a device does not present here.
    fn refusal(&self, device: &DeviceInfo) -> Option<String> {
        // SAFETY: device and surface are of one instance.
        let supported =
            unsafe { self.loader.get_physical_device_surface_support(device.handle(), device.family(), self.handle) };
        match supported {
            Ok(true) => self.format(device).err().map(|e| e.to_string()),
            Ok(false) => Some("its queue does not present there".into()),
            Err(e) => Some(e.to_string()),
        }
    }

    /// An sRGB format: linear colour is blitted to it, and encoded on the way.
    fn format(&self, device: &DeviceInfo) -> Result<vk::SurfaceFormatKHR, String> {
        let (physical, surface) = (device.handle(), self.handle);
        // SAFETY: device and surface are of one instance.
        let formats = unsafe { self.loader.get_physical_device_surface_formats(physical, surface) };
        let formats = formats.map_err(|e| e.to_string())?;
        let srgb = [vk::Format::B8G8R8A8_SRGB, vk::Format::R8G8B8A8_SRGB];
        let found = formats.iter().find(|f| srgb.contains(&f.format));
        found.copied().ok_or_else(|| format!("it has no 8-bit sRGB images, only {:?}", formats))
    }

    fn capabilities(&self, device: &DeviceInfo) -> Result<vk::SurfaceCapabilitiesKHR, ViewError> {
        // SAFETY: device and surface are of one instance.
        let of = unsafe { self.loader.get_physical_device_surface_capabilities(device.handle(), self.handle) };
        of.map_err(failed("surface capabilities"))
    }
}

impl Drop for Surface<'_> {
    fn drop(&mut self) {
        // SAFETY: swapchains made for it borrow it and are gone.
        unsafe { self.loader.destroy_surface(self.handle, None) };
    }
}

/// Images to be presented, with what says that each is ready for that.
pub struct Swapchain<'a> {
    gpu: &'a Gpu<'a>,
    surface: &'a Surface<'a>,
    loader: ash::khr::swapchain::Device,
    handle: vk::SwapchainKHR,
    pub format: vk::Format,
    pub size: [u32; 2],
    pub images: Vec<vk::Image>,
    /// One an image: presented images wait for it.
    drawn: Vec<vk::Semaphore>,
}

/// What became of an image that was asked for or handed over.
pub enum Turn {
    Done(u32),
    /// Not now, or not of this size any more.
    Again,
    Stale,
}

impl<'a> Swapchain<'a> {
    /// Without images yet.
    pub fn new(gpu: &'a Gpu<'a>, surface: &'a Surface<'a>) -> Swapchain<'a> {
        let loader = ash::khr::swapchain::Device::new(gpu.instance().handles().1, &gpu.device);
        let (handle, format) = (vk::SwapchainKHR::null(), vk::Format::UNDEFINED);
        Swapchain { gpu, surface, loader, handle, format, size: [0; 2], images: Vec::new(), drawn: Vec::new() }
    }

    /// Images for a window that has this size; none, if it has no room for any (minimised). Waits for the device.
    pub fn fit(&mut self, window: [u32; 2]) -> Result<(), ViewError> {
        let device = &self.gpu.info;
        let can = self.surface.capabilities(device)?;
        let (least, most) = (can.min_image_extent, can.max_image_extent);
        let size = match can.current_extent {
            // The surface takes the size of its images.
            vk::Extent2D { width: u32::MAX, .. } => {
                [window[0].clamp(least.width, most.width), window[1].clamp(least.height, most.height)]
            }
            current => [current.width, current.height],
        };
        // SAFETY: the device is alive and used by this thread alone.
        unsafe { self.gpu.device.device_wait_idle() }.map_err(failed("device"))?;
        if size.contains(&0) || window.contains(&0) {
            self.size = [0; 2];
            return Ok(());
        }
        let label = || device.label();
        let format = self.surface.format(device).map_err(|why| ViewError::NoPresent { device: label(), why })?;
        if !can.supported_usage_flags.contains(vk::ImageUsageFlags::TRANSFER_DST) {
            return Err(ViewError::NoPresent { device: label(), why: "its images are no targets of copies".into() });
        }
        let alpha = [vk::CompositeAlphaFlagsKHR::OPAQUE, vk::CompositeAlphaFlagsKHR::INHERIT];
        let alpha = alpha.into_iter().find(|a| can.supported_composite_alpha.contains(*a));
        let wanted = can.min_image_count + 1;
        let old = self.handle;
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(self.surface.handle)
            .min_image_count(if can.max_image_count > 0 { wanted.min(can.max_image_count) } else { wanted })
            .image_format(format.format)
            .image_color_space(format.color_space)
            .image_extent(vk::Extent2D { width: size[0], height: size[1] })
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::TRANSFER_DST)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(can.current_transform)
            .composite_alpha(alpha.unwrap_or(vk::CompositeAlphaFlagsKHR::OPAQUE))
            // Always there.
            .present_mode(vk::PresentModeKHR::FIFO)
            .clipped(true)
            .old_swapchain(old);
        // SAFETY: complete info; the surface is alive, and nothing is in flight of the old images.
        unsafe {
            self.handle = self.loader.create_swapchain(&info, None).map_err(failed("swapchain"))?;
            self.loader.destroy_swapchain(old, None);
            self.images = self.loader.get_swapchain_images(self.handle).map_err(failed("swapchain images"))?;
        }
        (self.format, self.size) = (format.format, size);
        // SAFETY: the device is idle.
        self.drawn.drain(..).for_each(|s| unsafe { self.gpu.device.destroy_semaphore(s, None) });
        while self.drawn.len() < self.images.len() {
            // SAFETY: the device is alive.
            let made = unsafe { self.gpu.device.create_semaphore(&Default::default(), None) };
            self.drawn.push(made.map_err(failed("semaphore"))?);
        }
        Ok(())
    }

    /// The next image; `free` is signalled once it can be written to.
    pub fn acquire(&self, free: vk::Semaphore) -> Result<Turn, ViewError> {
        // SAFETY: nothing waits for the semaphore; the swapchain is alive.
        match unsafe { self.loader.acquire_next_image(self.handle, PATIENCE_NS, free, vk::Fence::null()) } {
            // Of another size than the window it is still shown; presenting it says so again.
            Ok((image, _)) => Ok(Turn::Done(image)),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(Turn::Again),
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => Ok(Turn::Stale),
            Err(e) => Err(failed("next image")(e)),
        }
    }

    /// What is signalled when an image is drawn.
    pub fn drawn(&self, image: u32) -> vk::Semaphore {
        self.drawn[image as usize]
    }

    /// Shows an image, once it is drawn.
    pub fn present(&self, image: u32) -> Result<Turn, ViewError> {
        let (waits, swapchains, images) = ([self.drawn(image)], [self.handle], [image]);
        let info = vk::PresentInfoKHR::default().wait_semaphores(&waits).swapchains(&swapchains).image_indices(&images);
        // SAFETY: the image was acquired, and what draws it and signals the semaphore was submitted.
        match unsafe { self.loader.queue_present(self.gpu.queue(), &info) } {
            Ok(false) => Ok(Turn::Done(image)),
            Ok(true) | Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => Ok(Turn::Stale),
            Err(e) => Err(failed("presentation")(e)),
        }
    }
}

/// How long the next image is waited for: a window that shows none still answers.
const PATIENCE_NS: u64 = 100_000_000;

impl Drop for Swapchain<'_> {
    fn drop(&mut self) {
        // SAFETY: these are this object's own; the device is waited for before, and whatever it answers is over.
        unsafe {
            let _ = self.gpu.device.device_wait_idle();
            self.drawn.iter().for_each(|s| self.gpu.device.destroy_semaphore(*s, None));
            self.loader.destroy_swapchain(self.handle, None);
        }
    }
}

/// What an instance has to have for a window.
pub fn extensions(window: &Window) -> Result<Vec<&'static CStr>, ViewError> {
    let names = ash_window::enumerate_required_extensions(handles(window)?.0)
        .map_err(|e| ViewError::Host(HostError::Vulkan("extensions for a window", e)))?;
    // SAFETY: names of extensions are static strings.
    Ok(names.iter().map(|name| unsafe { CStr::from_ptr(*name) }).collect())
}

/// Display and window as surfaces are made of them. On X11 those of XCB: not every driver takes Xlib's, and one that does not
/// (SwiftShader) crashes where another brought the extension.
fn handles(window: &Window) -> Result<(RawDisplayHandle, RawWindowHandle), ViewError> {
    let no_display = |e: HandleError| ViewError::NoDisplay(e.to_string());
    let display = window.display_handle().map_err(no_display)?.as_raw();
    let handle = window.window_handle().map_err(no_display)?.as_raw();
    #[cfg(target_os = "linux")]
    if let (RawDisplayHandle::Xlib(x), RawWindowHandle::Xlib(w)) = (display, handle) {
        use raw_window_handle::{XcbDisplayHandle, XcbWindowHandle};
        let failed = |what: &dyn std::fmt::Display| ViewError::NoDisplay(format!("no XCB connection: {what}"));
        let library = x11_dl::xlib_xcb::Xlib_xcb::open().map_err(|e| failed(&e))?;
        let xlib = x.display.ok_or_else(|| failed(&"no display"))?;
        // SAFETY: the display is the window's, and alive; the connection is its own, and lives as long.
        let connection = unsafe { (library.XGetXCBConnection)(xlib.as_ptr().cast()) };
        let number = u32::try_from(w.window).ok().and_then(NonZeroU32::new).ok_or_else(|| failed(&"no window"))?;
        let display = XcbDisplayHandle::new(NonNull::new(connection.cast()), x.screen);
        return Ok((display.into(), XcbWindowHandle::new(number).into()));
    }
    Ok((display, handle))
}
