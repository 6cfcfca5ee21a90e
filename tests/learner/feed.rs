//! What learners are fed in tests, and how they are looked at.

#![allow(dead_code, reason = "every test takes its own part of this")]

use coadapt::learner::lwpr::{self, Lwpr};
use coadapt::learner::rfwr::{self, Rfwr};
use coadapt::learner::{Kernel, Learner, Model};
use proptest::prelude::*;

/// All that is stored of a model; two of the same text are the same to the last bit.
pub fn stored(model: &impl serde::Serialize) -> String {
    serde_json::to_string(model).unwrap()
}

/// A smooth bent function of two inputs, sampled along a path that fills the square.
pub fn sample(k: u32) -> ([f64; 2], [f64; 1]) {
    let k = f64::from(k);
    let (a, b) = ((k * 0.754_877_666).fract(), (k * 0.569_840_291).fract());
    let x = [2.0 * a - 1.0, 2.0 * b - 1.0];
    (x, [(3.0 * x[0]).sin() + x[1] * x[1] + 0.05 * (k * 12.9898).sin()])
}

/// Numbers of every size up to 10^±`decades`, and exactly 0.
pub fn wild(decades: i32) -> impl Strategy<Value = f64> {
    (-decades..=decades, -10.0..10.0, 0..8_u8).prop_map(|(power, digits, dice)| match dice {
        0 => 0.0,
        1..=4 => digits / 5.0,
        _ => digits / 10.0 * 10_f64.powi(power),
    })
}

/// A sample: three inputs and three outputs, of which a learner takes the first, and a weight.
#[derive(Clone, Debug)]
pub struct Sample {
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub weight: f64,
}

/// Up to 150 samples of any finite numbers: huge, tiny and 0, some several times in a row,
/// some without weight.
pub fn wild_stream() -> impl Strategy<Value = Vec<Sample>> {
    let numbers = || prop::collection::vec(wild(300), 3);
    let weight = prop_oneof![
        4 => Just(1.0),
        2 => Just(0.0),
        3 => 0.0..10.0,
        1 => wild(300).prop_map(f64::abs),
    ];
    let sample = (numbers(), numbers(), weight).prop_map(|(x, y, weight)| Sample { x, y, weight });
    prop::collection::vec((sample, 1..4_usize), 1..75).prop_map(|samples| {
        let repeat = |(sample, times)| std::iter::repeat_n(sample, times);
        samples.into_iter().flat_map(repeat).take(150).collect()
    })
}

/// `lengths` samples from [−1, 1]³ of three bent functions, a little noisy and weighted.
pub fn tame_stream(
    lengths: impl Into<prop::collection::SizeRange>,
) -> impl Strategy<Value = Vec<Sample>> {
    let number = || -1.0..1.0_f64;
    let sample = ([number(), number(), number()], number(), 0.1..2.0).prop_map(
        |([a, b, c], noise, weight)| {
            let y = [(3.0 * a).sin() + b * b, a * c - 0.5 * b, (c - a).cos() + 0.3 * b];
            let y = y.map(|y| y + 0.05 * noise).to_vec();
            Sample { x: vec![a, b, c], y, weight }
        },
    );
    prop::collection::vec(sample, lengths)
}

/// A learner and how it is set.
#[expect(clippy::struct_excessive_bools, reason = "switches that are thrown at random")]
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    pub is_lwpr: bool,
    pub inputs: usize,
    pub outputs: usize,
    pub diag_only: bool,
    pub update_d: bool,
    pub meta: bool,
    pub bi_square: bool,
    /// P of new fields, RFWR; the published 1e10 costs the first updates ten digits.
    pub init_p: f64,
    /// Whether what this crate adds to the publications is on.
    pub limited: bool,
}

/// The most fields (per output for LWPR) and the largest output of a limited learner.
pub const MOST_FIELDS: u32 = 12;
pub const LIMIT: f64 = 10.0;

pub fn setups() -> impl Strategy<Value = Setup> {
    let sizes = (1..=3_usize, 1..=3_usize);
    (any::<[bool; 5]>(), sizes).prop_map(|(switches, (inputs, outputs))| {
        let [is_lwpr, diag_only, meta, bi_square, limited] = switches;
        let (update_d, init_p) = (true, 1e10);
        Setup { is_lwpr, inputs, outputs, diag_only, update_d, meta, bi_square, init_p, limited }
    })
}

impl Setup {
    pub fn build(self) -> Model {
        if self.is_lwpr {
            Model::Lwpr(Lwpr::new(self.lwpr()).unwrap())
        } else {
            Model::Rfwr(Rfwr::new(self.rfwr()).unwrap())
        }
    }

    fn kernel(self) -> Kernel {
        if self.bi_square { Kernel::BiSquare } else { Kernel::Gaussian }
    }

    fn rfwr(self) -> rfwr::Settings {
        let limit = |value: f64| self.limited.then_some(value);
        rfwr::Settings {
            kernel: self.kernel(),
            diag_only: self.diag_only,
            update_d: self.update_d,
            meta: self.meta,
            init_d: rfwr::InitialMetric::Scalar(3.0),
            init_alpha: 50.0,
            init_p: self.init_p,
            max_fields: self.limited.then_some(MOST_FIELDS),
            output_limit: limit(LIMIT),
            d_floor: limit(0.01),
            d_ceiling: limit(1e4),
            min_one_minus_h: limit(0.01),
            ..rfwr::Settings::new(self.inputs, self.outputs)
        }
    }

    fn lwpr(self) -> lwpr::Settings {
        let limit = |value: f64| self.limited.then_some(value);
        lwpr::Settings {
            kernel: self.kernel(),
            diag_only: self.diag_only,
            update_d: self.update_d,
            meta: self.meta,
            init_d: lwpr::InitialMetric::Scalar(3.0),
            max_fields: self.limited.then_some(MOST_FIELDS),
            output_limit: limit(LIMIT),
            d_floor: limit(0.01),
            d_ceiling: limit(1e4),
            min_one_minus_h: limit(0.01),
            ..lwpr::Settings::new(self.inputs, self.outputs)
        }
    }
}

/// The metrics of all fields, each as its diagonal or by rows.
pub fn metrics(model: &Model) -> Vec<Vec<f64>> {
    fn owned(d: impl AsRef<[f64]>) -> Vec<f64> {
        d.as_ref().to_vec()
    }
    match model {
        Model::Rfwr(rfwr) => (0..model.fields()).map(|field| owned(rfwr.metric(field))).collect(),
        Model::Lwpr(lwpr) => lwpr
            .submodels()
            .iter()
            .flat_map(|submodel| {
                (0..submodel.fields().len()).map(|field| owned(submodel.metric(field)))
            })
            .collect(),
    }
}
