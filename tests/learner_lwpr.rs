//! LWPR against golden runs of its authors' library, and its promises.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking, helpers too")]

#[path = "learner/feed.rs"]
mod feed;
#[path = "learner/golden.rs"]
mod golden;

use coadapt::learner::lwpr::{Field, Growth, InitialMetric, Lwpr, Projection, Settings, UNKNOWN};
use coadapt::learner::{Kernel, Kind, Learner, Model, Params};
use feed::{sample, stored};
use golden::{agree, numbers, read, table};
use serde_json::Value;

const CASES: [&str; 9] = [
    "lwpr/a_1d_fixed_d",
    "lwpr/b_2d_cross_diag",
    "lwpr/c_2d_cross_full_meta",
    "lwpr/d_4d_cartpole",
    "lwpr/e_2d_2out",
    "lwpr/f_2d_bisquare_meta",
    "lwpr/g_4d_cartpole_traj",
    "lwpr/h_5d_projections",
    "lwpr/i_1d_rate_halving",
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
        update_d: count("update_D") == 1,
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
        init_s2: number("init_S2"),
        add_threshold: number("add_threshold"),
        cutoff: number("cutoff_update"),
        ..Settings::new(count("n_in"), count("n_out"))
    }
}

/// How many projections each field has.
fn projections(fields: &[Field]) -> Vec<usize> {
    fields.iter().map(|field| field.regression.projections.len()).collect()
}

/// An event as the golden table writes it, with the two largest activations.
type Event = (String, [f64; 2]);

/// What the last update did to the fields of output `k`, which had `before` projections.
fn events(lwpr: &Lwpr, k: usize, before: &[usize], (growth, step): (Growth, u32)) -> Vec<String> {
    let now = projections(&lwpr.submodels()[k].fields());
    let event = |kind, field: usize, detail: &str, fields: usize| {
        format!("{step},{},{kind},{field},{detail},{fields}", k + 1)
    };
    let mut events = Vec::new();
    for (field, old) in before.iter().enumerate() {
        let place = match growth {
            Growth::Pruned { field: gone, .. } if gone == field => continue,
            Growth::Pruned { field: gone, .. } if field == now.len() => gone,
            _ => field,
        };
        if now[place] > *old {
            events.push(event("add_projection", field, &now[place].to_string(), before.len()));
        }
    }
    match growth {
        Growth::None => {}
        Growth::Added { field, template } => {
            let template = template.map_or("-1".to_owned(), |template| template.to_string());
            events.push(event("add", field, &template, now.len()));
        }
        Growth::Pruned { field, survivor } => {
            events.push(event("prune", field, &survivor.to_string(), now.len()));
        }
    }
    events
}

fn trained(case: &str) -> Lwpr {
    let settings = settings(case);
    let (n, m) = (settings.inputs, settings.outputs);
    let trace = table(case, "trace.csv.gz");
    let mut lwpr = Lwpr::new(settings).unwrap();
    let (mut seen, mut steps) = (Vec::new(), Vec::new());
    for (row, step) in table(case, "train.csv.gz").iter().zip(1_u32..) {
        let before: Vec<_> =
            lwpr.submodels().iter().map(|submodel| projections(&submodel.fields())).collect();
        let update = lwpr.learn(&row[..n], &row[n..n + m], 1.0).unwrap();
        let (output, changes) = (update.output.to_vec(), update.changes.to_vec());
        for (k, change) in changes.iter().enumerate() {
            let weights = [change.max_activation, change.second_activation];
            let happened = events(&lwpr, k, &before[k], (change.growth, step));
            seen.extend(happened.into_iter().map(|event| (event, weights)));
        }
        for golden in trace.iter().filter(|golden| golden[0] == f64::from(step)) {
            let k = (0..m).find(|k| (k + 1).to_string() == golden[1].to_string()).unwrap();
            let submodel = &lwpr.submodels()[k];
            let counts = [submodel.len().to_string(), submodel.pruned().to_string()];
            let right = [golden[2].to_string(), golden[3].to_string()];
            assert_eq!(counts, right, "{case}, step {step}, output {k}");
            steps.push(vec![golden[1], output[k], changes[k].max_activation]);
        }
    }
    check_events(case, &seen);
    for k in 1..=u32::try_from(m).unwrap() {
        let of = |rows: &[Vec<f64>], skip| -> Vec<Vec<f64>> {
            let rows = rows.iter().filter(|row| row[skip] == f64::from(k));
            rows.map(|row| row[row.len() - 2..].to_vec()).collect()
        };
        agree(&format!("{case}: trace of {k}"), &of(&trace, 1), &of(&steps, 0), 1e-9);
    }
    lwpr
}

