//! What holds of the learners whatever they are fed.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

#[path = "learner/feed.rs"]
mod feed;

use coadapt::learner::rfwr::{InitialMetric, Rfwr, Settings};
use coadapt::learner::{Learner, Model, Refusal};
use feed::{LIMIT, MOST_FIELDS, Sample, Setup};
use feed::{metrics, sample, setups, stored, tame_stream, wild, wild_stream};
use nalgebra::{DMatrix, SymmetricEigen, Vector2};
use proptest::prelude::*;

/// A learner of tame functions with fields along the axes.
const PLAIN: Setup = Setup {
    is_lwpr: false,
    inputs: 3,
    outputs: 1,
    diag_only: true,
    update_d: true,
    meta: false,
    bi_square: false,
    init_p: 1e5,
    limited: false,
};

fn learn(model: &mut Model, setup: Setup, sample: &Sample) -> Result<(), Refusal> {
    model.update(&sample.x[..setup.inputs], &sample.y[..setup.outputs], sample.weight)
}

fn predict(model: &Model, x: &[f64]) -> Vec<f64> {
    let mut y = vec![f64::NAN; model.outputs()];
    model.predict(&x[..model.inputs()], &mut y);
    y
}

fn trained(setup: Setup, samples: &[Sample]) -> Model {
    let mut model = setup.build();
    for sample in samples {
        learn(&mut model, setup, sample).unwrap();
    }
    model
}

/// The largest activations and the outputs that an update of `model` tells of.
fn told(model: &mut Model, x: &[f64], y: &[f64], weight: f64) -> (Vec<f64>, Vec<f64>) {
    match model {
        Model::Rfwr(rfwr) => {
            let update = rfwr.learn(x, y, weight).unwrap();
            let activations = vec![update.max_activation, update.second_activation];
            (activations, update.output.to_vec())
        }
        Model::Lwpr(lwpr) => {
            let update = lwpr.learn(x, y, weight).unwrap();
            let both = update.changes.iter().flat_map(|c| [c.max_activation, c.second_activation]);
            (both.collect(), update.output.to_vec())
        }
    }
}

/// Whether `d` measures distances. Rounding may cost a full one the last of its definiteness.
fn is_metric(d: &[f64], setup: Setup) -> bool {
    let n = setup.inputs;
    if d.len() == n {
        return d.iter().all(|d| *d > 0.0 && d.is_finite());
    }
    let most = d.iter().fold(0.0_f64, |most, d| most.max(d.abs()));
    let matrix = DMatrix::from_row_slice(n, n, d) / most;
    let least = if setup.limited && n < 3 { 0.0 } else { -1e-13 };
    matrix == matrix.transpose()
        && matrix.diagonal().iter().all(|d| *d > 0.0)
        && SymmetricEigen::new(matrix).eigenvalues.iter().all(|value| *value >= least)
}

