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

mod field;
mod settings;
mod workshop;

use serde::{Deserialize, Serialize};

pub use field::{Errors, Field, Regression};
pub use settings::Settings;

pub use super::settings::{InitialMetric, MAX_INPUTS};

use super::metric::Metric;
use super::shapes::{Nearest, Shapes, Size, distance};
use super::{BuildError, Learner, Refusal, all_finite};
use field::Findings;
use workshop::Workshop;

/// A new field takes after the nearest one if that is activated by more than this share of
/// `w_gen`.
const KINSHIP: f64 = 0.1;

/// The learner.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "Stored")]
pub struct Rfwr {
    settings: Settings,
    samples: u64,
    pruned: u64,
    shapes: Shapes,
    fields: Vec<Field>,
    #[serde(skip_serializing)]
    workshop: Workshop,
}

/// A learner as read from a file, before it is checked.
#[derive(Deserialize)]
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

/// How an update changed the set of fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Growth {
    /// Not at all.
    None,
    /// A field was appended.
    Added {
        /// Its index.
        field: usize,
        /// The field whose metric, rates and offset it took over.
        template: Option<usize>,
    },
    /// A field was removed; the later ones moved down.
    Pruned {
        /// Its index before.
        field: usize,
        /// The overlapping field that stays, by its index before.
        survivor: usize,
    },
}

impl Rfwr {
    /// A learner that knows nothing.
    ///
    /// # Errors
    /// When a setting is outside its range or a length does not fit.
    pub fn new(settings: Settings) -> Result<Self, BuildError> {
        let workshop = Workshop::new(&settings)?;
        let shapes = Shapes::new(settings.inputs, settings.diag_only);
        Ok(Self { settings, samples: 0, pruned: 0, shapes, fields: Vec::new(), workshop })
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
    pub fn centre(&self, field: usize) -> &[f64] {
        self.shapes.centre(field)
    }

    /// The metric D of `field`, normalised: its diagonal (`diag_only`) or n × n by rows.
    pub fn metric(&self, field: usize) -> &[f64] {
        self.shapes.metric(field)
    }

    /// The fields, in storage order.
    pub fn field_states(&self) -> &[Field] {
        &self.fields
    }

    /// Learns a sample (see [`Learner::update`]) and says what came of it.
    ///
    /// # Errors
    /// As [`Learner::update`].
    pub fn learn(&mut self, x: &[f64], y: &[f64], weight: f64) -> Result<Update<'_>, Refusal> {
        self.admit(x, y, weight)?;
        self.samples += 1;
        let nearest = match (x.len(), y.len()) {
            (1, 1) => self.teach_with((1, 1), weight),
            (2, 1) => self.teach_with((2, 1), weight),
            (3, 1) => self.teach_with((3, 1), weight),
            (4, 1) => self.teach_with((4, 1), weight),
            (5, 1) => self.teach_with((5, 1), weight),
            (6, 1) => self.teach_with((6, 1), weight),
            size => self.teach_with(size, weight),
        };
        let strongest = |near: Option<(usize, f64)>| {
            let (index, w) = near.map(|(index, q)| (index, self.workshop.window.activation(q)))?;
            (w > 0.0).then_some((index, w))
        };
        let (first, second) = (strongest(nearest.first), strongest(nearest.second));
        let growth = self.grow(first, second, y);
        Ok(Update {
            output: &self.workshop.blend,
            max_activation: first.map_or(0.0, |(_, w)| w),
            second_activation: second.map_or(0.0, |(_, w)| w),
            growth,
        })
    }

    /// [`teach`](Self::teach) for constant numbers of inputs and outputs, which makes all
    /// sizes in it constant.
    #[inline(always)]
    fn teach_with(&mut self, (inputs, outputs): (usize, usize), weight: f64) -> Nearest {
        if self.settings.diag_only {
            self.teach(Size { inputs, outputs, entries: inputs }, weight)
        } else {
            self.teach(Size { inputs, outputs, entries: inputs * inputs }, weight)
        }
    }

