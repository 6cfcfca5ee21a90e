//! The local regressions of eight fields learn a sample, or predict.

use fearless_simd::prelude::*;

use super::field::{
    Base, COUNT, H, LAMBDA, N_DATA, NEARLY_NOTHING, OFFSET, PER_S2, ProjectionRows, R, SS_P,
    SS_Y_RES, SUM_E_CV2, SUM_E2, SUM_W, Size, TRUSTWORTHY,
};
use super::settings::Settings;
use super::speech::{Speech, count, counts, enough};
use crate::learner::lanes::{Cut, Lanes, Mask, Row, all, fused};
use crate::learner::settings::MAX_INPUTS;

/// What [`ripeness`] must exceed for errors to be counted and shapes learned.
const RIPE: f64 = 0.1;
/// The same for a projection before the next one is added.
const RIPE_FOR_NEXT: f64 = 0.5;
/// A projection with a smaller count has not seen any sample.
const FRESH: f64 = 0.5;
/// A projection has seen as much as the first one when its count is this share of it.
const AS_MUCH: f64 = 0.99;

/// What the regressions found about a sample, for the metric; every eight fields
/// overwrite it.
#[derive(Clone, Debug)]
pub struct Findings {
    /// What is left of x − x̄ (n).
    residual: Vec<Row>,
    /// s (up to n), in the end with the new U and P.
    pub s: Vec<Row>,
    /// The errors before learning, of projections 1 to j together (up to n).
    e_cvs: Vec<Row>,
    /// 1 / Σ ws² of each projection (up to n).
    pub per_s2: Vec<Row>,
    /// The error before learning, of the projections that count.
    pub e_cv: Row,
    /// Their error after it.
    pub e: Row,
    /// The fields' predictions of the sample.
    pub y: Row,
}

/// A normalised sample and the activations of eight fields times its weight.
#[derive(Clone, Copy)]
pub struct Given<'a, S: Simd> {
    /// The inputs (n).
    pub x: &'a [f64],
    /// The output.
    pub y: f64,
    /// The weighted activations.
    pub w: Lanes<S>,
}

/// The regressions of eight fields, to be read or written.
pub struct Rows<T> {
    /// How many of what there are.
    size: Size,
    /// The rows of the base.
    base: T,
    /// The rows of the projections that any of the fields has.
    projections: T,
}

impl Findings {
    /// Room for `n` inputs.
    pub fn new(n: usize) -> Self {
        let room = || vec![Row::ZERO; n];
        Self {
            residual: room(),
            s: room(),
            e_cvs: room(),
            per_s2: room(),
            e_cv: Row::ZERO,
            e: Row::ZERO,
            y: Row::ZERO,
        }
    }
}

/// How far a count has come, where 1 is as far as a forgetting factor lets it come.
#[inline(always)]
fn ripeness<S: Simd>(n_data: Lanes<S>, lambda: Lanes<S>) -> Lanes<S> {
    n_data * (all(lambda.simd, 1.0) - lambda)
}

impl<T: Cut> Rows<T> {
    /// What `rows` are: all but the metric.
    #[inline(always)]
    pub fn new(size: Size, rows: T) -> Self {
        let (base, projections) = rows.cut(size.base());
        Self { size, base, projections }
    }
}

