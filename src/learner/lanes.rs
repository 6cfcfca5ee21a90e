//! Eight fields at a time.
//!
//! Fields learn alone, and by the same equations. So eight of them share a *block*: every
//! quantity is a [`Row`] of eight numbers, one a field, and one instruction of the vector
//! unit (two or four of a narrower one) does for eight fields what the equation says for one.
//!
//! No operation here is approximate, and none depends on the machine: all vector units, and
//! the plain code where there is none, give the same bits. (Where a processor cannot multiply
//! and add at once, [`fused`] is slow instead.)

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f64x8, i64x8, mask64x8};

/// How many fields share a block.
pub const LANES: usize = 8;

/// Eight fields.
pub type Eight = [usize; LANES];

/// One number of each of eight fields, in a register.
pub type Lanes<S> = f64x8<S>;
/// One decision for each of eight fields.
pub type Mask<S> = mask64x8<S>;

/// One number of each of eight fields, in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Row(pub [f64; LANES]);

impl Row {
    /// Zeros.
    pub const ZERO: Self = Self([0.0; LANES]);

    /// The numbers.
    #[inline(always)]
    pub fn get<S: Simd>(&self, simd: S) -> Lanes<S> {
        self.0.simd_into(simd)
    }

    /// Replaces the numbers.
    #[inline(always)]
    pub fn set<S: Simd>(&mut self, lanes: Lanes<S>) {
        self.0 = lanes.into();
    }
}

/// Rows that can be cut in two, to be read or to be written.
pub trait Cut: Sized {
    /// The first `count` rows, and the others.
    fn cut(self, count: usize) -> (Self, Self);
}

impl<T> Cut for &[T] {
    #[inline(always)]
    fn cut(self, count: usize) -> (Self, Self) {
        self.split_at(count)
    }
}

impl<T> Cut for &mut [T] {
    #[inline(always)]
    fn cut(self, count: usize) -> (Self, Self) {
        self.split_at_mut(count)
    }
}

/// `value` for all eight fields.
#[inline(always)]
pub fn all<S: Simd>(simd: S, value: f64) -> Lanes<S> {
    Lanes::splat(simd, value)
}

/// a b + c, rounded once.
#[inline(always)]
pub fn fused<S: Simd>(a: Lanes<S>, b: Lanes<S>, c: Lanes<S>) -> Lanes<S> {
    if !fuses(a.simd.level()) {
        return fused_one_by_one([a.into(), b.into(), c.into()]).simd_into(a.simd);
    }
    a.mul_add(b, c)
}

/// Whether a vector unit multiplies and adds at once; known when code is compiled for it.
#[inline(always)]
fn fuses(level: Level) -> bool {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    return level.as_avx2().is_some();
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    return !level.is_fallback();
}

#[cold]
fn fused_one_by_one([a, b, c]: [[f64; LANES]; 3]) -> [f64; LANES] {
    std::array::from_fn(|lane| a[lane].mul_add(b[lane], c[lane]))
}

/// c − a b, rounded once.
#[inline(always)]
pub fn without<S: Simd>(c: Lanes<S>, a: Lanes<S>, b: Lanes<S>) -> Lanes<S> {
    fused(-a, b, c)
}

/// The sum of products.
#[inline(always)]
pub fn dot<S: Simd>(simd: S, a: &[Row], b: &[Row]) -> Lanes<S> {
    let mut sum = all(simd, 0.0);
    for (a, b) in a.iter().zip(b) {
        sum = fused(a.get(simd), b.get(simd), sum);
    }
    sum
}

/// Writes a symmetric matrix, kept as what is on and above its diagonal by rows, times `x`
/// into `v`, and returns v·x.
#[inline(always)]
pub fn multiply<S: Simd>(simd: S, v: &mut [Row], symmetric: &[Row], x: &[Row]) -> Lanes<S> {
    v.fill(Row::ZERO);
    let (mut rest, mut x_rest, mut v_rest) = (symmetric, x, v);
    let mut v_x = all(simd, 0.0);
    while let ([here, x_after @ ..], [v_here, v_after @ ..]) = (x_rest, v_rest) {
        let (row, below) = rest.split_at(x_after.len() + 1);
        let here = here.get(simd);
        let mut sum = fused(row[0].get(simd), here, v_here.get(simd));
        for ((p, x), v) in row[1..].iter().zip(x_after).zip(&mut *v_after) {
            let p = p.get(simd);
            sum = fused(p, x.get(simd), sum);
            v.set(fused(p, here, v.get(simd)));
        }
        v_here.set(sum);
        v_x = fused(sum, here, v_x);
        (rest, x_rest, v_rest) = (below, x_after, v_after);
    }
    v_x
}

/// Work for the vector unit.
pub trait Work {
    /// What comes of it.
    type Output;

    /// Does it. Must be inlined, as everything it calls: only then is it compiled for S.
    fn with<S: Simd>(self, simd: S) -> Self::Output;
}

/// Does `work` with the vector unit of the given level.
#[inline]
pub fn run<W: Work>(level: Level, work: W) -> W::Output {
    dispatch!(level, simd => work.with(simd))
}

