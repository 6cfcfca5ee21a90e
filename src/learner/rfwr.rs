//! Receptive Field Weighted Regression.
//!
//! Schaal & Atkeson (1998), "Constructive incremental learning from only local
//! information", Neural Computation 10, 2047–2084. The details follow the first author's
//! published program of 2002, which the golden tests compare with.
//!
//! # The idea
//! The function is covered with *receptive fields*. Each has a centre c and a metric D, is
//! activated by an input x as
//!
//! w = exp(−q/2),  q = (x − c)ᵀ D (x − c),
//!
//! and holds a linear model of its own, y ≈ Bᵀ(x − x̄) + b₀. The prediction is the mean of
//! the fields' predictions, weighted with w. Fields do not compete: each learns alone from
//! what activates it, which is why what was learned elsewhere is never spoilt.
//!
//! # One update
//! For every field with w > `cutoff`:
//! 1. **Means.** x̄, its variance and b₀ move towards the sample, with forgetting λ.
//! 2. **Regression** by recursive least squares on x − x̄ and y − b₀:
//!    `P ← (P − P x xᵀP / (λ/w + xᵀP x)) / λ`, `B ← B + w P x e_cvᵀ`,
//!    where `e_cv` is the error before, and e the error after the sample.
//! 3. **Metric.** `D = MᵀM` descends the gradient of the leave-one-out error within the field
//!    plus a penalty on narrowness, `J = Σ w|e_cv|²/W + γ Σ D²`: fields are wide where the
//!    function is straight and narrow where it bends.
//!
//! Then **growth**: where no field's activation exceeds `w_gen`, one is added with its
//! centre at x, shaped like the nearest one if that is near at all; and where two exceed
//! `w_prune`, one of them is removed. A field *speaks* (counts in predictions) once it has
//! seen enough samples in enough directions.
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
//! field computes its next state aside and keeps it only if every number is finite and D
//! is positive; otherwise the field drops that sample, or that step of its metric.

mod errors;
mod field;
mod regression;
mod settings;
mod workshop;

use serde::{Deserialize, Serialize};

pub use field::{Errors, Field, Regression};
pub use settings::Settings;

pub use super::growth::Growth;
pub use super::settings::{InitialMetric, MAX_INPUTS};

use super::growth::Wish;
use super::lanes::run;
use super::metric::Metric;
use super::near::Near;
use super::sample::{divide, settled};
use super::shapes::Shapes;
use super::store::Store;
use super::{BuildError, Learner, Refusal};
use workshop::{Consult, Teach, Workshop};

/// The learner.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct Rfwr {
    settings: Settings,
    samples: u64,
    pruned: u64,
    shapes: Shapes,
    /// All that fields know, in the order of [`Field::to_column`].
    fields: Store,
    workshop: Box<Workshop>,
}

/// A learner as in a file.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    settings: Settings,
    samples: u64,
    pruned: u64,
    shapes: Shapes,
    fields: Vec<Field>,
}

/// What an update did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Update<'a> {
    /// The prediction for the sample, each field's taken just after it learned the sample;
    /// 0 where no field speaks. Raw units.
    pub output: &'a [f64],
    /// The largest activation of any field before the update; 0 if there was none.
    pub max_activation: f64,
    /// The second largest.
    pub second_activation: f64,
    /// Whether fields came or went.
    pub growth: Growth,
}

impl Rfwr {
    /// A learner that knows nothing.
    ///
    /// # Errors
    /// When a setting is outside its range or a length does not fit.
    pub fn new(settings: Settings) -> Result<Self, BuildError> {
        let workshop = Box::new(Workshop::new(&settings)?);
        let shapes = Shapes::new(settings.inputs, settings.diag_only);
        let fields = Store::new(settings.inputs, workshop.blank(&settings));
        Ok(Self { settings, samples: 0, pruned: 0, shapes, fields, workshop })
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// How many samples were learned.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// How many fields were removed.
    pub fn pruned(&self) -> u64 {
        self.pruned
    }

    /// The centre of `field`, in normalised coordinates.
    pub fn centre(&self, field: usize) -> Vec<f64> {
        self.shapes.centre(field)
    }

    /// The metric D of `field`, normalised: its diagonal (`diag_only`) or n × n by rows.
    pub fn metric(&self, field: usize) -> Vec<f64> {
        self.shapes.metric(field)
    }

    /// The fields, in storage order.
    pub fn field_states(&self) -> Vec<Field> {
        (0..self.fields()).map(|field| self.state(field)).collect()
    }

    fn state(&self, field: usize) -> Field {
        Field::from_column(self.workshop.size, &self.fields.column(field))
    }

    /// Learns a sample (see [`Learner::update`]) and says what came of it.
    ///
    /// # Errors
    /// As [`Learner::update`].
    pub fn learn(&mut self, x: &[f64], y: &[f64], weight: f64) -> Result<Update<'_>, Refusal> {
        let Self { settings, shapes, fields, workshop: shop, .. } = self;
        shop.sample.admit((x, &settings.norm_in), (y, &settings.norm_out), weight)?;
        self.samples += 1;
        let level = shop.level;
        let taught = run(level, Teach { settings, shapes, fields, shop, weight });
        settle(&mut shop.blend, taught.voices, settings);
        let growth = self.grow(taught.strongest, y);
        let activation = |near: Near| near.map_or(0.0, |(_, w)| w);
        Ok(Update {
            output: &self.workshop.blend,
            max_activation: activation(taught.strongest[0]),
            second_activation: activation(taught.strongest[1]),
            growth,
        })
    }