fn check_events(case: &str, ours: &[Event]) {
    let golden = read(case, "events.csv.gz");
    for (golden, (event, weights)) in golden.lines().skip(1).zip(ours) {
        let cells: Vec<_> = golden.split(',').collect();
        assert_eq!([&cells[..5], &cells[7..]].concat().join(","), *event, "{case}");
        for (cell, weight) in cells[5..7].iter().zip(weights) {
            let error: f64 = cell.parse::<f64>().unwrap() - weight;
            assert!(error.abs() < 1e-9, "{case}: {golden} with weights {weights:?}");
        }
    }
    assert_eq!(golden.lines().skip(1).count(), ours.len(), "{case}: events");
}

fn check_predictions(case: &str, lwpr: &Lwpr) {
    let before = stored(lwpr);
    let (n, m) = (lwpr.inputs(), lwpr.outputs());
    let (mut golden, mut ours) = (Vec::new(), Vec::new());
    for row in table(case, "predict.csv.gz") {
        let (mut y, mut conf, mut max_w) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        lwpr.predict_with_confidence(&row[..n], &mut y, &mut conf, &mut max_w);
        let mut plain = vec![f64::NAN; m];
        let activation = lwpr.predict(&row[..n], &mut plain);
        assert_eq!(plain, y, "{case}");
        assert_eq!(activation, max_w.iter().fold(0.0, |most, w| w.max(most)), "{case}");
        let mut right = row[n..].to_vec();
        for k in 0..m {
            // Where nothing is known the bound is so large that it would hide all others.
            let unknown = UNKNOWN * lwpr.settings().norm_out[k];
            assert_eq!(right[3 * k + 1] == unknown, conf[k] == unknown, "{case}");
            if conf[k] == unknown {
                (right[3 * k + 1], conf[k]) = (0.0, 0.0);
            }
        }
        golden.push(right);
        ours.push((0..m).flat_map(|k| [y[k], conf[k], max_w[k]]).collect());
    }
    agree(&format!("{case}: predict"), &golden, &ours, 1e-9);
    assert_eq!(stored(lwpr), before, "{case}: predictions change nothing");
}

/// Demands that `ours` is `golden`, relative to the latter's largest entry.
fn same(what: &str, golden: &[f64], ours: &[f64], tolerance: f64) {
    let most = golden.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    assert_eq!(golden.len(), ours.len(), "{what}");
    for (golden, ours) in golden.iter().zip(ours) {
        assert!((golden - ours).abs() <= tolerance * most, "{what}: {ours} for {golden}");
    }
}

fn check_final(case: &str, lwpr: &Lwpr) {
    let golden: Value = serde_json::from_str(&read(case, "final.json.gz")).unwrap();
    assert_eq!(golden["n_data"].as_u64(), Some(lwpr.samples()), "{case}");
    for (output, submodel) in golden["outputs"].as_array().unwrap().iter().zip(lwpr.submodels()) {
        let fields = output["rfs"].as_array().unwrap();
        assert_eq!(fields.len(), submodel.len(), "{case}");
        assert_eq!(output["n_pruned"].as_u64(), Some(submodel.pruned()), "{case}");
        for (index, (golden, ours)) in fields.iter().zip(&submodel.fields()).enumerate() {
            let trusted = golden["trustworthy"] == 1;
            assert_eq!(trusted, ours.regression.trustworthy, "{case}, field {index}");
            let tolerance = if trusted { 1e-8 } else { 1e-5 };
            let compare = |key: &str, ours: &[f64]| {
                let what = format!("{case}, field {index}, {key}");
                same(&what, &numbers(&golden[key]), ours, tolerance);
            };
            compare("c", &submodel.centre(index));
            check_regression(ours, compare);
            let place = format!("{case}, field {index}");
            check_metric(&place, golden, (&submodel.metric(index), ours), tolerance);
        }
    }
}

