//! How well the learners learn the cross function: the table of `docs/LEARNERS.md`.
//!
//! ```sh
//! cargo run --release --example accuracy
//! ```
//!
//! Inputs uniform in [−1, 1]², noise of standard deviation 0.1, no cap on fields. The nMSE is
//! the mean squared error on a noise-free 41 × 41 grid over the variance there. The seeds
//! were not used to choose the settings.

#[path = "common/cross.rs"]
mod cross;

use std::error::Error;
use std::io::{self, ErrorKind, Write};

use coadapt::learner::lwpr::Lwpr;
use coadapt::learner::rfwr::Rfwr;
use coadapt::learner::{BuildError, Learner, Model};
use cross::{Bending, CROSS, FINE, W_GEN, grid_nmse, lwpr_settings, rfwr_settings};

const SEEDS: [u64; 5] = [1, 2, 3, 4, 5];
/// After how many samples the learner is judged.
const MOMENTS: [usize; 3] = [1_000, 10_000, 100_000];

/// One line of settings.
struct Row {
    learner: &'static str,
    build: fn(Bending) -> Result<Model, BuildError>,
    bending: Bending,
    /// The most that the median may be in the end.
    target: f64,
}

const ROWS: [Row; 3] = [
    Row { learner: "lwpr", build: lwpr, bending: FINE, target: 0.0025 },
    Row { learner: "rfwr", build: rfwr, bending: FINE, target: 0.005 },
    Row {
        learner: "rfwr",
        build: rfwr,
        bending: Bending { init_alpha: 250.0, penalty: 1e-7, meta: true },
        target: 0.005,
    },
];

fn lwpr(bending: Bending) -> Result<Model, BuildError> {
    Ok(Model::Lwpr(Lwpr::new(lwpr_settings(bending))?))
}

fn rfwr(bending: Bending) -> Result<Model, BuildError> {
    Ok(Model::Rfwr(Rfwr::new(rfwr_settings(bending))?))
}

/// The nMSE and the number of fields at a moment.
#[derive(Clone, Copy, Default)]
struct Standing {
    nmse: f64,
    fields: usize,
}

/// Learns from the samples of one seed, judged at every moment.
fn learn(row: &Row, seed: u64) -> Result<[Standing; MOMENTS.len()], Box<dyn Error>> {
    let mut model = (row.build)(row.bending)?;
    let mut samples = CROSS.samples(seed);
    let mut standings = [Standing::default(); MOMENTS.len()];
    let mut learned = 0;
    for (standing, moment) in standings.iter_mut().zip(MOMENTS) {
        for (x, y) in samples.by_ref().take(moment - learned) {
            model.update(&x, &[y], 1.0)?;
        }
        learned = moment;
        *standing = Standing { nmse: grid_nmse(&model), fields: model.fields() };
    }
    Ok(standings)
}

/// The middle one of an odd number of values.
fn median<T: PartialOrd + Copy>(values: impl Iterator<Item = T>) -> Option<T> {
    let mut values: Vec<T> = values.collect();
    values.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    values.get(values.len() / 2).copied()
}

fn print(out: &mut impl Write) -> Result<(), Box<dyn Error>> {
    writeln!(out, "cross function, noise 0.1, w_gen {W_GEN}, init_d {}, full D", CROSS.init_d)?;
    writeln!(out, "nMSE on the 41 x 41 grid\n")?;
    write!(out, "{:<8}{:>6} {:>8}{:>5}  {:>7}", "learner", "alpha", "penalty", "meta", "samples")?;
    for seed in SEEDS {
        write!(out, "  {:>6}", format!("seed {seed}"))?;
    }
    writeln!(out, "   {:>6}  {:>6}", "median", "fields")?;
    for row in &ROWS {
        print_row(out, row)?;
    }
    Ok(())
}

fn print_row(out: &mut impl Write, row: &Row) -> Result<(), Box<dyn Error>> {
    let learned: Vec<_> =
        SEEDS.iter().map(|&seed| learn(row, seed)).collect::<Result<_, Box<dyn Error>>>()?;
    let Bending { init_alpha, penalty, meta } = row.bending;
    let meta = if meta { "yes" } else { "no" };
    let mut last = f64::NAN;
    for (at, moment) in MOMENTS.iter().enumerate() {
        write!(out, "{:<8}{init_alpha:>6} {penalty:>8e}{meta:>5}  {moment:>7}", row.learner)?;
        for standings in &learned {
            write!(out, "  {:.4}", standings[at].nmse)?;
        }
        last = median(learned.iter().map(|standings| standings[at].nmse)).unwrap_or(f64::NAN);
        let fields = median(learned.iter().map(|standings| standings[at].fields)).unwrap_or(0);
        writeln!(out, "   {last:.4}  {fields:>6}")?;
    }
    let verdict = if last <= row.target { "reached" } else { "MISSED" };
    writeln!(out, "{:>38} at most {:.4}: {verdict}\n", "wanted", row.target)?;
    out.flush()?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    match print(&mut io::stdout().lock()) {
        // Whoever read has seen enough.
        Err(error) if is_closed_pipe(&*error) => Ok(()),
        result => result,
    }
}

fn is_closed_pipe(error: &(dyn Error + 'static)) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
}
