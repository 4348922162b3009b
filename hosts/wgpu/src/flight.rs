//! Which frames are on their way: wgpu says when a command buffer is done, or that it never will be.

use std::sync::{
    Arc,
    atomic::{AtomicU8, Ordering},
};

/// Where the frame last recorded into a slot is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum State {
    /// There is none.
    Free,
    /// Recorded; submitted or not.
    Recorded,
    /// Its command buffer was dropped without being submitted.
    Dropped,
}

/// A slot's state, told from wherever wgpu polls.
#[derive(Clone, Debug, Default)]
pub(crate) struct Place(Arc<AtomicU8>);

impl Place {
    pub fn state(&self) -> State {
        match self.0.load(Ordering::Acquire) {
            0 => State::Free,
            1 => State::Recorded,
            _ => State::Dropped,
        }
    }

    fn set(&self, state: State) {
        self.0.store(state as u8, Ordering::Release);
    }

    pub fn free(&self) {
        self.set(State::Free);
    }

    /// The frame that is being recorded: [`Ticket::done`] when it is done, or dropped if it never runs.
    pub fn take(&self) -> Ticket {
        self.set(State::Recorded);
        Ticket(Some(self.clone()))
    }
}

pub(crate) struct Ticket(Option<Place>);

impl Ticket {
    pub fn done(mut self) {
        if let Some(place) = self.0.take() {
            place.free();
        }
    }
}

impl Drop for Ticket {
    fn drop(&mut self) {
        if let Some(place) = self.0.take() {
            place.set(State::Dropped);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_done_or_dropped() {
        let place = Place::default();
        assert_eq!(place.state(), State::Free);
        let ticket = place.take();
        assert_eq!(place.state(), State::Recorded);
        ticket.done();
        assert_eq!(place.state(), State::Free);
        drop(place.take());
        assert_eq!(place.state(), State::Dropped);
    }
}
