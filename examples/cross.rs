//! The learners as a library: one of them learns the cross function from noisy samples, and
//! draws what it has come to, as text of 80 columns.
//!
//! ```sh
//! cargo run --release --example cross -- --learner rfwr --samples 3000 --seed 7
//! ```
//!
//! Everything a program of one's own needs is in `learn`: settings, a learner, samples.

#[path = "common/cross.rs"]
mod cross;
#[path = "cross/picture.rs"]
mod picture;

use std::error::Error;
use std::io::{self, ErrorKind, Write};

use clap::{Parser, ValueEnum};
use coadapt::learner::lwpr::Lwpr;
use coadapt::learner::rfwr::Rfwr;
use coadapt::learner::{Learner, Model};
use cross::{Bending, CROSS, grid_nmse, lwpr_settings, rfwr_settings};
use picture::{Canvas, Ellipse, maps};

/// Learn the cross function and draw the receptive fields.
#[derive(Debug, Parser)]
struct Options {
    /// Which learner
    #[arg(long, value_enum, default_value_t = Kind::Lwpr)]
    learner: Kind,
    /// How many samples it learns
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(1..))]
    samples: u32,
    /// The seed of the samples
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The penalty on narrow fields: less of it gives more and smaller ones
    #[arg(long, default_value_t = 1e-6)]
    penalty: f64,
    /// The activation at which fields are outlined
    #[arg(long, default_value_t = 0.4, value_parser = outline)]
    outline: f64,
    /// Draw the fields with plain letters instead of dots
    #[arg(long)]
    ascii: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Kind {
    Lwpr,
    Rfwr,
}

/// Reads an activation that has an outline.
fn outline(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(w) if (0.001..1.0).contains(&w) => Ok(w),
        _ => Err("an activation is a number from 0.001 to below 1".to_owned()),
    }
}

/// Lets a new learner learn.
fn learn(options: &Options) -> Result<Model, Box<dyn Error>> {
    let bending = Bending { init_alpha: CROSS.init_alpha, penalty: options.penalty, meta: true };
    let mut model = match options.learner {
        Kind::Lwpr => Model::Lwpr(Lwpr::new(lwpr_settings(bending))?),
        Kind::Rfwr => Model::Rfwr(Rfwr::new(rfwr_settings(bending))?),
    };
    for (_, (x, y)) in (0..options.samples).zip(CROSS.samples(options.seed)) {
        model.update(&x, &[y], 1.0)?;
    }
    Ok(model)
}

/// The outlines of all fields where their activation is `w`.
fn outlines(model: &Model, w: f64) -> Vec<Ellipse> {
    match model {
        Model::Rfwr(rfwr) => (0..rfwr.fields())
            .map(|field| Ellipse::new(rfwr.centre(field), rfwr.metric(field), w))
            .collect(),
        Model::Lwpr(lwpr) => {
            let Some(submodel) = lwpr.submodels().first() else { return Vec::new() };
            (0..lwpr.fields())
                .map(|field| Ellipse::new(submodel.centre(field), submodel.metric(field), w))
                .collect()
        }
    }
}

fn show(out: &mut impl Write, options: &Options) -> Result<(), Box<dyn Error>> {
    let model = learn(options)?;
    let predict = |x: [f64; 2]| {
        let mut y = [0.0];
        model.predict(&x, &mut y);
        y[0]
    };
    let truth = |x: [f64; 2]| cross::cross(&x);
    writeln!(out, "{}", maps(&[("the function", &truth), ("as learned", &predict)]))?;
    let mut canvas = Canvas::new();
    for ellipse in outlines(&model, options.outline) {
        canvas.draw(&ellipse);
    }
    let Options { learner, samples, seed, outline, .. } = options;
    let fields = model.fields();
    writeln!(out, "{fields} receptive fields, outlined where their activation is {outline}")?;
    writeln!(out, "{}", if options.ascii { canvas.plain() } else { canvas.dotted() })?;
    let name = format!("{learner:?}").to_uppercase();
    let nmse = grid_nmse(&model);
    writeln!(out, "{name}, {samples} samples, seed {seed}: {fields} fields, nMSE {nmse:.4}")?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    match show(&mut io::stdout().lock(), &Options::parse()) {
        // Whoever read has seen enough.
        Err(error) if is_closed_pipe(&*error) => Ok(()),
        result => result,
    }
}

fn is_closed_pipe(error: &(dyn Error + 'static)) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
}
