//! Where the active fields learn a sample, eight at a time.

use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::Change;
use super::field::{COUNT, Field, LAMBDA, N_DATA, Projection, Regression, SS_P, Size};
use super::regression::{Findings, Given, Rows};
use super::settings::Settings;
use super::shaping::Reckoning;
use super::speech::Speech;
use super::submodel::Voices;
use crate::learner::BuildError;
use crate::learner::growth::Growth;
use crate::learner::kernel::{Activation, Window};
use crate::learner::lanes::{Eight, LANES, Lanes, Mask, Row, Work, all, finite, total};
use crate::learner::metric::{Descent, Metric, Oversized, Rules};
use crate::learner::near::{Group, Near, Search};
use crate::learner::records::padded;
use crate::learner::sample::Sample;
use crate::learner::settings::MAX_INPUTS;
use crate::learner::shapes::Shapes;
use crate::learner::store::{FEW_INPUTS, Store};

/// The bi-square kernel ends at this q.
const REACH: f64 = 4.0;

/// What follows from the settings, and room to work in, so that updates need no heap.
#[derive(Clone, Debug)]
pub struct Workshop {
    /// The vector unit.
    pub level: Level,
    /// The learner's sizes.
    pub size: Size,
    /// How fields answer.
    pub window: Window,
    rules: Rules,
    reckoning: Reckoning,
    /// D of new fields, as far as it is kept,
    pub start_d: Vec<f64>,
    /// and its factor.
    pub start: Metric,
    /// The sample.
    pub sample: Sample,
    /// The prediction the update returns.
    pub output: Vec<f64>,
    /// What happened to each output's fields.
    pub changes: Vec<Change>,
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

/// Lets all active fields of one output learn the workshop's sample.
pub struct Teach<'a> {
    /// The settings.
    pub settings: &'a Settings,
    /// Where the fields are.
    pub shapes: &'a mut Shapes,
    /// What they know.
    pub fields: &'a mut Store,
    /// The workshop with the sample's inputs.
    pub shop: &'a mut Workshop,
    /// The sample's output, normalised.
    pub y: f64,
    /// How often the sample counts.
    pub weight: f64,
}

impl Workshop {
    /// For a learner of these settings.
    ///
    /// # Errors
    /// When a setting is outside its range or a length does not fit.
    pub fn new(settings: &Settings) -> Result<Self, BuildError> {
        let (start_d, start_m) = settings.start()?;
        let (n, outputs) = (settings.inputs, settings.outputs);
        let (size, room) = (settings.size(), vec![Row::ZERO; n]);
        let d = vec![Row::ZERO; start_d.len()];
        let change = Change { max_activation: 0.0, second_activation: 0.0, growth: Growth::None };
        Ok(Self {
            level: Level::new(),
            size,
            window: Window::new(settings.kernel, REACH, settings.cutoff),
            rules: Rules {
                gamma: settings.gamma(),
                meta_rate: settings.meta.then_some(settings.meta_rate),
                oversized: Oversized::Skipped,
                bounds: settings.bounds(),
            },
            reckoning: Reckoning {
                meta: settings.meta,
                min_one_minus_h: settings.min_one_minus_h,
                h: room.clone(),
                r: room,
            },
            start_d,
            start: Metric::new(start_m, settings.init_alpha),
            sample: Sample::new(n, outputs),
            output: vec![0.0; outputs],
            changes: vec![change; outputs],
            room: vec![Row::ZERO; size.height(n)],
            next: vec![Row::ZERO; size.height(n)],
            d: (d.clone(), d),
            offset: vec![Row::ZERO; n],
            found: Findings::new(n),
        })
    }

    /// The numbers of no field: some projections, none of which it has.
    pub fn blank(&self, settings: &Settings) -> Vec<f64> {
        let regression = Regression::new(settings, 0.0, settings.first_projections());
        let mut numbers = Field { regression, metric: self.start.clone() }.to_column();
        numbers[self.size.base_scalar(COUNT)] = 0.0;
        numbers
    }
}

/// The most of eight counts.
#[inline(always)]
fn most(counts: Row) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "counts")]
    let most = counts.0.into_iter().fold(1.0, f64::max) as usize;
    most
}

