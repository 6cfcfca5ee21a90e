//! What each field knows, one record after the other: for fields of which few are active at a
//! time, and those few are gathered to be used.

use std::ops::Range;

use fearless_simd::f64x4;
use fearless_simd::prelude::*;

use super::lanes::{Eight, LANES, Mask, Row};

/// So many numbers of a field lie together.
const CHUNK: usize = 4;

/// So many numbers, filled up to whole chunks.
pub const fn padded(numbers: usize) -> usize {
    numbers.next_multiple_of(CHUNK)
}

#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct Chunk([f64; CHUNK]);

impl Chunk {
    #[inline(always)]
    fn get<S: Simd>(&self, simd: S) -> f64x4<S> {
        self.0.simd_into(simd)
    }
}

/// A table with a record a field: numbers one after the other, filled up to whole chunks.
#[derive(Clone, Debug)]
pub struct Records {
    /// The records, and after them room for eight that are nobody's.
    chunks: Vec<Chunk>,
    /// The record of a field that was given nothing.
    blank: Vec<Chunk>,
    /// How many numbers a field has.
    height: usize,
    fields: usize,
}

fn pack(numbers: &[f64]) -> Vec<Chunk> {
    let chunk = |part: &[f64]| Chunk(std::array::from_fn(|k| part.get(k).copied().unwrap_or(0.0)));
    numbers.chunks(CHUNK).map(chunk).collect()
}

/// Rows become columns.
#[inline(always)]
fn transpose<S: Simd>([a, b, c, d]: [f64x4<S>; CHUNK]) -> [f64x4<S>; CHUNK] {
    let ((a_c, a_c_2), (b_d, b_d_2)) = (a.interleave(c), b.interleave(d));
    let ((first, second), (third, fourth)) = (a_c.interleave(b_d), a_c_2.interleave(b_d_2));
    [first, second, third, fourth]
}

impl Records {
    /// No fields yet. `blank` is what a record has beyond the numbers that it is given.
    pub fn new(blank: &[f64]) -> Self {
        Self { chunks: Vec::new(), blank: pack(blank), height: blank.len(), fields: 0 }
    }

    /// The number of fields.
    pub fn fields(&self) -> usize {
        self.fields
    }

    /// How many numbers a field has.
    pub fn height(&self) -> usize {
        self.height
    }

    #[inline(always)]
    fn range(&self, field: usize) -> Range<usize> {
        field * self.blank.len()..(field + 1) * self.blank.len()
    }

    #[inline(always)]
    fn record(&self, field: usize) -> &[Chunk] {
        &self.chunks[self.range(field)]
    }

    #[inline(always)]
    fn part(&self, field: usize, chunks: &Range<usize>) -> &[Chunk] {
        &self.chunks[field * self.blank.len() + chunks.start..][..chunks.end - chunks.start]
    }

    /// A number of a field.
    #[inline(always)]
    pub fn number(&self, field: usize, at: usize) -> f64 {
        self.record(field)[at / CHUNK].0[at % CHUNK]
    }

    /// Changes a number of a field.
    pub fn set(&mut self, field: usize, at: usize, value: f64) {
        let range = self.range(field);
        self.chunks[range][at / CHUNK].0[at % CHUNK] = value;
    }

    /// The numbers of a field.
    pub fn column(&self, field: usize) -> Vec<f64> {
        self.record(field).iter().flat_map(|chunk| chunk.0).take(self.height).collect()
    }

    /// Appends a field with these numbers, and then blank ones.
    pub fn push(&mut self, numbers: &[f64]) {
        let place = self.range(self.fields);
        self.fields += 1;
        self.make_room();
        self.chunks[place].copy_from_slice(&self.blank);
        for (at, &number) in numbers.iter().enumerate() {
            self.set(self.fields - 1, at, number);
        }
    }

    /// Room for the fields, and for eight more that are nobody's.
    fn make_room(&mut self) {
        self.chunks.resize((self.fields + LANES) * self.blank.len(), Chunk([0.0; CHUNK]));
    }

    /// Removes `field`; the later ones move down.
    pub fn remove(&mut self, field: usize) {
        self.chunks.drain(self.range(field));
        self.fields -= 1;
        self.make_room();
    }

