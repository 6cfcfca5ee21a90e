//! Locally Weighted Projection Regression.
//!
//! Vijayakumar & Schaal (2000), "Locally weighted projection regression: an O(n) algorithm
//! for incremental real time learning in high dimensional space", ICML; Klanke,
//! Vijayakumar & Schaal (2008), "A library for locally weighted projection regression",
//! JMLR 9, 623–626. The details follow that library, which the golden tests compare with.
//!
//! # The idea
//! As [`rfwr`](super::rfwr), with two differences. Every output has receptive fields of its
//! own. And a field does not fit all inputs at once, but regresses on few *projections* of
//! them: the direction U₁ along which the inputs vary with the output, then a second one
//! for what the first leaves unexplained, and so on (partial least squares). Where inputs
//! are many but redundant a few projections do, and no matrix is kept.
//!
//! # One update
//! For every field with w > `cutoff`:
//! 1. **Means.** x̄, its variance and β₀ move towards the sample, with forgetting λ.
//! 2. **Regression.** With `x₁ = x − x̄` and `t₁ = y − β₀`, each projection j turns Uⱼ
//!    towards the remembered Σ w tⱼ xⱼ, sees `sⱼ = Uⱼ·xⱼ`, and fits `tⱼ ≈ βⱼ sⱼ` and
//!    `xⱼ ≈ Pⱼ sⱼ`; what remains of both goes to the next.
//! 3. **Metric.** `D = MᵀM` descends as RFWR's does; a step that would be too large is not
//!    taken.
//! 4. **Projections.** One is added, up to n, while the last one lowers the error enough.
//!
//! Then **growth**: where no field's activation exceeds `w_gen`, one is added with its
//! centre at x, shaped like the nearest one if that is near at all; and where two exceed
//! `w_prune`, the wider of them is removed. A field *speaks* (counts in predictions) once it
//! has seen more than 2n samples.
//!
//! # Confidence
//! [`Lwpr::predict_with_confidence`] gives one standard deviation of each prediction: of the
//! noise within the fields, of their uncertainty, and of their disagreement.
//!
//! # Weighted samples
//! A sample's `weight` multiplies w where the field learns: in the sums, means, the
//! regression and the metric (there dw/dM and its derivative are multiplied too). The bare
//! activation decides about cutoff, growth and pruning, and blends the prediction that an
//! update returns. A sample of weight 0 teaches no field anything, nor does it make one
//! forget; it may still found a field, whose first weighted sample then sets everything.
//!
//! # What cannot happen
//! Not in the publication: whatever finite numbers it is fed, the learner stays finite. A
//! field computes its next state aside and keeps it only if every number is finite and D's
//! diagonal is positive; otherwise the field drops that sample, or that step of its metric.

mod field;
mod projection;
mod regression;
mod settings;
mod shaping;
mod speech;
mod submodel;
mod workshop;

use serde::{Deserialize, Serialize};

pub use field::{Field, Projection, Regression};
pub use settings::Settings;
pub use submodel::Submodel;

pub use super::growth::Growth;
pub use super::settings::{InitialMetric, MAX_INPUTS};

use super::sample::{divide, settled};
use super::{BuildError, Learner, Refusal};
use submodel::Voices;
use workshop::Workshop;

/// The confidence bound, in units of the output's norm, where nothing is known.
pub const UNKNOWN: f64 = 1e20;

/// The learner.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct Lwpr {
    settings: Settings,
    samples: u64,
    submodels: Vec<Submodel>,
    workshop: Box<Workshop>,
}

/// A learner as in a file.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    settings: Settings,
    samples: u64,
    submodels: Vec<submodel::Stored>,
}

/// What an update did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Update<'a> {
    /// The prediction for the sample, each field's taken just after its regression learned
    /// the sample; 0 where no field speaks. Raw units.
    pub output: &'a [f64],
    /// What happened to the fields of each output.
    pub changes: &'a [Change],
}

/// What an update did to the fields of one output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// The largest activation of any field before the update; 0 if there was none.
    pub max_activation: f64,
    /// The second largest.
    pub second_activation: f64,
    /// Whether fields came or went.
    pub growth: Growth,
}

impl Lwpr {
    /// A learner that knows nothing.
    ///
    /// # Errors
    /// When a setting is outside its range or a length does not fit.
    pub fn new(settings: Settings) -> Result<Self, BuildError> {
        let workshop = Box::new(Workshop::new(&settings)?);
        let fresh = |_| Submodel::new(&settings, &workshop);
        let submodels = (0..settings.outputs).map(fresh).collect();
        Ok(Self { settings, samples: 0, submodels, workshop })
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// How many samples were learned.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// What is known of each output.
    pub fn submodels(&self) -> &[Submodel] {
        &self.submodels
    }

    /// Learns a sample (see [`Learner::update`]) and says what came of it.
    ///
    /// # Errors
    /// As [`Learner::update`].
    pub fn learn(&mut self, x: &[f64], y: &[f64], weight: f64) -> Result<Update<'_>, Refusal> {
        let Self { settings, submodels, workshop: shop, .. } = self;
        shop.sample.admit((x, &settings.norm_in), (y, &settings.norm_out), weight)?;
        self.samples += 1;
        for (k, submodel) in submodels.iter_mut().enumerate() {
            let y = shop.sample.y[k];
            let (voices, change) = submodel.learn(y, weight, (shop, settings));
            shop.output[k] = voices.prediction(settings.norm_out[k], settings);
            shop.changes[k] = change;
        }
        Ok(Update { output: &shop.output, changes: &shop.changes })
    }

