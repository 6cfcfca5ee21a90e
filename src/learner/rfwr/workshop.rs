//! Where the active fields learn a sample, eight at a time.

use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::errors::Heard;
use super::field::{Field, LAMBDA, SUM_W, Size, TRUSTWORTHY};
use super::regression::{Findings, Given, predict};
use super::settings::Settings;
use crate::learner::BuildError;
use crate::learner::kernel::{Activation, Window};
use crate::learner::lanes::{Eight, LANES, Lanes, Mask, Row, Work, all, finite, total};
use crate::learner::metric::{Descent, Metric, Oversized, Rules};
use crate::learner::near::{Group, Near, Search};
use crate::learner::sample::Sample;
use crate::learner::settings::MAX_INPUTS;
use crate::learner::shapes::Shapes;
use crate::learner::store::{FEW_INPUTS, Store};

/// The bi-square kernel ends at this q.
const REACH: f64 = 2.0;
/// P beyond this is no knowledge but the outcome of forgetting without new directions.
const WORN_OUT: f64 = 1e100;

/// What follows from the settings, and room to work in, so that updates need no heap.
#[derive(Clone, Debug)]
pub struct Workshop {
    /// The vector unit.
    pub level: Level,
    /// The learner's sizes.
    pub size: Size,
    /// How fields answer.
    pub window: Window,
    /// How metrics descend.
    rules: Rules,
    /// D of new fields, as far as it is kept,
    pub start_d: Vec<f64>,
    /// and its factor.
    pub start: Metric,
    /// The sample.
    pub sample: Sample,
    /// The prediction the update returns.
    pub blend: Vec<f64>,
    /// The sums over fields of w y.
    voices: Vec<Row>,
    /// What eight fields know, where it does not lie ready,
    room: Vec<Row>,
    /// and what they are about to know.
    next: Vec<Row>,
    /// Their D, before and after.
    d: (Vec<Row>, Vec<Row>),
    /// How far the sample is from their centres.
    offset: Vec<Row>,
    found: Findings,
}

/// Lets all active fields learn the workshop's sample.
pub struct Teach<'a> {
    /// The settings.
    pub settings: &'a Settings,
    /// Where the fields are.
    pub shapes: &'a mut Shapes,
    /// What they know.
    pub fields: &'a mut Store,
    /// The workshop with the sample. Its blend becomes the sums over fields of w y.
    pub shop: &'a mut Workshop,
    /// How often the sample counts.
    pub weight: f64,
}

/// What an update learned about the fields together.
pub struct Taught {
    /// The sum of the activations of all that speak.
    pub voices: f64,
    /// The two fields activated most, with their activations.
    pub strongest: [Near; 2],
}

impl Workshop {
    /// For a learner of these settings.
    ///
    /// # Errors
    /// When a setting is outside its range or a length does not fit.
    pub fn new(settings: &Settings) -> Result<Self, BuildError> {
        let (start_d, start_m) = settings.start()?;
        let size = settings.size();
        let m = settings.outputs;
        let d = vec![Row::ZERO; start_d.len()];
        Ok(Self {
            level: Level::new(),
            size,
            window: Window::new(settings.kernel, REACH, settings.cutoff),
            rules: Rules {
                gamma: settings.gamma(),
                meta_rate: settings.meta.then_some(settings.meta_rate),
                oversized: Oversized::Halved,
                bounds: settings.bounds(),
            },
            next: vec![Row::ZERO; size.height()],
            room: vec![Row::ZERO; size.height()],
            d: (d.clone(), d),
            offset: vec![Row::ZERO; settings.inputs],
            start_d,
            start: Metric::new(start_m, settings.init_alpha),
            sample: Sample::new(settings.inputs, m),
            blend: vec![0.0; m],
            voices: vec![Row::ZERO; m],
            found: Findings::new(size),
        })
    }

    /// The numbers of no field.
    pub fn blank(&self, settings: &Settings) -> Vec<f64> {
        Field::new(settings, vec![0.0; settings.outputs], self.start.clone()).to_column()
    }
}