impl Work for Teach<'_> {
    type Output = (Voices, [Near; 2]);

    #[inline(always)]
    fn with<S: Simd>(mut self, simd: S) -> Self::Output {
        let size = self.shop.size;
        let (window, zero) = (self.shop.window, all(simd, 0.0));
        let (mut sum_w, mut sum_wy) = (zero, zero);
        let mut search = Search::new(simd, self.fields.gathers());
        while let Some(Group { eight, q }) =
            search.next(simd, (self.shapes, &window), &self.shop.sample.x[..size.inputs])
        {
            let w = window.activation(q);
            let active = window.counts(w);
            let heard = self.teach(simd, (eight, size), (active.select(w, zero), active));
            sum_w += heard;
            sum_wy += heard * self.shop.found.y.get(simd);
        }
        let voices = Voices { sum_w: total(sum_w), sum_wy: total(sum_wy), ..Voices::default() };
        (voices, window.strongest(simd, search.nearest(simd, self.shapes, &self.shop.sample.x)))
    }
}

impl Teach<'_> {
    /// Lets the active ones of eight fields learn the sample: regression first and then
    /// shape. Each part is learned aside, and taken over where it is sound. Leaves what the
    /// fields say in between, and returns the weights of those that speak.
    #[inline(always)]
    fn teach<S: Simd>(
        &mut self,
        simd: S,
        (eight, size): (Eight, Size),
        (w, active): (Lanes<S>, Mask<S>),
    ) -> Lanes<S> {
        let activation = self.shop.window.derivatives(w, self.weight);
        let counts = self.fields.row(&eight, size.base_scalar(COUNT));
        let (start, end) = (size.metric(), size.height(most(counts)));
        let Workshop { sample, room, next, found, .. } = &mut *self.shop;
        let rows = self.fields.rows(simd, &eight, start..end, &mut room[start..end]);
        let old = Rows::new(size, rows);
        let next = &mut next[start..end];
        let given = Given { x: &sample.x[..size.inputs], y: self.y, w: activation.w };
        Rows::new(size, &mut *next).learn(simd, &old, given, (found, self.settings));
        let new = Rows::new(size, &*next);
        let sound = finite(simd, active & activation.w.simd_gt(0.0), next);
        let mut trusted = new.trustworthy(simd);
        if (active & !sound).any_true() {
            trusted = sound.select(trusted, old.trustworthy(simd));
            found.y.set(sound.select(found.y.get(simd), old.predict(simd, given.x)));
        }
        let wanting = sound & new.wants_projection(simd, &old, self.settings);
        let said = found.y.get(simd);
        let speaking = active & trusted & said.is_finite();
        let zero = all(simd, 0.0);
        found.y.set(speaking.select(said, zero));
        if self.settings.update_d {
            self.reshape(simd, (eight, size, end), (activation, sound));
        }
        self.take_over(simd, (&eight, size), (counts.get(simd), sound), end);
        if wanting.any_true() {
            self.add_projections(&eight, wanting.to_bitmask());
        }
        speaking.select(w, zero)
    }

    /// Lets the fields of `mask`, whose regressions have just learned, learn their shape.
    #[inline(always)]
    fn reshape<S: Simd>(
        &mut self,
        simd: S,
        (eight, size, end): (Eight, Size, usize),
        (activation, mask): (Activation<S>, Mask<S>),
    ) {
        let Workshop { rules, reckoning, sample, room, next, d, offset, found, .. } =
            &mut *self.shop;
        let start = size.metric();
        let (room, known) = room[..end].split_at_mut(start);
        let old = Rows::new(size, self.fields.rows_again(&eight, start, known));
        let mask = mask & old.is_ripe(simd, old.first(simd, N_DATA));
        if mask.all_false() {
            return;
        }
        let (metric, next) = next[..end].split_at_mut(start);
        let mut new = Rows::new(size, next);
        let cost = reckoning.judge(simd, (&old, &new.read()), activation.w, found);
        let (offset, old_d) = (&mut offset[..size.inputs], &mut d.0[..size.entries]);
        self.shapes.gather(simd, (&eight, &sample.x[..size.inputs]), (offset, old_d));
        let by = Descent { offset, d: old_d, activation, cost };
        let depth = old.depth();
        let memories = (&reckoning.h[..depth], &reckoning.r[..depth]);
        let learned = rules.learned(size.entries);
        let old_metric = self.fields.rows(simd, &eight, 0..learned, room);
        let new_d = &mut d.1[..size.entries];
        let mask = rules.descend(simd, (old_metric, &mut *metric), new_d, (&by, mask));
        let mask = finite(simd, finite(simd, mask, memories.0), memories.1);
        new.remember(simd, mask, memories);
        self.shapes.scatter(simd, (&eight, mask), new_d);
        self.fields.replace(simd, (&eight, mask), 0, &metric[..learned]);
    }

    /// Takes over what the fields of `mask` have learned, but for their metrics.
    #[inline(always)]
    fn take_over<S: Simd>(
        &mut self,
        simd: S,
        (eight, size): (&Eight, Size),
        (counts, mask): (Lanes<S>, Mask<S>),
        end: usize,
    ) {
        let depth = (end - size.height(0)) / size.projection();
        let (mut start, mut has) = (size.metric(), mask);
        for j in 1..=depth {
            #[expect(clippy::cast_precision_loss, reason = "at most 64 projections")]
            let has_next = mask & counts.simd_gt(j as f64);
            // Projections that the same fields have go together.
            if j < depth && (has & !has_next).all_false() {
                continue;
            }
            let rows = &self.shop.next[start..size.height(j)];
            self.fields.replace(simd, (eight, has), start, rows);
            (start, has) = (size.height(j), has_next);
        }
    }

    /// Gives the fields of these bits, which have just learned a sample, one projection more.
    #[cold]
    fn add_projections(&mut self, eight: &Eight, bits: u64) {
        let (size, settings) = (self.shop.size, self.settings);
        for lane in (0..LANES).filter(|lane| bits >> lane & 1 == 1) {
            let field = eight[lane];
            let count = self.fields.number(field, size.base_scalar(COUNT));
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
            let axis = count as usize;
            if self.fields.height() < size.height(axis + 1) {
                self.fields.extend(&Projection::new(axis, settings).to_column());
            }
            // It counts the sample that it was born of, from nothing.
            let (tau, end) = (settings.tau_lambda, settings.final_lambda);
            let lambda = tau * settings.init_lambda + end * (1.0 - tau);
            self.fields.set(field, size.scalar(axis, N_DATA), 1.0);
            self.fields.set(field, size.scalar(axis, LAMBDA), lambda);
            self.fields.set(field, size.base_scalar(COUNT), count + 1.0);
            self.fields.set(field, size.base_scalar(SS_P), 0.0);
        }
    }
}

