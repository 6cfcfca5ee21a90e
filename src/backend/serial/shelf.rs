//! What calibrations found, kept in a folder with one RON file for each device.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use super::{Params, scales};
use crate::backend::wire::Format;
use crate::check::{Check, Checker};

/// A calibration holds for so many days.
pub const FRESH_DAYS: f64 = 7.0;
/// Clocks of two computers may differ by so many days.
const SKEW_DAYS: f64 = 0.05;

/// What a calibration found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// The device's lasting name.
    pub device: String,
    /// When it was calibrated, RFC 3339.
    pub at: String,
    /// What it was calibrated for.
    pub made_for: MadeFor,
    /// The reading of the pole that hangs at rest, counts.
    pub hanging: f64,
    /// Whether the angle's reading falls while the angle grows.
    pub angle_invert: bool,
    /// Whether the position's reading falls while the position grows.
    pub position_invert: bool,
    /// Whether a positive command pushes to the left.
    pub motor_invert: bool,
}

/// Those of a profile's values that a calibration was made with, and holds for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MadeFor {
    /// What the device speaks.
    pub format: Format,
    /// Whether it finds its ends first, which may turn the position's sign.
    pub homing: bool,
    /// Counts of a full turn of the pole.
    pub counts_per_turn: f64,
    /// The way of a count, m.
    pub m_per_count: f64,
    /// The command that drives the motor fully.
    pub full_scale: u32,
    /// The limits that a person has looked at, m.
    pub soft_limit_m: f64,
    /// The outer one.
    pub hard_limit_m: f64,
}

impl MadeFor {
    /// What matters of `params`.
    #[must_use]
    pub const fn of(params: &Params) -> Self {
        Self {
            format: params.format,
            homing: params.homing,
            counts_per_turn: params.scales.angle.counts_per_turn,
            m_per_count: params.scales.position.m_per_count,
            full_scale: params.scales.motor.full_scale,
            soft_limit_m: params.safety.soft_limit_m,
            hard_limit_m: params.safety.hard_limit_m,
        }
    }
}

impl Check for Calibration {
    fn check(&self, c: &mut Checker<'_>) {
        c.demand(!self.device.is_empty(), "device", &self.device, "a name");
        c.demand(self.time().is_some(), "at", &self.at, "a time such as 2026-03-14T09:26:53Z");
        c.range("hanging", self.hanging, -1e7..=1e7);
    }
}

impl Calibration {
    /// Corrects `scales`. To do it twice changes nothing more.
    pub fn apply(&self, scales: &mut scales::Params) {
        let scales::Params { angle, position, motor, .. } = scales;
        angle.hanging = self.hanging;
        position.invert = self.position_invert;
        if angle.invert != self.angle_invert {
            angle.invert = self.angle_invert;
            // Upright stays at the same reading.
            angle.upright_deg = -angle.upright_deg;
        }
        if motor.invert != self.motor_invert {
            motor.invert = self.motor_invert;
            // What was forward is backward now.
            std::mem::swap(&mut motor.friction_forward, &mut motor.friction_backward);
        }
    }

    /// Whether it is older than so many `days` at `now`. One of another day to come, or of no
    /// readable time, is too old as well: nobody knows what it is worth.
    #[must_use]
    pub fn is_stale(&self, now: Timestamp, days: f64) -> bool {
        let age = self.time().map(|at| now.duration_since(at).as_secs_f64() / 86_400.0);
        !age.is_some_and(|age| (-SKEW_DAYS..=days).contains(&age))
    }

    /// Whether it was made for `params`.
    #[must_use]
    pub fn fits(&self, params: &Params) -> bool {
        self.made_for == MadeFor::of(params)
    }

    fn time(&self) -> Option<Timestamp> {
        self.at.parse().ok()
    }
}

/// Why a device may not be armed before it was calibrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Uncalibrated {
    /// It never was.
    #[error("this device was never calibrated: calibrate it first")]
    Never,
    /// It was, but too long ago.
    #[error("this device's calibration is too old: calibrate it again")]
    Stale,
    /// The profile was another one.
    #[error("this device was calibrated for other scales or limits: calibrate it again")]
    Changed,
}