    /// Removes `field`; the last one takes its place.
    pub fn swap_remove(&mut self, field: usize) {
        self.fields -= 1;
        let last = self.range(self.fields);
        self.chunks.copy_within(last, field * self.blank.len());
        self.make_room();
    }

    /// Gives every field further numbers, all blank.
    pub fn extend(&mut self, more: &[f64]) {
        let blank: Vec<f64> = self.blank.iter().flat_map(|chunk| chunk.0).collect();
        let mut longer = Self::new(&[&blank[..self.height], more].concat());
        for field in 0..self.fields {
            longer.push(&self.column(field));
        }
        *self = longer;
    }

    /// Fills `rows` with numbers of eight fields: those of `range`, which starts with a chunk,
    /// and any others of its last chunk.
    #[inline(always)]
    pub fn gather<S: Simd>(&self, simd: S, eight: &Eight, range: Range<usize>, rows: &mut [Row]) {
        let chunks = range.start / CHUNK..range.end.div_ceil(CHUNK);
        let rows = &mut rows[..chunks.len() * CHUNK];
        let [a, b, c, d, e, f, g, h] = *eight;
        let (a, b) = (self.part(a, &chunks), self.part(b, &chunks));
        let (c, d) = (self.part(c, &chunks), self.part(d, &chunks));
        let (e, f) = (self.part(e, &chunks), self.part(f, &chunks));
        let (g, h) = (self.part(g, &chunks), self.part(h, &chunks));
        for (k, rows) in rows.chunks_exact_mut(CHUNK).enumerate() {
            let [low_a, low_b, low_c, low_d] =
                transpose([a[k].get(simd), b[k].get(simd), c[k].get(simd), d[k].get(simd)]);
            let [high_a, high_b, high_c, high_d] =
                transpose([e[k].get(simd), f[k].get(simd), g[k].get(simd), h[k].get(simd)]);
            rows[0].set(simd.combine_f64x4(low_a, high_a));
            rows[1].set(simd.combine_f64x4(low_b, high_b));
            rows[2].set(simd.combine_f64x4(low_c, high_c));
            rows[3].set(simd.combine_f64x4(low_d, high_d));
        }
    }

    /// Replaces numbers of those of eight fields that the mask names, from `start` on, by rows.
    /// `start` and their number are whole chunks.
    #[inline(always)]
    pub fn scatter<S: Simd>(
        &mut self,
        simd: S,
        (eight, mask): (&Eight, Mask<S>),
        start: usize,
        rows: &[Row],
    ) {
        let (bits, nobody) = (mask.to_bitmask(), self.fields);
        let mut places = *eight;
        for (lane, place) in places.iter_mut().enumerate() {
            // What nobody wants is written where nobody is: cheaper than a decision a chunk.
            if bits >> lane & 1 == 0 {
                *place = nobody + lane;
            }
        }
        let chunks = start / CHUNK..(start + rows.len()) / CHUNK;
        // Fails only if a field were named twice.
        let Some(parts) = self.parts(places, &chunks) else { return };
        let [a, b, c, d, e, f, g, h] = parts;
        for (k, rows) in rows.chunks_exact(CHUNK).enumerate() {
            let (low_a, high_a) = simd.split_f64x8(rows[0].get(simd));
            let (low_b, high_b) = simd.split_f64x8(rows[1].get(simd));
            let (low_c, high_c) = simd.split_f64x8(rows[2].get(simd));
            let (low_d, high_d) = simd.split_f64x8(rows[3].get(simd));
            [a[k], b[k], c[k], d[k]] = as_chunks(transpose([low_a, low_b, low_c, low_d]));
            [e[k], f[k], g[k], h[k]] = as_chunks(transpose([high_a, high_b, high_c, high_d]));
        }
    }

