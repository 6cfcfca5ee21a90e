//! Range checks of parameters, collected instead of stopping at the first.

use std::fmt::{self, Display};
use std::ops::RangeInclusive;

/// One value that is not allowed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The dotted path of the key, such as `plant.pole_length_m`.
    pub key: String,
    /// The value as given.
    pub value: String,
    /// What would be allowed, in words.
    pub allowed: String,
}

/// Collects the faults of one section of parameters.
pub struct Checker<'a> {
    section: String,
    faults: &'a mut Vec<Fault>,
}

impl<'a> Checker<'a> {
    /// A checker for the keys directly at the root.
    pub fn new(faults: &'a mut Vec<Fault>) -> Self {
        Self { section: String::new(), faults }
    }

    /// A checker for the keys under `section`.
    pub fn section(&mut self, section: &str) -> Checker<'_> {
        Checker { section: format!("{}{section}.", self.section), faults: self.faults }
    }

    /// Demands a finite number within `range`.
    pub fn range(&mut self, key: &str, value: f64, range: RangeInclusive<f64>) {
        if !range.contains(&value) {
            let allowed = format!("{} to {}", Short(*range.start()), Short(*range.end()));
            self.refuse(key, value, &allowed);
        }
    }

    /// Demands a whole number within `range`.
    pub fn count(&mut self, key: &str, value: u32, range: RangeInclusive<u32>) {
        if !range.contains(&value) {
            let allowed = format!("{} to {}", range.start(), range.end());
            self.refuse(key, value, &allowed);
        }
    }

    /// Reports `key` unless `holds`.
    pub fn demand(&mut self, holds: bool, key: &str, value: impl Display, allowed: &str) {
        if !holds {
            self.refuse(key, value, allowed);
        }
    }

    fn refuse(&mut self, key: &str, value: impl Display, allowed: &str) {
        self.faults.push(Fault {
            key: format!("{}{key}", self.section),
            value: value.to_string(),
            allowed: allowed.to_owned(),
        });
    }
}

/// A number as people write it: 0.05 and 1000, but 1e-6 and 1e15.
struct Short(f64);

impl Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(value) = self;
        if *value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
            write!(f, "{value}")
        } else {
            write!(f, "{value:e}")
        }
    }
}

/// Parameters that know their allowed ranges.
pub trait Check {
    /// Reports every value outside its range.
    fn check(&self, checker: &mut Checker<'_>);
}

/// What is not there has no faults.
impl<T: Check> Check for Option<T> {
    fn check(&self, checker: &mut Checker<'_>) {
        if let Some(parameters) = self {
            parameters.check(checker);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_tells_its_path_its_value_and_the_range() {
        let mut faults = Vec::new();
        let mut checker = Checker::new(&mut faults);
        let mut section = checker.section("plant");
        section.range("mass_kg", f64::NAN, 0.001..=1000.0);
        section.range("stiffness", 2e15, 1e-6..=1e15);
        section.count("substeps", 0, 1..=1_000_000);
        section.range("bounce", 0.5, 0.0..=1.0);
        let told: Vec<String> =
            faults.iter().map(|f| format!("{} {}: {}", f.key, f.value, f.allowed)).collect();
        assert_eq!(
            told,
            [
                "plant.mass_kg NaN: 0.001 to 1000",
                "plant.stiffness 2000000000000000: 1e-6 to 1e15",
                "plant.substeps 0: 1 to 1000000",
            ]
        );
    }
}
