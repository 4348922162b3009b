//! The last net under the parsers.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::sync::{Arc, Mutex, PoisonError};

thread_local! {
    /// Whether this thread's panics are somebody's error, and not printed.
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Calls `f`; a panic in it is not printed, and its message returned. The process's panic hook is replaced meanwhile, so
/// calls from several threads take turns.
pub(crate) fn quietly<T>(f: impl FnOnce() -> T) -> Result<T, String> {
    type Hook = Arc<dyn Fn(&PanicHookInfo<'_>) + Sync + Send>;
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _lock = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let before: Hook = take_hook().into();
    let during = before.clone();
    set_hook(Box::new(move |info| {
        if !QUIET.get() {
            during(info);
        }
    }));
    let result = catch_unwind(AssertUnwindSafe(|| helping(f)));
    set_hook(Box::new(move |info| before(info)));
    result.map_err(|panic| match panic.downcast::<String>() {
        Ok(message) => *message,
        Err(panic) => panic.downcast_ref::<&str>().unwrap_or(&"no message").to_string(),
    })
}

/// Calls `f` on another thread that works for [`quietly`], which then gets its panic.
pub(crate) fn helping<T>(f: impl FnOnce() -> T) -> T {
    struct Restore(bool);
    impl Drop for Restore {
        fn drop(&mut self) {
            QUIET.set(self.0);
        }
    }
    // The hook runs before the stack unwinds.
    let _restore = Restore(QUIET.replace(true));
    f()
}
