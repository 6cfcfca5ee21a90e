//! The computer that the program runs on, as its files tell: who is logged in, what may be
//! opened, and what stands in a device's way.
//!
//! All is read below one root folder, so that a test can build itself a computer.

mod login;

pub use login::{Login, Membership};

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

/// Something that keeps a device from its work, and what mends it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// What it is about.
    pub about: About,
    /// What is wrong, a sentence.
    pub what: String,
    /// What to do: where it mends by itself, the very lines to type, one a line.
    pub mend: String,
}

impl Problem {
    /// A problem with `about`.
    #[must_use]
    pub fn new(about: About, what: impl Into<String>, mend: impl Into<String>) -> Self {
        Self { about, what: what.into(), mend: mend.into() }
    }
}

/// What a problem is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum About {
    /// Gamepads and joysticks.
    Gamepad,
    /// Serial ports.
    Serial,
    /// The terminal.
    Terminal,
}

impl About {
    /// Its name.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Gamepad => "gamepad",
            Self::Serial => "serial",
            Self::Terminal => "terminal",
        }
    }
}

/// What this user may do with a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Rights {
    /// Read it.
    pub read: bool,
    /// Write it.
    pub write: bool,
}

impl Rights {
    /// Whether it can be used: devices are opened for both.
    #[must_use]
    pub const fn are_enough(self) -> bool {
        self.read && self.write
    }

    /// In words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match (self.read, self.write) {
            (true, true) => "read and write",
            (true, false) => "read only",
            (false, true) => "write only",
            (false, false) => "none",
        }
    }
}

/// A computer: its files and the program's environment.
#[derive(Clone, Debug)]
pub struct Host {
    root: PathBuf,
    variables: BTreeMap<String, String>,
    rights: fn(&Path) -> Rights,
}

impl Host {
    /// This computer.
    #[must_use]
    pub fn here() -> Self {
        let text = |text: std::ffi::OsString| text.to_string_lossy().into_owned();
        let variables = std::env::vars_os().map(|(name, value)| (text(name), text(value)));
        Self { root: PathBuf::from("/"), variables: variables.collect(), rights: rights_here }
    }

    /// A computer whose files lie below `root`, with these environment variables. Its rights
    /// are those that a file's owner has, whoever asks.
    #[must_use]
    pub fn at(root: &Path, variables: &[(&str, &str)]) -> Self {
        let own = |(name, value): &(&str, &str)| ((*name).to_owned(), (*value).to_owned());
        let variables = variables.iter().map(own).collect();
        Self { root: root.to_owned(), variables, rights: rights_of_owner }
    }

    /// An environment variable that is not empty.
    #[must_use]
    pub fn variable(&self, name: &str) -> Option<&str> {
        self.variables.get(name).map(String::as_str).filter(|value| !value.is_empty())
    }

    /// Whether somebody works here from another computer, through SSH.
    #[must_use]
    pub fn is_remote(&self) -> bool {
        self.variable("SSH_CONNECTION").is_some() || self.variable("SSH_TTY").is_some()
    }

    /// Whether this is a container, as far as its files tell.
    #[must_use]
    pub fn is_container(&self) -> bool {
        let marks = ["/.dockerenv", "/run/.containerenv", "/run/systemd/container"];
        marks.iter().any(|mark| self.exists(mark)) || self.variable("container").is_some()
    }

    /// Whether there is such a file or folder.
    #[must_use]
    pub fn exists(&self, path: &str) -> bool {
        self.place(path).exists()
    }

    /// The text of a file, without the blanks around it.
    #[must_use]
    pub fn text(&self, path: &str) -> Option<String> {
        let bytes = fs::read(self.place(path)).ok()?;
        Some(String::from_utf8_lossy(&bytes).trim().to_owned())
    }

    /// The names in a folder in order; none where there is no such folder.
    #[must_use]
    pub fn names(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.place(folder)).into_iter().flatten().flatten();
        let mut names: Vec<String> =
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// Where a link leads, as it is written.
    #[must_use]
    pub fn link(&self, path: &str) -> Option<PathBuf> {
        fs::read_link(self.place(path)).ok()
    }

    /// What this user may do with a file.
    #[must_use]
    pub fn rights(&self, path: &str) -> Rights {
        (self.rights)(&self.place(path))
    }

    /// The group that a file belongs to.
    #[must_use]
    pub fn group_of(&self, path: &str) -> Option<String> {
        let id = group_id(&self.place(path))?;
        let groups = self.text("/etc/group")?;
        login::groups(&groups).find(|group| group.id == id).map(|group| group.name.to_owned())
    }

    fn place(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }
}

/// Asked of the system, since access lists count too; nothing is opened, for opening a serial
/// port resets some boards.
#[cfg(unix)]
fn rights_here(path: &Path) -> Rights {
    use rustix::fs::{Access, access};
    let may = |what| access(path, what).is_ok();
    Rights { read: may(Access::READ_OK), write: may(Access::WRITE_OK) }
}

/// Elsewhere ports have no rights of their own.
#[cfg(not(unix))]
fn rights_here(_path: &Path) -> Rights {
    Rights { read: true, write: true }
}

#[cfg(unix)]
fn rights_of_owner(path: &Path) -> Rights {
    use std::os::unix::fs::PermissionsExt;
    let mode = fs::metadata(path).map_or(0, |about| about.permissions().mode());
    Rights { read: mode & 0o400 != 0, write: mode & 0o200 != 0 }
}

#[cfg(not(unix))]
fn rights_of_owner(path: &Path) -> Rights {
    rights_here(path)
}

#[cfg(unix)]
fn group_id(path: &Path) -> Option<u32> {
    use std::os::unix::fs::MetadataExt;
    Some(fs::metadata(path).ok()?.gid())
}

#[cfg(not(unix))]
fn group_id(_path: &Path) -> Option<u32> {
    None
}

/// The most memory that this program has used so far, MiB; none where the system does not tell.
#[must_use]
pub fn most_memory_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib / 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_computer_is_what_lies_below_its_root() {
        let root = tempfile::tempdir().unwrap();
        fs::create_dir_all(root.path().join("dev")).unwrap();
        fs::write(root.path().join("dev/b"), " text\n").unwrap();
        fs::write(root.path().join("dev/a"), "").unwrap();
        let host = Host::at(root.path(), &[("SSH_CONNECTION", "1 2 3 4"), ("EMPTY", "")]);
        assert_eq!(host.names("/dev"), ["a", "b"]);
        assert_eq!(host.names("/sys"), [""; 0]);
        assert_eq!(host.text("/dev/b").as_deref(), Some("text"));
        assert!(host.is_remote() && !host.is_container());
        assert_eq!(host.variable("EMPTY"), None);
        assert!(host.rights("/dev/a").are_enough());
        assert!(!host.rights("/dev/c").are_enough());
    }
}
