//! Which device `--backend serial:…` means, today and after it was unplugged.

use std::fmt::{self, Display};
use std::str::FromStr;

use super::ports::{self, Listed, Usb};
use crate::host::Host;

/// The folder of lasting names.
const BY_ID: &str = "/dev/serial/by-id";

/// A device as a person names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// A path such as `/dev/ttyUSB0`, or a link to it.
    Path(String),
    /// A name below `/dev/serial/by-id`.
    ById(String),
    /// A USB device by its numbers.
    Usb {
        /// The maker's number.
        vendor: u16,
        /// The product's number.
        product: u16,
        /// The serial number, where one was given.
        serial: Option<String>,
    },
}

/// Words that name no device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?} names no serial port: give a path such as /dev/ttyUSB0, a name in /dev/serial/by-id, or \
     usb:VID:PID[:SERIAL] with numbers such as usb:1a86:7523; `coadapt devices` lists what is there"
)]
pub struct Unnamed(String);

/// Why a device is not there.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Missing {
    /// Nothing has this name.
    #[error("{0} is not there: plug it in, and look at its power and its cable")]
    Gone(String),
    /// Several have it.
    #[error("{0} is the name of {1} devices: add the serial number, usb:VID:PID:SERIAL")]
    Several(String, usize),
}

impl FromStr for Address {
    type Err = Unnamed;

    fn from_str(words: &str) -> Result<Self, Unnamed> {
        let unnamed = || Unnamed(words.to_owned());
        if let Some(numbers) = words.strip_prefix("usb:") {
            let mut parts = numbers.splitn(3, ':');
            let mut number = || {
                let digits = parts.next().filter(|digits| (1..=4).contains(&digits.len()));
                digits.and_then(|digits| u16::from_str_radix(digits, 16).ok()).ok_or_else(unnamed)
            };
            let (vendor, product) = (number()?, number()?);
            let serial = parts.next().map(str::to_owned);
            if serial.as_ref().is_some_and(String::is_empty) {
                return Err(unnamed());
            }
            return Ok(Self::Usb { vendor, product, serial });
        }
        if let Some(name) = words.strip_prefix(BY_ID).map(|name| name.trim_start_matches('/')) {
            return if name.is_empty() { Err(unnamed()) } else { Ok(Self::ById(name.to_owned())) };
        }
        match words {
            "" => Err(unnamed()),
            path if path.contains('/') || cfg!(windows) => Ok(Self::Path(path.to_owned())),
            name => Ok(Self::ById(name.to_owned())),
        }
    }
}

impl Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Path(path) => f.write_str(path),
            Self::ById(name) => write!(f, "{BY_ID}/{name}"),
            Self::Usb { vendor, product, serial } => {
                write!(f, "usb:{vendor:04x}:{product:04x}")?;
                serial.as_ref().map_or(Ok(()), |serial| write!(f, ":{serial}"))
            }
        }
    }
}

impl Address {
    /// The path where the device is at the moment.
    ///
    /// # Errors
    /// When it is not there, or it is not clear which one is meant.
    pub fn path(&self, host: &Host) -> Result<String, Missing> {
        match self {
            Self::Usb { .. } => self.find(&ports::listed(host)),
            Self::ById(_) | Self::Path(_) => {
                let path = self.to_string();
                if host.exists(&path) { Ok(path) } else { Err(Missing::Gone(path)) }
            }
        }
    }

    /// The one of `listed` that is meant.
    fn find(&self, listed: &[Listed]) -> Result<String, Missing> {
        let meant: Vec<&Listed> = listed
            .iter()
            .filter(|port| port.usb.as_ref().is_some_and(|usb| self.is(usb)))
            .collect();
        match meant[..] {
            [] => Err(Missing::Gone(self.to_string())),
            [one] => Ok(one.path.clone()),
            _ => Err(Missing::Several(self.to_string(), meant.len())),
        }
    }

    fn is(&self, usb: &Usb) -> bool {
        let Self::Usb { vendor, product, serial } = self else { return false };
        (usb.vendor, usb.product) == (*vendor, *product)
            && serial.as_ref().is_none_or(|serial| usb.serial.as_ref() == Some(serial))
    }

    /// What the device is called for good: the lasting name of the port at `path`, where it has
    /// one, and what a person called it elsewhere.
    #[must_use]
    pub fn identity(&self, host: &Host, path: &str) -> String {
        let device = path.rsplit('/').next().unwrap_or(path);
        let lasting = host.names(BY_ID).into_iter().find(|name| {
            host.link(&format!("{BY_ID}/{name}"))
                .is_some_and(|to| to.file_name().is_some_and(|file| file == device))
        });
        match self {
            Self::ById(name) => name.clone(),
            _ => lasting.unwrap_or_else(|| self.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn usb(path: &str, serial: Option<&str>) -> Listed {
        let usb = Usb {
            vendor: 0x1a86,
            product: 0x7523,
            serial: serial.map(str::to_owned),
            ..Usb::default()
        };
        Listed { path: path.to_owned(), usb: Some(usb) }
    }

    #[test]
    fn a_path_a_lasting_name_and_usb_numbers_are_told_apart() {
        let address = |words: &str| words.parse::<Address>();
        assert_eq!(address("/dev/ttyUSB0"), Ok(Address::Path("/dev/ttyUSB0".to_owned())));
        assert_eq!(address("./cp0"), Ok(Address::Path("./cp0".to_owned())));
        let by_id = Ok(Address::ById("usb-1a86_USB_Serial-if00-port0".to_owned()));
        assert_eq!(address("usb-1a86_USB_Serial-if00-port0"), by_id);
        assert_eq!(address("/dev/serial/by-id/usb-1a86_USB_Serial-if00-port0"), by_id);
        let named = |serial: Option<&str>| {
            let serial = serial.map(str::to_owned);
            Ok(Address::Usb { vendor: 0x1a86, product: 0x7523, serial })
        };
        assert_eq!(address("usb:1a86:7523"), named(None));
        assert_eq!(address("usb:1A86:7523:A1:B2"), named(Some("A1:B2")));
        for wrong in [
            "",
            "usb:",
            "usb:1a86",
            "usb:1a86:xyz",
            "usb:11a86:1",
            "usb:1:2:",
            "/dev/serial/by-id/",
        ] {
            assert!(address(wrong).is_err(), "{wrong}");
        }
        for words in ["/dev/ttyACM3", "usb:1a86:7523", "usb:1a86:7523:A1"] {
            assert_eq!(address(words).unwrap().to_string(), words);
        }
    }

    #[test]
    fn one_of_two_boards_of_a_kind_is_found_by_its_serial_number_alone() {
        let both = [usb("/dev/ttyUSB0", Some("A")), usb("/dev/ttyUSB1", Some("B"))];
        let find = |words: &str| words.parse::<Address>().unwrap().find(&both);
        assert_eq!(find("usb:1a86:7523:B"), Ok("/dev/ttyUSB1".to_owned()));
        assert_eq!(find("usb:1a86:7523"), Err(Missing::Several("usb:1a86:7523".to_owned(), 2)));
        assert!(matches!(find("usb:1a86:7523:C"), Err(Missing::Gone(_))));
        assert!(matches!(find("usb:0403:6001"), Err(Missing::Gone(_))));
    }
}
