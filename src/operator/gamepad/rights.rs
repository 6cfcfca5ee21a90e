//! Why a gamepad is not seen: its device's rights, a container, a missing library.

use serde::Serialize;

use crate::host::{About, Host, Login, Membership, Problem, Rights};

/// An input device of the system that is a gamepad or joystick.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Node {
    /// Its device, such as `/dev/input/event7`.
    pub path: String,
    /// Its name by the kernel.
    pub name: String,
    /// Whether the device is there; a container may see the name only.
    pub is_there: bool,
    /// What this user may do with it. Both are needed: a pad that can only be read stays hidden.
    pub rights: Rights,
}

/// Where the kernel lists its input devices.
const DEVICES: &str = "/proc/bus/input/devices";
/// The folder of their nodes.
const INPUT: &str = "/dev/input";
/// The group whose members may use them.
const GROUP: &str = "input";
/// The buttons that only joysticks and gamepads have: `BTN_JOYSTICK` up to `BTN_THUMBR`.
const BUTTONS: std::ops::RangeInclusive<usize> = 0x120..=0x13e;
/// Gives pads to whoever sits at the computer.
const RULE: &str = r#"KERNEL=="event*", SUBSYSTEM=="input", ENV{ID_INPUT_JOYSTICK}=="1", MODE="0660", TAG+="uaccess""#;
/// Finds pads by looking at `/dev/input`, without udev.
pub const WITHOUT_UDEV: &str = "GILRS_DISABLE_UDEV=1 coadapt devices    # and so with coadapt run";

/// The gamepads that the kernel of `host` knows, whether or not they can be used.
#[must_use]
pub fn nodes(host: &Host) -> Vec<Node> {
    let devices = host.text(DEVICES).unwrap_or_default();
    devices.split("\n\n").filter_map(|device| node(host, device)).collect()
}

/// The gamepad that a paragraph of the kernel's list is about, if it is one.
fn node(host: &Host, device: &str) -> Option<Node> {
    let field = |key: &str| device.lines().find_map(|line| line.trim().strip_prefix(key));
    let handlers = field("H: Handlers=")?.split_whitespace();
    let is_joystick = handlers.clone().any(|handler| handler.starts_with("js"));
    if !is_joystick && !field("B: KEY=").is_some_and(has_pad_buttons) {
        return None;
    }
    let event = handlers.into_iter().find(|handler| handler.starts_with("event"))?;
    let path = format!("{INPUT}/{event}");
    let name = field("N: Name=").unwrap_or("").trim_matches('"').to_owned();
    Some(Node { is_there: host.exists(&path), rights: host.rights(&path), path, name })
}

/// Whether a bitmap of keys, words of 64 from the highest down, has a button of a pad.
fn has_pad_buttons(bitmap: &str) -> bool {
    let words: Vec<u64> =
        bitmap.split_whitespace().rev().filter_map(|w| u64::from_str_radix(w, 16).ok()).collect();
    let mut buttons = BUTTONS;
    buttons.any(|bit| words.get(bit / 64).is_some_and(|word| word >> (bit % 64) & 1 == 1))
}

/// What the program itself can do about gamepads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Build {
    /// Whether it was built with gilrs.
    pub gamepads: bool,
    /// Whether libudev can be opened.
    pub libudev: bool,
}

impl Build {
    /// This program, here.
    #[must_use]
    pub fn here() -> Self {
        #[cfg(all(target_os = "linux", feature = "gamepad"))]
        let libudev = libudev_sys::is_available();
        #[cfg(not(all(target_os = "linux", feature = "gamepad")))]
        let libudev = true;
        Self { gamepads: cfg!(feature = "gamepad"), libudev }
    }
}

/// Why pads may not be seen on `host`, and what mends it; `seen`: how many pads are there for
/// the program.
#[must_use]
pub fn problems(
    host: &Host,
    login: &Login,
    build: Build,
    nodes: &[Node],
    seen: usize,
) -> Vec<Problem> {
    if !build.gamepads {
        return vec![problem(
            "this coadapt was built without gamepads",
            "cargo build --release    # without --no-default-features",
        )];
    }
    if !host.exists(INPUT) {
        return vec![if host.is_container() {
            problem(
                "there is no /dev/input: this container sees no gamepad",
                "docker run --device /dev/input …    # or podman, when the container starts",
            )
        } else {
            problem(
                "there is no /dev/input: no gamepad or other input device has a node here",
                "sudo modprobe evdev    # in a virtual machine, also pass the pad through",
            )
        }];
    }
    let mut problems = Vec::new();
    problems.extend(rights(host, login, nodes));
    problems.extend(missing(host, nodes));
    if seen == 0 {
        problems.extend(udev(host, build));
        if problems.is_empty() {
            problems.extend(unheard(host, nodes));
        }
    }
    problems
}

fn problem(what: impl Into<String>, mend: impl Into<String>) -> Problem {
    Problem::new(About::Gamepad, what, mend)
}

