//! A library opened at run time.

use std::env;
use std::ffi::{CStr, CString, OsString, c_void};
use std::os::unix::ffi::OsStringExt;
use std::ptr::NonNull;

/// The variable that names another file than [`NAME`].
const VARIABLE: &str = "COADAPT_LIBUDEV";

/// The library by its binary interface: every libudev of the last ten years has this number.
#[cfg(target_os = "linux")]
const NAME: &CStr = c"libudev.so.1";
/// The BSDs' stand-in for it.
#[cfg(not(target_os = "linux"))]
const NAME: &CStr = c"libudev.so.0";

/// An open library. It is never closed: what was looked up in it may be called at any time.
pub struct Library(NonNull<c_void>);

impl Library {
    /// Opens the library that the machine, or [`VARIABLE`], says.
    pub fn open() -> Option<Self> {
        match env::var_os(VARIABLE).map(OsString::into_vec) {
            // An empty name would be this program itself.
            Some(file) if file.is_empty() => None,
            // A name with a zero inside names no file.
            Some(file) => CString::new(file).ok().and_then(|file| Self::named(&file)),
            None => Self::named(NAME),
        }
    }

    fn named(file: &CStr) -> Option<Self> {
        // SAFETY: the name ends with a zero. The library's initialisers run: whoever may choose
        // it, through the variable or the loader's path, may run code as this user anyway.
        let handle = unsafe { libc::dlopen(file.as_ptr(), libc::RTLD_NOW | libc::RTLD_LOCAL) };
        NonNull::new(handle).map(Self)
    }

    /// The address of `name`, which ends with a zero; null if the library does not have it.
    pub fn symbol(&self, name: &str) -> *mut c_void {
        let Ok(name) = CStr::from_bytes_with_nul(name.as_bytes()) else {
            return std::ptr::null_mut();
        };
        // SAFETY: the handle is of an open library, and the name ends with a zero.
        unsafe { libc::dlsym(self.0.as_ptr(), name.as_ptr()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_library_has_what_it_has() {
        // Every program that links the C library has it open already.
        let this = Library::named(c"libc.so.6");
        let Some(library) = this else { return };
        assert!(!library.symbol("getpid\0").is_null());
        assert!(library.symbol("udev_new\0").is_null());
        assert!(library.symbol("no zero at its end").is_null());
    }

    #[test]
    fn no_file_no_library() {
        assert!(Library::named(c"/nonexistent/libudev.so.1").is_none());
    }
}