fn check_queries(model: &Model, setup: Setup, queries: &[[f64; 3]]) -> Result<(), TestCaseError> {
    let most = if setup.limited { LIMIT } else { f64::MAX };
    let m = setup.outputs;
    for x in queries {
        let x = &x[..setup.inputs];
        let mut y = vec![f64::NAN; m];
        let activation = model.predict(x, &mut y);
        prop_assert!((0.0..=1.0).contains(&activation), "{activation} at {x:?}");
        prop_assert!(y.iter().all(|y| y.abs() <= most), "{y:?} at {x:?}");
        let Model::Lwpr(lwpr) = model else { continue };
        let (mut again, mut conf, mut max_w) = (y.clone(), vec![f64::NAN; m], vec![f64::NAN; m]);
        lwpr.predict_with_confidence(x, &mut again, &mut conf, &mut max_w);
        prop_assert_eq!(&again, &y);
        prop_assert!(conf.iter().all(|conf| (0.0..f64::INFINITY).contains(conf)), "{conf:?}");
        prop_assert_eq!(max_w.iter().copied().fold(0.0, f64::max), activation);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_stream_leaves_every_field_sound(
        setup in setups(),
        samples in wild_stream(),
        queries in prop::collection::vec([wild(300), wild(300), wild(300)], 20),
    ) {
        let (n, m) = (setup.inputs, setup.outputs);
        let most = if setup.limited { LIMIT } else { f64::MAX };
        let mut model = setup.build();
        for Sample { x, y, weight } in &samples {
            let (activations, output) = told(&mut model, &x[..n], &y[..m], *weight);
            prop_assert!(activations.iter().all(|w| (0.0..=1.0).contains(w)), "{activations:?}");
            prop_assert!(output.iter().all(|y| y.abs() <= most), "{output:?}");
        }
        for d in metrics(&model) {
            prop_assert!(is_metric(&d, setup), "{d:?}");
        }
        // What is not finite is stored as nothing, which no reader takes for a number.
        let before = stored(&model);
        prop_assert!(serde_json::from_str::<Model>(&before).is_ok());
        check_queries(&model, setup, &queries)?;
        let seen = samples.iter().map(|Sample { x, .. }| [x[0], x[1], x[2]]);
        check_queries(&model, setup, &seen.collect::<Vec<_>>())?;
        let beyond = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX];
        check_queries(&model, setup, &beyond.map(|x| [x, 0.5, x]))?;
        prop_assert!(stored(&model) == before, "a prediction changed the learner");
    }

    #[test]
    fn the_cap_on_fields_is_never_passed(setup in setups(), samples in wild_stream()) {
        let setup = Setup { limited: true, ..setup };
        let submodels = if setup.is_lwpr { setup.outputs } else { 1 };
        let mut model = setup.build();
        for sample in &samples {
            learn(&mut model, setup, sample).unwrap();
            prop_assert!(model.fields() <= MOST_FIELDS as usize * submodels);
        }
        if let Model::Lwpr(lwpr) = &model {
            let most = lwpr.submodels().iter().map(|submodel| submodel.fields().len()).max();
            prop_assert!(most.unwrap() <= MOST_FIELDS as usize);
        }
    }

    #[test]
    fn what_is_not_finite_is_refused_and_leaves_no_trace(
        setup in setups(),
        samples in wild_stream(),
        poison in prop::collection::vec((0..150_usize, 0..3_usize, 0..3_usize), 1..20),
    ) {
        let mut pure = trained(setup, &samples);
        let mut model = setup.build();
        let mut refused = 0;
        for (k, sample) in samples.iter().enumerate() {
            for (_, what, place) in poison.iter().filter(|(at, ..)| at % samples.len() == k) {
                let mut bad = sample.clone();
                let value = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][*what];
                match place {
                    0 => bad.x[*what % setup.inputs] = value,
                    1 => bad.y[*what % setup.outputs] = value,
                    _ => bad.weight = value,
                }
                prop_assert_eq!(learn(&mut model, setup, &bad), Err(Refusal::NotFinite));
                refused += 1;
                bad = Sample { weight: -1.0, ..sample.clone() };
                prop_assert_eq!(learn(&mut model, setup, &bad), Err(Refusal::NegativeWeight));
            }
            learn(&mut model, setup, sample).unwrap();
        }
        prop_assert_eq!(refused, poison.len());
        prop_assert!(stored(&model) == stored(&pure), "a refused sample left a trace");
        let learned = |model: &Model| match model {
            Model::Rfwr(rfwr) => rfwr.samples(),
            Model::Lwpr(lwpr) => lwpr.samples(),
        };
        prop_assert_eq!(learned(&model), samples.len() as u64);
        // Nor did it leave one that is not stored.
        learn(&mut model, setup, &samples[0]).unwrap();
        learn(&mut pure, setup, &samples[0]).unwrap();
        prop_assert!(stored(&model) == stored(&pure));
    }

    #[test]
    fn a_reloaded_learner_learns_on_as_if_never_saved(
        setup in setups(),
        tame in tame_stream(0..100),
        samples in wild_stream(),
        saved_at in 0.0..1.0,
    ) {
        let all = [tame, samples].concat();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a place in a short list"
        )]
        let (before, after) = all.split_at((saved_at * all.len() as f64) as usize);
        let mut model = trained(setup, before);
        let text = stored(&model);
        let mut reloaded: Model = serde_json::from_str(&text).unwrap();
        prop_assert!(stored(&reloaded) == text, "stored in another way");
        for sample in after {
            learn(&mut model, setup, sample).unwrap();
            learn(&mut reloaded, setup, sample).unwrap();
            let said = (predict(&model, &sample.x), predict(&reloaded, &sample.x));
            prop_assert_eq!(said.0, said.1);
        }
        prop_assert!(stored(&model) == stored(&reloaded), "learned on in another way");
    }

    /// Exactly where outputs do not meet: in LWPR, and in RFWR while metrics are fixed. A
    /// metric of RFWR learns from the sum over outputs, which rounds by its order.
    #[test]
    fn permuted_outputs_give_permuted_results(
        (is_lwpr, update_d, diag_only) in any::<(bool, bool, bool)>(),
        samples in tame_stream(100..200),
        order in Just(vec![0, 1, 2]).prop_shuffle(),
    ) {
        let setup = Setup { is_lwpr, outputs: 3, diag_only, update_d, ..PLAIN };
        let permuted: Vec<_> = samples
            .iter()
            .map(|sample| Sample { y: permute(&sample.y, &order), ..sample.clone() })
            .collect();
        let (straight, permuted) = (trained(setup, &samples), trained(setup, &permuted));
        prop_assert_eq!(straight.fields(), permuted.fields());
        let tolerance = if is_lwpr || !update_d { 0.0 } else { 1e-6 };
        for sample in &samples {
            let y = permute(&predict(&straight, &sample.x), &order);
            prop_assert!(are_near(&y, &predict(&permuted, &sample.x), tolerance));
        }
    }

    /// To rounding, where fields are aligned with the axes: the factor M of a full metric is
    /// triangular in the order of the inputs, and learns by it.
    #[test]
    fn permuted_inputs_give_the_same_rfwr(
        (update_d, meta) in any::<(bool, bool)>(),
        samples in tame_stream(100..200),
        order in Just(vec![0, 1, 2]).prop_shuffle(),
    ) {
        let setup = Setup { update_d, meta, ..PLAIN };
        let permuted: Vec<_> = samples
            .iter()
            .map(|sample| Sample { x: permute(&sample.x, &order), ..sample.clone() })
            .collect();
        let (straight, other) = (trained(setup, &samples), trained(setup, &permuted));
        prop_assert_eq!(straight.fields(), other.fields());
        for (sample, permuted) in samples.iter().zip(&permuted) {
            let (y, same) = (predict(&straight, &sample.x), predict(&other, &permuted.x));
            prop_assert!(are_near(&y, &same, 1e-6), "{y:?} and {same:?}");
        }
    }

    /// Of what a field sees: inputs and outputs relative to their means so far.
    #[test]
    fn a_field_with_a_fixed_metric_is_weighted_least_squares(
        samples in tame_stream(40..300),
        (init_lambda, tau_lambda) in (0.9..1.0, 0.9..1.0),
        d in 0.1..1.5,
    ) {
        let settings = Settings {
            update_d: false,
            init_d: InitialMetric::Scalar(d),
            init_lambda,
            tau_lambda,
            final_lambda: 0.999,
            init_p: 1e6,
            w_gen: 0.001,
            ..Settings::new(2, 1)
        };
        let mut rfwr = Rfwr::new(settings).unwrap();
        for sample in &samples {
            rfwr.learn(&sample.x[..2], &sample.y[..1], sample.weight).unwrap();
        }
        let field = rfwr.field_states().first().unwrap().regression.clone();
        let batch = batch(&samples, (d, 1e6), (init_lambda, tau_lambda, 0.999));
        prop_assert_eq!(rfwr.fields(), 1);
        let error = (batch - Vector2::from_row_slice(&field.slopes)).norm();
        prop_assert!(error <= 1e-6 * batch.norm().max(1.0), "{:?} for {batch:?}", field.slopes);
    }
}

