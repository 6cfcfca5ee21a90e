//! Which serial ports there are, who may use them, and what stands in their way.

use serde::Serialize;

use crate::host::{About, Host, Login, Membership, Problem, Rights};

/// A port that the system lists.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Listed {
    /// Its device, such as `/dev/ttyUSB0`.
    pub path: String,
    /// What is plugged in, where it is USB.
    pub usb: Option<Usb>,
}

/// A USB device as it names itself.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Usb {
    /// The maker's number.
    pub vendor: u16,
    /// The product's number.
    pub product: u16,
    /// The serial number, where it has one.
    pub serial: Option<String>,
    /// The maker's name.
    pub manufacturer: Option<String>,
    /// The product's name.
    pub name: Option<String>,
}

/// A serial port with all that is known of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Port {
    /// Its device, such as `/dev/ttyUSB0`; the number may be another one tomorrow.
    pub path: String,
    /// Its lasting name below `/dev/serial/by-id`.
    pub by_id: Option<String>,
    /// What is plugged in, where it is USB.
    pub usb: Option<Usb>,
    /// What this user may do with it.
    pub rights: Rights,
    /// The group whose members may use it.
    pub group: Option<String>,
    /// The program that has it open, as far as this user may know.
    pub holder: Option<Holder>,
    /// How long an FTDI chip keeps bytes to itself, ms.
    pub latency_ms: Option<u32>,
}

/// A program that has a port open.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Holder {
    /// The process' number.
    pub pid: u32,
    /// Its name.
    pub name: String,
}

/// The folder of lasting names.
const BY_ID: &str = "/dev/serial/by-id";
/// What answers a control loop has to wait no longer than, ms.
const QUICK_MS: u32 = 2;
/// Makers of the chips that braille displays share with laboratory boards: WCH (`CH340`),
/// FTDI, Silicon Labs (`CP210x`).
const BRAILLE_LIKE: [u16; 3] = [0x1a86, 0x0403, 0x10c4];
/// Makes udev read its rules again.
const RELOAD: &str = "sudo udevadm control --reload && sudo udevadm trigger";

/// The ports that the system lists on `host`, which is this computer.
#[must_use]
pub fn listed(host: &Host) -> Vec<Listed> {
    // The crate takes this folder for granted.
    if cfg!(target_os = "linux") && !host.exists("/sys/class/tty") {
        return Vec::new();
    }
    let mut listed: Vec<Listed> =
        serialport::available_ports().unwrap_or_default().into_iter().map(Listed::from).collect();
    listed.sort_by(|a, b| a.path.cmp(&b.path));
    listed
}

impl From<serialport::SerialPortInfo> for Listed {
    fn from(info: serialport::SerialPortInfo) -> Self {
        let usb = match info.port_type {
            serialport::SerialPortType::UsbPort(usb) => Some(Usb {
                vendor: usb.vid,
                product: usb.pid,
                serial: usb.serial_number,
                manufacturer: usb.manufacturer,
                name: usb.product,
            }),
            _ => None,
        };
        Self { path: info.port_name, usb }
    }
}

/// What the files of `host` know of the `listed` ports.
#[must_use]
pub fn ports(host: &Host, listed: &[Listed]) -> Vec<Port> {
    let lasting: Vec<(String, String)> = host
        .names(BY_ID)
        .into_iter()
        .filter_map(|name| {
            let target = host.link(&format!("{BY_ID}/{name}"))?;
            Some((target.file_name()?.to_string_lossy().into_owned(), name))
        })
        .collect();
    let holders = if listed.is_empty() { Vec::new() } else { holders(host) };
    let port = |listed: &Listed| {
        let path = &listed.path;
        let device = path.rsplit('/').next().unwrap_or(path);
        let latency = format!("/sys/bus/usb-serial/devices/{device}/latency_timer");
        Port {
            path: path.clone(),
            by_id: lasting.iter().find(|(to, _)| to == device).map(|(_, name)| name.clone()),
            usb: listed.usb.clone(),
            rights: host.rights(path),
            group: host.group_of(path),
            holder: holders.iter().find(|(held, _)| held == path).map(|(_, who)| who.clone()),
            latency_ms: host.text(&latency).and_then(|text| text.parse().ok()),
        }
    };
    listed.iter().map(port).collect()
}

