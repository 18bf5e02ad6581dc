//! The functions that C calls: the only code of the workspace that may be unsafe.
//!
//! It does three things and decides nothing: pointers become references, a panic becomes a status, and handles become boxes. What a
//! caller owes is the same everywhere: a pointer is null or points to what its type says, a handle was made here and is not freed yet,
//! a text is as long as it says, and one thread at a time uses an engine.
#![expect(unsafe_code, reason = "C gives pointers, whose validity no compiler checks")]
#![expect(
    clippy::missing_safety_doc,
    reason = "the docs are those of the header; the module says what is owed"
)]

use crate::engine::{Engine, Verdict};
use crate::error::{Error, Status};
use crate::model::{Model, NO_ID};
use crate::output::Output;
use shsa_core::observation::RawValue;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;

/// The version of the library, such as `0.1.0`.
#[unsafe(no_mangle)]
pub extern "C" fn shsa_version() -> *const c_char {
    const VERSION: &CStr =
        match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
            Ok(version) => version,
            Err(_) => c"",
        };
    VERSION.as_ptr()
}

/// Reads and checks a model: YAML or JSON, UTF-8, of `length` bytes. `name` is what errors call the text; it may be null.
///
/// `*model` is the model, to be freed with `shsa_model_free`, or null. Ends with `SHSA_STATUS_MODEL` where the text has errors; then
/// `*error` has the first one. `error` may be null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_model_load(
    text: *const c_char,
    length: usize,
    name: *const c_char,
    model: *mut *mut Model,
    error: *mut Error,
) -> Status {
    // SAFETY: as the module says.
    let (text, name) = unsafe { (bytes(text, length), c_str(name)) };
    // SAFETY: as the module says.
    let Some(model) = (unsafe { model.as_mut() }) else { return Status::Argument };
    *model = ptr::null_mut();
    let loaded = guarded(|| match text.map(std::str::from_utf8) {
        Some(Ok(text)) => Model::load(text, name.unwrap_or("model")),
        Some(Err(cut)) => Err(no_text(cut.valid_up_to())),
        None => Err(Box::new(Error::whole(Status::Argument, "the text of the model is a null pointer"))),
    });
    // SAFETY: as the module says.
    unsafe { handed(loaded, error) }.map_or_else(
        |status| status,
        |made| {
            *model = Box::into_raw(Box::new(made));
            Status::Ok
        },
    )
}

/// Frees a model; null is allowed. Engines made of it go on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_model_free(model: *mut Model) {
    // SAFETY: as the module says.
    unsafe { free(model) };
}

/// The number of elements of a kind, an `shsa_element`; 0 for an unknown kind.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_model_count(model: *const Model, element: u32) -> u32 {
    // SAFETY: as the module says.
    let model = unsafe { model.as_ref() };
    model.and_then(|it| u32::try_from(it.names(element).len()).ok()).unwrap_or(0)
}

/// The index of an element of a kind, an `shsa_element`, by its name; `SHSA_NO_ID` where none has it. A need is also found by its
/// variable, if it is the only one of it. Takes time in proportion to the number of elements: ask once, before the loop.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_model_find(model: *const Model, element: u32, name: *const c_char) -> u32 {
    // SAFETY: as the module says.
    let (model, name) = unsafe { (model.as_ref(), c_str(name)) };
    let found = model.zip(name).and_then(|(model, name)| guarded(|| model.find(element, name)));
    found.unwrap_or(NO_ID)
}

/// The name of an element of a kind, an `shsa_element`; null for an unknown one. It is valid until the model is freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_model_name(model: *const Model, element: u32, index: u32) -> *const c_char {
    // SAFETY: as the module says.
    let model = unsafe { model.as_ref() };
    let name = model.and_then(|it| it.names(element).get(index as usize));
    name.map_or(ptr::null(), |name| name.as_ptr())
}

/// An engine for a model, to be freed with `shsa_engine_free`; null if `model` is. All memory that observations need is allocated here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_engine_new(model: *const Model) -> *mut Engine {
    // SAFETY: as the module says.
    let model = unsafe { model.as_ref() };
    let engine = model.and_then(|model| guarded(|| Engine::new(model)));
    engine.map_or(ptr::null_mut(), |engine| Box::into_raw(Box::new(engine)))
}

/// Frees an engine; null is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_engine_free(engine: *mut Engine) {
    // SAFETY: as the module says.
    unsafe { free(engine) };
}

