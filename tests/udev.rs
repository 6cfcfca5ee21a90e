//! gilrs over our libudev: on a machine with the library, without it, and on one that looks into
//! `/dev/input` itself.
//!
//! A process opens the library once, so each machine is a process of its own: a test runs this
//! file's hidden test again, with the variables set.

#![cfg(all(feature = "gamepad", target_os = "linux"))]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

use std::env;
use std::path::Path;
use std::process::Command;

use gilrs::GilrsBuilder;

/// What gilrs says when it starts in a process with the variable `name` set to `value`.
fn start_with(name: &str, value: &str) -> String {
    let mut again = Command::new(env::current_exe().unwrap());
    again.args(["--ignored", "--exact", "starts", "--nocapture"]);
    again.env_remove("COADAPT_LIBUDEV").env_remove("GILRS_DISABLE_UDEV").env(name, value);
    let output = again.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stdout).unwrap();
    let (_, answer) = said.split_once("gilrs: ").unwrap();
    answer.lines().next().unwrap().to_owned()
}

#[test]
#[ignore = "runs within another test, in a process of its own"]
#[expect(clippy::print_stdout, reason = "this is how it answers the test that runs it")]
fn starts() {
    match GilrsBuilder::new().with_force_feedback(false).build() {
        Ok(_) => println!("gilrs: ready"),
        Err(error) => println!("gilrs: {error}"),
    }
}

#[test]
fn without_libudev_it_says_so() {
    let answer = start_with("COADAPT_LIBUDEV", "/nonexistent/libudev.so.1");
    assert_eq!(answer, "Failed to create udev context");
}

#[test]
fn with_libudev_it_is_ready_though_no_pad_is_there() {
    // The variable is unset again where it names nothing: what the machine has is opened.
    let answer = start_with("COADAPT_OTHER", "");
    let expected =
        if libudev_sys::is_available() { "ready" } else { "Failed to create udev context" };
    assert_eq!(answer, expected);
}

#[test]
fn without_udev_it_looks_for_itself() {
    let answer = start_with("GILRS_DISABLE_UDEV", "1");
    if Path::new("/dev/input").exists() {
        assert_eq!(answer, "ready");
    } else {
        assert!(answer.contains("No such file or directory"), "{answer}");
    }
}
