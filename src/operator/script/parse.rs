//! From a script's bytes to its tables, with every fault at its line and column.

use std::collections::BTreeMap;

use ron::value::RawValue;
use serde::Deserialize;

use super::{Address, Faults, PhaseWord, Row};

type Tables = BTreeMap<Address, Vec<Row>>;
type Spot = (usize, usize);

pub(super) fn tables(
    bytes: &[u8],
    is_ron: bool,
    phases: &[PhaseWord],
    faults: &mut Faults,
) -> Tables {
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text.strip_prefix('\u{feff}').unwrap_or(text),
        Err(error) => {
            let before = String::from_utf8_lossy(&bytes[..error.valid_up_to()]);
            faults.push(spot(&before, before.len()), "not UTF-8 text; save the table as UTF-8");
            return Tables::new();
        }
    };
    let mut builder = Builder { tables: Tables::new(), phases, faults };
    if is_ron {
        builder.read_ron(text);
    } else {
        builder.read_csv(text);
    }
    builder.tables
}

/// Line and column of the byte `offset`.
fn spot(text: &str, offset: usize) -> Spot {
    let before = &text[..offset];
    let line_start = before.rfind('\n').map_or(0, |end| end + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// A row as RON has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RonRow {
    t: f64,
    u: f64,
    #[serde(default)]
    phase: Option<String>,
    #[serde(default)]
    episode: Option<u32>,
}

struct Builder<'a> {
    tables: Tables,
    phases: &'a [PhaseWord],
    faults: &'a mut Faults,
}

#[expect(clippy::option_option, reason = "outer: could be read; inner: serves one, not all")]
impl Builder<'_> {
    fn read_ron(&mut self, text: &str) {
        let rows: Vec<&RawValue> = match ron::from_str(text) {
            Ok(rows) => rows,
            Err(error) => {
                let at = (error.span.start.line, error.span.start.col);
                self.faults.push(at, format!("{}; allowed is a list of rows", error.code));
                return;
            }
        };
        let options = ron::Options::default()
            .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
        // Rows come in the order of the text: places are counted on from row to row.
        let (mut offset, mut line, mut line_start) = (0, 1, 0);
        for row in rows {
            let row = row.trim().get_ron();
            // A row borrows from the text: its address says where it stands.
            let start = (row.as_ptr() as usize).saturating_sub(text.as_ptr() as usize);
            line += text[offset..start].matches('\n').count();
            line_start = text[offset..start].rfind('\n').map_or(line_start, |end| offset + end + 1);
            offset = start;
            let at = (line, text[line_start..start].chars().count() + 1);
            match options.from_str::<RonRow>(row) {
                Ok(RonRow { t, u, phase, episode }) => {
                    let t = self.finite("t", t, at);
                    let u = self.finite("u", u, at);
                    let phase = phase.map_or(Some(None), |word| self.phase(&word, at));
                    self.add(t, u, phase.map(|phase| (phase, episode)), at);
                }
                Err(error) => self.faults.push(
                    at,
                    format!(
                        "{}; allowed is (t: SECONDS, u: VALUE, phase: \"WORD\", episode: N)",
                        error.code
                    ),
                ),
            }
        }
    }

    fn read_csv(&mut self, text: &str) {
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let Some((index, header)) = lines.next() else {
            self.faults.push((1, 1), "the script is empty; allowed is a table with columns t,u");
            return;
        };
        let names: Vec<&str> = cells(header).map(|(_, cell)| cell).collect();
        let known = ["t", "u", "phase", "episode"];
        for (column, name) in cells(header) {
            if !known.contains(&name) || names.iter().filter(|other| **other == name).count() > 1 {
                let what = format!(
                    "column `{name}` is unknown or given twice; allowed are t,u,phase,episode"
                );
                self.faults.push((index + 1, column), what);
            }
        }
        let place = known.map(|name| names.iter().position(|other| *other == name));
        let [Some(t), Some(u), phase, episode] = place else {
            let missing = if place[0].is_none() { "t" } else { "u" };
            self.faults
                .push((index + 1, 1), format!("column {missing} is missing; t,u are needed"));
            return;
        };
        for (index, line) in lines {
            let row: Vec<(usize, &str)> = cells(line).collect();
            let at = |column: usize| (index + 1, row[column].0);
            if row.len() != names.len() {
                let what =
                    format!("the row has {} cells; the header has {}", row.len(), names.len());
                self.faults.push((index + 1, 1), what);
                continue;
            }
            let time = self.number("t", row[t].1, at(t));
            let value = self.number("u", row[u].1, at(u));
            let phase = phase.filter(|i| !row[*i].1.is_empty());
            let phase = phase.map_or(Some(None), |i| self.phase(row[i].1, at(i)));
            let episode = episode.filter(|i| !row[*i].1.is_empty());
            let episode = episode.map_or(Some(None), |i| self.episode(row[i].1, at(i)));
            self.add(time, value, phase.zip(episode), at(t));
        }
    }

    fn number(&mut self, name: &str, cell: &str, at: Spot) -> Option<f64> {
        self.finite_or(name, cell.parse().unwrap_or(f64::NAN), cell, at)
    }

    fn finite(&mut self, name: &str, value: f64, at: Spot) -> Option<f64> {
        self.finite_or(name, value, &value.to_string(), at)
    }

    fn finite_or(&mut self, name: &str, value: f64, given: &str, at: Spot) -> Option<f64> {
        if !value.is_finite() {
            self.faults.push(at, format!("{name} is `{given}`; allowed is a finite number"));
        }
        value.is_finite().then_some(value)
    }

    fn phase(&mut self, word: &str, at: Spot) -> Option<Option<u8>> {
        let number = self.phases.iter().find(|(name, _)| *name == word).map(|(_, n)| Some(*n));
        if number.is_none() {
            let words: Vec<&str> = self.phases.iter().map(|(name, _)| *name).collect();
            self.faults.push(at, format!("phase is `{word}`; allowed are {}", words.join(", ")));
        }
        number
    }

    fn episode(&mut self, cell: &str, at: Spot) -> Option<Option<u32>> {
        let number = cell.parse().ok().filter(|number| *number > 0);
        if number.is_none() {
            let what = format!("episode is `{cell}`; allowed is a whole number from 1");
            self.faults.push(at, what);
        }
        number.map(Some)
    }

    /// Adds a row if all of it could be read and its time comes after that before it.
    fn add(&mut self, t: Option<f64>, u: Option<f64>, address: Option<Address>, at: Spot) {
        let (Some(t), Some(u), Some(address)) = (t, u, address) else { return };
        let table = self.tables.entry(address).or_default();
        match table.last() {
            Some(last) if t <= last.t => {
                let what =
                    format!("t is {t}; allowed is a time after {} of the row before", last.t);
                self.faults.push(at, what);
            }
            _ => table.push(Row { t, u: Some(u) }),
        }
    }
}

/// The cells of a CSV line with the columns they start at. Numbers and words hold no
/// comma, so quotes mean nothing but themselves and are taken off.
fn cells(line: &str) -> impl Iterator<Item = (usize, &str)> {
    line.split(',').scan(1, |column, cell| {
        let start = *column;
        *column += cell.chars().count() + 1;
        Some((start, cell.trim().trim_matches('"')))
    })
}