impl<'a> Rows<&'a [Row]> {
    /// The base.
    #[inline(always)]
    pub fn base(&self) -> Base<&'a [Row]> {
        self.size.cut_base(self.base)
    }

    /// How many projections there are.
    #[inline(always)]
    pub fn depth(&self) -> usize {
        self.projections.len() / self.size.projection()
    }

    /// Projection `j`.
    #[inline(always)]
    pub fn projection(&self, j: usize) -> ProjectionRows<&'a [Row]> {
        let height = self.size.projection();
        self.size.cut_projection(&self.projections[j * height..][..height])
    }

    /// Where fields may speak.
    #[inline(always)]
    pub fn trustworthy<S: Simd>(&self, simd: S) -> Mask<S> {
        self.base[TRUSTWORTHY].get(simd).simd_gt(0.0)
    }

    /// The first projection's scalars.
    #[inline(always)]
    pub fn first<S: Simd>(&self, simd: S, scalar: usize) -> Lanes<S> {
        self.projections[scalar].get(simd)
    }

    /// Where projection `j` with so many samples counts in predictions.
    #[inline(always)]
    fn counts<S: Simd>(&self, simd: S, j: usize, n_data: Lanes<S>) -> Mask<S> {
        counts(self.size, self.base[COUNT].get(simd) - count(j), n_data)
    }

    /// Where there is a projection `j`.
    #[inline(always)]
    pub fn has<S: Simd>(&self, simd: S, j: usize) -> Mask<S> {
        self.base[COUNT].get(simd).simd_gt(count(j))
    }

    /// Where there is a projection `j` that has seen enough for errors to be counted and shapes
    /// learned.
    #[inline(always)]
    pub fn knows<S: Simd>(&self, simd: S, j: usize) -> Mask<S> {
        self.has(simd, j) & self.is_ripe(simd, self.projection(j).scalar(simd, N_DATA))
    }

    /// Where projection `j` is the last one.
    #[inline(always)]
    fn ends<S: Simd>(&self, simd: S, j: usize) -> Mask<S> {
        self.base[COUNT].get(simd).simd_eq(count(j) + 1.0)
    }

    /// Where a projection of so many samples has seen enough for errors to be counted and shapes
    /// learned.
    #[inline(always)]
    pub fn is_ripe<S: Simd>(&self, simd: S, n_data: Lanes<S>) -> Mask<S> {
        ripeness(n_data, self.first(simd, LAMBDA)).simd_gt(RIPE)
    }

    /// The sum of squared errors of the last projection that counts, of the first in any
    /// case, and its sum of weights. Which count is told by the numbers of samples in
    /// `counted`.
    #[inline(always)]
    pub fn spread<S: Simd>(&self, simd: S, counted: &Self) -> (Lanes<S>, Lanes<S>) {
        let mut last = (all(simd, 0.0), all(simd, 1.0));
        for j in 0..self.depth() {
            let (projection, counted) = (self.projection(j), counted.projection(j));
            let here = (projection.scalar(simd, SUM_E_CV2), projection.scalar(simd, SUM_W));
            if j == 0 {
                last = here;
                continue;
            }
            let counts = self.counts(simd, j, counted.scalar(simd, N_DATA));
            last = (counts.select(here.0, last.0), counts.select(here.1, last.1));
        }
        last
    }

    /// What the fields say at `x`.
    #[inline(always)]
    pub fn predict<S: Simd>(&self, simd: S, x: &[f64]) -> Lanes<S> {
        let mut room = [Row::ZERO; MAX_INPUTS];
        let mut speech = Speech::begin(simd, self.size, self.base, (x, &mut room[..x.len()]));
        for (j, rows) in self.projections.chunks_exact(self.size.projection()).enumerate() {
            speech.hear(simd, j, rows);
        }
        speech.y
    }
}

impl Rows<&mut [Row]> {
    /// These rows, to be read.
    #[inline(always)]
    pub fn read(&self) -> Rows<&[Row]> {
        Rows { size: self.size, base: self.base, projections: self.projections }
    }

    /// The base.
    #[inline(always)]
    fn base(&mut self) -> Base<&mut [Row]> {
        self.size.cut_base(&mut *self.base)
    }

    /// Projection `j`.
    #[inline(always)]
    fn projection(&mut self, j: usize) -> ProjectionRows<&mut [Row]> {
        let height = self.size.projection();
        self.size.cut_projection(&mut self.projections[j * height..][..height])
    }

    /// Becomes what comes after the `old` regressions and the sample. What was found on the
    /// way is left in `found`.
    #[inline(always)]
    pub fn learn<S: Simd>(
        &mut self,
        simd: S,
        old: &Rows<&[Row]>,
        given: Given<'_, S>,
        (found, settings): (&mut Findings, &Settings),
    ) {
        let yz = self.move_means(simd, old, given, found);
        let zero = all(simd, 0.0);
        let (mut forgetting, mut cost, mut fitted) = (zero, zero, zero);
        let mut target = yz;
        for j in 0..old.depth() {
            let before = old.projection(j);
            let has = old.has(simd, j);
            let s = has.select(before.see(simd, j, &found.residual[..old.size.inputs]), zero);
            let pull = s * before.scalar(simd, PER_S2);
            fitted = fused(before.scalar(simd, SS_Y_RES), pull, fitted);
            forgetting = has.select(before.scalar(simd, LAMBDA), forgetting);
            let heard = (given.w, s, target);
            let residual = (&mut found.residual[..old.size.inputs], settings);
            let per_s2 = self.projection(j).learn(simd, &before, heard, residual);
            found.per_s2[j].set(per_s2);
            // At a projection's first sample, it accounts for the input of its axis.
            let fresh = before.scalar(simd, N_DATA).simd_lt(FRESH);
            let along = found.residual[j].get(simd);
            found.residual[j].set(fresh.select(along - s, along));
            cost = fused(given.w * s * (given.w * s), per_s2, cost);
            target = yz - fitted;
            found.e_cvs[j].set(target);
        }
        let remembered = old.base[SS_P].get(simd);
        self.base[SS_P].set(forgetting * remembered + cost);
        self.base[COUNT] = old.base[COUNT];
        self.note_errors(simd, old, (given, yz, forgetting), found);
    }

