//! Every driver there is, each with one instance, device, renderer and sky for the whole run: making them, and the shaders
//! that a renderer has compiled by and by, took most of the time of most tests. Tests take turns on each driver.

use super::Driver;
use crate::{
    Equirect,
    host::{DeviceInfo, Gpu, Instance, Session},
};
use std::{
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    sync::{Condvar, LazyLock, Mutex, PoisonError},
};

/// The sky behind every frame.
pub static SKY: LazyLock<Equirect> = LazyLock::new(Equirect::procedural_sky);

/// What is made once on a driver. The driver's references are to what the two pointers own.
struct Made {
    driver: Option<Box<Driver<'static>>>,
    gpu: *mut Gpu<'static>,
    instance: *mut Instance,
}

// SAFETY: no part of it is bound to a thread, and only whoever holds it uses it.
unsafe impl Send for Made {}

impl Made {
    fn new(label: &str) -> Made {
        let instance = Box::into_raw(Box::new(Instance::new(true).expect("validation layer: run ./setup.sh")));
        let mut made = Made { driver: None, gpu: std::ptr::null_mut(), instance };
        // SAFETY: both live until `end`, which lets go of the driver first.
        unsafe {
            let info = (*instance).pick(Some(label)).expect("it was there a moment ago");
            made.gpu = Box::into_raw(Box::new(Gpu::new(&*instance, info).expect("device")));
            let session = Session::new(&*made.gpu, [1, 1], &SKY).expect("session");
            made.driver = Some(Box::new(Driver::new(&*instance, session, label)));
        }
        made
    }

    fn driver(&self) -> &Driver<'static> {
        self.driver.as_deref().expect("until `end`")
    }

    /// Destroys everything: what it says of that, the validation layer says of what was left.
    fn end(mut self) -> Vec<String> {
        self.destroy_device();
        // SAFETY: as made in `new`, until `drop`.
        unsafe { (*self.instance).take_messages() }
    }

    fn destroy_device(&mut self) {
        if let Some(driver) = self.driver.take() {
            driver.end();
        }
        let gpu = std::mem::replace(&mut self.gpu, std::ptr::null_mut());
        if !gpu.is_null() {
            // SAFETY: it came from a box, once; the driver that referred to it is gone.
            drop(unsafe { Box::from_raw(gpu) });
        }
    }
}

impl Drop for Made {
    fn drop(&mut self) {
        self.destroy_device();
        // SAFETY: it came from a box, once; the device that referred to it is gone.
        drop(unsafe { Box::from_raw(self.instance) });
    }
}

/// A driver's place in the pool.
enum Place {
    Free(Option<Made>),
    Taken,
}

struct Pool {
    labels: Vec<String>,
    places: Mutex<Vec<Place>>,
    freed: Condvar,
}

static POOL: LazyLock<Pool> = LazyLock::new(|| {
    let devices = Instance::new(false).and_then(|i| i.devices()).expect("a Vulkan loader");
    let mut usable: Vec<DeviceInfo> = devices.into_iter().filter(|d| d.refusal.is_none()).collect();
    assert!(!usable.is_empty(), "no usable Vulkan device: run ./setup.sh");
    let wanted = std::env::var("MENISCUS_DRIVERS").unwrap_or_default();
    let wanted: Vec<_> = wanted.split(',').map(str::trim).filter(|w| !w.is_empty()).collect();
    for w in &wanted {
        assert!(usable.iter().any(|d| d.is_called(w)), "MENISCUS_DRIVERS calls for \"{w}\", which is not here");
    }
    usable.retain(|d| wanted.is_empty() || wanted.iter().any(|w| d.is_called(w)));
    let labels: Vec<_> = usable.iter().map(DeviceInfo::label).collect();
    let places = Mutex::new(labels.iter().map(|_| Place::Free(None)).collect());
    Pool { labels, places, freed: Condvar::new() }
});

/// One test's time on a driver, which is given back at its end however that comes.
struct Turn {
    at: usize,
    made: Option<Made>,
}

impl Turn {
    /// On the first of these drivers that is free, or gets free.
    fn take(left: &[usize]) -> Turn {
        let mut places = POOL.places.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(at) = left.iter().copied().find(|at| matches!(places[*at], Place::Free(_))) {
                let Place::Free(made) = std::mem::replace(&mut places[at], Place::Taken) else { unreachable!() };
                return Turn { at, made };
            }
            places = POOL.freed.wait(places).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        at_exit();
        POOL.places.lock().unwrap_or_else(PoisonError::into_inner)[self.at] = Place::Free(self.made.take());
        POOL.freed.notify_all();
    }
}

/// Runs a test on every usable driver, with core and synchronization validation; any message fails it, and so does finding
/// no driver at all. MENISCUS_DRIVERS (comma-separated parts of names or drivers, as `meniscus info` prints them) says which
/// to run on; one that it names and that is not there is a failure, too.
pub fn each_driver(test: impl Fn(&Driver)) {
    let mut left: Vec<usize> = (0..POOL.labels.len()).collect();
    while !left.is_empty() {
        let mut turn = Turn::take(&left);
        left.retain(|at| *at != turn.at);
        let label = &POOL.labels[turn.at];
        println!("driver: {label}");
        let made = turn.made.take().unwrap_or_else(|| Made::new(label));
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            made.driver().start_anew();
            test(made.driver());
        }));
        let messages = made.driver().instance.take_messages();
        if outcome.is_ok() && messages.is_empty() {
            turn.made = Some(made);
            continue;
        }
        // No other test shall find what a failed one has left: the next one makes everything anew.
        drop(made);
        let said = format!("{label}: validation:\n{}", messages.join("\n"));
        match outcome {
            Ok(()) => panic!("{said}"),
            Err(panic) => {
                println!("{said}");
                resume_unwind(panic);
            }
        }
    }
}

/// The drivers that tests run on: name and driver of each.
pub fn labels() -> &'static [String] {
    &POOL.labels
}

unsafe extern "C" {
    fn atexit(handler: extern "C" fn()) -> i32;
    fn _exit(code: i32) -> !;
}

/// Has everything destroyed when the process ends, which is when the validation layer reports what was not. Handlers run
/// latest first. So one is there from after each turn: before destructors of whatever a driver has set up during it.
fn at_exit() {
    // SAFETY: the handler is a function without arguments, and unwinds nowhere (it would abort).
    unsafe { atexit(destroy_all) };
}

extern "C" fn destroy_all() {
    let mut messages = Vec::new();
    // A thread that still holds a driver has failed to end; nothing is said of that driver.
    if let Ok(mut places) = POOL.places.try_lock() {
        for (place, label) in places.iter_mut().zip(&POOL.labels) {
            if let Place::Free(made) = place {
                let said = made.take().map(Made::end).unwrap_or_default();
                messages.extend(said.iter().map(|m| format!("{label}: {m}")));
            }
        }
    }
    if !messages.is_empty() {
        eprintln!("validation, when everything was destroyed after all tests:\n{}", messages.join("\n"));
        // SAFETY: ends the process; `exit` must not be called from here.
        unsafe { _exit(101) };
    }
}