/// Pads whose nodes this user may not read and write.
fn rights(host: &Host, login: &Login, nodes: &[Node]) -> Option<Problem> {
    let shut: Vec<&Node> = nodes.iter().filter(|n| n.is_there && !n.rights.are_enough()).collect();
    let first = shut.first()?;
    let of = |node: &&Node| format!("{} ({})", node.name, node.path);
    let pads = shut.iter().map(of).collect::<Vec<_>>().join(", ");
    let (user, rights) = (&login.user, first.rights.words());
    let may = format!("{user} may not use {pads}: rights {rights}, read and write are needed");
    let join = format!("sudo usermod -aG {GROUP} {user}    # then log in again");
    Some(match login.membership(host, GROUP) {
        Membership::NextLogin => problem(
            format!("{may}; {user} is in group {GROUP}, but not in this login"),
            "log out and in again; over SSH end all connections first",
        ),
        _ if host.is_remote() => problem(
            format!(
                "{may}; over SSH the rule for who sits at the computer (uaccess) gives nothing, \
                 group {GROUP} of this computer does"
            ),
            join,
        ),
        Membership::Member => problem(
            format!("{may}; group {GROUP} has no right to it"),
            format!(
                "echo '{RULE}' | sudo tee /etc/udev/rules.d/70-coadapt-pads.rules\n\
                 sudo udevadm control --reload && sudo udevadm trigger"
            ),
        ),
        Membership::Outside | Membership::NoGroup => problem(
            may,
            format!(
                "echo '{RULE}' | sudo tee /etc/udev/rules.d/70-coadapt-pads.rules\n\
                 sudo udevadm control --reload && sudo udevadm trigger\n\
                 {join}; instead of the rule"
            ),
        ),
    })
}

/// Pads that the kernel knows and this place does not, or no nodes at all.
fn missing(host: &Host, nodes: &[Node]) -> Option<Problem> {
    if let Some(node) = nodes.iter().find(|node| !node.is_there) {
        let what = format!("the kernel has a pad ({}), but {} is not here", node.name, node.path);
        return Some(problem(what, format!("docker run --device {INPUT} …    # in a container")));
    }
    let has_events = host.names(INPUT).iter().any(|name| name.starts_with("event"));
    (!has_events).then(|| {
        problem(
            "/dev/input has no event devices, so no gamepad is seen",
            if host.is_container() {
                "docker run --device /dev/input …    # plug the pad in before"
            } else {
                "sudo modprobe evdev    # then plug the pad in again"
            },
        )
    })
}

/// gilrs waits for udev, which is not at work here.
fn udev(host: &Host, build: Build) -> Option<Problem> {
    if host.variable("GILRS_DISABLE_UDEV").is_some() {
        return None;
    }
    if !build.libudev {
        return Some(problem(
            "libudev is not installed: pads are not found without it",
            format!("sudo apt install libudev1\n{WITHOUT_UDEV}"),
        ));
    }
    (!host.exists("/run/udev"))
        .then(|| problem("udev does not run here (a container?): no pad is reported", WITHOUT_UDEV))
}

