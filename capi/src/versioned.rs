//! Structs, arrays and numbers that come from C and go there; each checked for what can be checked.

use crate::status::Failure;
use std::{mem::MaybeUninit, ptr};

/// A struct that begins with its size, as C sees it: later versions have more fields at the end. What a shorter one lacks is 0,
/// which stands for what was there before the field; of a longer one, what is not known here has to be 0.
///
/// # Safety
/// `repr(C)`, the first field a `usize`, no padding anywhere, and any bytes are a value.
pub(crate) unsafe trait Versioned: Copy {
    /// Name in C.
    const NAME: &'static str;
    /// Bytes up to the last field that has to be there.
    const LEAST: usize;
    /// What keeps a place for a later version, and is 0 in this one.
    fn reserved(&self) -> u32 {
        0
    }
}

/// Longer than any version will be.
const MOST: usize = 1 << 16;

/// Checks that a size can be one of `T`'s.
fn check_size<T: Versioned>(size: usize) -> Result<(), Failure> {
    let (name, least) = (T::NAME, T::LEAST);
    if size < least || size > MOST {
        let remedy = format!("set it to sizeof({name}), which is {} in this version", size_of::<T>());
        return Err(Failure::argument(format!("struct_size of {name} is {size}, and {least} at least: {remedy}")));
    }
    Ok(())
}

pub(crate) fn null(name: &str) -> Failure {
    Failure::argument(format!("the pointer to {name} is null: give one"))
}

/// A struct that C filled.
///
/// # Safety
/// `from` is null, or as many bytes as its first field says can be read.
pub(crate) unsafe fn read<T: Versioned>(from: *const T) -> Result<T, Failure> {
    if from.is_null() {
        return Err(null(T::NAME));
    }
    // SAFETY: this function's contract, and the trait's: the size comes first.
    let size = unsafe { from.cast::<usize>().read_unaligned() };
    check_size::<T>(size)?;
    let known = size.min(size_of::<T>());
    let mut value = MaybeUninit::<T>::zeroed();
    // SAFETY: `size` bytes can be read (contract), and any bytes are a value (the trait).
    let value = unsafe {
        ptr::copy_nonoverlapping(from.cast::<u8>(), value.as_mut_ptr().cast::<u8>(), known);
        value.assume_init()
    };
    // SAFETY: as above.
    let rest = unsafe { std::slice::from_raw_parts(from.cast::<u8>().add(known), size - known) };
    if rest.iter().any(|byte| *byte != 0) || value.reserved() != 0 {
        let name = T::NAME;
        return Err(Failure::argument(format!(
            "{name} asks for what this library, version {}, does not know: use a newer library, or leave what is \
             reserved, and fields after its {} bytes, 0",
            env!("CARGO_PKG_VERSION"),
            size_of::<T>()
        )));
    }
    Ok(value)
}

/// The same where null stands for none.
///
/// # Safety
/// As [`read`].
pub(crate) unsafe fn read_some<T: Versioned>(from: *const T) -> Result<Option<T>, Failure> {
    if from.is_null() {
        return Ok(None);
    }
    // SAFETY: this function's contract.
    unsafe { read(from) }.map(Some)
}

/// Fills a struct of C's, whose size C has set.
///
/// # Safety
/// `to` is null, or as many bytes as its first field says can be read and written.
pub(crate) unsafe fn write<T: Versioned>(to: *mut T, value: T) -> Result<(), Failure> {
    if to.is_null() {
        return Err(null(T::NAME));
    }
    // SAFETY: this function's contract, and the trait's: the size comes first, and stays.
    let size = unsafe { to.cast::<usize>().read_unaligned() };
    check_size::<T>(size)?;
    // SAFETY: as above; there is no padding in it.
    unsafe { put(&value, to.cast(), size, size_of::<usize>()) };
    Ok(())
}

/// Copies a value's bytes from `first` on into `size` bytes; those that it does not have become 0.
///
/// # Safety
/// There is room for `size` bytes, `first` or more. `T` has no padding.
unsafe fn put<T: Copy>(value: &T, to: *mut u8, size: usize, first: usize) {
    let known = size.min(size_of::<T>());
    // SAFETY: this function's contract.
    unsafe {
        ptr::copy_nonoverlapping(ptr::from_ref(value).cast::<u8>().add(first), to.add(first), known - first);
        to.add(known).write_bytes(0, size - known);
    }
}

