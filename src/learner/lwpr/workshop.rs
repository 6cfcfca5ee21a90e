//! Where one field after the other learns a sample.

use super::field::{Field, Findings, Regression, Sample};
use super::settings::Settings;
use super::shaping::Reckoning;
use super::{Change, Growth};
use crate::learner::kernel::{Activation, Window};
use crate::learner::metric::{Cost, Descent, Metric, Oversized, Rules};
use crate::learner::shapes::{Size, is_positive};
use crate::learner::{BuildError, all_finite};

/// The bi-square kernel ends at this q.
const REACH: f64 = 4.0;

/// What follows from the settings, and room to work in, so that updates need no heap.
#[derive(Clone, Debug)]
pub struct Workshop {
    /// The learner's sizes.
    pub size: Size,
    /// How fields answer.
    pub window: Window,
    rules: Rules,
    reckoning: Reckoning,
    /// D of new fields,
    pub start_d: Vec<f64>,
    /// and its factor.
    pub start: Metric,
    /// The sample's inputs, normalised.
    pub x: Vec<f64>,
    /// Its outputs.
    pub y: Vec<f64>,
    /// The prediction the update returns.
    pub output: Vec<f64>,
    /// What happened to each output's fields.
    pub changes: Vec<Change>,
    next: Regression,
    next_metric: Metric,
    /// The learned part of a D before and after the sample.
    d: (Vec<f64>, Vec<f64>),
    offset: Vec<f64>,
    found: Findings,
}

impl Workshop {
    /// For a learner of these settings.
    ///
    /// # Errors
    /// When a setting is outside its range or a length does not fit.
    pub fn new(settings: &Settings) -> Result<Self, BuildError> {
        let (start_d, start_m) = settings.start()?;
        let (n, outputs) = (settings.inputs, settings.outputs);
        let learned = vec![0.0; start_m.len()];
        let start = Metric::new(start_m, settings.init_alpha);
        let change = Change { max_activation: 0.0, second_activation: 0.0, growth: Growth::None };
        Ok(Self {
            size: settings.size(),
            window: Window::new(settings.kernel, REACH, settings.cutoff),
            rules: Rules {
                gamma: settings.gamma(),
                meta_rate: settings.meta.then_some(settings.meta_rate),
                oversized: Oversized::Skipped,
                bounds: settings.bounds(),
            },
            reckoning: Reckoning { meta: settings.meta, min_one_minus_h: settings.min_one_minus_h },
            start_d,
            x: vec![0.0; n],
            y: vec![0.0; outputs],
            output: vec![0.0; outputs],
            changes: vec![change; outputs],
            // With room for all projections.
            next: Regression::new(settings, 0.0, n),
            next_metric: start.clone(),
            start,
            d: (learned.clone(), learned),
            offset: vec![0.0; n],
            found: Findings::new(n),
        })
    }

    /// Lets `field`, which is at `centre` with the metric `d`, learn the workshop's x and
    /// this `y`: regression first and then its shape. Each part learns in a copy, which takes
    /// its place if sound. Returns the field's prediction in between.
    pub fn teach(
        &mut self,
        field: &mut Field,
        (centre, d): (&[f64], &mut [f64]),
        (activation, y): (Activation, f64),
        settings: &Settings,
    ) -> f64 {
        let Field { regression, metric } = field;
        if activation.w <= 0.0 {
            return regression.predict(&self.x);
        }
        self.next.copy(regression);
        let sample = Sample { x: &self.x, y, w: activation.w };
        self.next.learn(&sample, &mut self.found);
        if !self.next.is_sound(self.x.len()) {
            return regression.predict(&self.x);
        }
        if settings.update_d {
            let cost = self.next.judge(activation.w, &mut self.found, self.reckoning);
            if let Some(cost) = cost {
                self.reshape(metric, (centre, d), activation, cost);
            }
        }
        self.next.settle(settings);
        regression.copy(&self.next);
        self.found.y
    }

    /// Takes a step on the metric.
    fn reshape(
        &mut self,
        metric: &mut Metric,
        (centre, d): (&[f64], &mut [f64]),
        activation: Activation,
        cost: Cost,
    ) {
        let n = centre.len();
        for ((offset, x), centre) in self.offset.iter_mut().zip(&self.x).zip(centre) {
            *offset = x - centre;
        }
        let (before, after) = (&mut self.d.0, &mut self.d.1);
        // Where M is diagonal and D is not, only D's diagonal is learned.
        let stride = if before.len() < d.len() { n + 1 } else { 1 };
        for (before, d) in before.iter_mut().zip(d.iter().step_by(stride)) {
            *before = *d;
        }
        let descent = Descent { offset: &self.offset, d: before, activation, cost };
        metric.descend(&mut self.next_metric, after, &descent, &self.rules);
        let projections = self.next.projections.len();
        let sound = self.next_metric.is_sound(after.len())
            && all_finite(after)
            && is_positive(after, n)
            && all_finite(&self.found.h[..projections])
            && all_finite(&self.found.r[..projections]);
        if sound {
            std::mem::swap(metric, &mut self.next_metric);
            for (d, after) in d.iter_mut().step_by(stride).zip(&*after) {
                *d = *after;
            }
            self.next.remember(&self.found);
        }
    }
}