/// Every terminal device that some process has open, and which.
fn holders(host: &Host) -> Vec<(String, Holder)> {
    let mut found = Vec::new();
    for pid in host.names("/proc").iter().filter_map(|name| name.parse::<u32>().ok()) {
        for descriptor in host.names(&format!("/proc/{pid}/fd")) {
            let Some(file) = host.link(&format!("/proc/{pid}/fd/{descriptor}")) else { continue };
            let file = file.to_string_lossy().into_owned();
            if file.starts_with("/dev/tty") {
                found.push((file, Holder { pid, name: process(host, pid) }));
            }
        }
    }
    found
}

fn process(host: &Host, pid: u32) -> String {
    host.text(&format!("/proc/{pid}/comm")).unwrap_or_default()
}

/// Whether a process of this name runs.
fn runs(host: &Host, name: &str) -> bool {
    let mut pids = host.names("/proc").into_iter().filter_map(|name| name.parse::<u32>().ok());
    pids.any(|pid| process(host, pid) == name)
}

/// What stands in the way of `ports`, and what mends it.
#[must_use]
pub fn problems(host: &Host, login: &Login, ports: &[Port]) -> Vec<Problem> {
    let mut problems = Vec::new();
    problems.extend(braille(host, ports));
    problems.extend(without_port(host, ports));
    problems.extend(rights(host, login, ports));
    for port in ports {
        problems.extend(port.holder.as_ref().map(|holder| held(port, holder)));
    }
    problems.extend(modem_manager(host, ports));
    for port in ports {
        problems.extend(slow(port));
    }
    problems
}

fn problem(what: String, mend: impl Into<String>) -> Problem {
    Problem::new(About::Serial, what, mend)
}

/// brltty takes ports away as soon as they are plugged in.
fn braille(host: &Host, ports: &[Port]) -> Option<Problem> {
    let is_alike = |vendor| BRAILLE_LIKE.contains(&vendor);
    let there = ports.iter().any(|port| port.usb.as_ref().is_some_and(|usb| is_alike(usb.vendor)))
        || adapters(host).iter().any(|(vendor, _)| is_alike(*vendor));
    (there && runs(host, "brltty")).then(|| {
        problem(
            "brltty runs, and takes USB serial ports (CH340, FTDI, CP210x) for braille displays"
                .to_owned(),
            "sudo systemctl mask --now brltty.service brltty-udev.service",
        )
    })
}

/// The USB devices with a chip for serial lines: maker and product.
fn adapters(host: &Host) -> Vec<(u16, u16)> {
    let number = |device: &str, name: &str| {
        let text = host.text(&format!("/sys/bus/usb/devices/{device}/{name}"))?;
        u16::from_str_radix(&text, 16).ok()
    };
    let devices = host.names("/sys/bus/usb/devices");
    let all =
        devices.iter().filter_map(|d| Some((number(d, "idVendor")?, number(d, "idProduct")?)));
    // FTDI, WCH and Silicon Labs make other things too; these are their serial lines.
    let is_serial = |(vendor, product): &(u16, u16)| match vendor {
        0x0403 => matches!(product, 0x6001 | 0x6010 | 0x6011 | 0x6014 | 0x6015),
        0x1a86 => matches!(product, 0x5523 | 0x7522 | 0x7523 | 0x55d3 | 0x55d4),
        0x10c4 => matches!(product, 0xea60 | 0xea70 | 0xea71),
        _ => false,
    };
    all.filter(is_serial).collect()
}

/// An adapter is plugged in, but no port came of it.
fn without_port(host: &Host, ports: &[Port]) -> Option<Problem> {
    let has_port = |adapter: &(u16, u16)| {
        let mut usb = ports.iter().filter_map(|port| port.usb.as_ref());
        usb.any(|usb| (usb.vendor, usb.product) == *adapter)
    };
    let (vendor, product) = adapters(host).into_iter().find(|adapter| !has_port(adapter))?;
    Some(problem(
        format!(
            "a USB serial adapter ({vendor:04x}:{product:04x}) is plugged in, but has no port: its \
             driver is missing or another program took it; in a container, its device is not \
             passed in"
        ),
        "sudo dmesg | grep -iE 'tty|brltty|ch34|ftdi|cp210' | tail",
    ))
}