/// The calibration that holds at `now` for a device with `params`, of what was `found`.
///
/// # Errors
/// Why none does.
pub fn current<'a>(
    found: Option<&'a Calibration>,
    params: &Params,
    now: Timestamp,
    days: f64,
) -> Result<&'a Calibration, Uncalibrated> {
    match found {
        None => Err(Uncalibrated::Never),
        Some(found) if !found.fits(params) => Err(Uncalibrated::Changed),
        Some(found) if found.is_stale(now, days) => Err(Uncalibrated::Stale),
        Some(found) => Ok(found),
    }
}

/// Why a calibration could not be kept or read back.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused.
    #[error("cannot {action} {}: {cause}", path.display())]
    Io {
        /// What was tried, such as `write`.
        action: &'static str,
        /// On which file or folder.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// A file is not what it should be.
    #[error("{}: {problem}; remove the file and calibrate again", path.display())]
    Unfit {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
}

impl Error {
    fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |cause| Self::Io { action, path, cause }
    }
}

/// The calibration of `device` in `folder`, if there is one.
///
/// # Errors
/// When there is a file for it that cannot be read or is none of this device.
pub fn load(folder: &Path, device: &str) -> Result<Option<Calibration>, Error> {
    let path = place(folder, device);
    let text = match fs::read_to_string(&path) {
        Err(cause) if cause.kind() == ErrorKind::NotFound => return Ok(None),
        read => read.map_err(Error::io("read", &path))?,
    };
    let unfit = |problem: String| Error::Unfit { path: path.clone(), problem };
    let found: Calibration = ron::from_str(&text).map_err(|error| unfit(error.to_string()))?;
    let mut faults = Vec::new();
    found.check(&mut Checker::new(&mut faults));
    if let Some(fault) = faults.first() {
        let (key, value, allowed) = (&fault.key, &fault.value, &fault.allowed);
        return Err(unfit(format!("{key} is {value:?}, allowed is {allowed}")));
    }
    if found.device != device {
        return Err(unfit(format!("it is of another device, {}", found.device)));
    }
    Ok(Some(found))
}

/// Keeps `calibration` in `folder` in place of an older one: whole, or not at all.
///
/// # Errors
/// When the system refuses; what was there is still there then.
pub fn store(folder: &Path, calibration: &Calibration) -> Result<(), Error> {
    let path = place(folder, &calibration.device);
    let pretty = ron::ser::PrettyConfig::new().new_line("\n");
    let text = ron::ser::to_string_pretty(calibration, pretty)
        .map_err(|error| Error::Unfit { path: path.clone(), problem: error.to_string() })?;
    fs::create_dir_all(folder).map_err(Error::io("make", folder))?;
    replace(folder, &path, &format!("{text}\n")).map_err(Error::io("write", &path))
}

/// Puts `text` into its place, to outlive a loss of power.
fn replace(folder: &Path, path: &Path, text: &str) -> io::Result<()> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".coadapt-").suffix(".new");
    #[cfg(unix)]
    let builder = {
        use std::os::unix::fs::PermissionsExt;
        // As any new file; the system takes away what the user's mask says.
        builder.permissions(fs::Permissions::from_mode(0o666))
    };
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(text.as_bytes())?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|fault| fault.error)?;
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}