/// Takes an observation of a signal: a number in the signal's unit, with the time stamp that its source gave it and the time at which
/// it was received, in ns of one clock. Not-a-number is a value that the sensor could not measure. Allocates nothing
/// after the first value of each signal.
///
/// Time never goes back: what is received before something else that was taken counts as received at the same moment.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_engine_observe(
    engine: *mut Engine,
    signal: u32,
    stamp_ns: i64,
    received_ns: i64,
    value: f64,
) -> Status {
    // SAFETY: as the module says.
    unsafe { of_engine(engine, |it| it.observe(signal, stamp_ns, received_ns, RawValue::Number(value))) }
}

/// As `shsa_engine_observe`, for a value that brings its own bounds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_engine_observe_range(
    engine: *mut Engine,
    signal: u32,
    stamp_ns: i64,
    received_ns: i64,
    lo: f64,
    hi: f64,
) -> Status {
    // SAFETY: as the module says.
    unsafe {
        of_engine(engine, |it| it.observe(signal, stamp_ns, received_ns, RawValue::Interval { lo, hi }))
    }
}

/// As `shsa_engine_observe`, for a signal of a vector of `length` numbers, such as a scan. The numbers are copied, for which memory is
/// allocated and freed again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_engine_observe_vector(
    engine: *mut Engine,
    signal: u32,
    stamp_ns: i64,
    received_ns: i64,
    values: *const f64,
    length: usize,
) -> Status {
    // SAFETY: as the module says.
    let Some(values) = (unsafe { slice(values, length) }) else { return Status::Argument };
    // SAFETY: as the module says.
    unsafe {
        of_engine(engine, |it| it.observe(signal, stamp_ns, received_ns, RawValue::Vector(values.to_vec())))
    }
}

/// Lets time pass until now, after all observations that were received until now: what they mean comes out, and silence is noticed.
/// Allocates nothing, except where something is decided.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_engine_advance(engine: *mut Engine, now_ns: i64) -> Status {
    let advanced = |it: &mut Engine| {
        it.advance(now_ns);
        Status::Ok
    };
    // SAFETY: as the module says.
    unsafe { of_engine(engine, advanced) }
}

/// The next output, the oldest first; ends with `SHSA_STATUS_NOTHING` when there is none. The pointers within `*output` are valid until
/// the next call with the engine. Published numbers allocate nothing; decisions allocate their texts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_engine_poll(engine: *mut Engine, output: *mut Output) -> Status {
    // SAFETY: as the module says.
    let Some(output) = (unsafe { output.as_mut() }) else { return Status::Argument };
    // SAFETY: as the module says.
    unsafe { of_engine(engine, |it| put(it.poll(), output)) }
}

/// When `shsa_engine_advance` is due at the latest, if nothing is observed before, in ns; ends with `SHSA_STATUS_NOTHING` when nothing is
/// waited for.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_engine_next_deadline(engine: *mut Engine, due_ns: *mut i64) -> Status {
    // SAFETY: as the module says.
    let Some(due_ns) = (unsafe { due_ns.as_mut() }) else { return Status::Argument };
    // SAFETY: as the module says.
    unsafe { of_engine(engine, |it| put(it.next_deadline(), due_ns)) }
}

/// What is thought of a signal now; of an unknown signal, `SHSA_VERDICT_UNKNOWN`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_engine_verdict(engine: *mut Engine, signal: u32) -> Verdict {
    let mut verdict = Verdict::Unknown;
    let asked = |it: &mut Engine| put(Some(it.verdict(signal)), &mut verdict);
    // SAFETY: as the module says.
    unsafe { of_engine(engine, asked) };
    verdict
}

/// The state that outlasts the process, as JSON that ends with a zero, to be freed with `shsa_string_free`; null where the engine is null
/// or broken.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_engine_snapshot(engine: *mut Engine) -> *mut c_char {
    let mut text = ptr::null_mut();
    let taken = |it: &mut Engine| put(Some(it.snapshot().into_raw()), &mut text);
    // SAFETY: as the module says.
    unsafe { of_engine(engine, taken) };
    text
}

/// Takes over a state that `shsa_engine_snapshot` has given, of `length` bytes without the zero, before the first observation. The model
/// may have changed since: what is the same goes on. Ends with `SHSA_STATUS_STATE` where the text is no state; then `*error` says why.
/// `error` may be null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_engine_restore(
    engine: *mut Engine,
    text: *const c_char,
    length: usize,
    now_ns: i64,
    error: *mut Error,
) -> Status {
    // SAFETY: as the module says.
    let text = unsafe { bytes(text, length) };
    let mut restored = Some(Ok(()));
    let restore = |it: &mut Engine| {
        let result = match text.map(std::str::from_utf8) {
            Some(Ok(text)) => it.restore(text, now_ns),
            Some(Err(cut)) => Err(no_text(cut.valid_up_to())),
            None => Err(Box::new(Error::whole(Status::Argument, "the text of the state is a null pointer"))),
        };
        restored = Some(result);
        Status::Ok
    };
    // SAFETY: as the module says.
    let status = unsafe { of_engine(engine, restore) };
    if status != Status::Ok {
        return status;
    }
    // SAFETY: as the module says.
    unsafe { handed(restored, error) }.map_or_else(|status| status, |()| Status::Ok)
}