fn check_regression(ours: &Field, compare: impl Fn(&str, &[f64])) {
    let regression = &ours.regression;
    let each = |of: fn(&Projection) -> f64| -> Vec<f64> {
        regression.projections.iter().map(of).collect()
    };
    compare("beta0", &[regression.offset]);
    compare("sum_e2", &[regression.sum_e2]);
    compare("SSp", &[regression.ss_p]);
    compare("mean_x", &regression.mean);
    compare("var_x", &regression.var);
    compare("n_data", &each(|projection| projection.n_data));
    compare("lambda", &each(|projection| projection.lambda));
    compare("sum_w", &each(|projection| projection.sum_w));
    compare("sum_e_cv2", &each(|projection| projection.sum_e_cv2));
    compare("SSs2", &each(|projection| projection.ss_s2));
    compare("SSYres", &each(|projection| projection.ss_y_res));
    compare("beta", &each(Projection::beta));
    compare("H", &each(|projection| projection.h));
    compare("r", &each(|projection| projection.r));
    // A column there is a projection's vector here.
    let columns = |of: fn(&Projection) -> Vec<f64>| -> Vec<f64> {
        let n = regression.mean.len();
        let row = |i| regression.projections.iter().map(move |projection| of(projection)[i]);
        (0..n).flat_map(row).collect()
    };
    compare("U", &columns(Projection::u));
    compare("P", &columns(Projection::p));
    compare("SXresYres", &columns(|projection| projection.s_x_res_y_res.clone()));
    if regression.trustworthy {
        let n = regression.mean.len();
        let along = |axis: usize| {
            let mut x = regression.mean.clone();
            x[axis] += 1.0;
            regression.predict(&x) - regression.offset
        };
        compare("slope", &(0..n).map(along).collect::<Vec<_>>());
    }
}

fn check_metric(place: &str, golden: &Value, (d, field): (&[f64], &Field), tolerance: f64) {
    let n = field.regression.mean.len();
    // What we keep of a matrix: its diagonal, or what is on and above it.
    let diagonal = field.metric.m.len() == n;
    let kept = |all: &[f64]| -> Vec<f64> {
        let length = |a| if diagonal { 1 } else { n - a };
        (0..n).flat_map(|a| all[a * n + a..][..length(a)].to_vec()).collect()
    };
    let compare = |key: &str, ours: &[f64]| {
        same(&format!("{place}, {key}"), &kept(&numbers(&golden[key])), ours, tolerance);
    };
    compare("D", &if diagonal { d.to_vec() } else { kept(d) });
    compare("M", &field.metric.m);
    compare("alpha", &field.metric.alpha);
    if !golden["b"].is_null() {
        compare("b", &field.metric.log_alpha);
        compare("h", &field.metric.trace);
    }
}

#[test]
fn agrees_with_the_golden_runs() {
    for case in CASES {
        let lwpr = trained(case);
        check_predictions(case, &lwpr);
        check_final(case, &lwpr);
    }
}

/// What a profile says, for LWPR.
fn params() -> Params {
    Params { kind: Kind::Lwpr, ..Params::default() }
}

/// A learner for `inputs` numbers as a profile makes it, with tight norms.
fn profiled(params: &Params, inputs: usize) -> Lwpr {
    let norm_in = vec![1.0; inputs];
    match (Params { norm_in, ..params.clone() }).build(inputs, 10.0).unwrap() {
        Model::Lwpr(lwpr) => lwpr,
        Model::Rfwr(_) => panic!("another learner"),
    }
}

/// A learner that has seen `samples` of the bent function.
fn experienced(params: &Params, samples: u32) -> Lwpr {
    let mut lwpr = profiled(params, 2);
    for k in 0..samples {
        let (x, y) = sample(k);
        lwpr.learn(&x, &y, 1.0).unwrap();
    }
    lwpr
}

