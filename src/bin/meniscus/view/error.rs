//! Why there is no window, or none any more.

use ash::vk;
use meniscus::host::HostError;

#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    #[error(
        "no window: {0}. Start it where there is a display (DISPLAY names an X server; on Wayland, XWayland's), with \
         libx11-6, libxcursor1, libxi6 and libxkbcommon-x11-0 installed; without a display use `meniscus render`"
    )]
    NoDisplay(String),
    #[error("{device} cannot draw to this window: {why}. Choose another with --device; `meniscus info` lists them")]
    NoPresent { device: String, why: String },
    #[error("the window: {0}: {1}. Start anew, with a smaller window or another --device")]
    Window(&'static str, vk::Result),
    #[error(transparent)]
    Host(#[from] HostError),
}

/// Names what failed.
pub fn failed(what: &'static str) -> impl FnOnce(vk::Result) -> ViewError {
    move |e| ViewError::Window(what, e)
}

/// What winit says, without the place in its source that it says first.
pub fn without_place(text: &str) -> String {
    let said = text.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map_or(text, |(_, said)| said);
    said.trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_in_foreign_source_are_not_said() {
        let said = without_place("os error at /a/b.rs:7: no DISPLAY: none.");
        assert_eq!([said, without_place("no window")], ["no DISPLAY: none", "no window"]);
    }
}
