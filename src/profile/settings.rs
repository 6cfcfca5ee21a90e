//! A learner's settings in a file of their own, for fits of tables.
//!
//! The keys are the algorithms' own names, in large or small letters; RON, or JSON in a
//! file that ends in `.json`. What a file leaves out is the profile's where a recorded
//! session is fitted, and the published value otherwise.

mod given;
mod keys;

use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::reading::nearest;
use super::report::{Fault, Place, Report, clip};
use super::scan::line_of;
use crate::learner::lwpr::{self, InitialMetric, Lwpr};
use crate::learner::rfwr::{self, Rfwr};
use crate::learner::{BuildError, Kernel, Kind, Model, Params};
use given::{Given, Manner};
use keys::{KEYS, Key, kernel_of, misfit};

/// No settings file is longer than this, bytes.
const LONGEST: u64 = 1 << 20;

/// Why there are no settings, or no learner of them.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The system does not give the file.
    #[error("the settings {} cannot be read: {error}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// Keys or values are wrong.
    #[error("{0}")]
    Faults(Report),
    /// The values do not go together, or not with the data.
    #[error("{place}{error}")]
    Unfit {
        /// Where the value stands, up to a colon; empty where no file says it.
        place: String,
        /// What is wrong.
        error: BuildError,
    },
}

/// A setting of the file.
#[derive(Clone, Debug)]
struct Setting {
    name: &'static str,
    at: Range<usize>,
    value: Given,
}

/// A settings file, its keys and values checked one by one.
#[derive(Clone, Debug)]
pub struct LearnerFile {
    shown: String,
    source: String,
    settings: Vec<Setting>,
}

impl LearnerFile {
    /// Reads the settings in `path`: JSON if that is its ending, RON otherwise. Of a whole
    /// profile it takes the learner's section.
    ///
    /// # Errors
    /// When it cannot be read, or with everything that is wrong with it.
    pub fn open(path: &Path) -> Result<Self, SettingsError> {
        let refused = |error| SettingsError::Unreadable { path: path.to_owned(), error };
        let mut source = String::new();
        let mut file = File::open(path).map_err(refused)?.take(LONGEST + 1);
        file.read_to_string(&mut source).map_err(refused)?;
        if file.limit() == 0 {
            return Err(refused(io::Error::other("it is larger than 1 MiB")));
        }
        let is_json = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
        let manner = if is_json { Manner::Json } else { Manner::Ron };
        Self::of_text(&path.display().to_string(), &source, manner)
    }

    fn of_text(shown: &str, source: &str, manner: Manner) -> Result<Self, SettingsError> {
        let source = source.strip_prefix('\u{feff}').unwrap_or(source).to_owned();
        let mut settings: Vec<Setting> = Vec::new();
        let mut faults = Vec::new();
        match given::entries(&source, manner) {
            Err(fault) => faults.push(*fault),
            Ok(entries) => {
                for entry in entries {
                    match setting(entry, &settings, &source) {
                        Ok(setting) => settings.push(setting),
                        Err(fault) => faults.push(*fault),
                    }
                }
            }
        }
        let file = Self { shown: shown.to_owned(), source, settings };
        if faults.is_empty() { Ok(file) } else { Err(file.refuse(faults)) }
    }

    /// The learner that these settings are for, if they say so.
    #[must_use]
    pub fn kind(&self) -> Option<Kind> {
        ["learner", "kind", "algorithm"].into_iter().find_map(|key| match self.value(key)? {
            Given::Word(word) => Kind::from_word(&word.to_ascii_lowercase()),
            _ => None,
        })
    }

    /// The file's name.
    #[must_use]
    pub fn shown(&self) -> &str {
        &self.shown
    }

