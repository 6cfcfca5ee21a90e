//! The part of libudev that `gilrs-core` calls, without libudev at build time.
//!
//! On Linux gilrs finds gamepads through libudev, and the crate `libudev-sys` of the registry
//! needs its development package to build. This crate takes its place (`[patch.crates-io]` in the
//! manifest of coadapt): the same names, types and signatures, but `libudev.so.1` is opened when
//! the first function is called. A machine without it gets a program that builds, runs, and says
//! that there is no udev.
//!
//! # What a function does when libudev is not there
//!
//! The same as when libudev fails: one that returns a pointer returns null, one that returns an
//! `int` returns `-ENOSYS`. This holds for each function by itself, should a library lack some.
//! gilrs then gives up with "Failed to create udev context".
//!
//! # Which functions there are
//!
//! The 26 that gilrs-core 0.6 calls, and no others: a new version of it that calls more does not
//! compile, which is better than a function nobody tried. They are listed below with what gilrs
//! wants of them. What they mean stands in libudev's manual (`man 3 libudev`).
//!
//! # Another library
//!
//! `COADAPT_LIBUDEV` names the file to open instead, for a machine that keeps it elsewhere and for
//! tests: `COADAPT_LIBUDEV=/nonexistent` is a machine without libudev. It is read once, at the
//! first call. [`is_available`] tells whether a library was found.

// Elsewhere gilrs does without udev, and this crate is empty.
#![cfg(unix)]
// The names are those of the C library.
#![allow(non_camel_case_types)]
// Handles come from one function and go to the next, as the manual says; every function is as
// unsafe as its C original, and for the same reasons.
#![allow(clippy::missing_safety_doc)]

mod library;

use std::ffi::{c_char, c_int, c_void};
use std::mem;
use std::sync::OnceLock;

use library::Library;