impl Work for Teach<'_> {
    type Output = Taught;

    #[inline(always)]
    fn with<S: Simd>(mut self, simd: S) -> Taught {
        let size = self.shop.size;
        let (window, zero) = (self.shop.window, all(simd, 0.0));
        let mut voices = zero;
        self.shop.voices.fill(Row::ZERO);
        let mut search = Search::new(simd, self.fields.gathers());
        while let Some(Group { eight, q }) =
            search.next(simd, (self.shapes, &window), &self.shop.sample.x[..size.inputs])
        {
            let w = window.activation(q);
            let active = window.counts(w);
            voices += self.teach(simd, (eight, size), (active.select(w, zero), active));
        }
        for (sum, rows) in self.shop.blend.iter_mut().zip(&self.shop.voices) {
            *sum = total(rows.get(simd));
        }
        Taught {
            voices: total(voices),
            strongest: window
                .strongest(simd, search.nearest(simd, self.shapes, &self.shop.sample.x)),
        }
    }
}

impl Teach<'_> {
    /// Lets the active ones of eight fields learn the sample: regression first and then
    /// shape. Each part is learned aside, and taken over where it is sound. Adds what the
    /// fields say in between to the voices, and returns their weights.
    #[inline(always)]
    fn teach<S: Simd>(
        &mut self,
        simd: S,
        (eight, size): (Eight, Size),
        (w, active): (Lanes<S>, Mask<S>),
    ) -> Lanes<S> {
        let activation = self.shop.window.derivatives(w, self.weight);
        let Workshop { sample, room, next, found, voices, .. } = &mut *self.shop;
        let room = &mut room[..size.regression()];
        let rows = self.fields.rows(simd, &eight, 0..size.regression(), room);
        let old = size.cut_regression(rows);
        let (next, ..) = size.cut(&mut next[..]);
        let given = Given { x: &sample.x[..size.inputs], y: &sample.y, w: activation.w };
        size.cut_regression(&mut *next).learn(simd, size, &old, given, (found, self.settings));
        let sound = finite(simd, active & activation.w.simd_gt(0.0), next);
        let mut trusted = size.cut_regression(&*next).trustworthy(simd);
        let mut lost = active & !sound;
        if lost.any_true() {
            trusted = sound.select(trusted, old.trustworthy(simd));
            let models = old.outputs.chunks_exact(size.output());
            for (said, model) in found.y.iter_mut().zip(models) {
                let before = predict(simd, old.mean, size.cut_output(model), given.x);
                said.set(sound.select(said.get(simd), before));
            }
            lost &= activation.w.simd_gt(0.0) & worn_out(simd, old.p);
        }
        let speaking = finite(simd, active & trusted, &found.y);
        let zero = all(simd, 0.0);
        for (sum, said) in voices.iter_mut().zip(&found.y) {
            sum.set(sum.get(simd) + speaking.select(w * said.get(simd), zero));
        }
        if self.settings.update_d {
            self.reshape(simd, (eight, size), (activation, sound));
        }
        let (learned, ..) = size.cut(&self.shop.next[..]);
        self.fields.replace(simd, (&eight, sound), 0, learned);
        if lost.any_true() {
            self.mend(&eight, lost.to_bitmask());
        }
        speaking.select(w, zero)
    }

    /// Lets the fields of `mask`, whose regressions have just learned, learn their shape.
    #[inline(always)]
    fn reshape<S: Simd>(
        &mut self,
        simd: S,
        (eight, size): (Eight, Size),
        (activation, mask): (Activation<S>, Mask<S>),
    ) {
        let Workshop { rules, sample, room, next, d, offset, found, .. } = &mut *self.shop;
        let (regression, errors, metric) = size.cut(&mut next[..]);
        let regression = size.cut_regression(&*regression);
        let lost = regression.inflation(simd).0.simd_gt(self.settings.vif_update);
        let mask = mask & !lost;
        if mask.all_false() {
            return;
        }
        let learned = errors.len() + rules.learned(size.entries);
        let start = size.regression();
        let lambda = self.fields.row(&eight, LAMBDA).get(simd);
        let (_, room) = room.split_at_mut(start);
        let old = self.fields.rows(simd, &eight, start..start + learned, room);
        let (old_errors, old_metric) = old.split_at(errors.len());
        let heard =
            Heard { lambda, sum_w: regression.scalars[SUM_W].get(simd), w: activation.w, found };
        let old_errors = size.cut_errors(old_errors);
        let cost = size.cut_errors(&mut *errors).learn(simd, &old_errors, heard, self.settings);
        let (offset, old_d) = (&mut offset[..size.inputs], &mut d.0[..size.entries]);
        self.shapes.gather(simd, (&eight, &sample.x[..size.inputs]), (offset, old_d));
        let by = Descent { offset, d: old_d, activation, cost };
        let new_d = &mut d.1[..size.entries];
        let mask = finite(simd, mask, errors);
        let mask = rules.descend(simd, (old_metric, &mut *metric), new_d, (&by, mask));
        self.shapes.scatter(simd, (&eight, mask), new_d);
        self.fields.replace(simd, (&eight, mask), start, &next[start..start + learned]);
    }

    /// Starts P of the fields of these bits anew.
    #[cold]
    fn mend(&mut self, eight: &Eight, bits: u64) {
        let size = self.shop.size;
        for lane in (0..LANES).filter(|lane| bits >> lane & 1 == 1) {
            let fresh = size.fresh_p(self.settings.init_p);
            for (k, p) in fresh.into_iter().enumerate() {
                self.fields.set(eight[lane], size.p() + k, p);
            }
        }
    }
}

