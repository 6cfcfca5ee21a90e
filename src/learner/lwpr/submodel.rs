//! The fields of one output.

use serde::{Deserialize, Serialize};

use super::Change;
use super::field::{Field, Regression};
use super::settings::Settings;
use super::workshop::{Consult, Teach, Workshop};
use crate::learner::BuildError;
use crate::learner::growth::{Growth, Wish};
use crate::learner::lanes::run;
use crate::learner::metric::Metric;
use crate::learner::near::Near;
use crate::learner::shapes::Shapes;
use crate::learner::store::Store;

/// Everything that is known of one output.
#[derive(Clone, Debug)]
pub struct Submodel {
    size: super::field::Size,
    pruned: u64,
    shapes: Shapes,
    /// All that fields know, in the order of [`Field::to_column`].
    fields: Store,
}

/// A submodel as in a file.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Stored {
    pruned: u64,
    shapes: Shapes,
    fields: Vec<Field>,
}

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
    pub(super) fn new(settings: &Settings, shop: &Workshop) -> Self {
        Self {
            size: shop.size,
            pruned: 0,
            shapes: Shapes::new(settings.inputs, settings.diag_only),
            fields: Store::new(settings.inputs, shop.blank(settings)),
        }
    }

    /// How many fields were removed.
    pub fn pruned(&self) -> u64 {
        self.pruned
    }

    /// The number of fields.
    pub fn len(&self) -> usize {
        self.fields.fields()
    }

    /// Whether there are no fields.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The centre of `field`, in normalised coordinates.
    pub fn centre(&self, field: usize) -> Vec<f64> {
        self.shapes.centre(field)
    }

    /// The metric D of `field`, normalised: its diagonal, where the rest is 0 for good, or
    /// n × n by rows.
    pub fn metric(&self, field: usize) -> Vec<f64> {
        self.shapes.metric(field)
    }

    /// The fields, in storage order.
    pub fn fields(&self) -> Vec<Field> {
        (0..self.len()).map(|field| self.state(field)).collect()
    }

    fn state(&self, field: usize) -> Field {
        Field::from_column(self.size, &self.fields.column(field))
    }

    /// This submodel as in a file.
    pub(super) fn store(&self) -> Stored {
        Stored { pruned: self.pruned, shapes: self.shapes.clone(), fields: self.fields() }
    }

    /// A submodel from a file.
    ///
    /// # Errors
    /// When it cannot be.
    pub(super) fn restore(
        stored: Stored,
        settings: &Settings,
        shop: &Workshop,
    ) -> Result<Self, BuildError> {
        let Stored { pruned, shapes, fields } = stored;
        if !shapes.holds(settings.inputs, settings.diag_only, fields.len()) {
            return Err(BuildError::Shapes { fields: fields.len() });
        }
        if let Some(field) = fields.iter().position(|field| !field.is_sound(shop.size)) {
            return Err(BuildError::Field { field });
        }
        let mut submodel = Self { pruned, shapes, ..Self::new(settings, shop) };
        for field in &fields {
            submodel.push(field, settings);
        }
        Ok(submodel)
    }

    /// Lets every active field learn the workshop's x and this `y`; then fields come and go.
    /// The voices are those of the fields just after they learned.
    pub(super) fn learn(
        &mut self,
        y: f64,
        weight: f64,
        (shop, settings): (&mut Workshop, &Settings),
    ) -> (Voices, Change) {
        let Self { shapes, fields, .. } = self;
        let level = shop.level;
        let teach = Teach { settings, shapes, fields, shop: &mut *shop, y, weight };
        let (voices, strongest) = run(level, teach);
        let growth = self.grow(strongest, y, (shop, settings));
        let activation = |near: Near| near.map_or(0.0, |(_, w)| w);
        let change = Change {
            max_activation: activation(strongest[0]),
            second_activation: activation(strongest[1]),
            growth,
        };
        (voices, change)
    }

    /// Hears all fields about the normalised `x`, about the variance too if it is wanted.
    pub(super) fn consult(&self, x: &[f64], shop: &Workshop, variance: bool) -> Voices {
        let Self { shapes, fields, .. } = self;
        run(shop.level, Consult { shapes, fields, shop, x, variance })
    }

    /// Adds a field in empty space, or removes one of two that overlap.
    fn grow(
        &mut self,
        strongest: [Near; 2],
        y: f64,
        (shop, settings): (&Workshop, &Settings),
    ) -> Growth {
        let trusted = |field: usize| self.state(field).regression.trustworthy;
        match settings.growth().wish(strongest, self.len(), trusted) {
            Wish::Stay => Growth::None,
            Wish::Add(template) => self.add(template, y, (shop, settings)),
            Wish::Prune(first, second) => self.prune(first, second),
        }
    }

    fn add(
        &mut self,
        template: Option<usize>,
        y: f64,
        (shop, settings): (&Workshop, &Settings),
    ) -> Growth {
        let (offset, projections, metric, d) = if let Some(index) = template {
            let Field { regression, metric } = self.state(index);
            let metric = Metric::inheriting(metric.m, metric.alpha);
            (regression.offset, regression.projections.len(), metric, self.shapes.kept(index))
        } else {
            (y, settings.first_projections(), shop.start.clone(), shop.start_d.clone())
        };
        let field = self.len();
        self.shapes.push(&shop.sample.x, &d);
        let regression = Regression::new(settings, offset, projections);
        self.push(&Field { regression, metric }, settings);
        Growth::Added { field, template }
    }

    /// Appends a field, with room for its projections.
    fn push(&mut self, field: &Field, settings: &Settings) {
        let numbers = field.to_column();
        while self.fields.height() < numbers.len() {
            let axis = (self.fields.height() - self.size.height(0)) / self.size.projection();
            self.fields.extend(&super::field::Projection::new(axis, settings).to_column());
        }
        self.fields.push(&numbers);
    }

    /// Removes the wider of two fields, as the trace of D says; of equal ones the one
    /// activated less.
    fn prune(&mut self, first: usize, second: usize) -> Growth {
        let trace = |field| self.shapes.diagonal(field).iter().sum::<f64>();
        let (field, survivor) =
            if trace(first) < trace(second) { (first, second) } else { (second, first) };
        self.shapes.swap_remove(field);
        self.fields.swap_remove(field);
        self.pruned += 1;
        Growth::Pruned { field, survivor }
    }
}