    /// Writes for every output the prediction at `x` into `y`, its standard deviation into
    /// `conf`, and the largest activation of its fields into `max_w`. All are finite. Where
    /// no field speaks the prediction is 0 and its deviation [`UNKNOWN`] times the output's
    /// norm; `y` alone is clamped to the output limit.
    ///
    /// When `x` has a wrong length nothing is known; a list that is shorter than the outputs
    /// gets those that fit.
    pub fn predict_with_confidence(
        &self,
        x: &[f64],
        y: &mut [f64],
        conf: &mut [f64],
        max_w: &mut [f64],
    ) {
        let outputs = y.iter_mut().zip(conf).zip(max_w).zip(&self.settings.norm_out);
        for (k, (((y, conf), max_w), norm)) in outputs.enumerate() {
            let voices = self.hear(k, x, true);
            *y = voices.prediction(*norm, &self.settings);
            *conf = voices.deviation(*norm);
            *max_w = voices.max_activation;
        }
    }

    /// What the fields of `output` say about the raw `x`, about the variance too if it is
    /// wanted.
    fn hear(&self, output: usize, x: &[f64], variance: bool) -> Voices {
        let mut room = [0.0; MAX_INPUTS];
        let scaled = &mut room[..self.settings.inputs];
        if x.len() != scaled.len() {
            return Voices::default();
        }
        divide(scaled, x, &self.settings.norm_in);
        self.submodels[output].consult(scaled, &self.workshop, variance)
    }
}

impl Learner for Lwpr {
    fn inputs(&self) -> usize {
        self.settings.inputs
    }

    fn outputs(&self) -> usize {
        self.settings.outputs
    }

    fn update(&mut self, x: &[f64], y: &[f64], weight: f64) -> Result<(), Refusal> {
        self.learn(x, y, weight).map(drop)
    }

    fn predict(&self, x: &[f64], y: &mut [f64]) -> f64 {
        y.fill(0.0);
        if y.len() != self.settings.outputs {
            return 0.0;
        }
        let mut largest: f64 = 0.0;
        for (k, (y, norm)) in y.iter_mut().zip(&self.settings.norm_out).enumerate() {
            let voices = self.hear(k, x, false);
            *y = voices.prediction(*norm, &self.settings);
            largest = largest.max(voices.max_activation);
        }
        largest
    }

    /// Of all outputs together.
    fn fields(&self) -> usize {
        self.submodels.iter().map(Submodel::len).sum()
    }
}

impl From<Lwpr> for Stored {
    fn from(lwpr: Lwpr) -> Self {
        let Lwpr { settings, samples, submodels, .. } = lwpr;
        Self { settings, samples, submodels: submodels.iter().map(Submodel::store).collect() }
    }
}

impl TryFrom<Stored> for Lwpr {
    type Error = BuildError;

    fn try_from(stored: Stored) -> Result<Self, BuildError> {
        let Stored { settings, samples, submodels } = stored;
        let workshop = Box::new(Workshop::new(&settings)?);
        let (given, wanted) = (submodels.len(), settings.outputs);
        if given != wanted {
            return Err(BuildError::Length { key: "submodels", given, wanted });
        }
        let restore = |stored| Submodel::restore(stored, &settings, &workshop);
        let submodels = submodels.into_iter().map(restore).collect::<Result<_, _>>()?;
        Ok(Self { settings, samples, submodels, workshop })
    }
}

impl Voices {
    /// The prediction in raw units, within the limit and always finite.
    fn prediction(&self, norm: f64, settings: &Settings) -> f64 {
        let mean = if self.sum_w > 0.0 { self.sum_wy / self.sum_w * norm } else { 0.0 };
        settled(mean, settings.output_limit)
    }

    /// Its standard deviation in raw units, always finite.
    fn deviation(&self, norm: f64) -> f64 {
        let scatter = self.sum_wy2 - self.sum_wy * self.sum_wy / self.sum_w;
        let deviation = norm * (scatter.abs().sqrt() / self.sum_w);
        if self.sum_w > 0.0 && deviation.is_finite() { deviation } else { UNKNOWN * norm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::Level;

    /// What a learner knows after a few hundred samples, taught with one vector unit.
    fn taught(inputs: usize, level: Level) -> String {
        let plain = Settings::new(inputs, 2);
        let settings = Settings { diag_only: false, meta: true, w_gen: 0.3, ..plain };
        let mut learner = Lwpr::new(settings).unwrap();
        learner.workshop.level = level;
        for k in 0..400 {
            let at = |i: usize| {
                (f64::from(k) * (0.754 + 0.1 * f64::from(u8::try_from(i).unwrap()))).fract()
            };
            let x: Vec<f64> = (0..inputs).map(|i| 0.6 * at(i) - 0.3).collect();
            let y = [(3.0 * x[0]).sin(), x.iter().sum::<f64>()];
            learner.update(&x, &y, 1.0).unwrap();
        }
        serde_json::to_string(&learner).unwrap()
    }

    #[test]
    fn every_vector_unit_learns_the_same_bits() {
        for inputs in [1, 3, 8] {
            let plain = taught(inputs, Level::baseline());
            assert_eq!(taught(inputs, Level::new()), plain, "{inputs} inputs");
        }
    }
}