    /// These chunks of the records at eight places.
    #[inline(always)]
    fn parts(&mut self, places: Eight, chunks: &Range<usize>) -> Option<[&mut [Chunk]; LANES]> {
        let stride = self.blank.len();
        let [a, b, c, d, e, f, g, h] = places;
        if !(a < b && b < c && c < d && d < e && e < f && f < g && g < h) {
            let ranges =
                places.map(|place| place * stride + chunks.start..place * stride + chunks.end);
            return self.chunks.get_disjoint_mut(ranges).ok();
        }
        // Fields are found in their order, so mostly one walk will do.
        let mut records = self.chunks.chunks_exact_mut(stride);
        let part = chunks.clone();
        Some([
            &mut records.nth(a)?[part.clone()],
            &mut records.nth(b - a - 1)?[part.clone()],
            &mut records.nth(c - b - 1)?[part.clone()],
            &mut records.nth(d - c - 1)?[part.clone()],
            &mut records.nth(e - d - 1)?[part.clone()],
            &mut records.nth(f - e - 1)?[part.clone()],
            &mut records.nth(g - f - 1)?[part.clone()],
            &mut records.nth(h - g - 1)?[part],
        ])
    }
}

#[inline(always)]
fn as_chunks<S: Simd>([a, b, c, d]: [f64x4<S>; CHUNK]) -> [Chunk; CHUNK] {
    [Chunk(a.into()), Chunk(b.into()), Chunk(c.into()), Chunk(d.into())]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learner::lanes::{Lanes, Work, run};
    use fearless_simd::Level;

    fn filled(fields: u32) -> Records {
        let mut records = Records::new(&[0.0, -1.0]);
        for field in 0..fields {
            records.push(&[f64::from(field)]);
        }
        records
    }

    fn first_numbers(records: &Records) -> Vec<f64> {
        (0..records.fields()).map(|field| records.number(field, 0)).collect()
    }

    #[test]
    fn what_is_not_given_is_blank() {
        let mut records = filled(2);
        assert_eq!(records.column(1), [1.0, -1.0]);
        records.extend(&[7.0, 8.0, 9.0]);
        assert_eq!(records.column(1), [1.0, -1.0, 7.0, 8.0, 9.0]);
        records.push(&[5.0]);
        assert_eq!(records.column(2), [5.0, -1.0, 7.0, 8.0, 9.0]);
    }

    #[test]
    fn removal_moves_the_later_fields_down_or_the_last_one_in() {
        let mut records = filled(6);
        records.remove(1);
        assert_eq!(first_numbers(&records), [0.0, 2.0, 3.0, 4.0, 5.0]);
        records.swap_remove(0);
        assert_eq!(first_numbers(&records), [5.0, 2.0, 3.0, 4.0]);
        records.swap_remove(3);
        assert_eq!(first_numbers(&records), [5.0, 2.0, 3.0]);
    }

    struct Negate<'a>(&'a mut Records, Eight, [f64; LANES]);

    impl Work for Negate<'_> {
        type Output = Vec<Row>;

        #[inline(always)]
        fn with<S: Simd>(self, simd: S) -> Vec<Row> {
            let Self(records, eight, wanted) = self;
            let wanted: Lanes<S> = wanted.simd_into(simd);
            let mut rows = vec![Row::ZERO; 8];
            records.gather(simd, &eight, 4..7, &mut rows[4..]);
            let negative: Vec<Row> = rows.iter().map(|row| Row(row.0.map(|x| -x))).collect();
            records.scatter(simd, (&eight, wanted.simd_gt(0.0)), 4, &negative[4..]);
            rows
        }
    }

    #[test]
    fn records_become_rows_and_records_again() {
        let mut records = Records::new(&[0.0; 8]);
        for field in 0..9 {
            let numbers: Vec<f64> = (0..8).map(|at| f64::from(10 * field + at)).collect();
            records.push(&numbers);
        }
        let eight = [4, 0, 2, 1, 8, 7, 6, 5];
        let wanted = [1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
        let rows = run(Level::new(), Negate(&mut records, eight, wanted));
        for (at, row) in rows.iter().enumerate().skip(4) {
            #[expect(clippy::cast_precision_loss)]
            let expected = eight.map(|field| (10 * field + at) as f64);
            assert_eq!(row.0, expected);
        }
        assert_eq!(records.column(8), [80.0, 81.0, 82.0, 83.0, -84.0, -85.0, -86.0, -87.0]);
        assert_eq!(records.column(0)[4..], [4.0, 5.0, 6.0, 7.0], "not wanted");
    }
}
