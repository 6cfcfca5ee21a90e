//! How strongly a receptive field answers at a distance from its centre.

use fearless_simd::prelude::*;
use serde::{Deserialize, Serialize};

use super::lanes::{LANES, Lanes, Mask, Row, all, exp};
use super::near::Near;

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

/// Activations and their derivatives with respect to q.
#[derive(Clone, Copy, Debug)]
pub struct Activation<S: Simd> {
    /// w, from 0 to 1.
    pub w: Lanes<S>,
    /// dw/dq.
    pub slope: Lanes<S>,
    /// d²w/dq².
    pub curvature: Lanes<S>,
}

/// A kernel together with the reach of its bi-square form, which differs between learners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    kernel: Kernel,
    reach: f64,
    /// From this q on no activation exceeds the cutoff, with a little room for rounding.
    horizon: f64,
    cutoff: f64,
}

impl Window {
    /// `kernel`, where the bi-square one ends at q = `reach` and activations up to `cutoff`
    /// do not count.
    pub fn new(kernel: Kernel, reach: f64, cutoff: f64) -> Self {
        let edge = match kernel {
            Kernel::Gaussian => -2.0 * cutoff.ln(),
            Kernel::BiSquare => reach * (1.0 - cutoff.sqrt()),
        };
        Self { kernel, reach, horizon: edge * (1.0 + 1e-9), cutoff }
    }

    /// Where the activation at `q` may exceed the cutoff: a cheap test that spares the
    /// exponential of distant fields. NaN is beyond any horizon.
    #[inline(always)]
    pub fn may_count<S: Simd>(&self, q: Lanes<S>) -> Mask<S> {
        q.simd_lt(self.horizon)
    }

    /// Where the activation `w` exceeds the cutoff.
    #[inline(always)]
    pub fn counts<S: Simd>(&self, w: Lanes<S>) -> Mask<S> {
        w.simd_gt(self.cutoff)
    }

    /// w(q). A NaN distance is infinitely far; rounding below 0 is distance 0.
    #[inline(always)]
    pub fn activation<S: Simd>(&self, q: Lanes<S>) -> Lanes<S> {
        let zero = all(q.simd, 0.0);
        let near = q.max(zero);
        let (w, far) = match self.kernel {
            // Below e^-700 nothing is left that could matter.
            Kernel::Gaussian => (exp(near * -0.5), near.simd_gt(1400.0)),
            Kernel::BiSquare => {
                let left = all(q.simd, 1.0) - near / self.reach;
                (left * left, near.simd_gt(self.reach))
            }
        };
        (far | q.is_nan()).select(zero, w)
    }

    /// The activations of the two nearest fields, where there are any.
    #[inline(always)]
    pub fn strongest<S: Simd>(&self, simd: S, nearest: [Near; 2]) -> [Near; 2] {
        let mut q = [f64::NAN; LANES];
        for (q, near) in q.iter_mut().zip(nearest) {
            *q = near.map_or(f64::NAN, |(_, q)| q);
        }
        let Row(w) = Row(self.activation(q.simd_into(simd)).into());
        let active = |near: Near, w: f64| near.filter(|_| w > 0.0).map(|(field, _)| (field, w));
        [active(nearest[0], w[0]), active(nearest[1], w[1])]
    }

    /// The derivatives that belong to the activations `w`, of a sample that counts `weight`
    /// times.
    #[inline(always)]
    pub fn derivatives<S: Simd>(&self, w: Lanes<S>, weight: f64) -> Activation<S> {
        let (slope, curvature) = match self.kernel {
            Kernel::Gaussian => (w * -0.5, w * 0.25),
            Kernel::BiSquare => {
                let zero = all(w.simd, 0.0);
                let bent = all(w.simd, 2.0 / (self.reach * self.reach));
                (w.sqrt() * (-2.0 / self.reach), w.simd_gt(0.0).select(bent, zero))
            }
        };
        Activation { w: w * weight, slope: slope * weight, curvature: curvature * weight }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learner::lanes::{Work, run};
    use fearless_simd::Level;
    use proptest::prelude::*;

    /// w, dw/dq and d²w/dq² at four distances.
    struct At(Window, [f64; LANES]);

    impl Work for At {
        type Output = [[f64; LANES]; 3];

        #[inline(always)]
        fn with<S: Simd>(self, simd: S) -> Self::Output {
            let w = self.0.activation(self.1.simd_into(simd));
            let Activation { w, slope, curvature } = self.0.derivatives(w, 1.0);
            [w.into(), slope.into(), curvature.into()]
        }
    }

    fn at(window: Window, q: [f64; LANES]) -> [[f64; LANES]; 3] {
        run(Level::new(), At(window, q))
    }

    const KERNELS: [Kernel; 2] = [Kernel::Gaussian, Kernel::BiSquare];

    proptest! {
        #[test]
        fn activations_stay_within_0_and_1(q in prop::array::uniform8(proptest::num::f64::ANY)) {
            for kernel in KERNELS {
                for w in at(Window::new(kernel, 2.0, 0.001), q)[0] {
                    prop_assert!((0.0..=1.0).contains(&w), "{kernel:?} at {q:?}: {w}");
                }
            }
        }

        #[test]
        fn nothing_beyond_the_horizon_exceeds_the_cutoff(q in 0.0..40.0) {
            for kernel in KERNELS {
                let window = Window::new(kernel, 2.0, 0.001);
                prop_assert!(q < window.horizon || at(window, [q; LANES])[0][0] <= 0.001);
            }
        }

        #[test]
        fn derivatives_are_those_of_the_activation(q in 0.1..1.8) {
            let h = 1e-5;
            for kernel in KERNELS {
                let window = Window::new(kernel, 2.0, 0.001);
                let [[before, here, after, ..], [_, slope, ..], [_, curvature, ..]] =
                    at(window, [q - h, q, q + h, q, q, q, q, q]);
                prop_assert!((slope - (after - before) / (2.0 * h)).abs() < 1e-7);
                let exact = (after - 2.0 * here + before) / (h * h);
                prop_assert!((curvature - exact).abs() < 1e-3);
            }
        }
    }
}