    /// The given keys that `kind` does not have.
    #[must_use]
    pub fn unused(&self, kind: Kind) -> Vec<&'static str> {
        let is_others = |key: &&Key| key.only.is_some_and(|only| only != kind);
        let others = KEYS.iter().filter(is_others).map(|key| key.name);
        others.filter(|name| self.value(name).is_some()).collect()
    }

    fn refuse(&self, faults: Vec<Fault>) -> SettingsError {
        SettingsError::Faults(Report {
            shown: self.shown.clone(),
            source: self.source.clone(),
            faults,
        })
    }

    fn setting(&self, name: &str) -> Option<&Setting> {
        self.settings.iter().find(|setting| setting.name == name)
    }

    fn value(&self, name: &str) -> Option<&Given> {
        self.setting(name).map(|setting| &setting.value)
    }

    fn number(&self, name: &str) -> Option<f64> {
        match self.value(name)? {
            Given::Number(number) => Some(*number),
            _ => None,
        }
    }

    /// The number that a diagonal or matrix consists of.
    fn uniform(&self, name: &str) -> Option<f64> {
        match self.value(name)? {
            Given::Number(number) => Some(*number),
            Given::List(list) => list.first().copied(),
            Given::Matrix(rows) => rows.first()?.first().copied(),
            _ => None,
        }
    }

    fn flag(&self, name: &str) -> Option<bool> {
        match self.value(name)? {
            Given::Flag(flag) => Some(*flag),
            Given::Number(number) => Some(*number == 1.0),
            _ => None,
        }
    }

    /// A value that may be absent: `None` when the file does not speak of it.
    #[expect(clippy::option_option, reason = "not given is not the same as given as nothing")]
    fn limit(&self, name: &str) -> Option<Option<f64>> {
        self.value(name).map(|_| self.number(name))
    }

    fn kernel(&self) -> Option<Kernel> {
        match self.value("kernel")? {
            Given::Word(word) => kernel_of(word),
            _ => None,
        }
    }

    fn metric(&self) -> Option<InitialMetric> {
        Some(match self.value("init_d")? {
            Given::Number(d) => InitialMetric::Scalar(*d),
            Given::List(list) => InitialMetric::Diagonal(list.clone()),
            Given::Matrix(rows) => match diagonal_of(rows) {
                Some(diagonal) => InitialMetric::Diagonal(diagonal),
                None => InitialMetric::Full(rows.clone()),
            },
            _ => return None,
        })
    }

    fn norms(&self, name: &str, count: usize) -> Option<Vec<f64>> {
        match self.value(name)? {
            Given::Number(norm) => Some(vec![*norm; count]),
            Given::List(norms) => Some(norms.clone()),
            _ => None,
        }
    }

    /// What does not fit the data, or another setting.
    fn faults(&self, diag_only: bool, (inputs, outputs): (usize, usize)) -> Vec<Fault> {
        let mut faults = Vec::new();
        for (name, option, columns) in [
            ("n_in", "--inputs", inputs),
            ("inputs", "--inputs", inputs),
            ("n_out", "--outputs", outputs),
            ("outputs", "--outputs", outputs),
        ] {
            #[expect(clippy::cast_precision_loss, reason = "a number of columns")]
            if let Some(setting) = self.setting(name)
                && self.number(name) != Some(columns as f64)
            {
                let expected = format!("{option} names {columns}");
                faults.push(fault(setting, "does not fit the data", &self.source, expected));
            }
        }
        for name in ["init_alpha", "init_p"] {
            // Off its diagonal init_p is 0.
            let diag_only = diag_only || name == "init_p";
            if let Some(setting) = self.setting(name)
                && !is_uniform(&setting.value, diag_only)
            {
                let expected = "one number serves all entries here: give a scalar, or a matrix \
                                whose entries are equal";
                faults.push(fault(setting, "is not supported", &self.source, expected.to_owned()));
            }
        }
        faults.extend(self.disagreeing(
            &["cutoff", "cutoff_update", "cutoff_predict"],
            "one cutoff serves learning and predicting: give one",
        ));
        faults.extend(self.disagreeing(
            &["learner", "kind", "algorithm"],
            "another key names another learner: give one",
        ));
        faults
    }

    /// The settings among `names`, which mean the same, that differ from the first given.
    fn disagreeing(&self, names: &[&str], expected: &str) -> Vec<Fault> {
        let mut given = names.iter().filter_map(|name| self.setting(name));
        let Some(first) = given.next() else { return Vec::new() };
        given
            .filter(|other| !other.value.says_as(&first.value))
            .map(|other| fault(other, "contradicts another key", &self.source, expected.to_owned()))
            .collect()
    }

    fn cutoff(&self) -> Option<f64> {
        let names = ["cutoff", "cutoff_update", "cutoff_predict"];
        names.into_iter().find_map(|name| self.number(name))
    }

    /// Where the file says `name`, up to a colon.
    fn place(&self, name: &str) -> String {
        match self.setting(name) {
            Some(setting) => {
                format!("{}, line {}: ", self.shown, line_of(&self.source, setting.at.start))
            }
            None => String::new(),
        }
    }
}

/// Puts the file's values, where it has them, into settings of either learner.
macro_rules! overlay {
    ($file:ident onto $settings:ident:
     $([$($key:ident)*] by $getter:ident;)*) => {
        $($(
            if let Some(value) = $file.$getter(stringify!($key)) {
                $settings.$key = value;
            }
        )*)*
        if let Some(kernel) = $file.kernel() {
            $settings.kernel = kernel;
        }
        if let Some(metric) = $file.metric() {
            $settings.init_d = metric;
        }
        if let Some(cutoff) = $file.cutoff() {
            $settings.cutoff = cutoff;
        }
        if $file.value("max_fields").is_some() {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "checked when it was read"
            )]
            let count = $file.number("max_fields").map(|count| count as u32);
            $settings.max_fields = count;
        }
        if let Some(norms) = $file.norms("norm_in", $settings.inputs) {
            $settings.norm_in = norms;
        }
        if let Some(norms) = $file.norms("norm_out", $settings.outputs) {
            $settings.norm_out = norms;
        }
    };
}

fn onto_rfwr(file: &LearnerFile, settings: &mut rfwr::Settings) {
    overlay!(file onto settings:
        [diag_only update_d meta] by flag;
        [meta_rate penalty w_gen w_prune init_lambda final_lambda tau_lambda vif_trust vif_update
         min_n_data_factor] by number;
        [init_alpha init_p] by uniform;
        [output_limit d_floor d_ceiling min_one_minus_h] by limit;
    );
}