/// Where forgetting has blown P up in a direction that is never seen.
#[cold]
fn worn_out<S: Simd>(simd: S, p: &[Row]) -> Mask<S> {
    let mut worn_out = Mask::splat(simd, false);
    for p in p {
        worn_out |= p.get(simd).abs().simd_gt(WORN_OUT);
    }
    worn_out
}

/// Hears all fields about a normalised input.
pub struct Consult<'a> {
    /// Where the fields are.
    pub shapes: &'a Shapes,
    /// What they know.
    pub fields: &'a Store,
    /// The workshop, for what follows from the settings.
    pub shop: &'a Workshop,
    /// The input.
    pub x: &'a [f64],
    /// Becomes the sums over fields of w y.
    pub y: &'a mut [f64],
}

/// Room for what predictions need of so many inputs: x̄ or slopes, with scalars.
const fn room_for(inputs: usize) -> usize {
    inputs + 8
}

impl Work for Consult<'_> {
    type Output = Taught;

    #[inline(always)]
    fn with<S: Simd>(self, simd: S) -> Taught {
        if self.x.len() <= FEW_INPUTS {
            const ROOM: usize = room_for(FEW_INPUTS);
            self.hear(simd, (&mut [Row::ZERO; ROOM], &mut [Row::ZERO; ROOM]))
        } else {
            const ROOM: usize = room_for(MAX_INPUTS);
            self.hear(simd, (&mut [Row::ZERO; ROOM], &mut [Row::ZERO; ROOM]))
        }
    }
}

impl Consult<'_> {
    #[inline(always)]
    fn hear<S: Simd>(self, simd: S, (head, output): (&mut [Row], &mut [Row])) -> Taught {
        let Self { shapes, fields, shop: &Workshop { size, ref window, .. }, x, y } = self;
        let zero = all(simd, 0.0);
        let mut voices = zero;
        y.fill(0.0);
        let (head, output) = (&mut head[..size.head()], &mut output[..size.output()]);
        let mut search = Search::new(simd, fields.gathers());
        while let Some(Group { eight, q }) = search.next(simd, (shapes, window), x) {
            let w = window.activation(q);
            let (scalars, mean) = size.cut_head(fields.rows(simd, &eight, 0..size.head(), head));
            let trustworthy = scalars[TRUSTWORTHY].get(simd).simd_gt(0.0);
            let speaking = window.counts(w) & trustworthy;
            voices += speaking.select(w, zero);
            let mut start = size.head();
            for sum in &mut *y {
                let model = fields.rows(simd, &eight, start..start + size.output(), output);
                let said = predict(simd, mean, size.cut_output(model), x);
                *sum += total((speaking & said.is_finite()).select(w * said, zero));
                start += size.output();
            }
        }
        Taught {
            voices: total(voices),
            strongest: window.strongest(simd, search.nearest(simd, shapes, x)),
        }
    }
}
