//! Text that comes from C and goes there.

use crate::status::Failure;
use std::ffi::{CStr, c_char};

/// Text that C gave.
///
/// # Safety
/// `text` is null, or ends with a 0 and stays as it is for `'a`.
pub(crate) unsafe fn get<'a>(text: *const c_char, what: &str) -> Result<&'a str, Failure> {
    if text.is_null() {
        return Err(Failure::argument(format!("{what} is null: give text that ends with a 0")));
    }
    // SAFETY: this function's contract.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str()
        .map_err(|_| Failure::argument(format!("{what} is not UTF-8: {}", text.to_string_lossy().escape_debug())))
}

/// Copies text into C's memory: what fits whole characters, and a 0; and says how long all of it is.
///
/// # Safety
/// `to` is null or has room for `capacity` bytes; `length` is null or valid for a write.
pub(crate) unsafe fn put(text: &str, to: *mut c_char, capacity: usize, length: *mut usize) -> Result<(), Failure> {
    if to.is_null() && capacity > 0 {
        return Err(Failure::argument("the text's buffer is null: give one, or a capacity of 0"));
    }
    // A 0 within would end the text there.
    let text = text.replace('\0', " ");
    if capacity > 0 {
        let fits = text.floor_char_boundary_before(capacity - 1);
        // SAFETY: this function's contract: `fits` is less than `capacity`.
        unsafe {
            to.cast::<u8>().copy_from_nonoverlapping(text.as_ptr(), fits);
            to.add(fits).write(0);
        }
    }
    if !length.is_null() {
        // SAFETY: this function's contract.
        unsafe { length.write_unaligned(text.len()) };
    }
    Ok(())
}

/// Text in an array of a struct: what fits, and zeros.
pub(crate) fn array<const N: usize>(text: &str) -> [c_char; N] {
    let fits = text.floor_char_boundary_before(N - 1);
    let mut array = [0; N];
    array.iter_mut().zip(&text.as_bytes()[..fits]).for_each(|(to, byte)| *to = *byte as c_char);
    array
}

trait Boundary {
    /// The last place at or before this one where a character ends.
    fn floor_char_boundary_before(&self, most: usize) -> usize;
}

impl Boundary for str {
    fn floor_char_boundary_before(&self, most: usize) -> usize {
        (0..=most.min(self.len())).rev().find(|i| self.is_char_boundary(*i)).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::MeniscusStatus;

    /// What is written into a buffer of so many bytes, and beyond; and the length that is told.
    fn put(text: &str, capacity: usize) -> ([u8; 8], usize) {
        let (mut bytes, mut length) = ([b'#'; 8], 0);
        // SAFETY: `capacity` is 8 at most.
        unsafe { super::put(text, bytes.as_mut_ptr().cast(), capacity, &mut length) }.expect("there is a buffer");
        (bytes, length)
    }

    #[test]
    fn text_is_cut_where_a_character_ends() {
        assert_eq!(put("abc", 8), (*b"abc\0####", 3));
        assert_eq!(put("abc", 3), (*b"ab\0#####", 3));
        assert_eq!(put("aé", 3), (*b"a\0######", 3));
        assert_eq!(put("abc", 1), (*b"\0#######", 3));
        assert_eq!(put("abc", 0), (*b"########", 3));
        assert_eq!(put("a\0c", 4), (*b"a c\0####", 3));
        assert_eq!(array::<4>("abcdef").map(|c| c as u8), *b"abc\0");
        // SAFETY: null, as is allowed.
        let error = unsafe { super::put("abc", std::ptr::null_mut(), 1, std::ptr::null_mut()) };
        assert!(error.is_err_and(|e| e.status == MeniscusStatus::ErrorArgument));
    }

    #[test]
    fn text_has_to_be_text() {
        // SAFETY: each ends with a 0, or is null.
        unsafe {
            assert_eq!(get(c"field".as_ptr(), "a name").expect("text"), "field");
            let error = get(std::ptr::null(), "a name").expect_err("null");
            assert!(error.message.starts_with("a name is null"), "{}", error.message);
            let error = get(c"\xff\n".as_ptr(), "a name").expect_err("not UTF-8");
            assert!(error.message.contains("not UTF-8") && !error.message.contains('\n'), "{}", error.message);
        }
    }
}
