//! Machines with libudev, without it, and with something else by its name.
//!
//! A process opens the library once, so each machine is a process of its own: a test runs this
//! file's hidden test of the same name again, with the variable set.

#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

use std::env;
use std::ffi::{CStr, c_int};
use std::path::Path;
use std::process::Command;
use std::ptr::{null, null_mut};

use libudev_sys as ud;

/// Runs the hidden test `name` with `COADAPT_LIBUDEV` set to `library`, or unset.
fn on_machine(library: Option<&str>, name: &str) {
    let mut again = Command::new(env::current_exe().unwrap());
    again.args(["--ignored", "--exact", name, "--nocapture"]).env_remove("COADAPT_LIBUDEV");
    if let Some(library) = library {
        again.env("COADAPT_LIBUDEV", library);
    }
    let output = again.output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let wrong = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("1 passed"), "{said}\n{wrong}");
}

#[test]
fn without_a_library_all_functions_fail() {
    on_machine(Some("/nonexistent/libudev.so.1"), "nothing_there");
    on_machine(Some(""), "nothing_there");
}

#[test]
fn a_library_without_the_functions_is_none() {
    on_machine(Some("libc.so.6"), "nothing_there");
}

#[test]
fn with_the_library_of_this_machine_devices_are_found() {
    // Debian and Fedora and their children put it here; other machines may lack it and pass.
    let places = ["/lib", "/usr/lib", "/usr/lib64"].into_iter().flat_map(|folder| {
        let wide = Path::new(folder).join(format!("{}-linux-gnu", env::consts::ARCH));
        [Path::new(folder).to_owned(), wide]
    });
    let is_there = places.map(|folder| folder.join("libudev.so.1")).any(|file| file.exists());
    // A program without a loader opens nothing.
    if is_there && cfg!(not(target_feature = "crt-static")) {
        on_machine(None, "everything_there");
    }
}

#[test]
#[ignore = "runs within another test, in a process of its own"]
fn nothing_there() {
    const ENOSYS: c_int = -libc::ENOSYS;
    assert!(!ud::is_available());
    let (udev, entry, device) = (null_mut(), null_mut(), null_mut());
    let (monitor, enumerate) = (null_mut(), null_mut());
    // SAFETY: there is no library that could look at what it is given.
    #[expect(clippy::multiple_unsafe_ops_per_block, reason = "one reason holds for all")]
    unsafe {
        assert!(ud::udev_new().is_null());
        assert!(ud::udev_ref(udev).is_null());
        assert!(ud::udev_unref(udev).is_null());
        assert!(ud::udev_enumerate_new(udev).is_null());
        assert!(ud::udev_enumerate_unref(enumerate).is_null());
        assert_eq!(ud::udev_enumerate_add_match_subsystem(enumerate, null()), ENOSYS);
        assert_eq!(ud::udev_enumerate_add_match_property(enumerate, null(), null()), ENOSYS);
        assert_eq!(ud::udev_enumerate_scan_devices(enumerate), ENOSYS);
        assert!(ud::udev_enumerate_get_list_entry(enumerate).is_null());
        assert!(ud::udev_list_entry_get_next(entry).is_null());
        assert!(ud::udev_list_entry_get_name(entry).is_null());
        assert!(ud::udev_list_entry_get_value(entry).is_null());
        assert!(ud::udev_device_new_from_syspath(udev, null()).is_null());
        assert!(ud::udev_device_ref(device).is_null());
        assert!(ud::udev_device_unref(device).is_null());
        assert!(ud::udev_device_get_syspath(device).is_null());
        assert!(ud::udev_device_get_devnode(device).is_null());
        assert!(ud::udev_device_get_action(device).is_null());
        assert!(ud::udev_device_get_properties_list_entry(device).is_null());
        assert!(ud::udev_device_get_property_value(device, null()).is_null());
        assert!(ud::udev_monitor_new_from_netlink(udev, null()).is_null());
        assert!(ud::udev_monitor_unref(monitor).is_null());
        let filtered = ud::udev_monitor_filter_add_match_subsystem_devtype(monitor, null(), null());
        assert_eq!(filtered, ENOSYS);
        assert_eq!(ud::udev_monitor_enable_receiving(monitor), ENOSYS);
        assert_eq!(ud::udev_monitor_get_fd(monitor), ENOSYS);
        assert!(ud::udev_monitor_receive_device(monitor).is_null());
    }
}