    /// Lets every active field learn the sample in the workshop, blends their predictions
    /// of it, and finds the two nearest fields.
    #[inline(always)]
    fn teach(&mut self, size: Size, weight: f64) -> Nearest {
        let shop = &mut self.workshop;
        shop.blend.fill(0.0);
        let mut nearest = Nearest::NONE;
        let mut voices = 0.0;
        let mut found = Findings::NONE;
        for (index, field) in self.fields.iter_mut().enumerate() {
            let (centre, d) = self.shapes.place(index, size);
            let q = distance(centre, d, &shop.x[..size.inputs]);
            nearest.note(index, q);
            if !shop.window.may_count(q) {
                continue;
            }
            let w = shop.window.activation(q);
            if w <= self.settings.cutoff {
                continue;
            }
            let activation = shop.window.derivatives(w).times(weight);
            shop.teach(field, (centre, d), (size, activation, &mut found), &self.settings);
            let said = &found.y[..size.outputs];
            if field.regression.trustworthy && all_finite(said) {
                voices += w;
                for (sum, y) in shop.blend.iter_mut().zip(said) {
                    *sum += w * y;
                }
            }
        }
        settle(&mut shop.blend, voices, &self.settings);
        nearest
    }

    /// [`consult`](Self::consult) for constant numbers of inputs and outputs.
    #[inline(always)]
    fn consult_with(&self, (inputs, outputs): (usize, usize), x: &[f64], y: &mut [f64]) -> f64 {
        if self.settings.diag_only {
            self.consult(Size { inputs, outputs, entries: inputs }, x, y)
        } else {
            self.consult(Size { inputs, outputs, entries: inputs * inputs }, x, y)
        }
    }

    /// Predicts at the normalised `x`, see [`Learner::predict`].
    #[inline(always)]
    fn consult(&self, size: Size, x: &[f64], y: &mut [f64]) -> f64 {
        let x = &x[..size.inputs];
        let window = self.workshop.window;
        let mut nearest = f64::INFINITY;
        let mut voices = 0.0;
        for (Field { regression, .. }, (centre, d)) in
            self.fields.iter().zip(self.shapes.each(size))
        {
            let q = distance(centre, d, x);
            nearest = nearest.min(q);
            if !window.may_count(q) {
                continue;
            }
            let w = window.activation(q);
            if w <= self.settings.cutoff || !regression.trustworthy {
                continue;
            }
            voices += w;
            for (k, sum) in y.iter_mut().enumerate() {
                *sum += w * regression.predict(size, k, x);
            }
        }
        settle(y, voices, &self.settings);
        window.activation(nearest)
    }

    /// Checks a sample and normalises it into the workshop.
    fn admit(&mut self, x: &[f64], y: &[f64], weight: f64) -> Result<(), Refusal> {
        for (given, wanted) in [(x.len(), self.settings.inputs), (y.len(), self.settings.outputs)] {
            if given != wanted {
                return Err(Refusal::Length { wanted, given });
            }
        }
        if !weight.is_finite() || !x.iter().chain(y).all(|value| value.is_finite()) {
            return Err(Refusal::NotFinite);
        }
        if weight < 0.0 {
            return Err(Refusal::NegativeWeight);
        }
        let shop = &mut self.workshop;
        divide(&mut shop.x, x, &self.settings.norm_in);
        divide(&mut shop.y, y, &self.settings.norm_out);
        if shop.x.iter().chain(&shop.y).all(|value| value.is_finite()) {
            Ok(())
        } else {
            Err(Refusal::NotFinite)
        }
    }

    /// Adds a field in empty space, or removes one of two that overlap.
    fn grow(
        &mut self,
        first: Option<(usize, f64)>,
        second: Option<(usize, f64)>,
        raw_y: &[f64],
    ) -> Growth {
        let settings = &self.settings;
        let full = settings.max_fields.is_some_and(|most| self.fields.len() >= most as usize);
        match (first, second) {
            (Some((_, w)), None) if w > settings.w_gen => Growth::None,
            (Some((_, w)), Some((_, w_second))) if w > settings.w_gen => {
                if w_second > settings.w_prune { self.prune(first, second) } else { Growth::None }
            }
            _ if full => Growth::None,
            _ => self.add(first, raw_y),
        }
    }

