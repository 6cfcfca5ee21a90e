//! Range checks of parameters, collected instead of stopping at the first.

use std::fmt::Display;
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
            let allowed = format!("{} to {}", range.start(), range.end());
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

/// Parameters that know their allowed ranges.
pub trait Check {
    /// Reports every value outside its range.
    fn check(&self, checker: &mut Checker<'_>);
}