/// The file of `device`: its name, with every byte that a file's name had better not have in
/// the way of web addresses.
fn place(folder: &Path, device: &str) -> PathBuf {
    let mut name = String::from("device-");
    for byte in device.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' => {
                name.push(char::from(byte));
            }
            // Writing into a string does not fail.
            _ => drop(write!(name, "%{byte:02X}")),
        }
    }
    folder.join(name + ".ron")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn calibration(device: &str) -> Calibration {
        Calibration {
            device: device.to_owned(),
            at: "2026-03-14T09:26:53Z".to_owned(),
            made_for: MadeFor::of(&Params::default()),
            hanging: 1028.5,
            angle_invert: true,
            position_invert: false,
            motor_invert: true,
        }
    }

    fn time(text: &str) -> Timestamp {
        text.parse().unwrap()
    }

    #[test]
    fn a_calibration_is_kept_by_its_devices_name_and_replaced_whole() {
        let folder = tempfile::tempdir().unwrap();
        let shelf = folder.path().join("devices");
        assert_eq!(load(&shelf, "a").unwrap(), None);
        for name in ["usb-1a86_USB_Serial-if00", "../../etc/passwd", "a b", "a_b", "é", "."] {
            store(&shelf, &calibration(name)).unwrap();
            assert_eq!(load(&shelf, name).unwrap(), Some(calibration(name)), "{name}");
        }
        assert_eq!(fs::read_dir(&shelf).unwrap().count(), 6, "all within the folder");
        let newer = Calibration { hanging: 7.25, ..calibration("a b") };
        store(&shelf, &newer).unwrap();
        assert_eq!(load(&shelf, "a b").unwrap(), Some(newer));
        assert_eq!(fs::read_dir(&shelf).unwrap().count(), 6, "nothing is left over");
    }

    #[test]
    fn a_file_that_is_damaged_or_of_another_device_is_told() {
        let folder = tempfile::tempdir().unwrap();
        store(folder.path(), &calibration("a")).unwrap();
        let text = fs::read_to_string(place(folder.path(), "a")).unwrap();
        for (from, to, words) in [
            ("hanging", "hangings", "hangings"),
            ("1028.5", "inf", "hanging is \"inf\""),
            ("2026-03-14", "yesterday", "at is"),
            ("\"a\"", "\"b\"", "another device, b"),
            (")", "", "Expected"),
        ] {
            assert!(text.contains(from), "{text}");
            fs::write(place(folder.path(), "a"), text.replace(from, to)).unwrap();
            let error = load(folder.path(), "a").unwrap_err().to_string();
            assert!(error.contains(words) && error.contains("calibrate again"), "{error}");
        }
    }

    #[test]
    fn only_a_fresh_calibration_for_the_same_scales_and_limits_counts() {
        let params = Params::default();
        let made = calibration("a");
        let judge = |found, params: &Params, now| {
            current(found, params, time(now), FRESH_DAYS).map(|found| found.hanging)
        };
        assert_eq!(judge(Some(&made), &params, "2026-03-21T09:00:00Z"), Ok(1028.5));
        assert_eq!(judge(Some(&made), &params, "2026-03-14T09:26:00Z"), Ok(1028.5));
        let stale = Err(Uncalibrated::Stale);
        assert_eq!(judge(Some(&made), &params, "2026-03-21T10:00:00Z"), stale);
        assert_eq!(judge(Some(&made), &params, "2026-03-13T00:00:00Z"), stale, "yet to come");
        assert_eq!(judge(None, &params, "2026-03-14T10:00:00Z"), Err(Uncalibrated::Never));
        let mut other = params;
        other.scales.angle.counts_per_turn = 4069.0;
        assert_eq!(judge(Some(&made), &other, "2026-03-14T10:00:00Z"), Err(Uncalibrated::Changed));
        let unreadable = Calibration { at: "soon".to_owned(), ..made };
        assert!(unreadable.is_stale(time("2026-03-14T10:00:00Z"), FRESH_DAYS));
    }

    proptest! {
        #[test]
        fn to_correct_twice_is_to_correct_once_and_upright_stays_at_its_reading(
            hanging in -2000.0..2000.0, upright_deg in -45.0..45.0,
            was in any::<(bool, bool, bool)>(), is in any::<(bool, bool, bool)>(),
        ) {
            let mut scales = scales::Params::default();
            scales.angle.hanging = hanging;
            scales.angle.upright_deg = upright_deg;
            (scales.angle.invert, scales.position.invert, scales.motor.invert) = was;
            let found = Calibration {
                hanging, angle_invert: is.0, position_invert: is.1, motor_invert: is.2,
                ..calibration("a")
            };
            let before = scales.clone();
            found.apply(&mut scales);
            let once = scales.clone();
            found.apply(&mut scales);
            prop_assert_eq!(&scales, &once);
            for reading in [-1500, 0, 1500] {
                let sign = if was.0 == is.0 { 1.0 } else { -1.0 };
                let apart = scales.angle(reading) - sign * before.angle(reading);
                prop_assert!(crate::signal::wrapped(apart).abs() < 1e-9);
            }
            // The same friction on the same command.
            let sign = if was.2 == is.2 { 1.0 } else { -1.0 };
            prop_assert_eq!(scales.command(sign * 0.3, sign), before.command(0.3, 1.0));
        }
    }
}