/// Frees a text that the library has made; null is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shsa_string_free(text: *mut c_char) {
    if !text.is_null() {
        // SAFETY: as the module says: the text was made by `CString::into_raw`.
        drop(unsafe { CString::from_raw(text) });
    }
}

/// Runs a call; `None` where it panics, whose message is printed to standard error.
fn guarded<T>(call: impl FnOnce() -> T) -> Option<T> {
    // What a panic may have left half done is marked as broken, or dropped.
    catch_unwind(AssertUnwindSafe(call)).ok()
}

/// Runs a call with an engine, which is broken once a call has panicked.
unsafe fn of_engine(engine: *mut Engine, call: impl FnOnce(&mut Engine) -> Status) -> Status {
    // SAFETY: as the module says.
    let Some(engine) = (unsafe { engine.as_mut() }) else { return Status::Argument };
    if engine.is_broken {
        return Status::Panic;
    }
    guarded(|| call(engine)).unwrap_or_else(|| {
        engine.is_broken = true;
        Status::Panic
    })
}

/// Puts a result in its place, if there is one.
fn put<T>(result: Option<T>, place: &mut T) -> Status {
    result.map_or(Status::Nothing, |result| {
        *place = result;
        Status::Ok
    })
}

/// What a call has made (`None` where it has panicked); tells the error otherwise.
unsafe fn handed<T>(made: Option<Result<T, Box<Error>>>, error: *mut Error) -> Result<T, Status> {
    let failed = || Box::new(Error::whole(Status::Panic, "the library has failed, see standard error"));
    let result = made.unwrap_or_else(|| Err(failed()));
    // SAFETY: as the module says.
    if let Some(place) = unsafe { error.as_mut() } {
        *place = *result.as_ref().err().cloned().unwrap_or_else(|| Box::new(Error::none()));
    }
    result.map_err(|error| error.status)
}

/// The error of a text that is none.
fn no_text(byte: usize) -> Box<Error> {
    Box::new(Error::whole(Status::Argument, &format!("byte {byte} of the text is not UTF-8")))
}

/// The bytes of a text; `None` for a null pointer.
unsafe fn bytes<'t>(text: *const c_char, length: usize) -> Option<&'t [u8]> {
    // SAFETY: as the module says; bytes have no alignment.
    unsafe { slice(text.cast(), length) }
}

/// Numbers or bytes; `None` for a null pointer.
unsafe fn slice<'t, T>(first: *const T, length: usize) -> Option<&'t [T]> {
    // SAFETY: as the module says.
    (!first.is_null()).then(|| unsafe { std::slice::from_raw_parts(first, length) })
}

/// A text that ends with a zero; `None` for a null pointer and for what is not UTF-8.
unsafe fn c_str<'t>(text: *const c_char) -> Option<&'t str> {
    // SAFETY: as the module says.
    (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) }).and_then(|text| text.to_str().ok())
}

/// Frees what a handle stands for.
unsafe fn free<T>(handle: *mut T) {
    if !handle.is_null() {
        // SAFETY: as the module says: the handle was made by `Box::into_raw`.
        let owned = unsafe { Box::from_raw(handle) };
        guarded(|| drop(owned));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_ends_at_the_border_and_breaks_the_engine() {
        let model =
            Model::load("shsa: 1\nvariables: { a: }\nsignals: { s: { variable: a } }\n", "m").ok().unwrap();
        let mut engine = Engine::new(&model);
        // SAFETY: the engine is a local value.
        let status = unsafe { of_engine(&raw mut engine, |_| panic!("a defect")) };
        assert_eq!(status, Status::Panic);
        // SAFETY: the same.
        assert_eq!(unsafe { shsa_engine_observe(&raw mut engine, 0, 0, 0, 1.0) }, Status::Panic);
        let mut error = Error::none();
        // SAFETY: the error is a local value.
        let handed = unsafe { handed::<()>(guarded(|| panic!("a defect")), &raw mut error) };
        assert_eq!((handed, error.status, error.count), (Err(Status::Panic), Status::Panic, 1));
    }
}