/// Hears all fields of one output about a normalised input.
pub struct Consult<'a> {
    /// Where the fields are.
    pub shapes: &'a Shapes,
    /// What they know.
    pub fields: &'a Store,
    /// The workshop, for what follows from the settings.
    pub shop: &'a Workshop,
    /// The input.
    pub x: &'a [f64],
    /// Whether the variance is wanted too.
    pub variance: bool,
}

/// Room for what predictions need of so many inputs: a base or a projection, with its scalars.
const fn room_for(inputs: usize) -> usize {
    padded(2 * inputs + 10)
}

impl Work for Consult<'_> {
    type Output = Voices;

    #[inline(always)]
    fn with<S: Simd>(self, simd: S) -> Voices {
        if self.x.len() <= FEW_INPUTS {
            const ROOM: usize = room_for(FEW_INPUTS);
            self.hear(simd, (&mut [Row::ZERO; ROOM], &mut [Row::ZERO; FEW_INPUTS]))
        } else {
            const ROOM: usize = room_for(MAX_INPUTS);
            self.hear(simd, (&mut [Row::ZERO; ROOM], &mut [Row::ZERO; MAX_INPUTS]))
        }
    }
}

impl Consult<'_> {
    #[inline(always)]
    fn hear<S: Simd>(self, simd: S, (room, residual): (&mut [Row], &mut [Row])) -> Voices {
        let Self { shapes, fields, shop: &Workshop { size, ref window, .. }, x, variance } = self;
        let (residual, zero) = (&mut residual[..x.len()], all(simd, 0.0));
        let (mut sum_w, mut sum_wy, mut sum_wy2) = (zero, zero, zero);
        let mut search = Search::new(simd, fields.gathers());
        while let Some(Group { eight, q }) = search.next(simd, (shapes, window), x) {
            let w = window.activation(q);
            let range = size.metric()..size.metric() + size.base_to_predict();
            let base = fields.rows(simd, &eight, range, &mut room[..size.base()]);
            let mut speech = Speech::begin(simd, size, base, (x, residual));
            for j in 0..most(base[COUNT]) {
                let range = size.height(j)..size.height(j + 1);
                let room = &mut room[..size.projection()];
                speech.hear(simd, j, fields.rows(simd, &eight, range, room));
            }
            let speaking = window.counts(w) & speech.trustworthy & speech.y.is_finite();
            sum_w += speaking.select(w, zero);
            sum_wy += speaking.select(w * speech.y, zero);
            if variance {
                let squares = speech.variance(w) + speech.y * speech.y;
                sum_wy2 += speaking.select(w * squares, zero);
            }
        }
        let [first, _] = window.strongest(simd, search.nearest(simd, shapes, x));
        Voices {
            sum_w: total(sum_w),
            sum_wy: total(sum_wy),
            sum_wy2: total(sum_wy2),
            max_activation: first.map_or(0.0, |(_, w)| w),
        }
    }
}
