//! RFWR against golden runs of the first author's program, and its promises.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking, helpers too")]

#[path = "learner/feed.rs"]
mod feed;
#[path = "learner/golden.rs"]
mod golden;

use coadapt::learner::rfwr::{Growth, InitialMetric, Rfwr, Settings};
use coadapt::learner::{Kernel, Learner, Model, Params};
use feed::{sample, stored};
use golden::{agree, numbers, read, table};
use serde_json::Value;

const CASES: [&str; 6] = [
    "rfwr/a_1d",
    "rfwr/b_2d_cross_diag",
    "rfwr/c_2d_cross_full_meta",
    "rfwr/d_4d_cartpole",
    "rfwr/e_2d_2out_bisquare",
    "rfwr/f_1d_rate_halving",
];

fn settings(case: &str) -> Settings {
    let case: Value = serde_json::from_str(&read(case, "case.json")).unwrap();
    let number = |key: &str| case[key].as_f64().unwrap();
    let count = |key: &str| usize::try_from(case[key].as_u64().unwrap()).unwrap();
    let rows: Vec<_> = case["init_D"].as_array().unwrap().iter().map(numbers).collect();
    let diag_only = count("diag_only") == 1;
    let diagonal = (0..rows.len()).map(|i| rows[i][i]).collect();
    Settings {
        kernel: if case["kernel"] == "BiSquare" { Kernel::BiSquare } else { Kernel::Gaussian },
        diag_only,
        meta: count("meta") == 1,
        meta_rate: number("meta_rate"),
        penalty: number("penalty"),
        init_alpha: numbers(&case["init_alpha"])[0],
        init_d: if diag_only {
            InitialMetric::Diagonal(diagonal)
        } else {
            InitialMetric::Full(rows)
        },
        norm_in: numbers(&case["norm_in"]),
        norm_out: numbers(&case["norm_out"]),
        w_gen: number("w_gen"),
        w_prune: number("w_prune"),
        init_lambda: number("init_lambda"),
        final_lambda: number("final_lambda"),
        tau_lambda: number("tau_lambda"),
        init_p: number("init_P"),
        vif_trust: number("vif_trust"),
        vif_update: number("vif_update"),
        min_n_data_factor: number("min_n_data_factor"),
        cutoff: number("cutoff_update"),
        ..Settings::new(count("n_in"), count("n_out"))
    }
}

fn trained(case: &str) -> Rfwr {
    let settings = settings(case);
    let (n, m) = (settings.inputs, settings.outputs);
    let trace = table(case, "trace.csv.gz");
    let mut rfwr = Rfwr::new(settings).unwrap();
    let (mut events, mut steps) = (Vec::new(), Vec::new());
    for (row, step) in table(case, "train.csv.gz").iter().zip(1_u32..) {
        let update = rfwr.learn(&row[..n], &row[n..n + m], 1.0).unwrap();
        let weights = [update.max_activation, update.second_activation];
        let event = match update.growth {
            Growth::None => None,
            Growth::Added { field, template } => {
                Some(("add", field, template.map_or("-1".to_owned(), |t| t.to_string())))
            }
            Growth::Pruned { field, survivor } => Some(("prune", field, survivor.to_string())),
        };
        let mut seen = update.output.to_vec();
        seen.push(update.max_activation);
        if let Some((kind, field, detail)) = event {
            events.push((format!("{step},{kind},{field},{detail}"), weights, rfwr.fields()));
        }
        if let Some(golden) = trace.iter().find(|golden| golden[0] == f64::from(step)) {
            assert_eq!(rfwr.fields().to_string(), golden[1].to_string(), "{case}, step {step}");
            assert_eq!(rfwr.pruned().to_string(), golden[2].to_string(), "{case}, step {step}");
            steps.push(seen);
        }
    }
    check_events(case, &events);
    let trace: Vec<_> = trace.iter().map(|row| row[3..].to_vec()).collect();
    agree(&format!("{case}: trace"), &trace, &steps, 1e-4);
    rfwr
}