/// e to the `x`, for `x` from −700 to 700; beyond it as at these ends. At most two units in
/// the last place off. NaN gives NaN.
///
/// x = k ln 2 + r with |r| ≤ ln 2 / 2, and e^r by its Taylor series up to r¹³/13!, whose
/// rest is below 5e-18.
#[inline(always)]
pub fn exp<S: Simd>(x: Lanes<S>) -> Lanes<S> {
    const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    // Adding this rounds to a whole number and leaves it in the lowest bits.
    const ROUNDER: f64 = 6_755_399_441_055_744.0;
    const BIAS: i64 = 1023;
    let simd = x.simd;
    let in_range = x.max(all(simd, -700.0)).min(all(simd, 700.0));
    let rounded = fused(in_range, all(simd, std::f64::consts::LOG2_E), all(simd, ROUNDER));
    let k = rounded - ROUNDER;
    let r = without(without(in_range, k, all(simd, LN2_HIGH)), k, all(simd, LN2_LOW));
    let r2 = r * r;
    let r4 = r2 * r2;
    let first = fused(r2, line(r, 1.0 / 6.0, 0.5), line(r, 1.0, 1.0));
    let second = fused(r2, line(r, 1.0 / 5040.0, 1.0 / 720.0), line(r, 1.0 / 120.0, 1.0 / 24.0));
    let third = fused(
        r2,
        line(r, 1.0 / 39_916_800.0, 1.0 / 3_628_800.0),
        line(r, 1.0 / 362_880.0, 1.0 / 40_320.0),
    );
    let last = line(r, 1.0 / 6_227_020_800.0, 1.0 / 479_001_600.0);
    let power = fused(r4, fused(r4, fused(r4, last, third), second), first);
    let bits: i64x8<S> = rounded.bitcast();
    let scale: Lanes<S> = ((bits + i64x8::splat(simd, BIAS)) << 52).bitcast();
    x.is_nan().select(x, power * scale)
}

#[inline(always)]
fn line<S: Simd>(r: Lanes<S>, slope: f64, offset: f64) -> Lanes<S> {
    fused(r, all(r.simd, slope), all(r.simd, offset))
}

/// Where, within the mask, rows are finite. A number that is not finite makes a sum so too; a
/// sum of finite numbers may overflow as well, hence a closer look at a bad one.
#[inline(always)]
pub fn finite<S: Simd>(simd: S, mask: Mask<S>, rows: &[Row]) -> Mask<S> {
    let mut sums = [all(simd, 0.0); 4];
    let mut chunks = rows.chunks_exact(4);
    for chunk in &mut chunks {
        for (sum, row) in sums.iter_mut().zip(chunk) {
            *sum += row.get(simd);
        }
    }
    for (sum, row) in sums.iter_mut().zip(chunks.remainder()) {
        *sum += row.get(simd);
    }
    let sound = ((sums[0] + sums[1]) + (sums[2] + sums[3])).is_finite();
    if (mask & !sound).all_false() { mask } else { mask & finite_each(simd, rows) }
}

/// [`finite`], number by number.
#[cold]
fn finite_each<S: Simd>(simd: S, rows: &[Row]) -> Mask<S> {
    let mut sound = Mask::splat(simd, true);
    for lane in 0..LANES {
        sound.set(lane, rows.iter().all(|row| row.0[lane].is_finite()));
    }
    sound
}

/// The sum over the fields, in pairs, and pairs of pairs.
#[inline(always)]
pub fn total<S: Simd>(lanes: Lanes<S>) -> f64 {
    let Row([a, b, c, d, e, f, g, h]) = Row(lanes.into());
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    struct Exp([f64; LANES]);

    impl Work for Exp {
        type Output = [f64; LANES];

        #[inline(always)]
        fn with<S: Simd>(self, simd: S) -> [f64; LANES] {
            exp(self.0.simd_into(simd)).into()
        }
    }

    proptest! {
        #[test]
        fn exp_is_exact_to_two_units_in_the_last_place(x in prop::array::uniform8(-700.0..700.0)) {
            let ours = run(Level::new(), Exp(x));
            prop_assert_eq!(ours, run(Level::baseline(), Exp(x)), "all vector units agree");
            for (ours, x) in ours.into_iter().zip(x) {
                prop_assert!((ours / x.exp() - 1.0).abs() <= 4.5e-16, "exp({x}) = {ours}");
            }
        }
    }

    #[test]
    fn exp_at_its_ends() {
        let [zero, low, high, nan, ..] =
            run(Level::new(), Exp([0.0, -1e9, 1e9, f64::NAN, 1.0, 1.0, 1.0, 1.0]));
        assert_eq!(zero, 1.0);
        assert!((low, high) == ((-700.0_f64).exp(), 700.0_f64.exp()), "{low} {high}");
        assert!(nan.is_nan());
    }

    struct Finite<'a>(&'a [Row]);

    impl Work for Finite<'_> {
        type Output = u64;

        #[inline(always)]
        fn with<S: Simd>(self, simd: S) -> u64 {
            finite(simd, Mask::splat(simd, true), self.0).to_bitmask()
        }
    }

    #[test]
    fn what_is_not_finite_is_found_in_its_lane() {
        let mut rows = vec![Row([1.0, -1.0, f64::MAX, f64::MAX, 0.0, 0.0, 0.0, 0.0]); 7];
        assert_eq!(run(Level::new(), Finite(&rows)), 0b1111_1111, "sums may overflow");
        rows[2].0[1] = f64::NAN;
        rows[5].0[2] = f64::NEG_INFINITY;
        assert_eq!(run(Level::new(), Finite(&rows)), 0b1111_1001);
    }
}
