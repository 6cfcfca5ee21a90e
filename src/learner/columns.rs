//! Where the numbers of all fields are: in blocks of eight fields, a row a quantity.

use fearless_simd::prelude::*;

use super::lanes::{Eight, LANES, Mask, Row};

/// A table with a column a field. Fields 0 to 7 are the first block, 8 to 15 the second; a
/// block's rows lie one after the other, so that what a field needs lies close together.
#[derive(Clone, Debug)]
pub struct Columns {
    rows: Vec<Row>,
    /// The column of no field, which fills the last block up.
    blank: Vec<f64>,
    fields: usize,
}

impl Columns {
    /// No fields yet. `blank` is the column of none.
    pub fn new(blank: Vec<f64>) -> Self {
        Self { rows: Vec::new(), blank, fields: 0 }
    }

    /// The number of fields.
    pub fn fields(&self) -> usize {
        self.fields
    }

    /// The number of blocks.
    pub fn blocks(&self) -> usize {
        self.fields.div_ceil(LANES)
    }

    /// How many numbers a field has.
    pub fn height(&self) -> usize {
        self.blank.len()
    }

    /// The rows of a block.
    #[inline(always)]
    pub fn block(&self, block: usize) -> &[Row] {
        &self.rows[block * self.blank.len()..][..self.blank.len()]
    }

    /// The rows of a block, to be changed.
    #[inline(always)]
    pub fn block_mut(&mut self, block: usize) -> &mut [Row] {
        &mut self.rows[block * self.blank.len()..][..self.blank.len()]
    }

    /// A number of a field.
    pub fn number(&self, field: usize, row: usize) -> f64 {
        self.block(field / LANES)[row].0[field % LANES]
    }

    /// Changes a number of a field.
    pub fn set(&mut self, field: usize, row: usize, value: f64) {
        self.block_mut(field / LANES)[row].0[field % LANES] = value;
    }

    /// The numbers of a field.
    pub fn column(&self, field: usize) -> Vec<f64> {
        self.block(field / LANES).iter().map(|row| row.0[field % LANES]).collect()
    }

    /// Replaces the numbers of a field: as many as given, then blank ones.
    fn fill(&mut self, field: usize, numbers: &[f64]) {
        for row in 0..self.blank.len() {
            let number = numbers.get(row).or(self.blank.get(row));
            self.set(field, row, number.copied().unwrap_or(0.0));
        }
    }

    /// Appends a field with these numbers, and then blank ones.
    pub fn push(&mut self, numbers: &[f64]) {
        let field = self.fields;
        self.fields += 1;
        if field.is_multiple_of(LANES) {
            self.rows.extend(self.blank.iter().map(|&number| Row([number; LANES])));
        }
        self.fill(field, numbers);
    }

    /// Removes `field`; the later ones move down.
    pub fn remove(&mut self, field: usize) {
        for later in field + 1..self.fields {
            let numbers = self.column(later);
            self.fill(later - 1, &numbers);
        }
        self.pop();
    }

    /// Removes `field`; the last one takes its place.
    pub fn swap_remove(&mut self, field: usize) {
        let last = self.column(self.fields - 1);
        self.fill(field, &last);
        self.pop();
    }

    fn pop(&mut self) {
        self.fields -= 1;
        if self.fields.is_multiple_of(LANES) {
            self.rows.truncate(self.fields / LANES * self.blank.len());
        } else {
            self.fill(self.fields, &[]);
        }
    }

    /// Gives every field further numbers, all blank.
    pub fn extend(&mut self, more: &[f64]) {
        let mut taller = Self::new([&self.blank[..], more].concat());
        for field in 0..self.fields {
            taller.push(&self.column(field));
        }
        *self = taller;
    }

    /// Fills `into` with the numbers of eight fields from `start` on, a row a number.
    #[inline(always)]
    pub fn gather(&self, eight: &Eight, start: usize, into: &mut [Row]) {
        if is_block(eight) {
            into.copy_from_slice(&self.block(eight[0] / LANES)[start..][..into.len()]);
            return;
        }
        for (lane, &field) in eight.iter().enumerate() {
            let column = &self.block(field / LANES)[start..][..into.len()];
            for (into, row) in into.iter_mut().zip(column) {
                into.0[lane] = row.0[field % LANES];
            }
        }
    }

    /// Replaces numbers of those of eight fields that the mask names, from `start` on, by
    /// rows.
    #[inline(always)]
    pub fn scatter<S: Simd>(
        &mut self,
        simd: S,
        (eight, mask): (&Eight, Mask<S>),
        start: usize,
        rows: &[Row],
    ) {
        if is_block(eight) {
            for (old, new) in self.block_mut(eight[0] / LANES)[start..].iter_mut().zip(rows) {
                old.set(mask.select(new.get(simd), old.get(simd)));
            }
            return;
        }
        let bits = mask.to_bitmask();
        for (lane, &field) in eight.iter().enumerate() {
            if bits >> lane & 1 == 1 {
                let column = &mut self.block_mut(field / LANES)[start..][..rows.len()];
                for (to, from) in column.iter_mut().zip(rows) {
                    to.0[field % LANES] = from.0[lane];
                }
            }
        }
    }
}

/// Whether eight fields are those of a block, in their order.
#[inline(always)]
fn is_block(eight: &Eight) -> bool {
    let first = eight[0];
    first.is_multiple_of(LANES) && eight.iter().enumerate().all(|(lane, &f)| f == first + lane)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(fields: u32) -> Columns {
        let mut columns = Columns::new(vec![f64::NAN, -1.0]);
        for field in 0..fields {
            columns.push(&[f64::from(field), f64::from(field) + 0.5]);
        }
        columns
    }

    fn first_numbers(columns: &Columns) -> Vec<f64> {
        (0..columns.fields()).map(|field| columns.number(field, 0)).collect()
    }

    #[test]
    fn removal_moves_the_later_fields_down() {
        let mut columns = filled(10);
        columns.remove(1);
        assert_eq!(first_numbers(&columns), [0.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
        assert_eq!(columns.column(8), [9.0, 9.5]);
        columns.remove(8);
        assert_eq!((columns.fields(), columns.blocks()), (8, 1));
    }

    #[test]
    fn a_swap_removal_moves_the_last_field_into_the_gap() {
        let mut columns = filled(10);
        columns.swap_remove(0);
        assert_eq!(first_numbers(&columns), [9.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        columns.swap_remove(8);
        assert_eq!(first_numbers(&columns), [9.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    }

    #[test]
    fn the_place_of_no_field_is_blank() {
        let mut columns = filled(10);
        columns.remove(0);
        let blank = columns.block(1)[0].0;
        assert!(blank[1..].iter().all(|number| number.is_nan()), "{blank:?}");
    }

    #[test]
    fn further_numbers_are_blank() {
        let mut columns = filled(9);
        columns.extend(&[7.0]);
        assert_eq!(columns.column(8), [8.0, 8.5, 7.0]);
        columns.push(&[9.0]);
        assert_eq!(columns.column(9), [9.0, -1.0, 7.0]);
    }
}