fn check_events(case: &str, ours: &[(String, [f64; 2], usize)]) {
    let golden = read(case, "events.csv.gz");
    assert_eq!(golden.lines().skip(1).count(), ours.len(), "{case}: events");
    for (golden, (event, weights, fields)) in golden.lines().skip(1).zip(ours) {
        let cells: Vec<_> = golden.split(',').collect();
        assert_eq!(cells[..4].join(","), *event, "{case}");
        assert_eq!(cells[6], fields.to_string(), "{case}: {golden}");
        for (cell, weight) in cells[4..6].iter().zip(weights) {
            let error: f64 = cell.parse::<f64>().unwrap() - weight;
            assert!(error.abs() < 1e-6, "{case}: {golden} with weights {weights:?}");
        }
    }
}

fn check_predictions(case: &str, rfwr: &Rfwr) {
    let (n, m) = (rfwr.inputs(), rfwr.outputs());
    let rows = table(case, "predict.csv.gz");
    let ours: Vec<_> = rows
        .iter()
        .map(|row| {
            let mut y = vec![0.0; m];
            let activation = rfwr.predict(&row[..n], &mut y);
            y.push(activation);
            y
        })
        .collect();
    let golden: Vec<_> = rows.iter().map(|row| row[n..].to_vec()).collect();
    agree(&format!("{case}: predict"), &golden, &ours, 1e-6);
}

/// The transpose of an `inputs` × `outputs` matrix given row by row.
fn transposed(values: &[f64], outputs: usize) -> Vec<f64> {
    (0..outputs).flat_map(|k| values.iter().skip(k).step_by(outputs).copied()).collect()
}

fn check_final(case: &str, rfwr: &Rfwr) {
    let golden: Value = serde_json::from_str(&read(case, "final.json.gz")).unwrap();
    let (n, m) = (rfwr.inputs(), rfwr.outputs());
    let fields = golden["rfs"].as_array().unwrap();
    assert_eq!(fields.len(), rfwr.fields(), "{case}");
    assert_eq!(golden["n_pruned"].as_u64(), Some(rfwr.pruned()), "{case}");
    let diagonal = rfwr.settings().diag_only;
    // What we keep of a symmetric or triangular matrix: what is on and above its diagonal,
    let upper = |all: &[f64]| -> Vec<f64> {
        (0..n).flat_map(|a| all[a * n + a..(a + 1) * n].to_vec()).collect()
    };
    // or of M and D the diagonal alone.
    let kept = |all: Vec<f64>| -> Vec<f64> {
        if diagonal { all.into_iter().step_by(n + 1).collect() } else { upper(&all) }
    };
    for (index, (golden, ours)) in fields.iter().zip(&rfwr.field_states()).enumerate() {
        let compare = |key: &str, golden: Vec<f64>, ours: &[f64], tolerance: f64| {
            let most = golden.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            assert_eq!(golden.len(), ours.len(), "{case}, field {index}, {key}");
            for (golden, ours) in golden.iter().zip(ours) {
                assert!(
                    (golden - ours).abs() <= tolerance * most,
                    "{case}, field {index}, {key}: {ours} for {golden}"
                );
            }
        };
        let (regression, errors) = (&ours.regression, &ours.errors);
        assert_eq!(golden["trustworthy"] == 1, regression.trustworthy, "{case}, field {index}");
        for (key, ours) in [
            ("n_data", regression.n_data),
            ("lambda", regression.lambda),
            ("sum_w", regression.sum_w),
            ("sum_e_cv2", errors.sum_e_cv2),
            ("sum_e2", errors.sum_e2),
        ] {
            compare(key, numbers(&golden[key]), &[ours], 1e-5);
        }
        for (key, ours) in
            [("mean_x", &regression.mean), ("var_x", &regression.var), ("b0", &regression.offset)]
        {
            compare(key, numbers(&golden[key]), ours, 1e-5);
        }
        compare("c", numbers(&golden["c"]), &rfwr.centre(index), 1e-5);
        compare("P", upper(&numbers(&golden["P"])), &regression.p, 1e-5);
        compare("R", upper(&numbers(&golden["R"])), &errors.r, 1e-4);
        compare("B", transposed(&numbers(&golden["B"]), m), &regression.slopes, 1e-5);
        compare("H", transposed(&numbers(&golden["H"]), m), &errors.h, 1e-4);
        let metric = rfwr.metric(index);
        let ours_d = if diagonal { metric } else { upper(&metric) };
        compare("D", kept(numbers(&golden["D"])), &ours_d, 1e-5);
        compare("M", kept(numbers(&golden["M"])), &ours.metric.m, 1e-5);
        compare("alpha", kept(numbers(&golden["alpha"])), &ours.metric.alpha, 1e-5);
        if rfwr.settings().meta {
            compare("b", kept(numbers(&golden["b"])), &ours.metric.log_alpha, 1e-5);
            compare("h", kept(numbers(&golden["h"])), &ours.metric.trace, 1e-5);
        }
    }
}

