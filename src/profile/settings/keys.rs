//! The keys of a settings file, and what their values can be.

use super::given::Given;
use crate::learner::{Kernel, Kind};

/// What a setting can be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Form {
    /// A number from the first to the second.
    Number(f64, f64),
    /// The same, or nothing.
    Limit(f64, f64),
    /// A whole number of fields, or nothing.
    Count,
    /// Yes or no, also as 1 or 0.
    Flag,
    /// A kernel's name.
    Kernel,
    /// A learner's name.
    Learner,
    /// One number from the first to the second, also as a diagonal or matrix of it.
    Uniform(f64, f64),
    /// A scalar, a diagonal or a matrix.
    Metric,
    /// A scalar or a number for each column.
    Norms,
    /// A number of columns.
    Columns,
    /// What only describes the file.
    Remark,
}

/// A key of a settings file.
pub(super) struct Key {
    pub name: &'static str,
    pub form: Form,
    /// The only learner that has it.
    pub only: Option<Kind>,
}

const fn key(name: &'static str, form: Form) -> Key {
    Key { name, form, only: None }
}

const fn key_of(only: Kind, name: &'static str, form: Form) -> Key {
    Key { name, form, only: Some(only) }
}

/// The least and the largest that lengths, norms and the like may be.
const SMALL: f64 = 1e-12;
const BIG: f64 = 1e12;

/// All keys, in small letters.
pub(super) const KEYS: [Key; 40] = [
    key("learner", Form::Learner),
    key("kind", Form::Learner),
    key("algorithm", Form::Learner),
    key("kernel", Form::Kernel),
    key("diag_only", Form::Flag),
    key("update_d", Form::Flag),
    key("meta", Form::Flag),
    key("meta_rate", Form::Number(0.0, BIG)),
    key("penalty", Form::Number(0.0, BIG)),
    key("init_alpha", Form::Uniform(0.0, BIG)),
    key("init_d", Form::Metric),
    key("norm_in", Form::Norms),
    key("norm_out", Form::Norms),
    key("w_gen", Form::Number(0.0, 1.0)),
    key("w_prune", Form::Number(0.0, 1.0)),
    key("init_lambda", Form::Number(0.5, 1.0)),
    key("final_lambda", Form::Number(0.5, 1.0)),
    key("tau_lambda", Form::Number(0.0, 1.0)),
    key_of(Kind::Rfwr, "init_p", Form::Uniform(SMALL, 1e100)),
    key_of(Kind::Rfwr, "vif_trust", Form::Number(0.0, BIG)),
    key_of(Kind::Rfwr, "vif_update", Form::Number(0.0, BIG)),
    key_of(Kind::Rfwr, "min_n_data_factor", Form::Number(0.0, BIG)),
    key_of(Kind::Lwpr, "init_s2", Form::Number(1e-30, BIG)),
    key_of(Kind::Lwpr, "add_threshold", Form::Number(0.0, BIG)),
    key("cutoff", Form::Number(SMALL, 0.5)),
    key("cutoff_update", Form::Number(SMALL, 0.5)),
    key("cutoff_predict", Form::Number(SMALL, 0.5)),
    key("max_fields", Form::Count),
    key("output_limit", Form::Limit(0.0, f64::MAX)),
    key("d_floor", Form::Limit(SMALL, BIG)),
    key("d_ceiling", Form::Limit(SMALL, BIG)),
    key("min_one_minus_h", Form::Limit(SMALL, 1.0)),
    key("n_in", Form::Columns),
    key("n_out", Form::Columns),
    key("inputs", Form::Columns),
    key("outputs", Form::Columns),
    key("case", Form::Remark),
    key("description", Form::Remark),
    key("n_train", Form::Remark),
    key("n_query", Form::Remark),
];

/// What would be allowed, if `value` is not.
pub(super) fn misfit(form: Form, value: &Given) -> Option<String> {
    let within = |from: f64, to: f64| move |number: f64| (from..=to).contains(&number);
    let (fits, allowed) = match form {
        Form::Number(from, to) => (all(value, within(from, to), false), span(from, to)),
        Form::Uniform(from, to) => (all(value, within(from, to), true), span(from, to)),
        Form::Limit(from, to) => (
            *value == Given::Nothing || all(value, within(from, to), false),
            format!("{}, or None for no such limit", span(from, to)),
        ),
        Form::Count => (
            *value == Given::Nothing
                || all(value, |n| n.fract() == 0.0 && (1.0..=1e9).contains(&n), false),
            "a whole number from 1 to 1000000000, or None for no such limit".to_owned(),
        ),
        Form::Columns => (
            all(value, |n| n.fract() == 0.0 && (1.0..=64.0).contains(&n), false),
            "a whole number from 1 to 64".to_owned(),
        ),
        Form::Flag => (
            matches!(value, Given::Flag(_)) || all(value, |n| n == 0.0 || n == 1.0, false),
            "true or false, or 1 or 0".to_owned(),
        ),
        Form::Kernel => (
            matches!(value, Given::Word(word) if kernel_of(word).is_some()),
            "gaussian or bi_square".to_owned(),
        ),
        Form::Learner => (
            matches!(value, Given::Word(word)
                if Kind::from_word(&word.to_ascii_lowercase()).is_some()),
            "rfwr or lwpr".to_owned(),
        ),
        Form::Metric => (
            all(value, f64::is_finite, true),
            "a positive number, a list of them (the diagonal), or a matrix by rows".to_owned(),
        ),
        Form::Norms => (
            all(value, within(SMALL, BIG), true) && !matches!(value, Given::Matrix(_)),
            format!("a number for all columns or a list of one each, {}", span(SMALL, BIG)),
        ),
        Form::Remark => (true, String::new()),
    };
    (!fits).then_some(format!("allowed: {allowed}"))
}

/// Whether `value` is a number, or also a list or matrix, for all of which `fits` holds.
fn all(value: &Given, fits: impl Fn(f64) -> bool, may_be_many: bool) -> bool {
    match value {
        Given::Number(number) => fits(*number),
        Given::List(list) => may_be_many && !list.is_empty() && list.iter().all(|n| fits(*n)),
        Given::Matrix(rows) => {
            may_be_many && !rows.is_empty() && rows.iter().flatten().all(|n| fits(*n))
        }
        _ => false,
    }
}

fn span(from: f64, to: f64) -> String {
    if to == f64::MAX { format!("{from} or more") } else { format!("{from:?} to {to:?}") }
}

pub(super) fn kernel_of(word: &str) -> Option<Kernel> {
    match word.to_ascii_lowercase().replace(['_', '-'], "").as_str() {
        "gaussian" => Some(Kernel::Gaussian),
        "bisquare" => Some(Kernel::BiSquare),
        _ => None,
    }
}