/// Ports that this user may not use.
fn rights(host: &Host, login: &Login, ports: &[Port]) -> Vec<Problem> {
    let shut = ports.iter().filter(|port| !port.rights.are_enough());
    let mut groups: Vec<(String, Vec<&str>)> = Vec::new();
    for port in shut {
        let group = port.group.clone().unwrap_or_else(|| "dialout".to_owned());
        match groups.iter_mut().find(|(known, _)| *known == group) {
            Some((_, paths)) => paths.push(&port.path),
            None => groups.push((group, vec![&port.path])),
        }
    }
    let each = |(group, paths): (String, Vec<&str>)| {
        let (paths, user) = (paths.join(", "), &login.user);
        match login.membership(host, &group) {
            Membership::NextLogin => problem(
                format!(
                    "{user} is in group {group}, but not in this login, which cannot use {paths}"
                ),
                format!("newgrp {group}    # for this shell; or log out and in again"),
            ),
            // Of the superuser's own group nobody is made a member.
            _ if group == "root" => problem(
                format!("{paths}: no group of people may use it, as udev would set up"),
                format!(
                    "sudo chmod a+rw {}    # until it is plugged in again",
                    paths.replace(", ", " ")
                ),
            ),
            Membership::Member => problem(
                format!("{paths}: group {group} may not read and write"),
                format!("sudo chmod g+rw {}", paths.replace(", ", " ")),
            ),
            Membership::Outside | Membership::NoGroup => problem(
                format!("{user} may not use {paths}: not in group {group}"),
                format!("sudo usermod -aG {group} {user}    # then log out and in again"),
            ),
        }
    };
    groups.into_iter().map(each).collect()
}

fn held(port: &Port, holder: &Holder) -> Problem {
    problem(
        format!("{} is open in {} (process {})", port.path, holder.name, holder.pid),
        format!("kill {}    # or close it there", holder.pid),
    )
}

/// `ModemManager` sends modem commands to whatever is plugged in.
fn modem_manager(host: &Host, ports: &[Port]) -> Option<Problem> {
    let usb = ports.iter().find_map(|port| port.usb.as_ref())?;
    runs(host, "ModemManager").then(|| {
        let rule = format!(
            r#"ATTRS{{idVendor}}=="{:04x}", ATTRS{{idProduct}}=="{:04x}", ENV{{ID_MM_DEVICE_IGNORE}}="1""#,
            usb.vendor, usb.product
        );
        problem(
            "ModemManager runs, and talks to USB serial ports when they are plugged in".to_owned(),
            format!(
                "echo '{rule}' | sudo tee /etc/udev/rules.d/70-coadapt-ports.rules\n{RELOAD}"
            ),
        )
    })
}