#[test]
fn agrees_with_the_golden_runs() {
    for case in CASES {
        let rfwr = trained(case);
        check_predictions(case, &rfwr);
        check_final(case, &rfwr);
    }
}

/// A learner for `inputs` numbers as a profile makes it, with tight norms.
fn profiled(params: &Params, inputs: usize) -> Model {
    Params { norm_in: vec![1.0; inputs], ..params.clone() }.build(inputs, 10.0).unwrap()
}

#[test]
fn a_reloaded_learner_is_equal_and_learns_on_equally() {
    for (diag_only, meta) in [(true, false), (false, true)] {
        let mut model = profiled(&Params { diag_only, meta, ..Params::default() }, 2);
        for k in 0..800 {
            let (x, y) = sample(k);
            model.update(&x, &y, 1.0).unwrap();
        }
        let text = stored(&model);
        let mut reloaded: Model = serde_json::from_str(&text).unwrap();
        assert_eq!(stored(&reloaded), text);
        for k in 800..1200 {
            let (x, y) = sample(k);
            model.update(&x, &y, 1.0).unwrap();
            reloaded.update(&x, &y, 1.0).unwrap();
        }
        assert_eq!(stored(&reloaded), stored(&model));
    }
}

#[test]
fn damaged_files_are_refused_by_name() {
    let mut model = profiled(&Params::default(), 2);
    for k in 0..100 {
        let (x, y) = sample(k);
        model.update(&x, &y, 1.0).unwrap();
    }
    let whole: Value = serde_json::from_str(&stored(&model)).unwrap();
    let refusal = |pointer: &str, value: Value| {
        let mut damaged = whole.clone();
        *damaged.pointer_mut(pointer).unwrap() = value;
        serde_json::from_value::<Model>(damaged).unwrap_err().to_string()
    };
    assert!(refusal("/rfwr/fields/1/regression/p", [1.0].into()).contains("field 1"));
    assert!(refusal("/rfwr/fields/0/regression/lambda", 0.0.into()).contains("field 0"));
    assert!(refusal("/rfwr/shapes/metrics/0", (-1.0).into()).contains("centres and metrics"));
    assert!(refusal("/rfwr/settings/norm_in", [1.0].into()).contains("norm_in"));
    assert!(refusal("/rfwr/settings/w_gen", 7.0.into()).contains("w_gen"));
}

#[test]
fn norms_must_fit_the_inputs() {
    let error = Params::default().build(2, 10.0).unwrap_err().to_string();
    assert_eq!(error, "the learner's `norm_in` has 4 numbers where 2 are needed");
}

