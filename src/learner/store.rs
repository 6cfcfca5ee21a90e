//! What fields know, and how eight of them are brought before the vector unit.

use std::ops::Range;

use fearless_simd::prelude::*;

use super::columns::Columns;
use super::lanes::{Eight, LANES, Mask, Row};
use super::records::Records;

/// Up to so many inputs fields are small compared with the space: few of them are active at
/// a time, and these pay for being gathered.
pub const FEW_INPUTS: usize = 6;

/// A table with the same numbers for every field.
#[derive(Clone, Debug)]
pub enum Store {
    /// A field after the other: those that are active are gathered, from wherever they are.
    Records(Records),
    /// Eight fields side by side: whole blocks are used as they lie.
    Columns(Columns),
}

/// Calls the same method of either.
macro_rules! either {
    ($store:expr, $table:ident => $call:expr) => {
        match $store {
            Store::Records($table) => $call,
            Store::Columns($table) => $call,
        }
    };
}

impl Store {
    /// No fields yet, of a learner of so many inputs. `blank` is what a field has beyond the
    /// numbers that it is given.
    pub fn new(inputs: usize, blank: Vec<f64>) -> Self {
        if inputs <= FEW_INPUTS {
            Self::Records(Records::new(&blank))
        } else {
            Self::Columns(Columns::new(blank))
        }
    }

    /// Whether any eight fields can be used together, and not only those of a block.
    pub fn gathers(&self) -> bool {
        matches!(self, Self::Records(_))
    }

    /// The number of fields.
    pub fn fields(&self) -> usize {
        either!(self, table => table.fields())
    }

    /// How many numbers a field has.
    pub fn height(&self) -> usize {
        either!(self, table => table.height())
    }

    /// The numbers of a field.
    pub fn column(&self, field: usize) -> Vec<f64> {
        either!(self, table => table.column(field))
    }

    /// A number of a field.
    pub fn number(&self, field: usize, at: usize) -> f64 {
        either!(self, table => table.number(field, at))
    }

    /// Changes a number of a field.
    pub fn set(&mut self, field: usize, at: usize, value: f64) {
        either!(self, table => table.set(field, at, value));
    }

    /// Appends a field with these numbers, and then blank ones.
    pub fn push(&mut self, numbers: &[f64]) {
        either!(self, table => table.push(numbers));
    }

    /// Removes `field`; the later ones move down.
    pub fn remove(&mut self, field: usize) {
        either!(self, table => table.remove(field));
    }

    /// Removes `field`; the last one takes its place.
    pub fn swap_remove(&mut self, field: usize) {
        either!(self, table => table.swap_remove(field));
    }

    /// Gives every field further numbers, all blank.
    pub fn extend(&mut self, more: &[f64]) {
        either!(self, table => table.extend(more));
    }

    /// The same number of eight fields.
    #[inline(always)]
    pub fn row(&self, eight: &Eight, at: usize) -> Row {
        match self {
            Self::Records(records) => {
                let mut row = Row::ZERO;
                for (number, &field) in row.0.iter_mut().zip(eight) {
                    *number = records.number(field, at);
                }
                row
            }
            Self::Columns(columns) => columns.block(eight[0] / LANES)[at],
        }
    }

    /// As many numbers of eight fields as there is room, of which those of `range` are valid;
    /// it starts at a multiple of four. The room, which is a multiple of four too, is used
    /// where they do not lie ready.
    #[inline(always)]
    pub fn rows<'a, S: Simd>(
        &'a self,
        simd: S,
        eight: &Eight,
        range: Range<usize>,
        room: &'a mut [Row],
    ) -> &'a [Row] {
        match self {
            Self::Records(records) => {
                records.gather(simd, eight, range, room);
                room
            }
            Self::Columns(columns) => &columns.block(eight[0] / LANES)[range.start..][..room.len()],
        }
    }

    /// The rows from `start` on that [`rows`](Self::rows) gave, and left in `room`.
    #[inline(always)]
    pub fn rows_again<'a>(&'a self, eight: &Eight, start: usize, room: &'a [Row]) -> &'a [Row] {
        match self {
            Self::Records(_) => room,
            Self::Columns(columns) => &columns.block(eight[0] / LANES)[start..][..room.len()],
        }
    }

    /// Replaces numbers of those of eight fields that the mask names, from `start` on, by
    /// rows. `start` and their number are multiples of four.
    #[inline(always)]
    pub fn replace<S: Simd>(
        &mut self,
        simd: S,
        (eight, mask): (&Eight, Mask<S>),
        start: usize,
        rows: &[Row],
    ) {
        either!(self, table => table.scatter(simd, (eight, mask), start, rows));
    }
}
