//! The functions that the learners' examples and benches learn, and noisy samples of them:
//! the cross of the literature first of all.

#![allow(dead_code, reason = "every example and bench uses its own part of this")]

use coadapt::learner::{Learner, Model, lwpr, rfwr};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::StandardNormal;

/// Something to be learned: a function on [−1, 1]ⁿ, seen through normal noise.
#[derive(Clone, Copy, Debug)]
pub struct Workload {
    /// What it is called.
    pub name: &'static str,
    /// n.
    pub inputs: usize,
    /// The function.
    pub function: fn(&[f64]) -> f64,
    /// The standard deviation of the noise.
    pub noise: f64,
    /// How many samples are learned before time is taken.
    pub practice: u32,
    /// The metric that suits new fields, on the diagonal,
    pub init_d: f64,
    /// and its learning rate.
    pub init_alpha: f64,
}

/// Two ridges and a bump: Schaal & Atkeson (1998).
pub const CROSS: Workload = Workload {
    name: "2-D cross",
    inputs: 2,
    function: cross,
    noise: 0.1,
    practice: 20_000,
    init_d: 50.0,
    init_alpha: 250.0,
};

/// A linear policy of the cart-pole's four numbers.
pub const POLICY: Workload = Workload {
    name: "4-D policy",
    inputs: 4,
    function: policy,
    noise: 0.05,
    practice: 10_000,
    init_d: 7.0,
    init_alpha: 20.0,
};

/// Ten waves.
pub const WAVES: Workload = Workload {
    name: "10-D waves",
    inputs: 10,
    function: waves,
    noise: 0.05,
    practice: 5_000,
    init_d: 0.83,
    init_alpha: 1e-4,
};

/// The three that the reference measurements were made with.
pub const WORKLOADS: [Workload; 3] = [CROSS, POLICY, WAVES];

/// y = max(exp(−10 x₁²), exp(−50 x₂²), 1.25 exp(−5 (x₁² + x₂²))).
pub fn cross(x: &[f64]) -> f64 {
    let (a, b) = (x[0] * x[0], x[1] * x[1]);
    (-10.0 * a).exp().max((-50.0 * b).exp()).max(1.25 * (-5.0 * (a + b)).exp())
}

fn policy(x: &[f64]) -> f64 {
    (2.4 * x[0] + 5.4 * x[1] + 5.25 * x[2] + 13.5 * x[3]) / 10.0
}

fn waves(x: &[f64]) -> f64 {
    let mut phase = -1.0;
    let wave = |x: &f64| {
        phase += 1.0;
        0.3 * (1.5 * x + phase).sin()
    };
    x.iter().map(wave).sum::<f64>() + 0.2 * x[0] * x[1]
}

/// Endless samples, inputs uniform in [−1, 1]ⁿ: the same for the same seed.
pub struct Samples {
    workload: Workload,
    rng: ChaCha8Rng,
}

impl Workload {
    /// Its samples by `seed`.
    pub fn samples(self, seed: u64) -> Samples {
        Samples { workload: self, rng: ChaCha8Rng::seed_from_u64(seed) }
    }
}

impl Iterator for Samples {
    type Item = (Vec<f64>, f64);

    fn next(&mut self) -> Option<Self::Item> {
        let x: Vec<f64> =
            (0..self.workload.inputs).map(|_| self.rng.random_range(-1.0..=1.0)).collect();
        let error: f64 = self.rng.sample(StandardNormal);
        let y = (self.workload.function)(&x) + self.workload.noise * error;
        Some((x, y))
    }
}

/// How a learner may bend its fields.
#[derive(Clone, Copy, Debug)]
pub struct Bending {
    /// The learning rate of the metric.
    pub init_alpha: f64,
    /// The penalty on narrow fields.
    pub penalty: f64,
    /// Whether the rates are learned too.
    pub meta: bool,
}

/// What suits the cross: many small fields at any angle.
pub const FINE: Bending = Bending { init_alpha: 1000.0, penalty: 1e-8, meta: true };

/// Where fields are added on the cross.
pub const W_GEN: f64 = 0.2;

/// Settings of LWPR for the cross, otherwise as published.
pub fn lwpr_settings(bending: Bending) -> lwpr::Settings {
    let Bending { init_alpha, penalty, meta } = bending;
    lwpr::Settings {
        diag_only: false,
        meta,
        penalty,
        init_alpha,
        init_d: lwpr::InitialMetric::Scalar(CROSS.init_d),
        w_gen: W_GEN,
        ..lwpr::Settings::new(2, 1)
    }
}

/// Settings of RFWR for the cross, otherwise as published.
pub fn rfwr_settings(bending: Bending) -> rfwr::Settings {
    let Bending { init_alpha, penalty, meta } = bending;
    rfwr::Settings {
        diag_only: false,
        meta,
        penalty,
        init_alpha,
        init_d: rfwr::InitialMetric::Scalar(CROSS.init_d),
        w_gen: W_GEN,
        ..rfwr::Settings::new(2, 1)
    }
}

/// The points of the grid on which the cross is judged, a side.
const GRID: u32 = 41;

/// The mean squared error of `model` on a noise-free grid of 41 × 41 points of the cross, as
/// a share of the variance of the cross there.
pub fn grid_nmse(model: &Model) -> f64 {
    let at = |k: u32| f64::from(k) * 2.0 / f64::from(GRID - 1) - 1.0;
    let points = (0..GRID).flat_map(|a| (0..GRID).map(move |b| [at(a), at(b)]));
    let (mut sum, mut squares, mut errors) = (0.0, 0.0, 0.0);
    for x in points {
        let (right, mut said) = (cross(&x), [0.0]);
        model.predict(&x, &mut said);
        sum += right;
        squares += right * right;
        errors += (said[0] - right).powi(2);
    }
    let count = f64::from(GRID * GRID);
    let mean = sum / count;
    errors / count / (squares / count - mean * mean)
}
