//! `coadapt devices` without a screen, as programs and pipes meet it.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;

fn devices(words: &[&str]) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::cargo_bin("coadapt").unwrap();
    command.current_dir(folder.path()).arg("devices").args(words).write_stdin("");
    command.env("LC_ALL", "C").output().unwrap()
}

#[test]
fn json_is_one_object_with_stable_keys_and_problems_are_no_failure() {
    let output = devices(&["--json"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(object["schema"], 1);
    for key in ["gamepads", "gamepad_nodes", "serial_ports", "problems"] {
        assert!(object[key].is_array(), "{key} in {object}");
    }
    for key in ["asked", "utf8", "term", "key_releases", "mouse_pixels", "size", "tmux", "ssh"] {
        assert!(!object["terminal"].is_null(), "{key}");
        assert!(object["terminal"].get(key).is_some(), "{key} in {object}");
    }
    let Value::Array(problems) = &object["problems"] else { panic!("{object}") };
    let locale = problems.iter().find(|problem| problem["mend"] == "export LC_ALL=C.UTF-8");
    assert_eq!(locale.unwrap()["about"], "terminal", "the locale is none of UTF-8 here");
}

#[test]
fn elsewhere_than_on_a_terminal_sentences_are_printed() {
    let output = devices(&["mountain-car", "--set", "operator.gamepad.pad=Xbox"]);
    assert_eq!(output.status.code(), Some(0));
    let text = String::from_utf8(output.stdout).unwrap();
    for word in ["gamepads", "serial ports", "terminal", "what mends it"] {
        assert!(text.lines().any(|line| line.contains(word)), "{word} in {text}");
    }
    // A line that mends something is a line of its own, to be copied.
    assert!(text.lines().any(|line| line.trim() == "export LC_ALL=C.UTF-8"), "{text}");
}

#[test]
fn wrong_words_are_wrong_usage() {
    for words in [&["no-such-profile"][..], &["--set", "operator.gamepad.centre=7"], &["--xml"]] {
        assert_eq!(devices(words).status.code(), Some(2), "{words:?}");
    }
}