    /// The weighted means and variances with the sample, and the sample relative to them.
    #[inline(always)]
    fn move_means<S: Simd>(
        &mut self,
        simd: S,
        old: &Rows<&[Row]>,
        given: Given<'_, S>,
        found: &mut Findings,
    ) -> Lanes<S> {
        let remembered = old.first(simd, LAMBDA) * old.first(simd, SUM_W);
        let shares = all(simd, 1.0) / (remembered + given.w);
        let (old, new) = (old.base(), self.base());
        let before = old.mean.iter().zip(old.var);
        let after = new.mean.iter_mut().zip(new.var);
        for ((before, after), (xz, &x)) in
            before.zip(after).zip(found.residual.iter_mut().zip(given.x))
        {
            let x = all(simd, x);
            let mean = fused(remembered, before.0.get(simd), given.w * x) * shares;
            let z = x - mean;
            after.0.set(mean);
            after.1.set(fused(remembered, before.1.get(simd), given.w * (z * z)) * shares);
            xz.set(z);
        }
        let y = all(simd, given.y);
        let offset = (remembered * old.scalars[OFFSET].get(simd) + given.w * y) * shares;
        new.scalars[OFFSET].set(offset);
        y - offset
    }

    /// Notes how far off the fit was before and is after the sample.
    #[inline(always)]
    fn note_errors<S: Simd>(
        &mut self,
        simd: S,
        old: &Rows<&[Row]>,
        (given, yz, forgetting): (Given<'_, S>, Lanes<S>, Lanes<S>),
        found: &mut Findings,
    ) {
        let w = given.w;
        let ripe = old.is_ripe(simd, old.first(simd, N_DATA));
        let zero = all(simd, 0.0);
        let (mut fitted, mut e_cv) = (zero, yz);
        {
            let new = self.read();
            let mean = new.base().mean;
            for ((residual, mean), &x) in found.residual.iter_mut().zip(mean).zip(given.x) {
                residual.set(all(simd, x) - mean.get(simd));
            }
            for j in 0..old.depth() {
                let (projection, before) = (new.projection(j), old.projection(j));
                let residual = &mut found.residual[..old.size.inputs];
                let s = projection.see(simd, j, residual);
                let pull = s * projection.scalar(simd, PER_S2);
                found.s[j].set(s);
                projection.account(simd, pull, residual);
                let counts = old.counts(simd, j, before.scalar(simd, N_DATA));
                let said = projection.scalar(simd, SS_Y_RES) * pull;
                fitted += counts.select(said, zero);
                e_cv = counts.select(found.e_cvs[j].get(simd), e_cv);
            }
        }
        for j in 0..old.depth() {
            let before = old.projection(j);
            let e_cv = found.e_cvs[j].get(simd);
            let (sum, lambda) = (before.scalar(simd, SUM_E_CV2), before.scalars[LAMBDA]);
            let counted = fused(lambda.get(simd), sum, w * e_cv * e_cv);
            self.projection(j).scalars[SUM_E_CV2].set(ripe.select(counted, sum));
        }
        let e = yz - fitted;
        let base = self.base();
        let sum = old.base[SUM_E2].get(simd);
        base.scalars[SUM_E2].set(ripe.select(forgetting * sum + w * e * e, sum));
        let seen = old.first(simd, N_DATA).simd_gt(enough(old.size));
        let trustworthy = (old.trustworthy(simd) | seen).select(all(simd, 1.0), zero);
        base.scalars[TRUSTWORTHY].set(trustworthy);
        found.e.set(e);
        found.e_cv.set(e_cv);
        found.y.set(fitted + base.scalars[OFFSET].get(simd));
    }

    /// Takes over the memories H and r found with the sample, where the mask says so.
    #[inline(always)]
    pub fn remember<S: Simd>(&mut self, simd: S, mask: Mask<S>, (h, r): (&[Row], &[Row])) {
        for (j, (h, r)) in h.iter().zip(r).enumerate() {
            let scalars = self.projection(j).scalars;
            for (at, new) in [(H, h), (R, r)] {
                scalars[at].set(mask.select(new.get(simd), scalars[at].get(simd)));
            }
        }
    }
}

impl Rows<&[Row]> {
    /// Where, after a sample, the last projection is well known and has lowered the error
    /// enough for another to be tried. The counts are those in `old`, before the sample.
    #[inline(always)]
    pub fn wants_projection<S: Simd>(
        &self,
        simd: S,
        old: &Rows<&[Row]>,
        settings: &Settings,
    ) -> Mask<S> {
        let mut wanting = Mask::splat(simd, false);
        let room = self.base[COUNT].get(simd).simd_lt(count(settings.inputs));
        if room.all_false() {
            return wanting;
        }
        let mut error_before = all(simd, 0.0);
        for j in 0..old.depth() {
            let (projection, before) = (self.projection(j), old.projection(j));
            let error = projection.scalar(simd, SUM_E_CV2) / projection.scalar(simd, SUM_W)
                + NEARLY_NOTHING;
            let n_data = before.scalar(simd, N_DATA);
            let lambda = before.scalar(simd, LAMBDA);
            if j > 0 {
                wanting |= room
                    & self.ends(simd, j)
                    & error.simd_lt(error_before * settings.add_threshold)
                    & n_data.simd_gt(old.first(simd, N_DATA) * AS_MUCH)
                    & ripeness(n_data, lambda).simd_gt(RIPE_FOR_NEXT);
            }
            error_before = error;
        }
        wanting
    }
}
