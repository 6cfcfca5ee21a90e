//! Success: the moving average of a measure over the last α steps.

use serde::{Deserialize, Serialize};

use super::region::Scale;

/// What stands for the samples that a window does not have yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fill {
    /// The measure's minimum, success 0: eq. 19's division by α as printed.
    #[default]
    Minimum,
    /// Nothing: the mean over the samples seen so far.
    Partial,
}

/// A moving window over the last α measures of one region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Window {
    length: u32,
    fill: Fill,
    scale: Scale,
    /// The measures, oldest first from `next` on once the window is full.
    measures: Vec<f64>,
    next: usize,
    sum: f64,
}

impl Window {
    /// An empty window of `length` steps.
    #[must_use]
    pub fn new(length: u32, fill: Fill, scale: Scale) -> Self {
        Self { length: length.max(1), fill, scale, measures: Vec::new(), next: 0, sum: 0.0 }
    }

    /// Takes the newest measure and lets go of the one α steps before. A measure that is
    /// not finite counts as the minimum.
    pub fn push(&mut self, measure: f64) {
        let measure = if measure.is_finite() { measure } else { self.scale.minimum };
        if self.measures.len() < self.length as usize {
            self.measures.push(measure);
            self.sum += measure;
        } else if let Some(oldest) = self.measures.get_mut(self.next) {
            self.sum += measure - std::mem::replace(oldest, measure);
        }
        self.next += 1;
        if self.next >= self.length as usize {
            self.next = 0;
            // Once a turn the sum is taken anew, so that rounding never piles up.
            self.sum = self.measures.iter().sum();
        }
    }

    /// Whether no sample is missing any more.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.measures.len() >= self.length as usize
    }

    /// The success now, 0 to 1.
    #[must_use]
    pub fn success(&self) -> f64 {
        let seen = count(self.measures.len());
        let mean = match self.fill {
            Fill::Partial if self.measures.is_empty() => return 0.0,
            Fill::Partial => self.sum / seen,
            Fill::Minimum => {
                let length = f64::from(self.length);
                (self.sum + (length - seen) * self.scale.minimum) / length
            }
        };
        self.scale.success(mean)
    }
}

fn count(n: usize) -> f64 {
    u32::try_from(n).map_or(f64::INFINITY, f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const UNIT: Scale = Scale { minimum: 0.0, threshold: 1.0 };

    #[test]
    fn missing_samples_count_as_the_minimum_or_not_at_all() {
        let heights = Scale { minimum: -1.0, threshold: 0.5 };
        let mut minimum = Window::new(4, Fill::Minimum, heights);
        let mut partial = Window::new(4, Fill::Partial, heights);
        assert_eq!((minimum.success(), partial.success()), (0.0, 0.0));
        minimum.push(0.5);
        partial.push(0.5);
        assert_eq!((minimum.success(), partial.success()), (0.25, 1.0));
    }

    #[test]
    fn success_saturates() {
        let mut window = Window::new(1, Fill::Minimum, UNIT);
        window.push(7.0);
        assert_eq!(window.success(), 1.0);
        window.push(-7.0);
        assert_eq!(window.success(), 0.0);
        window.push(f64::NAN);
        assert_eq!(window.success(), 0.0);
    }

    proptest! {
        #[test]
        fn the_running_sum_is_the_mean_of_the_last_alpha(
            measures in prop::collection::vec(0.0..1.0_f64, 1..200),
            length in 1..40_u32,
        ) {
            let mut window = Window::new(length, Fill::Minimum, UNIT);
            for (k, &measure) in measures.iter().enumerate() {
                window.push(measure);
                let from = (k + 1).saturating_sub(length as usize);
                let mean = measures[from..=k].iter().sum::<f64>() / f64::from(length);
                prop_assert!((window.success() - mean).abs() < 1e-12);
            }
        }
    }
}