fn onto_lwpr(file: &LearnerFile, settings: &mut lwpr::Settings) {
    overlay!(file onto settings:
        [diag_only update_d meta] by flag;
        [meta_rate penalty w_gen w_prune init_lambda final_lambda tau_lambda init_s2
         add_threshold] by number;
        [init_alpha] by uniform;
        [output_limit d_floor d_ceiling min_one_minus_h] by limit;
    );
}

/// A fresh learner of `inputs` and `outputs`. Its settings are those of `file`; what that
/// leaves out is the profile's, with its largest action, or else the published value.
///
/// # Errors
/// When a value of the file does not fit the data or the other values.
pub fn build(
    kind: Kind,
    (inputs, outputs): (usize, usize),
    profile: Option<(&Params, f64)>,
    file: Option<&LearnerFile>,
) -> Result<Model, SettingsError> {
    let built = match kind {
        Kind::Rfwr => {
            let published = rfwr::Settings::new(inputs, outputs);
            let mut settings = profile.map_or(published, |(params, limit)| rfwr::Settings {
                outputs,
                norm_out: vec![params.norm_out; outputs],
                ..params.rfwr(inputs, limit)
            });
            if let Some(file) = file {
                onto_rfwr(file, &mut settings);
                refuse(file, settings.diag_only, (inputs, outputs))?;
            }
            Rfwr::new(settings).map(Model::Rfwr)
        }
        Kind::Lwpr => {
            let published = lwpr::Settings::new(inputs, outputs);
            let mut settings = profile.map_or(published, |(params, limit)| lwpr::Settings {
                outputs,
                norm_out: vec![params.norm_out; outputs],
                ..params.lwpr(inputs, limit)
            });
            if let Some(file) = file {
                onto_lwpr(file, &mut settings);
                refuse(file, settings.diag_only, (inputs, outputs))?;
            }
            Lwpr::new(settings).map(Model::Lwpr)
        }
    };
    built.map_err(|error| {
        let key = match &error {
            BuildError::Length { key, .. } | BuildError::Range { key, .. } => key,
            BuildError::FullMetric | BuildError::NoMetric => "init_d",
            _ => "",
        };
        SettingsError::Unfit { place: file.map(|f| f.place(key)).unwrap_or_default(), error }
    })
}

fn refuse(
    file: &LearnerFile,
    diag_only: bool,
    columns: (usize, usize),
) -> Result<(), SettingsError> {
    let faults = file.faults(diag_only, columns);
    if faults.is_empty() { Ok(()) } else { Err(file.refuse(faults)) }
}

/// The setting that an entry stands for.
fn setting(entry: given::Entry, earlier: &[Setting], source: &str) -> Result<Setting, Box<Fault>> {
    let name = entry.key.to_ascii_lowercase();
    let place = Place::Text(entry.at.clone());
    let Some(Key { name, form, .. }) = KEYS.iter().find(|key| key.name == name) else {
        let known = nearest(&name, KEYS.iter().map(|key| key.name));
        return Err(Box::new(Fault {
            key: entry.key.clone(),
            message: format!("unknown key `{}`", clip(&entry.key)),
            expected: "no such setting".to_owned(),
            help: known.map(|known| format!("did you mean `{known}`?")),
            place,
        }));
    };
    let setting = Setting { name, at: entry.at, value: entry.value };
    if earlier.iter().any(|earlier| earlier.name == *name) {
        let expected = "given before; remove one of the two".to_owned();
        return Err(Box::new(fault(&setting, "is given twice", source, expected)));
    }
    match misfit(*form, &setting.value) {
        None => Ok(setting),
        Some(expected) => Err(Box::new(fault(&setting, "is not allowed", source, expected))),
    }
}

fn fault(setting: &Setting, problem: &str, source: &str, expected: String) -> Fault {
    let value = source.get(setting.at.clone()).unwrap_or_default();
    Fault {
        key: setting.name.to_owned(),
        message: format!("`{}` is {}, which {problem}", setting.name, clip(value)),
        expected,
        help: None,
        place: Place::Text(setting.at.clone()),
    }
}

/// The diagonal of a square matrix that is 0 off it.
fn diagonal_of(rows: &[Vec<f64>]) -> Option<Vec<f64>> {
    let is_diagonal = rows.iter().enumerate().all(|(a, row)| {
        row.len() == rows.len() && row.iter().enumerate().all(|(b, d)| a == b || *d == 0.0)
    });
    let entry = |(a, row): (usize, &Vec<f64>)| row.get(a).copied();
    is_diagonal.then(|| rows.iter().enumerate().filter_map(entry).collect())
}

/// Whether one number stands for all entries of a value that matter.
fn is_uniform(value: &Given, diag_only: bool) -> bool {
    match value {
        Given::List(list) => list.windows(2).all(|pair| pair.first() == pair.last()),
        Given::Matrix(rows) => {
            let first = rows.first().and_then(|row| row.first());
            rows.iter().enumerate().all(|(a, row)| {
                row.iter().enumerate().all(|(b, n)| Some(n) == first || (diag_only && a != b))
            })
        }
        _ => true,
    }
}