/// A struct of which C gets an array. It has no size of its own: that of all comes as an argument.
///
/// # Safety
/// `repr(C)`, no padding anywhere.
pub(crate) unsafe trait Element: Copy {
    /// Name in C.
    const NAME: &'static str;
    /// Bytes that its first version had.
    const LEAST: usize;
}

/// Fills C's array, as far as it goes, and says how many there are.
///
/// # Safety
/// `to` is null, or has room for `*count` elements of `element_size` bytes; `count` is null or can be read and written.
pub(crate) unsafe fn fill<T: Element>(
    all: &[T],
    to: *mut T,
    element_size: usize,
    count: *mut usize,
) -> Result<(), Failure> {
    if count.is_null() {
        return Err(null("the count"));
    }
    // SAFETY: this function's contract.
    let room = unsafe { count.read_unaligned() };
    if !to.is_null() {
        let (name, least) = (T::NAME, T::LEAST);
        if element_size < least || element_size > MOST {
            let remedy = format!("give sizeof({name}), which is {} in this version", size_of::<T>());
            return Err(Failure::argument(format!("an element of {name} has {element_size} bytes: {remedy}")));
        }
        for (i, value) in all.iter().take(room).enumerate() {
            // SAFETY: this function's contract: `i` is less than `room`.
            unsafe { put(value, to.cast::<u8>().add(i * element_size), element_size, 0) };
        }
    }
    // SAFETY: as above.
    unsafe { count.write_unaligned(all.len()) };
    Ok(())
}

/// Values that C gave.
///
/// # Safety
/// `from` is null, or `count` values can be read and stay as they are for `'a`. Any bytes are a `T`.
pub(crate) unsafe fn slice<'a, T: Copy>(from: *const T, count: usize, what: &str) -> Result<&'a [T], Failure> {
    if count == 0 {
        return Ok(&[]);
    }
    if from.is_null() {
        return Err(Failure::argument(format!("{what}: null for {count} of them; give a pointer to as many")));
    }
    if !from.is_aligned() {
        let remedy = format!("a multiple of {} bytes", align_of::<T>());
        return Err(Failure::argument(format!("{what}: the pointer is not aligned; it has to be {remedy}")));
    }
    if count.checked_mul(size_of::<T>()).is_none_or(|bytes| bytes > isize::MAX as usize) {
        return Err(Failure::argument(format!("{what}: {count} of them are more than memory holds")));
    }
    // SAFETY: this function's contract, and what was checked.
    Ok(unsafe { std::slice::from_raw_parts(from, count) })
}

/// Gives C a new object, which C hands back to be destroyed.
///
/// # Safety
/// `to` is null or can be written.
pub(crate) unsafe fn give<T>(to: *mut *mut T, make: impl FnOnce() -> Result<T, Failure>) -> Result<(), Failure> {
    if to.is_null() {
        return Err(null("where the object is to be told"));
    }
    // SAFETY: this function's contract. Null first: that is what stays after an error.
    unsafe { to.write_unaligned(ptr::null_mut()) };
    let made = Box::into_raw(Box::new(make()?));
    // SAFETY: as above.
    unsafe { to.write_unaligned(made) };
    Ok(())
}

/// Takes an object back, if it is one.
///
/// # Safety
/// `object` is null or came from [`give`], and nobody uses it any more.
pub(crate) unsafe fn take<T>(object: *mut T) -> Option<Box<T>> {
    // SAFETY: this function's contract.
    (!object.is_null()).then(|| unsafe { Box::from_raw(object) })
}

/// An object of ours that C lends.
///
/// # Safety
/// `object` is null, or came from [`give`] and nobody changes it for `'a`.
pub(crate) unsafe fn borrow<'a, T>(object: *const T, what: &str) -> Result<&'a T, Failure> {
    // SAFETY: this function's contract.
    unsafe { object.as_ref() }.ok_or_else(|| null(what))
}

/// The same, to be changed.
///
/// # Safety
/// `object` is null, or came from [`give`] and nobody else uses it for `'a`.
pub(crate) unsafe fn borrow_mut<'a, T>(object: *mut T, what: &str) -> Result<&'a mut T, Failure> {
    // SAFETY: this function's contract.
    unsafe { object.as_mut() }.ok_or_else(|| null(what))
}

/// Writes a number of C's, if it wants one.
///
/// # Safety
/// `to` is null or can be written.
pub(crate) unsafe fn tell<T>(to: *mut T, value: T) {
    if !to.is_null() {
        // SAFETY: this function's contract.
        unsafe { to.write_unaligned(value) };
    }
}

#[cfg(test)]
mod tests;