/// An FTDI chip that waits for more bytes before it hands them on.
fn slow(port: &Port) -> Option<Problem> {
    let latency = port.latency_ms.filter(|latency| *latency > QUICK_MS)?;
    let device = port.path.rsplit('/').next().unwrap_or(&port.path);
    let rule =
        r#"ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1""#;
    Some(problem(
        format!(
            "{}: its FTDI chip keeps bytes up to {latency} ms, too long for a control loop",
            port.path
        ),
        format!(
            "echo 1 | sudo tee /sys/bus/usb-serial/devices/{device}/latency_timer\n\
             echo '{rule}' | sudo tee /etc/udev/rules.d/70-coadapt-latency.rules"
        ),
    ))
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::{PermissionsExt, symlink};
    use std::path::Path;

    /// A computer with an FTDI adapter and a CH340.
    struct Fake(tempfile::TempDir);

    impl Fake {
        fn new() -> Self {
            let fake = Self(tempfile::tempdir().unwrap());
            fake.file("dev/ttyUSB0", "").file("dev/ttyUSB1", "");
            fake.link("dev/serial/by-id/usb-FTDI_FT232R_A50285BI-if00-port0", "../../ttyUSB0");
            fake.file("sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "16\n");
            fake
        }

        fn file(&self, path: &str, text: &str) -> &Self {
            let path = self.0.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
            self
        }

        fn link(&self, path: &str, target: &str) -> &Self {
            let path = self.0.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            symlink(target, path).unwrap();
            self
        }

        fn shut(&self, path: &str) -> &Self {
            let shut = fs::Permissions::from_mode(0o060);
            fs::set_permissions(self.0.path().join(path), shut).unwrap();
            self
        }

        fn ports(&self) -> Vec<Port> {
            let usb = |vendor, product| Some(Usb { vendor, product, ..Usb::default() });
            ports(
                &self.host(),
                &[
                    Listed { path: "/dev/ttyUSB0".to_owned(), usb: usb(0x0403, 0x6001) },
                    Listed { path: "/dev/ttyUSB1".to_owned(), usb: usb(0x1a86, 0x7523) },
                ],
            )
        }

        fn host(&self) -> Host {
            Host::at(self.0.path(), &[("USER", "ann")])
        }

        fn problems(&self) -> Vec<Problem> {
            let host = self.host();
            problems(&host, &Login::on(&host), &self.ports())
        }
    }

    #[test]
    fn a_port_has_its_lasting_name_its_latency_and_its_holder() {
        let fake = Fake::new();
        fake.file("proc/77/comm", "screen\n").link("proc/77/fd/5", "/dev/ttyUSB1");
        let ports = fake.ports();
        assert_eq!(ports[0].by_id.as_deref(), Some("usb-FTDI_FT232R_A50285BI-if00-port0"));
        assert_eq!((ports[0].latency_ms, ports[1].latency_ms), (Some(16), None));
        assert_eq!(ports[1].holder, Some(Holder { pid: 77, name: "screen".to_owned() }));
        assert!(ports[0].rights.are_enough());
    }

    #[test]
    fn every_problem_has_the_line_that_mends_it() {
        let fake = Fake::new();
        fake.shut("dev/ttyUSB1").file("proc/9/comm", "ModemManager\n");
        fake.file("proc/8/comm", "brltty\n").file("proc/7/comm", "cat");
        fake.link("proc/7/fd/3", "/dev/ttyUSB0");
        fake.file("sys/bus/usb/devices/1-2/idVendor", "10c4\n");
        fake.file("sys/bus/usb/devices/1-2/idProduct", "ea60\n");
        let problems = fake.problems();
        let mends: Vec<&str> = problems.iter().map(|problem| problem.mend.as_str()).collect();
        for (mend, begins) in mends.iter().zip([
            "sudo systemctl mask --now brltty",
            "sudo dmesg | grep",
            "sudo usermod -aG ",
            "kill 7 ",
            "echo 'ATTRS{idVendor}==\"0403\"",
            "echo 1 | sudo tee /sys/bus/usb-serial/devices/ttyUSB0/latency_timer",
        ]) {
            assert!(mend.starts_with(begins), "{mend} for {begins}");
        }
        assert_eq!(problems.len(), 6, "{problems:?}");
        assert!(problems.iter().all(|problem| problem.about == About::Serial));
    }

    #[test]
    fn a_group_that_waits_for_the_next_login_says_so() {
        let fake = Fake::new();
        // The group of the file is that of whoever runs the test.
        let own = fs::metadata(fake.0.path().join("dev/ttyUSB1")).unwrap();
        let id = std::os::unix::fs::MetadataExt::gid(&own);
        fake.shut("dev/ttyUSB1").file("etc/group", &format!("uucp:x:{id}:ann\n"));
        let problems = fake.problems();
        assert!(problems[0].mend.starts_with("newgrp uucp"), "{problems:?}");
        fake.file("etc/group", &format!("uucp:x:{id}:bob\n"));
        let problems = fake.problems();
        assert_eq!(problems[0].mend, "sudo usermod -aG uucp ann    # then log out and in again");
    }

    #[test]
    fn a_computer_without_ports_has_no_problem() {
        let host = Host::at(Path::new("/nonexistent"), &[]);
        assert_eq!(listed(&host), []);
        assert_eq!(problems(&host, &Login::on(&host), &[]), []);
    }
}