    fn add(&mut self, strongest: Option<(usize, f64)>, raw_y: &[f64]) -> Growth {
        let template = strongest
            .filter(|&(index, w)| {
                w > KINSHIP * self.settings.w_gen && self.fields[index].regression.trustworthy
            })
            .map(|(index, _)| index);
        let shop = &self.workshop;
        let (offset, metric, d) = if let Some(index) = template {
            let Field { regression, metric, .. } = &self.fields[index];
            let metric = Metric::inheriting(metric.m.clone(), metric.alpha.clone());
            (regression.offset.clone(), metric, self.shapes.metric(index).to_vec())
        } else {
            // As published: the very first field gets the offset before normalisation. Its
            // first sample sets that right.
            let offset = if self.fields.is_empty() { raw_y } else { &shop.y };
            (offset.to_vec(), shop.start.clone(), shop.start_d.clone())
        };
        let field = self.fields.len();
        self.shapes.push(&shop.x, &d);
        self.fields.push(Field::new(&self.settings, offset, metric));
        Growth::Added { field, template }
    }

    /// Removes the narrower of two fields, as the sum of D's entries says; of equal ones
    /// the one activated more.
    fn prune(&mut self, first: Option<(usize, f64)>, second: Option<(usize, f64)>) -> Growth {
        let (Some((first, _)), Some((second, _))) = (first, second) else { return Growth::None };
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
        let Size { inputs, outputs, .. } = self.workshop.size;
        if x.len() != inputs || y.len() != outputs {
            return 0.0;
        }
        let mut room = [0.0; MAX_INPUTS];
        let scaled = &mut room[..inputs];
        divide(scaled, x, &self.settings.norm_in);
        match (inputs, outputs) {
            (1, 1) => self.consult_with((1, 1), scaled, y),
            (2, 1) => self.consult_with((2, 1), scaled, y),
            (3, 1) => self.consult_with((3, 1), scaled, y),
            (4, 1) => self.consult_with((4, 1), scaled, y),
            (5, 1) => self.consult_with((5, 1), scaled, y),
            (6, 1) => self.consult_with((6, 1), scaled, y),
            size => self.consult_with(size, scaled, y),
        }
    }

    fn fields(&self) -> usize {
        self.fields.len()
    }
}

impl TryFrom<Stored> for Rfwr {
    type Error = BuildError;

    fn try_from(stored: Stored) -> Result<Self, BuildError> {
        let Stored { settings, samples, pruned, shapes, fields } = stored;
        let workshop = Workshop::new(&settings)?;
        if !shapes.holds(settings.inputs, settings.diag_only, fields.len()) {
            return Err(BuildError::Shapes { fields: fields.len() });
        }
        let size = settings.size();
        if let Some(field) = fields.iter().position(|field| !field.is_sound(size)) {
            return Err(BuildError::Field { field });
        }
        Ok(Self { settings, samples, pruned, shapes, fields, workshop })
    }
}

/// Turns weighted sums into a prediction in raw units, within the limit and always finite.
fn settle(sums: &mut [f64], voices: f64, settings: &Settings) {
    let limit = settings.output_limit.unwrap_or(f64::MAX);
    for (y, norm) in sums.iter_mut().zip(&settings.norm_out) {
        let mean = if voices > 0.0 { *y / voices * norm } else { 0.0 };
        *y = if mean.is_nan() { 0.0 } else { mean.clamp(-limit, limit) };
    }
}

fn divide(into: &mut [f64], values: &[f64], norms: &[f64]) {
    for ((into, value), norm) in into.iter_mut().zip(values).zip(norms) {
        *into = value / norm;
    }
}