/// Declares handles: types of which only libudev knows what they are.
macro_rules! handles {
    ($($(#[$doc:meta])* $name:ident;)*) => {$(
        $(#[$doc])*
        #[repr(C)]
        #[derive(Debug)]
        pub struct $name {
            _opaque: [u8; 0],
            // Neither to be moved nor to be sent to another thread.
            _libudev: std::marker::PhantomData<(*mut u8, std::marker::PhantomPinned)>,
        }
    )*};
}

handles! {
    /// libudev's context.
    udev;
    /// An entry of a list: a name, perhaps a value, and the entry after it.
    udev_list_entry;
    /// A device.
    udev_device;
    /// A source of events: devices that come and go.
    udev_monitor;
    /// A search among the devices present.
    udev_enumerate;
}

/// Declares the functions, and the table of what the library has of them.
macro_rules! functions {
    ($(
        $(#[$doc:meta])*
        fn $name:ident($($argument:ident: $type:ty),*) -> $result:ty;
    )*) => {
        /// Where each function is, if the library has it.
        struct Table {
            $($name: Option<unsafe extern "C" fn($($type),*) -> $result>,)*
        }

        impl Table {
            /// Nothing: the table of a machine without libudev.
            const EMPTY: Self = Self { $($name: None,)* };

            /// Looks every function up.
            fn of(library: &Library) -> Self {
                Self {$(
                    // SAFETY: a null pointer becomes `None`, another is the C function of this
                    // name, whose signature in libudev.h is the one given here.
                    $name: unsafe {
                        mem::transmute::<
                            *mut c_void,
                            Option<unsafe extern "C" fn($($type),*) -> $result>,
                        >(library.symbol(concat!(stringify!($name), "\0")))
                    },
                )*}
            }

            /// How many functions the library has, and how many it should have.
            fn count(&self) -> (usize, usize) {
                let found = [$(self.$name.is_some()),*];
                (found.iter().filter(|found| **found).count(), found.len())
            }
        }

        $(
            $(#[$doc])*
            pub unsafe extern "C" fn $name($($argument: $type),*) -> $result {
                match table().$name {
                    // SAFETY: the caller answers for the arguments, as in C.
                    Some(function) => unsafe { function($($argument),*) },
                    None => <$result as Absent>::ABSENT,
                }
            }
        )*
    };
}

functions! {
    /// The context that all else begins with; gilrs takes null for "no udev here".
    fn udev_new() -> *mut udev;
    /// Keeps a context.
    fn udev_ref(udev: *mut udev) -> *mut udev;
    /// Lets a context go.
    fn udev_unref(udev: *mut udev) -> *mut udev;

    /// A search among the devices present, when gilrs starts.
    fn udev_enumerate_new(udev: *mut udev) -> *mut udev_enumerate;
    /// Lets a search go.
    fn udev_enumerate_unref(enumerate: *mut udev_enumerate) -> *mut udev_enumerate;
    /// Only devices of this subsystem: `input`.
    fn udev_enumerate_add_match_subsystem(
        enumerate: *mut udev_enumerate,
        subsystem: *const c_char
    ) -> c_int;
    /// Only devices with this property: `ID_INPUT_JOYSTICK=1`.
    fn udev_enumerate_add_match_property(
        enumerate: *mut udev_enumerate,
        property: *const c_char,
        value: *const c_char
    ) -> c_int;
    /// Searches.
    fn udev_enumerate_scan_devices(enumerate: *mut udev_enumerate) -> c_int;
    /// What was found: a list whose names are paths in sysfs. It belongs to the search.
    fn udev_enumerate_get_list_entry(enumerate: *mut udev_enumerate) -> *mut udev_list_entry;

    /// The next entry of a list, null at its end.
    fn udev_list_entry_get_next(entry: *mut udev_list_entry) -> *mut udev_list_entry;
    /// The name of an entry.
    fn udev_list_entry_get_name(entry: *mut udev_list_entry) -> *const c_char;
    /// The value of an entry, such as a property's.
    fn udev_list_entry_get_value(entry: *mut udev_list_entry) -> *const c_char;

    /// The device at a path in sysfs.
    fn udev_device_new_from_syspath(udev: *mut udev, syspath: *const c_char) -> *mut udev_device;
    /// Keeps a device.
    fn udev_device_ref(device: *mut udev_device) -> *mut udev_device;
    /// Lets a device go.
    fn udev_device_unref(device: *mut udev_device) -> *mut udev_device;
    /// Where a device is in sysfs: there gilrs finds the battery.
    fn udev_device_get_syspath(device: *mut udev_device) -> *const c_char;
    /// The file to open, such as `/dev/input/event5`.
    fn udev_device_get_devnode(device: *mut udev_device) -> *const c_char;
    /// `add` or `remove`, for a device that came through a monitor.
    fn udev_device_get_action(device: *mut udev_device) -> *const c_char;
    /// All properties of a device.
    fn udev_device_get_properties_list_entry(device: *mut udev_device) -> *mut udev_list_entry;
    /// One property of a device: whether one that came is a joystick.
    fn udev_device_get_property_value(
        device: *mut udev_device,
        key: *const c_char
    ) -> *const c_char;

    /// The source of events called `name`: `udev`, what the daemon says once it knows the device.
    fn udev_monitor_new_from_netlink(udev: *mut udev, name: *const c_char) -> *mut udev_monitor;
    /// Lets a source go.
    fn udev_monitor_unref(monitor: *mut udev_monitor) -> *mut udev_monitor;
    /// Only events of this subsystem; null for any type of device in it.
    fn udev_monitor_filter_add_match_subsystem_devtype(
        monitor: *mut udev_monitor,
        subsystem: *const c_char,
        devtype: *const c_char
    ) -> c_int;
    /// Begins to listen.
    fn udev_monitor_enable_receiving(monitor: *mut udev_monitor) -> c_int;
    /// What to poll. Negative numbers are ignored by `poll`: gilrs waits for ever, idle.
    fn udev_monitor_get_fd(monitor: *mut udev_monitor) -> c_int;
    /// The device of the next event.
    fn udev_monitor_receive_device(monitor: *mut udev_monitor) -> *mut udev_device;
}

/// Whether libudev was found and has every function above. Opens it, where nobody did before.
#[must_use]
pub fn is_available() -> bool {
    let (found, all) = table().count();
    found == all
}

/// The functions of this process. The library stays open for as long as it lives.
fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| Library::open().as_ref().map_or(Table::EMPTY, Table::of))
}

/// What a function returns that is not there.
trait Absent {
    const ABSENT: Self;
}

impl<T> Absent for *mut T {
    const ABSENT: Self = std::ptr::null_mut();
}

impl<T> Absent for *const T {
    const ABSENT: Self = std::ptr::null();
}

impl Absent for c_int {
    const ABSENT: Self = -libc::ENOSYS;
}