/// The slopes of all samples but the founding first, solved for at once.
fn batch(
    samples: &[Sample],
    (d, init_p): (f64, f64),
    (mut lambda, tau, end): (f64, f64, f64),
) -> Vector2<f64> {
    let xs: Vec<_> = samples.iter().map(|sample| Vector2::new(sample.x[0], sample.x[1])).collect();
    let (mut kept, mut weights, mut seen) = (1.0, Vec::new(), Vec::new());
    for (sample, x) in samples.iter().zip(&xs).skip(1) {
        // Forgetting wears all earlier weights alike.
        for weight in &mut weights {
            *weight *= lambda;
        }
        kept *= lambda;
        weights.push(sample.weight * (-0.5 * d * (x - xs[0]).norm_squared()).exp());
        let all: f64 = weights.iter().sum();
        let so_far = || weights.iter().zip(samples.iter().zip(&xs).skip(1));
        let mean_x: Vector2<f64> = so_far().map(|(w, (_, x))| x * *w).sum::<Vector2<f64>>() / all;
        let mean_y = so_far().map(|(w, (sample, _))| w * sample.y[0]).sum::<f64>() / all;
        seen.push((x - mean_x, sample.y[0] - mean_y));
        lambda = tau * lambda + end * (1.0 - tau);
    }
    // One row a sample, and one a slope that holds it at 0 with the prior's strength.
    let rows = seen.len();
    let mut inputs = DMatrix::zeros(rows + 2, 2);
    let mut outputs = DMatrix::zeros(rows + 2, 1);
    for (k, ((x, y), weight)) in seen.iter().zip(&weights).enumerate() {
        inputs.row_mut(k).copy_from(&(x.transpose() * weight.sqrt()));
        outputs[(k, 0)] = y * weight.sqrt();
    }
    for i in 0..2 {
        inputs[(rows + i, i)] = f64::sqrt(kept / init_p);
    }
    let slopes = inputs.svd(true, true).solve(&outputs, 1e-15).unwrap();
    Vector2::new(slopes[(0, 0)], slopes[(1, 0)])
}

fn permute(values: &[f64], order: &[usize]) -> Vec<f64> {
    order.iter().map(|&from| values[from]).collect()
}

fn are_near(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

/// A field of LWPR starts with its projections along the first axes, which matters ever less.
#[test]
fn permuted_inputs_give_nearly_the_same_lwpr() {
    let setup = Setup { is_lwpr: true, inputs: 2, update_d: false, ..PLAIN };
    let (mut straight, mut permuted) = (setup.build(), setup.build());
    let mut learn = |from: u32, to: u32| {
        for k in from..to {
            let (x, y) = sample(k);
            straight.update(&x, &y, 1.0).unwrap();
            permuted.update(&[x[1], x[0]], &y, 1.0).unwrap();
        }
        let apart = |k| {
            let (x, _) = sample(k);
            (predict(&straight, &x)[0] - predict(&permuted, &[x[1], x[0]])[0]).abs()
        };
        (0..400).map(apart).fold(0.0, f64::max)
    };
    let (early, late) = (learn(0, 300), learn(300, 16_000));
    assert!(early < 0.1 && late < 0.002, "{early}, then {late}");
}
