//! Progress, told to a function of JavaScript.

use js_sys::Function;
use shsa_lab::campaign::Progress;
use std::cell::{Cell, RefCell};
use std::time::Duration;
use wasm_bindgen::JsValue;

thread_local! {
    static LISTENER: RefCell<Option<Function>> = const { RefCell::new(None) };
    static STEPS: Cell<(usize, usize)> = const { Cell::new((0, 0)) };
    static WORK: RefCell<String> = const { RefCell::new(String::new()) };
}

/// The most calls of one search.
const MOST_CALLS: usize = 100;

/// Tells the progress to the listener of this thread, if it has one.
pub(crate) struct Told;

impl Told {
    /// With this listener, which is called with the steps that are done, their number, and of what they are.
    pub(crate) fn to(listener: Option<Function>) -> Told {
        LISTENER.set(listener);
        Told
    }

    fn tell(&self) {
        let (done, count) = STEPS.get();
        if !done.is_multiple_of((count / MOST_CALLS).max(1)) {
            return;
        }
        let of_what = WORK.with_borrow(|of_what| JsValue::from_str(of_what));
        let listener = LISTENER.with_borrow(Option::clone);
        // What a listener throws is no matter of the work.
        listener.map(|it| it.call3(&JsValue::NULL, &done.into(), &count.into(), &of_what).ok());
    }
}

impl Drop for Told {
    fn drop(&mut self) {
        LISTENER.take();
    }
}

impl Progress for Told {
    fn begin(&self, count: usize, of_what: &str) {
        STEPS.set((0, count));
        WORK.replace(of_what.to_owned());
        self.tell();
    }

    fn step(&self) {
        STEPS.set((STEPS.get().0 + 1, STEPS.get().1));
        self.tell();
    }

    fn end(&self) {}
}

/// The time that a report says a replay has taken: WebAssembly has no clock, and the caller measures it.
pub(crate) const UNMEASURED: Duration = Duration::ZERO;