    /// Adds a field in empty space, or removes one of two that overlap.
    fn grow(&mut self, strongest: [Near; 2], raw_y: &[f64]) -> Growth {
        let trusted = |field: usize| self.state(field).regression.trustworthy;
        match self.settings.growth().wish(strongest, self.fields(), trusted) {
            Wish::Stay => Growth::None,
            Wish::Add(template) => self.add(template, raw_y),
            Wish::Prune(first, second) => self.prune(first, second),
        }
    }

    fn add(&mut self, template: Option<usize>, raw_y: &[f64]) -> Growth {
        let shop = &self.workshop;
        let (offset, metric, d) = if let Some(index) = template {
            let Field { regression, metric, .. } = self.state(index);
            let metric = Metric::inheriting(metric.m, metric.alpha);
            (regression.offset, metric, self.shapes.kept(index))
        } else {
            // As published: the very first field gets the offset before normalisation. Its
            // first sample sets that right.
            let offset = if self.fields() == 0 { raw_y } else { &shop.sample.y };
            (offset.to_vec(), shop.start.clone(), shop.start_d.clone())
        };
        let field = self.fields();
        self.shapes.push(&shop.sample.x, &d);
        self.fields.push(&Field::new(&self.settings, offset, metric).to_column());
        Growth::Added { field, template }
    }

    /// Removes the narrower of two fields, as the sum of D's entries says; of equal ones
    /// the one activated more.
    fn prune(&mut self, first: usize, second: usize) -> Growth {
        let narrowness = |field| self.shapes.metric(field).iter().sum::<f64>();
        let (field, survivor) =
            if narrowness(second) > narrowness(first) { (second, first) } else { (first, second) };
        self.shapes.remove(field);
        self.fields.remove(field);
        self.pruned += 1;
        Growth::Pruned { field, survivor }
    }
}

impl Learner for Rfwr {
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
        let Self { settings, shapes, fields, workshop: shop, .. } = self;
        if x.len() != settings.inputs || y.len() != settings.outputs {
            return 0.0;
        }
        let mut room = [0.0; MAX_INPUTS];
        let x_scaled = &mut room[..x.len()];
        divide(x_scaled, x, &settings.norm_in);
        let heard = run(shop.level, Consult { shapes, fields, shop, x: x_scaled, y });
        settle(y, heard.voices, settings);
        heard.strongest[0].map_or(0.0, |(_, w)| w)
    }

    fn fields(&self) -> usize {
        self.fields.fields()
    }
}

impl From<Rfwr> for Stored {
    fn from(rfwr: Rfwr) -> Self {
        let fields = rfwr.field_states();
        let Rfwr { settings, samples, pruned, shapes, .. } = rfwr;
        Self { settings, samples, pruned, shapes, fields }
    }
}

impl TryFrom<Stored> for Rfwr {
    type Error = BuildError;

    fn try_from(stored: Stored) -> Result<Self, BuildError> {
        let Stored { settings, samples, pruned, shapes, fields: stored } = stored;
        let fresh = Self::new(settings)?;
        let Self { settings, workshop, mut fields, .. } = fresh;
        if !shapes.holds(settings.inputs, settings.diag_only, stored.len()) {
            return Err(BuildError::Shapes { fields: stored.len() });
        }
        if let Some(field) = stored.iter().position(|field| !field.is_sound(workshop.size)) {
            return Err(BuildError::Field { field });
        }
        for field in &stored {
            fields.push(&field.to_column());
        }
        Ok(Self { settings, samples, pruned, shapes, fields, workshop })
    }
}

/// Turns sums of w y into predictions in raw units, within the limit and always finite.
fn settle(sums: &mut [f64], voices: f64, settings: &Settings) {
    for (y, norm) in sums.iter_mut().zip(&settings.norm_out) {
        let mean = if voices > 0.0 { *y / voices * norm } else { 0.0 };
        *y = settled(mean, settings.output_limit);
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
        let mut learner = Rfwr::new(settings).unwrap();
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