#[test]
fn bad_samples_are_refused_and_leave_no_trace() {
    let mut model = profiled(&Params::default(), 2);
    model.update(&[0.1, 0.2], &[1.0], 1.0).unwrap();
    let before = stored(&model);
    assert!(model.update(&[f64::NAN, 0.0], &[1.0], 1.0).is_err());
    assert!(model.update(&[0.0, 0.0], &[f64::INFINITY], 1.0).is_err());
    assert!(model.update(&[0.0, 0.0], &[1.0], f64::NAN).is_err());
    assert!(model.update(&[0.0, 0.0], &[1.0], -1.0).is_err());
    assert!(model.update(&[0.0], &[1.0], 1.0).is_err());
    assert_eq!(stored(&model), before);
}

#[test]
fn no_field_is_added_at_the_cap() {
    let mut model = profiled(&Params { max_fields: 3, ..Params::default() }, 2);
    for k in 0..500 {
        let (x, y) = sample(k);
        model.update(&x, &y, 1.0).unwrap();
        assert!(model.fields() <= 3);
    }
    assert_eq!(model.fields(), 3);
}

/// One wide field over all samples, with a fixed metric and no forgetting.
fn one_field() -> Rfwr {
    let forever = Settings {
        update_d: false,
        init_d: InitialMetric::Scalar(0.5),
        init_lambda: 1.0,
        final_lambda: 1.0,
        w_gen: 0.01,
        ..Settings::new(2, 1)
    };
    Rfwr::new(forever).unwrap()
}

#[test]
fn one_field_without_forgetting_is_weighted_least_squares() {
    use nalgebra::{Matrix3, Vector3};
    let mut rfwr = one_field();
    let (mut normal, mut moment) = (Matrix3::zeros(), Vector3::zeros());
    for k in 0..4000 {
        let (x, [bent]) = sample(k);
        let y = 0.7 * x[0] - 1.3 * x[1] + 0.2 + 0.02 * bent;
        rfwr.learn(&x, &[y], 1.0).unwrap();
        if k > 0 {
            let offset = [x[0] - rfwr.centre(0)[0], x[1] - rfwr.centre(0)[1]];
            let w = (-0.25 * (offset[0] * offset[0] + offset[1] * offset[1])).exp();
            let row = Vector3::new(1.0, x[0], x[1]);
            normal += w * row * row.transpose();
            moment += w * y * row;
        }
    }
    assert_eq!(rfwr.fields(), 1);
    let batch = normal.cholesky().unwrap().solve(&moment);
    let field = rfwr.field_states().remove(0).regression;
    for (ours, batch) in field.slopes.iter().zip([batch[1], batch[2]]) {
        assert!((ours - batch).abs() < 5e-4, "{ours} for {batch}");
    }
    let mut y = [0.0];
    rfwr.predict(&[0.3, -0.4], &mut y);
    assert!((y[0] - (batch[0] + 0.3 * batch[1] - 0.4 * batch[2])).abs() < 5e-4);
}

#[test]
fn a_sample_of_weight_0_teaches_nothing() {
    let mut rfwr = one_field();
    for k in 0..50 {
        let (x, y) = sample(k);
        rfwr.learn(&x, &y, 1.0).unwrap();
    }
    let before = rfwr.field_states();
    rfwr.learn(&[0.1, 0.1], &[99.0], 0.0).unwrap();
    assert_eq!(rfwr.field_states(), before);
    rfwr.learn(&[0.1, 0.1], &[99.0], 0.5).unwrap();
    assert_ne!(rfwr.field_states(), before);
}

#[test]
fn a_new_field_is_within_the_bounds_of_its_metric() {
    let build = |init_d, floor, ceiling| {
        let init_d = InitialMetric::Scalar(init_d);
        Rfwr::new(Settings { init_d, d_floor: floor, d_ceiling: ceiling, ..Settings::new(2, 1) })
    };
    assert!(build(4.0, Some(4.0), Some(4.0)).is_ok());
    for refused in [build(0.5, Some(4.0), None), build(25.0, None, Some(1.0))] {
        assert!(refused.unwrap_err().to_string().contains("init_d"));
    }
}
