//! A comparison as a sentence that says how each of its numbers was found.

use std::fmt::{Display, Formatter, Result};

use super::{Comparison, Test};

impl Display for Comparison {
    /// Such as: mean 2.50 against 6.50, a difference of -4.00 (95 % BCa interval -5.50 to -2.50;
    /// Hedges' g -2.69); medians 2.50 and 6.50, sd 1.29 and 1.29, n = 4 and 4; exact permutation
    /// test of all 70 arrangements, two-sided: p = 0.0286 (with these sizes no p below 0.0286 is
    /// possible)
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Self { n, mean, median, sd, difference, .. } = self;
        let decimals = self.decimals();
        write!(
            f,
            "mean {:.decimals$} against {:.decimals$}, a difference of {difference:.decimals$} (",
            mean.0, mean.1
        )?;
        if let Some((low, high)) = self.interval95 {
            write!(f, "95 % BCa interval {low:.decimals$} to {high:.decimals$}; ")?;
        }
        match self.hedges_g {
            Some(g) => write!(f, "Hedges' g {g:.2}); ")?,
            None => f.write_str("no effect size without spread); ")?,
        }
        write!(
            f,
            "medians {:.decimals$} and {:.decimals$}, sd {:.decimals$} and {:.decimals$}, ",
            median.0, median.1, sd.0, sd.1
        )?;
        match self.test {
            Test::Permutation { .. } | Test::Welch { .. } => write!(f, "n = {} and {}; ", n.0, n.1),
            Test::PairedPermutation { .. } | Test::PairedT { .. } => {
                write!(f, "n = {} pairs; ", n.0)
            }
        }?;
        write!(f, "{}, two-sided: p {}", self.test, chance(self.p))?;
        match self.smallest_p {
            Some(least) => {
                write!(f, " (with these sizes no p below {} is possible)", number(least))
            }
            None => Ok(()),
        }
    }
}

impl Display for Test {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::Permutation { arrangements } => {
                write!(f, "exact permutation test of all {arrangements} arrangements")
            }
            Self::PairedPermutation { arrangements } => {
                write!(f, "exact sign-flip permutation test of all {arrangements} arrangements")
            }
            Self::Welch { t, df } => write!(f, "Welch's t-test, t({df:.1}) = {t:.2}"),
            Self::PairedT { t, df } => write!(f, "paired t-test, t({df:.0}) = {t:.2}"),
        }
    }
}

impl Comparison {
    /// The decimals that give the smaller spread three digits; where nothing spreads, the means.
    fn decimals(&self) -> usize {
        let sizes = [self.sd.0, self.sd.1, self.mean.0, self.mean.1].map(f64::abs);
        let spread = sizes[..2].iter().copied().filter(|size| *size > 0.0).reduce(f64::min);
        let size = spread.unwrap_or_else(|| sizes[2].max(sizes[3]));
        (0..9)
            .find(|&decimals| size * 10_f64.powi(decimals) >= 100.0)
            .map_or(9, |decimals| usize::try_from(decimals).unwrap_or_default())
    }
}

/// A chance with its sign: four decimals, or that it is smaller than they show.
fn chance(p: f64) -> String {
    if p < 0.0001 { "< 0.0001".to_owned() } else { format!("= {p:.4}") }
}

/// A smallest chance: four decimals, or two digits.
fn number(p: f64) -> String {
    if p < 0.001 { format!("{p:.1e}") } else { format!("{p:.4}") }
}
