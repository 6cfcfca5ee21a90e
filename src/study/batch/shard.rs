//! A share of a study's runs.

use std::fmt;
use std::str::FromStr;

/// The `number`th of `of` shares of a study's runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    pub number: u32,
    /// How many there are.
    pub of: u32,
}

impl Shard {
    /// The only share: all runs.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// The share among `of` that has the run of that number: they are dealt out one by one.
    #[must_use]
    pub const fn of_run(run: u32, of: u32) -> Self {
        Self { number: run.saturating_sub(1) % of + 1, of }
    }

    /// Whether the run of that number is in it.
    #[must_use]
    pub const fn holds(self, run: u32) -> bool {
        Self::of_run(run, self.of).number == self.number
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(words: &str) -> Result<Self, String> {
        let shard = words.split_once('/').and_then(|(number, of)| {
            Some(Self { number: number.trim().parse().ok()?, of: of.trim().parse().ok()? })
        });
        shard
            .filter(|shard| (1..=shard.of).contains(&shard.number))
            .ok_or_else(|| "give K/N, share K of N, K from 1 to N, such as 1/8".to_owned())
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}
