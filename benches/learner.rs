//! What an update and a prediction of RFWR cost, on noisy samples of functions learned
//! before: two inputs (the cross function) and four (a linear policy).

use std::hint::black_box;

use coadapt::learner::Learner;
use coadapt::learner::rfwr::{InitialMetric, Rfwr, Settings};
use coadapt::random::{Place, Purpose, stream};
use criterion::{Criterion, criterion_group, criterion_main};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

type Sample<const N: usize> = ([f64; N], [f64; 1]);

fn cross([a, b]: [f64; 2]) -> f64 {
    let ridges = (-10.0 * a * a).exp().max((-50.0 * b * b).exp());
    ridges.max(1.25 * (-5.0 * (a * a + b * b)).exp())
}

fn policy(x: [f64; 4]) -> f64 {
    (2.4 * x[0] + 5.4 * x[1] + 5.25 * x[2] + 13.5 * x[3]) / 10.0
}

fn sample<const N: usize>(
    rng: &mut ChaCha8Rng,
    function: fn([f64; N]) -> f64,
    noise: f64,
) -> Sample<N> {
    let x = std::array::from_fn(|_| rng.random_range(-1.0..=1.0));
    let error: f64 = rng.sample(StandardNormal);
    (x, [function(x) + noise * error])
}

fn measure<const N: usize>(
    criterion: &mut Criterion,
    name: &str,
    settings: Settings,
    (function, noise, practice): (fn([f64; N]) -> f64, f64, u32),
) {
    let mut rng = stream(1, Purpose::Starts, Place::default());
    let Ok(mut rfwr) = Rfwr::new(settings) else { return };
    for _ in 0..practice {
        let (x, y) = sample(&mut rng, function, noise);
        let _ = rfwr.update(&x, &y, 1.0);
    }
    let fresh: Vec<Sample<N>> = (0..10_000).map(|_| sample(&mut rng, function, noise)).collect();
    let mut group = criterion.benchmark_group(format!("{name}, {} fields", rfwr.fields()));
    let mut queries = fresh.iter().cycle();
    group.bench_function("predict", |b| {
        let mut y = [0.0];
        b.iter(|| queries.next().map(|(x, _)| rfwr.predict(black_box(x), &mut y)));
    });
    let mut samples = fresh.iter().cycle();
    group.bench_function("update", |b| {
        b.iter(|| samples.next().map(|(x, y)| rfwr.update(black_box(x), y, 1.0)));
    });
    group.finish();
}

/// A chain of exponentials, each waiting for the one before: what machines are compared by.
fn calibration(criterion: &mut Criterion) {
    let mut value = 0.5_f64;
    criterion.bench_function("calibration, exp", |b| {
        b.iter(|| {
            value = (-value).exp();
            value
        });
    });
}

fn learners(criterion: &mut Criterion) {
    for diag_only in [true, false] {
        let rules = |n, d, init_alpha| Settings {
            diag_only,
            meta: !diag_only,
            penalty: 1e-6,
            init_alpha,
            init_d: InitialMetric::Scalar(d),
            w_gen: 0.2,
            w_prune: 1.0,
            ..Settings::new(n, 1)
        };
        let shape = if diag_only { "diagonal" } else { "full, meta" };
        let two = (cross as fn([f64; 2]) -> f64, 0.1, 20_000);
        measure(criterion, &format!("rfwr 2-D {shape}"), rules(2, 50.0, 250.0), two);
        let four = (policy as fn([f64; 4]) -> f64, 0.05, 10_000);
        measure(criterion, &format!("rfwr 4-D {shape}"), rules(4, 7.0, 20.0), four);
    }
}

criterion_group!(benches, calibration, learners);
criterion_main!(benches);
