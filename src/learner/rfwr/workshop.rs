//! Where one field after the other learns a sample.

use super::field::{Field, Findings, Sample};
use super::settings::Settings;
use crate::learner::kernel::{Activation, Window};
use crate::learner::metric::{Descent, Metric, Oversized, Rules};
use crate::learner::settings::MAX_INPUTS;
use crate::learner::shapes::{Size, is_positive};
use crate::learner::{BuildError, all_finite};

/// The bi-square kernel ends at this q.
const REACH: f64 = 2.0;

/// What follows from the settings, and room to work in, so that updates need no heap.
#[derive(Clone, Debug)]
pub struct Workshop {
    /// The learner's sizes.
    pub size: Size,
    /// How fields answer.
    pub window: Window,
    /// How metrics descend.
    pub rules: Rules,
    /// D of new fields,
    pub start_d: Vec<f64>,
    /// and its factor.
    pub start: Metric,
    /// The state a field is about to have.
    pub next: Field,
    /// Its D.
    pub next_d: Vec<f64>,
    /// The sample's inputs, normalised.
    pub x: Vec<f64>,
    /// Its outputs.
    pub y: Vec<f64>,
    /// The prediction the update returns.
    pub blend: Vec<f64>,
}

impl Workshop {
    /// For a learner of these settings.
    ///
    /// # Errors
    /// When a setting is outside its range or a length does not fit.
    pub fn new(settings: &Settings) -> Result<Self, BuildError> {
        let (start_d, start_m) = settings.start()?;
        let (n, m) = (settings.inputs, settings.outputs);
        let metric = Metric::new(start_m, settings.init_alpha);
        Ok(Self {
            size: settings.size(),
            window: Window::new(settings.kernel, REACH, settings.cutoff),
            rules: Rules {
                gamma: settings.gamma(),
                meta_rate: settings.meta.then_some(settings.meta_rate),
                oversized: Oversized::Halved,
                bounds: settings.bounds(),
            },
            next_d: start_d.clone(),
            start_d,
            start: metric.clone(),
            next: Field::new(settings, vec![0.0; m], metric),
            x: vec![0.0; n],
            y: vec![0.0; m],
            blend: vec![0.0; m],
        })
    }

    /// Lets `field`, which is at `centre` with the metric `d`, learn the sample: regression
    /// first and then its shape. Each part learns in a copy, which takes its place if sound.
    #[inline(always)]
    pub fn teach(
        &mut self,
        field: &mut Field,
        (centre, d): (&[f64], &mut [f64]),
        (size, activation, found): (Size, Activation, &mut Findings),
        settings: &Settings,
    ) {
        let Size { inputs: n, outputs: m, entries } = size;
        let Field { regression, metric, errors } = field;
        let next = &mut self.next;
        let x = &self.x[..n];
        if activation.w > 0.0 {
            next.regression.copy(regression, size);
            next.regression.learn(&Sample { x, y: &self.y, activation }, (size, found), settings);
        }
        if activation.w <= 0.0 || !next.regression.is_sound(size) {
            regression.mend(settings.init_p);
            for (k, y) in found.y[..m].iter_mut().enumerate() {
                *y = regression.predict(size, k, x);
            }
            return;
        }
        let lambda = regression.lambda;
        std::mem::swap(regression, &mut next.regression);
        if !settings.update_d {
            return;
        }
        next.errors.copy(errors, size);
        let heard = (activation, size, &*found);
        let Some(cost) = next.errors.learn((lambda, regression), heard, settings) else { return };
        let mut offset = [0.0; MAX_INPUTS];
        for i in 0..n {
            offset[i] = x[i] - centre[i];
        }
        let descent = Descent { offset: &offset[..n], d, activation, cost };
        let next_d = &mut self.next_d[..entries];
        metric.descend(&mut next.metric, next_d, &descent, &self.rules);
        let sound = next.errors.is_sound(size)
            && next.metric.is_sound(entries)
            && all_finite(next_d)
            && is_positive(next_d, n);
        if sound {
            std::mem::swap(errors, &mut next.errors);
            std::mem::swap(metric, &mut next.metric);
            d.copy_from_slice(next_d);
        }
    }
}
