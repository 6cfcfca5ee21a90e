//! A folder of its own in which the program runs, as a user would run it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;

/// An empty folder in which the program runs; it is gone at the test's end.
pub struct Desk {
    folder: tempfile::TempDir,
}

impl Desk {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    /// The path of `name` in the folder.
    pub fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The program with the words of `line`, here.
    pub fn program(&self, line: &str) -> Command {
        let mut program = Command::cargo_bin("coadapt").unwrap();
        program.current_dir(self.folder.path()).args(line.split_whitespace());
        program
    }

    /// What the program did with the words of `line`.
    pub fn run(&self, line: &str) -> Output {
        self.program(line).output().unwrap()
    }

    /// Runs what must succeed, and returns what it printed.
    pub fn succeed(&self, line: &str) -> String {
        let output = self.run(line);
        assert!(output.status.success(), "{line}: {}", text(&output.stderr));
        text(&output.stdout)
    }
}

/// The names in a folder, in order; none where there is no folder.
pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}