/// Everything looks well, and still no pad is heard.
fn unheard(host: &Host, nodes: &[Node]) -> Option<Problem> {
    match nodes.first() {
        Some(node) => Some(problem(
            format!("{} ({}) may be used, but is not heard", node.name, node.path),
            WITHOUT_UDEV,
        )),
        None if host.is_remote() => Some(problem(
            "no pad is plugged in at this computer, which you reach through SSH; one at the \
             computer in front of you is relayed from there",
            format!(
                "coadapt run balance --operator gamepad:relay=unix:$HOME/pad    # here\n\
                 coadapt pad-relay | ssh {} 'coadapt pad-relay --forward unix:$HOME/pad'    # there",
                host.text("/proc/sys/kernel/hostname").unwrap_or_else(|| "LAB-PC".to_owned())
            ),
        )),
        None => None,
    }
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    const PAD: &str = "I: Bus=0003 Vendor=045e Product=028e Version=0114\n\
        N: Name=\"Microsoft X-Box 360 pad\"\n\
        H: Handlers=event7 js0 \n\
        B: KEY=7cdb000000000000 0 0 0 0\n";
    /// Without the kernel's module for joysticks: known by its buttons.
    const STICK: &str = "N: Name=\"Old stick\"\nH: Handlers=event9\n\
        B: KEY=fff00000000 0 0 0 0\n";
    const MOUSE: &str = "N: Name=\"A mouse\"\nH: Handlers=mouse0 event3\n\
        B: KEY=ff0000 0 0 0 0\n";

    const FULL: Build = Build { gamepads: true, libudev: true };

    struct Fake(tempfile::TempDir);

    impl Fake {
        fn new() -> Self {
            let fake = Self(tempfile::tempdir().unwrap());
            fake.file("proc/bus/input/devices", &[MOUSE, PAD, STICK].join("\n"));
            fake.file("dev/input/event3", "").file("dev/input/event7", "");
            fake.file("dev/input/event9", "").file("run/udev/control", "");
            fake.file("etc/group", "input:x:104:\n");
            fake
        }

        fn file(&self, path: &str, text: &str) -> &Self {
            let path = self.0.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
            self
        }

        fn shut(&self, path: &str, mode: u32) -> &Self {
            let shut = fs::Permissions::from_mode(mode);
            fs::set_permissions(self.0.path().join(path), shut).unwrap();
            self
        }

        fn problems_with(&self, build: Build, variables: &[(&str, &str)]) -> Vec<Problem> {
            let user = [&[("USER", "ann")], variables].concat();
            let host = Host::at(self.0.path(), &user);
            problems(&host, &Login::on(&host), build, &nodes(&host), 0)
        }

        fn problems(&self) -> Vec<Problem> {
            self.problems_with(FULL, &[])
        }
    }

    #[test]
    fn pads_are_known_by_their_handler_or_their_buttons() {
        let fake = Fake::new();
        let nodes = nodes(&Host::at(fake.0.path(), &[]));
        let names: Vec<&str> = nodes.iter().map(|node| node.name.as_str()).collect();
        assert_eq!(names, ["Microsoft X-Box 360 pad", "Old stick"]);
        assert_eq!(nodes[0].path, "/dev/input/event7");
        assert!(nodes.iter().all(|node| node.is_there && node.rights.are_enough()));
        let host = Host::at(fake.0.path(), &[]);
        assert_eq!(problems(&host, &Login::on(&host), FULL, &nodes, 2), []);
        assert!(fake.problems()[0].what.contains("but is not heard"));
    }

    #[test]
    fn a_pad_that_can_only_be_read_is_shut() {
        let fake = Fake::new();
        fake.shut("dev/input/event7", 0o440);
        let problems = fake.problems();
        assert!(problems[0].what.contains("rights read only"), "{problems:?}");
        assert!(problems[0].mend.contains("TAG+=\"uaccess\"' | sudo tee"), "{problems:?}");
        assert!(problems[0].mend.contains("sudo usermod -aG input ann"), "{problems:?}");
    }

    #[test]
    fn over_ssh_only_the_group_helps_and_a_new_group_needs_a_new_login() {
        let fake = Fake::new();
        fake.shut("dev/input/event9", 0o060);
        let remote = fake.problems_with(FULL, &[("SSH_CONNECTION", "1 2 3 4")]);
        assert_eq!(remote[0].mend, "sudo usermod -aG input ann    # then log in again");
        assert!(remote[0].what.contains("uaccess"));
        fake.file("etc/group", "input:x:104:ann\n");
        let next = fake.problems_with(FULL, &[("SSH_CONNECTION", "1 2 3 4")]);
        assert!(next[0].mend.starts_with("log out"), "{next:?}");
    }

    #[test]
    fn containers_and_missing_libraries_are_told() {
        let fake = Fake::new();
        let mend = |problems: Vec<Problem>| problems[0].mend.clone();
        let none = Build { gamepads: false, libudev: true };
        assert!(mend(fake.problems_with(none, &[])).contains("cargo build"));
        let bare = Build { gamepads: true, libudev: false };
        assert!(mend(fake.problems_with(bare, &[])).contains("apt install libudev1"));
        let off = fake.problems_with(bare, &[("GILRS_DISABLE_UDEV", "1")]);
        assert!(off.iter().all(|problem| !problem.what.contains("libudev")), "{off:?}");
        fake.file("proc/bus/input/devices", "");
        let remote = fake.problems_with(FULL, &[("SSH_CONNECTION", "1 2 3 4")]);
        assert!(mend(remote).contains("\ncoadapt pad-relay | ssh LAB-PC 'coadapt"));
        assert_eq!(fake.problems(), []);
        fake.file("proc/bus/input/devices", &[MOUSE, PAD, STICK].join("\n"));
        fs::remove_dir_all(fake.0.path().join("run")).unwrap();
        assert!(mend(fake.problems()).starts_with("GILRS_DISABLE_UDEV=1 coadapt"));
        fs::remove_file(fake.0.path().join("dev/input/event9")).unwrap();
        assert!(fake.problems()[0].what.contains("event9 is not here"));
        for event in ["event3", "event7"] {
            fs::remove_file(fake.0.path().join("dev/input").join(event)).unwrap();
        }
        fake.file("proc/bus/input/devices", "");
        assert!(fake.problems()[0].what.contains("no event devices"));
        fs::remove_dir_all(fake.0.path().join("dev")).unwrap();
        assert!(mend(fake.problems()).contains("modprobe evdev"));
        fake.file(".dockerenv", "");
        assert!(mend(fake.problems()).contains("--device /dev/input"));
    }
}