/// Goes through the devices of the subsystem `mem`, for `/dev/null` is on every machine; all else
/// is as gilrs does it.
#[test]
#[ignore = "runs within another test, in a process of its own"]
fn everything_there() {
    assert!(ud::is_available());
    // SAFETY: handles are used between the function that made them and the one that lets them
    // go, and lists while the search or the device lives that they belong to.
    #[expect(clippy::multiple_unsafe_ops_per_block, reason = "one reason holds for all")]
    unsafe {
        let udev = ud::udev_new();
        assert!(!udev.is_null());
        assert_eq!(ud::udev_ref(udev), udev);
        // What is left of a handle that someone else keeps, versions answer differently.
        ud::udev_unref(udev);

        let search = ud::udev_enumerate_new(udev);
        assert!(!search.is_null());
        assert_eq!(ud::udev_enumerate_add_match_subsystem(search, c"mem".as_ptr()), 0);
        let (key, value) = (c"DEVNAME".as_ptr(), c"/dev/null".as_ptr());
        assert_eq!(ud::udev_enumerate_add_match_property(search, key, value), 0);
        assert_eq!(ud::udev_enumerate_scan_devices(search), 0);
        let entry = ud::udev_enumerate_get_list_entry(search);
        // A machine without sysfs has a library and no devices.
        if Path::new("/sys/class/mem/null").exists() {
            assert!(!entry.is_null());
            assert!(ud::udev_list_entry_get_next(entry).is_null());
            let path = ud::udev_list_entry_get_name(entry);
            let device = ud::udev_device_new_from_syspath(udev, path);
            assert!(!device.is_null());
            assert_eq!(ud::udev_device_ref(device), device);
            ud::udev_device_unref(device);
            let text = |text| CStr::from_ptr(text).to_str().unwrap();
            assert_eq!(text(ud::udev_device_get_syspath(device)), text(path));
            assert_eq!(text(ud::udev_device_get_devnode(device)), "/dev/null");
            assert_eq!(text(ud::udev_device_get_property_value(device, key)), "/dev/null");
            assert!(ud::udev_device_get_action(device).is_null());
            let mut property = ud::udev_device_get_properties_list_entry(device);
            let mut subsystem = None;
            while !property.is_null() {
                if text(ud::udev_list_entry_get_name(property)) == "SUBSYSTEM" {
                    subsystem = Some(text(ud::udev_list_entry_get_value(property)));
                }
                property = ud::udev_list_entry_get_next(property);
            }
            assert_eq!(subsystem, Some("mem"));
            assert!(ud::udev_device_unref(device).is_null());
        }
        assert!(ud::udev_enumerate_unref(search).is_null());

        // No daemon needs to run for one to listen to it; a sandbox may forbid the socket.
        let monitor = ud::udev_monitor_new_from_netlink(udev, c"udev".as_ptr());
        if !monitor.is_null() {
            let input = c"input".as_ptr();
            let filtered =
                ud::udev_monitor_filter_add_match_subsystem_devtype(monitor, input, null());
            assert!(filtered >= 0);
            assert_eq!(ud::udev_monitor_enable_receiving(monitor), 0);
            assert!(ud::udev_monitor_get_fd(monitor) >= 0);
            assert!(ud::udev_monitor_receive_device(monitor).is_null());
            assert!(ud::udev_monitor_unref(monitor).is_null());
        }
        assert!(ud::udev_unref(udev).is_null());
    }
}
