//! The fields of one output.

use serde::{Deserialize, Serialize};

use super::field::{Field, Regression};
use super::settings::Settings;
use super::workshop::Workshop;
use super::{Change, Growth};
use crate::learner::BuildError;
use crate::learner::kernel::Window;
use crate::learner::metric::Metric;
use crate::learner::shapes::{Nearest, Shapes, Size, distance};

/// A new field takes after the nearest one if that is activated by more than this share of
/// `w_gen`.
const KINSHIP: f64 = 0.1;

/// Everything that is known of one output.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Submodel {
    pruned: u64,
    shapes: Shapes,
    fields: Vec<Field>,
}

/// A field and its activation.
type Active = Option<(usize, f64)>;

/// What the fields together say about an input, as sums over those that speak, and not yet
/// scaled.
#[derive(Clone, Copy, Debug, Default)]
pub struct Voices {
    /// Σ w.
    pub sum_w: f64,
    /// Σ w y.
    pub sum_wy: f64,
    /// Σ w (σ² + y²).
    pub sum_wy2: f64,
    /// The largest activation of any field.
    pub max_activation: f64,
}

impl Submodel {
    /// One without fields.
    pub fn new(settings: &Settings) -> Self {
        let shapes = Shapes::new(settings.inputs, settings.is_diagonal());
        Self { pruned: 0, shapes, fields: Vec::new() }
    }

    /// How many fields were removed.
    pub fn pruned(&self) -> u64 {
        self.pruned
    }

    /// The centre of `field`, in normalised coordinates.
    pub fn centre(&self, field: usize) -> &[f64] {
        self.shapes.centre(field)
    }

    /// The metric D of `field`, normalised: its diagonal, where the rest is 0 for good, or
    /// n × n by rows.
    pub fn metric(&self, field: usize) -> &[f64] {
        self.shapes.metric(field)
    }

    /// The fields, in storage order.
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// Says what is wrong with a submodel that was read from a file.
    pub(super) fn check(&self, settings: &Settings) -> Result<(), BuildError> {
        let fields = self.fields.len();
        if !self.shapes.holds(settings.inputs, settings.is_diagonal(), fields) {
            return Err(BuildError::Shapes { fields });
        }
        let sound = |field: &Field| {
            field.regression.is_sound(settings.inputs) && field.metric.is_sound(settings.factors())
        };
        let unsound = self.fields.iter().position(|field| !sound(field));
        unsound.map_or(Ok(()), |field| Err(BuildError::Field { field }))
    }

    /// Lets every active field learn the workshop's x and this `y`; then fields come and go.
    /// The voices are those of the fields just after they learned.
    pub(super) fn learn(
        &mut self,
        y: f64,
        weight: f64,
        (shop, settings): (&mut Workshop, &Settings),
    ) -> (Voices, Change) {
        let mut nearest = Nearest::NONE;
        let mut voices = Voices::default();
        for (index, field) in self.fields.iter_mut().enumerate() {
            let (centre, d) = self.shapes.place(index, shop.size);
            let q = distance(centre, d, &shop.x);
            nearest.note(index, q);
            if !shop.window.may_count(q) {
                continue;
            }
            let w = shop.window.activation(q);
            if w <= settings.cutoff {
                continue;
            }
            let activation = shop.window.derivatives(w).times(weight);
            let said = shop.teach(field, (centre, d), (activation, y), settings);
            if field.regression.trustworthy && said.is_finite() {
                voices.sum_w += w;
                voices.sum_wy += w * said;
            }
        }
        let strongest = |near: Active| {
            let (index, w) = near.map(|(index, q)| (index, shop.window.activation(q)))?;
            (w > 0.0).then_some((index, w))
        };
        let (first, second) = (strongest(nearest.first), strongest(nearest.second));
        let growth = self.grow((first, second), y, (shop, settings));
        let activation = |field: Active| field.map_or(0.0, |(_, w)| w);
        let change = Change {
            max_activation: activation(first),
            second_activation: activation(second),
            growth,
        };
        (voices, change)
    }

    /// Hears all fields about the normalised `x`.
    pub(super) fn consult(&self, x: &[f64], (size, window): (Size, Window), cutoff: f64) -> Voices {
        let mut nearest = f64::INFINITY;
        let mut voices = Voices::default();
        for (Field { regression, .. }, (centre, d)) in
            self.fields.iter().zip(self.shapes.each(size))
        {
            let q = distance(centre, d, x);
            nearest = nearest.min(q);
            if !window.may_count(q) {
                continue;
            }
            let w = window.activation(q);
            if w <= cutoff || !regression.trustworthy {
                continue;
            }
            let said = regression.opinion(x, w);
            voices.sum_w += w;
            voices.sum_wy += w * said.y;
            voices.sum_wy2 += w * (said.variance + said.y * said.y);
        }
        voices.max_activation = window.activation(nearest);
        voices
    }

    /// Adds a field in empty space, or removes one of two that overlap.
    fn grow(
        &mut self,
        (first, second): (Active, Active),
        y: f64,
        (shop, settings): (&Workshop, &Settings),
    ) -> Growth {
        let full = settings.max_fields.is_some_and(|most| self.fields.len() >= most as usize);
        match (first, second) {
            (Some((_, w)), None) if w > settings.w_gen => Growth::None,
            (Some((first, w)), Some((second, w_second))) if w > settings.w_gen => {
                if w_second > settings.w_prune { self.prune(first, second) } else { Growth::None }
            }
            _ if full => Growth::None,
            _ => self.add(first, y, (shop, settings)),
        }
    }

    fn add(
        &mut self,
        strongest: Active,
        y: f64,
        (shop, settings): (&Workshop, &Settings),
    ) -> Growth {
        let template = strongest
            .filter(|&(index, w)| {
                w > KINSHIP * settings.w_gen && self.fields[index].regression.trustworthy
            })
            .map(|(index, _)| index);
        let (offset, projections, metric, d) = if let Some(index) = template {
            let Field { regression, metric } = &self.fields[index];
            let metric = Metric::inheriting(metric.m.clone(), metric.alpha.clone());
            let d = self.shapes.metric(index).to_vec();
            (regression.offset, regression.projections.len(), metric, d)
        } else {
            (y, settings.first_projections(), shop.start.clone(), shop.start_d.clone())
        };
        let field = self.fields.len();
        self.shapes.push(&shop.x, &d);
        let regression = Regression::new(settings, offset, projections);
        self.fields.push(Field { regression, metric });
        Growth::Added { field, template }
    }

    /// Removes the wider of two fields, as the trace of D says; of equal ones the one
    /// activated less.
    fn prune(&mut self, first: usize, second: usize) -> Growth {
        let trace = |field| {
            let (d, n) = (self.shapes.metric(field), self.shapes.centre(field).len());
            d.iter().step_by(if d.len() == n { 1 } else { n + 1 }).sum::<f64>()
        };
        let (field, survivor) =
            if trace(first) < trace(second) { (first, second) } else { (second, first) };
        self.shapes.swap_remove(field);
        self.fields.swap_remove(field);
        self.pruned += 1;
        Growth::Pruned { field, survivor }
    }
}
