//! A learner that was written as a policy and read back is the same learner.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

use std::fs;

use coadapt::learner::{Kernel, Kind, Learner, Model, Params};
use coadapt::record::policy::{Policy, file_name, read_policy, write_policy};
use coadapt::sharing::Mode;

/// Where the cart-pole is at tick `k` of a made-up ride, and what a person does there.
fn sample(k: u32) -> ([f64; 4], [f64; 1]) {
    let t = f64::from(k) * 0.02;
    let x = [0.3 * t.sin(), (1.7 * t).cos(), 0.4 * (2.3 * t).sin(), 2.0 * (3.1 * t).cos()];
    (x, [12.0 * x[2].sin() + 2.0 * x[3] - x[0] * x[1]])
}

fn taught(params: &Params) -> Model {
    let mut model = params.build(4, 10.0).unwrap();
    teach(&mut model, 0..3000);
    assert!(model.fields() > 3, "{} fields", model.fields());
    model
}

fn teach(model: &mut Model, ticks: std::ops::Range<u32>) {
    for (x, y) in ticks.map(sample) {
        model.update(&x, &y, 1.0).unwrap();
    }
}

fn policy(learner: Model) -> Policy<Model> {
    Policy {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        task: "balance".to_owned(),
        preset: "thesis".to_owned(),
        mode: Mode::Simultaneous,
        percent: 100,
        features: ["x", "x_dot", "theta", "theta_dot"].map(str::to_owned).to_vec(),
        outputs: vec!["u_human".to_owned()],
        action_limit: Some(10.0),
        learner,
    }
}

/// The bits of what `model` predicts and how sure it is, at places it was and was not
/// taught.
fn predictions(model: &Model) -> Vec<(u64, u64)> {
    let answer = |k| {
        let (x, mut y) = sample(k);
        let activation = model.predict(&x, &mut y);
        (y[0].to_bits(), activation.to_bits())
    };
    (0..9000).step_by(13).map(answer).collect()
}

#[test]
fn a_policy_read_back_is_the_same_to_the_last_bit_and_learns_on_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let kinds = [
        Params::default(),
        Params { diag_only: false, meta: true, ..Params::default() },
        Params { kernel: Kernel::BiSquare, update_d: false, ..Params::default() },
        Params { kind: Kind::Lwpr, ..Params::default() },
        Params { kind: Kind::Lwpr, diag_only: false, meta: true, ..Params::default() },
    ];
    for params in kinds {
        let written = policy(taught(&params));
        let path = folder.path().join(file_name(None));
        write_policy(&path, &written).unwrap();
        let mut read: Policy<Model> = read_policy(&path).unwrap();

        assert_eq!(predictions(&read.learner), predictions(&written.learner));
        let again = folder.path().join("again.json");
        write_policy(&again, &read).unwrap();
        assert_eq!(fs::read(&again).unwrap(), fs::read(&path).unwrap());

        let mut learner = written.learner;
        let before = predictions(&learner);
        teach(&mut learner, 3000..4000);
        teach(&mut read.learner, 3000..4000);
        assert_ne!(predictions(&learner), before);
        assert_eq!(predictions(&read.learner), predictions(&learner));
        write_policy(&path, &policy(learner)).unwrap();
        write_policy(&again, &policy(read.learner)).unwrap();
        assert_eq!(fs::read(&again).unwrap(), fs::read(&path).unwrap());
    }
}
