//! How strongly a receptive field answers at a distance from its centre.

use serde::{Deserialize, Serialize};

/// The kernel w(q) of the squared distance q = (x − c)ᵀ D (x − c).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kernel {
    /// w = exp(−q/2).
    #[default]
    Gaussian,
    /// w = (1 − q/r)² within the reach r, 0 beyond it.
    BiSquare,
}

/// An activation and its derivatives with respect to q.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Activation {
    /// w, from 0 to 1.
    pub w: f64,
    /// dw/dq.
    pub slope: f64,
    /// d²w/dq².
    pub curvature: f64,
}

/// A kernel together with the reach of its bi-square form, which differs between learners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    kernel: Kernel,
    reach: f64,
    /// From this q on no activation exceeds the cutoff, with a little room for rounding.
    horizon: f64,
}

impl Window {
    /// `kernel`, where the bi-square one ends at q = `reach` and activations up to `cutoff`
    /// do not count.
    pub fn new(kernel: Kernel, reach: f64, cutoff: f64) -> Self {
        let edge = match kernel {
            Kernel::Gaussian => -2.0 * cutoff.ln(),
            Kernel::BiSquare => reach * (1.0 - cutoff.sqrt()),
        };
        Self { kernel, reach, horizon: edge * (1.0 + 1e-9) }
    }

    /// Whether the activation at `q` may exceed the cutoff: a cheap test that spares the
    /// exponential of distant fields. NaN is beyond any horizon.
    pub fn may_count(&self, q: f64) -> bool {
        q < self.horizon
    }

    /// w(q). A NaN distance is infinitely far; rounding below 0 is distance 0.
    pub fn activation(&self, q: f64) -> f64 {
        if q.is_nan() {
            return 0.0;
        }
        let q = q.max(0.0);
        match self.kernel {
            Kernel::Gaussian => (-0.5 * q).exp(),
            Kernel::BiSquare if q > self.reach => 0.0,
            Kernel::BiSquare => (1.0 - q / self.reach).powi(2),
        }
    }

    /// The derivatives that belong to the activation `w`.
    pub fn derivatives(&self, w: f64) -> Activation {
        match self.kernel {
            Kernel::Gaussian => Activation { w, slope: -0.5 * w, curvature: 0.25 * w },
            Kernel::BiSquare if w > 0.0 => Activation {
                w,
                slope: -2.0 / self.reach * w.sqrt(),
                curvature: 2.0 / self.reach.powi(2),
            },
            Kernel::BiSquare => Activation { w, slope: 0.0, curvature: 0.0 },
        }
    }
}

impl Activation {
    /// The activation of a sample that counts `weight` times.
    pub fn times(self, weight: f64) -> Self {
        Self { w: weight * self.w, slope: weight * self.slope, curvature: weight * self.curvature }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn activations_stay_within_0_and_1(q in proptest::num::f64::ANY) {
            for kernel in [Kernel::Gaussian, Kernel::BiSquare] {
                let w = Window::new(kernel, 2.0, 0.001).activation(q);
                prop_assert!((0.0..=1.0).contains(&w), "{kernel:?} at {q}: {w}");
            }
        }

        #[test]
        fn nothing_beyond_the_horizon_exceeds_the_cutoff(q in 0.0..40.0) {
            for kernel in [Kernel::Gaussian, Kernel::BiSquare] {
                let window = Window::new(kernel, 2.0, 0.001);
                prop_assert!(window.may_count(q) || window.activation(q) <= 0.001);
            }
        }

        #[test]
        fn derivatives_are_those_of_the_activation(q in 0.1..1.8) {
            let h = 1e-5;
            for kernel in [Kernel::Gaussian, Kernel::BiSquare] {
                let window = Window::new(kernel, 2.0, 0.001);
                let (before, at, after) =
                    (window.activation(q - h), window.activation(q), window.activation(q + h));
                let exact = window.derivatives(at);
                prop_assert!((exact.slope - (after - before) / (2.0 * h)).abs() < 1e-7);
                let curvature = (after - 2.0 * at + before) / (h * h);
                prop_assert!((exact.curvature - curvature).abs() < 1e-3);
            }
        }
    }
}