#[test]
fn a_reloaded_learner_is_equal_and_learns_on_equally() {
    for (diag_only, meta) in [(true, false), (false, true)] {
        let mut model = Model::Lwpr(experienced(&Params { diag_only, meta, ..params() }, 800));
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
    let model = Model::Lwpr(experienced(&params(), 100));
    let whole: Value = serde_json::from_str(&stored(&model)).unwrap();
    let refusal = |pointer: &str, value: Value| {
        let mut damaged = whole.clone();
        *damaged.pointer_mut(pointer).unwrap() = value;
        serde_json::from_value::<Model>(damaged).unwrap_err().to_string()
    };
    let first = "/lwpr/submodels/0/fields/0/regression";
    assert!(refusal(&format!("{first}/projections/1/ss_x_res"), [1.0].into()).contains("field 0"));
    assert!(refusal(&format!("{first}/projections"), Value::Array(vec![])).contains("field 0"));
    assert!(refusal(&format!("{first}/projections/1/lambda"), 0.0.into()).contains("field 0"));
    let metrics = "/lwpr/submodels/0/shapes/metrics/0";
    assert!(refusal(metrics, (-1.0).into()).contains("centres and metrics"));
    assert!(refusal("/lwpr/submodels", Value::Array(vec![])).contains("submodels"));
    assert!(refusal("/lwpr/settings/norm_in", [1.0].into()).contains("norm_in"));
    assert!(refusal("/lwpr/settings/add_threshold", (-7.0).into()).contains("add_threshold"));
}

#[test]
fn bad_samples_are_refused_and_leave_no_trace() {
    let mut lwpr = experienced(&params(), 1);
    let before = stored(&lwpr);
    assert!(lwpr.update(&[f64::NAN, 0.0], &[1.0], 1.0).is_err());
    assert!(lwpr.update(&[0.0, 0.0], &[f64::INFINITY], 1.0).is_err());
    assert!(lwpr.update(&[0.0, 0.0], &[1.0], f64::NAN).is_err());
    assert!(lwpr.update(&[0.0, 0.0], &[1.0], -1.0).is_err());
    assert!(lwpr.update(&[0.0], &[1.0], 1.0).is_err());
    assert_eq!(stored(&lwpr), before);
}

#[test]
fn no_field_is_added_at_the_cap() {
    let narrow = Params { init_d: 30.0, ..params() };
    assert!(experienced(&narrow, 500).fields() > 3);
    assert_eq!(experienced(&Params { max_fields: 3, ..narrow }, 500).fields(), 3);
}

#[test]
fn a_bent_function_is_learned_and_the_unknown_is_known_as_such() {
    let narrow = Params { init_d: 30.0, norm_out: 1.0, ..params() };
    let lwpr = experienced(&narrow, 8000);
    let (mut squares, mut inside) = (0.0, 0);
    for k in 8000..8400 {
        let (x, [right]) = sample(k);
        let (mut y, mut conf, mut max_w) = ([0.0], [0.0], [0.0]);
        lwpr.predict_with_confidence(&x, &mut y, &mut conf, &mut max_w);
        squares += (y[0] - right).powi(2) / 400.0;
        inside += i32::from((y[0] - right).abs() < 2.0 * conf[0]);
    }
    assert!(squares < 0.01, "mean squared error {squares}");
    assert!(inside > 360, "{inside} of 400 within two deviations");
    let (mut y, mut conf, mut max_w) = ([1.0], [1.0], [1.0]);
    lwpr.predict_with_confidence(&[90.0, 90.0], &mut y, &mut conf, &mut max_w);
    assert_eq!((y, conf), ([0.0], [UNKNOWN]));
}

#[test]
fn outputs_learn_apart() {
    let both = Settings { penalty: 1e-5, ..Settings::new(2, 2) };
    let mut together = Lwpr::new(both).unwrap();
    let mut alone = Lwpr::new(Settings { penalty: 1e-5, ..Settings::new(2, 1) }).unwrap();
    for k in 0..600 {
        let (x, [y]) = sample(k);
        together.learn(&x, &[x[1], y], 1.0).unwrap();
        alone.learn(&x, &[y], 1.0).unwrap();
    }
    assert_eq!(together.submodels()[1].fields(), alone.submodels()[0].fields());
    assert_ne!(together.submodels()[0].fields(), alone.submodels()[0].fields());
}

/// With `diag_only` only D's diagonal is learned, but all of it measures distances.
/// Its diagonal would shrink under what is off it, until it measured no distances any more.
#[test]
fn a_metric_of_which_only_the_diagonal_is_learned_must_be_diagonal() {
    let full = |off| InitialMetric::Full(vec![vec![10.0, off], vec![off, 10.0]]);
    let build = |init_d| Lwpr::new(Settings { init_d, ..Settings::new(2, 1) });
    assert!(build(full(0.0)).is_ok());
    assert!(build(full(4.0)).unwrap_err().to_string().contains("diag_only"));
}

#[test]
fn a_sample_of_weight_0_teaches_nothing() {
    let mut lwpr = experienced(&params(), 50);
    let before = lwpr.submodels()[0].fields();
    lwpr.learn(&[0.1, 0.1], &[99.0], 0.0).unwrap();
    assert_eq!(lwpr.submodels()[0].fields(), before);
    lwpr.learn(&[0.1, 0.1], &[99.0], 0.5).unwrap();
    assert_ne!(lwpr.submodels()[0].fields(), before);
}

/// While an input does not move, forgetting wears the variance along it down to 0, by which
/// nothing can be divided; the field must still learn once the input moves again.
#[test]
fn an_input_that_stands_still_does_no_lasting_harm() {
    let forgetful = Settings {
        init_lambda: 0.5,
        final_lambda: 0.5,
        init_d: InitialMetric::Scalar(1.0),
        ..Settings::new(1, 1)
    };
    let mut lwpr = Lwpr::new(forgetful).unwrap();
    for _ in 0..3000 {
        lwpr.learn(&[0.3], &[1.0], 1.0).unwrap();
    }
    for k in 0..200 {
        let x = 0.3 + 0.1 * f64::from(k).sin();
        lwpr.learn(&[x], &[2.0 * x + 5.0], 1.0).unwrap();
    }
    assert_eq!(lwpr.fields(), 1);
    let beta = lwpr.submodels()[0].fields()[0].regression.projections[0].beta();
    assert!((beta.abs() - 2.0).abs() < 1e-6, "{beta}");
}
