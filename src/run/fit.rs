//! `coadapt fit …`: a learner on a table or a recorded session.

mod progress;
mod results;
mod whole;

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

use super::shutdown::Shutdown;
use super::{RunError, say, signal_code, tell, wants_colour};
use crate::cli;
use crate::clock::WallClock;
use crate::learner::{Kind, Learner, Model, Params};
use crate::profile::settings::{self, LearnerFile, SettingsError};
use crate::record::policy::TABLE;
use crate::record::{self, Policy};
use crate::sharing::Mode;
use crate::study::fit::session::{self, Recorded};
use crate::study::fit::{self as fitting, FitError, Fitted, Kept, Source, Watch, predictions};
use crate::study::table::{self, Table, TableError};
use progress::Bar;
use results::Results;
use whole::Whole;

/// Between two looks whether somebody wants to stop while the data are awaited.
const PATIENCE: Duration = Duration::from_millis(50);
/// More fields than this, and more than one for every [`FEW_SAMPLES`] samples, are worth a word.
const MANY_FIELDS: usize = 200;
const FEW_SAMPLES: u64 = 10;

fn usage(error: impl std::fmt::Display) -> RunError {
    RunError::Usage(error.to_string())
}

impl From<FitError> for RunError {
    fn from(error: FitError) -> Self {
        match error {
            FitError::Write(_) => Self::Failed(error.to_string()),
            other => usage(other),
        }
    }
}

impl From<SettingsError> for RunError {
    fn from(error: SettingsError) -> Self {
        match error {
            SettingsError::Faults(report) => usage(report.render(wants_colour())),
            other => usage(other),
        }
    }
}

/// What is to be learned, and for what.
struct Data {
    source: Source,
    inputs: Vec<String>,
    outputs: Vec<String>,
    /// The session's learner, with the largest action.
    learner: Option<(Params, f64)>,
    task: String,
    preset: String,
    mode: Mode,
    notices: Vec<String>,
}

/// The files beside the data: queries, and what is to be written.
struct Files {
    query: Option<(Table<BufReader<File>>, u64)>,
    out: Option<Whole>,
    answers: Option<Whole>,
}

/// `coadapt fit …`
pub(super) fn fit(words: &cli::Fit) -> Result<ExitCode, RunError> {
    let shutdown = Shutdown::listen();
    let asked = words.learner.as_deref().map(kind_of).transpose()?;
    let file = words.settings.as_deref().map(LearnerFile::open).transpose()?;
    let Some(data) = gather(words, &shutdown)? else { return Ok(interrupted(&shutdown)) };
    let kind = choose_kind(asked, file.as_ref(), &data)?;
    let columns = (data.inputs.len(), data.outputs.len());
    let base = data.learner.as_ref().map(|(params, limit)| (params, *limit));
    let mut learner = settings::build(kind, columns, base, file.as_ref())?;
    let mut files = Files::open(words, &data.inputs)?;
    for notice in &data.notices {
        tell(notice);
    }
    tell_unused(file.as_ref(), kind);

    let clock = WallClock::start();
    let mut bar = Bar::new(clock);
    let mut watch = |progress| {
        bar.show(progress);
        shutdown.signal().is_none()
    };
    let fitted = fitting::fit(&mut learner, &data.source, &clock, &mut watch)?;
    let answered = files.answer(&learner, (&data.inputs, &data.outputs), &mut watch)?;
    bar.clear();
    // Asked last: what was stopped halfway is not kept.
    let Some(fitted) = fitted.filter(|_| shutdown.signal().is_none()) else {
        return Ok(interrupted(&shutdown));
    };
    warn(&fitted, &learner);
    let results = Results::new(kind, &learner, &fitted, (&data.inputs, &data.outputs));
    let kept = files.keep(words, data, learner)?;
    say(&if words.json { results.json()? } else { results.sentences(&kept, answered) })?;
    Ok(ExitCode::SUCCESS)
}

impl Files {
    /// Opens the queries, and makes sure that everything can be written, before the work.
    fn open(words: &cli::Fit, inputs: &[String]) -> Result<Self, RunError> {
        let read = [Some(&words.data), words.settings.as_ref(), words.query.as_ref()];
        let read: Vec<&Path> = read.into_iter().flatten().map(PathBuf::as_path).collect();
        let prepare = |option, path: Option<&PathBuf>| {
            path.map(|path| Whole::prepare(option, path, &read)).transpose()
        };
        let query = words.query.as_deref().map(|path| open_query(path, inputs)).transpose()?;
        let out = prepare("--out", words.out.as_ref())?;
        let answers = prepare("--predictions", words.predictions.as_ref())?;
        if let (Some(out), Some(answers)) = (&out, &answers)
            && out.is_same(answers)
        {
            return Err(usage("--out and --predictions name the same file"));
        }
        Ok(Self { query, out, answers })
    }

    /// Answers the queries, and returns their number.
    fn answer(
        &mut self,
        learner: &Model,
        (inputs, outputs): (&[String], &[String]),
        watch: Watch<'_>,
    ) -> Result<Option<u64>, RunError> {
        let (Some(query), Some(answers)) = (self.query.take(), &mut self.answers) else {
            return Ok(None);
        };
        let to = BufWriter::new(answers.file());
        Ok(predictions::predict(learner, (inputs, outputs), query, to, watch)?)
    }

    /// Writes the policy, puts both files into their places, and says which.
    fn keep(
        self,
        words: &cli::Fit,
        data: Data,
        learner: Model,
    ) -> Result<Vec<(&'static str, PathBuf)>, RunError> {
        let mut kept = Vec::new();
        if let (Some(mut out), Some(path)) = (self.out, &words.out) {
            let text = record::policy_text(path, &policy_of(data, learner));
            out.write(&text.map_err(|error| RunError::Failed(error.to_string()))?)?;
            kept.push(("policy", out.keep()?));
        }
        if let Some(answers) = self.answers {
            kept.push(("predictions", answers.keep()?));
        }
        Ok(kept)
    }
}

fn kind_of(word: &str) -> Result<Kind, RunError> {
    Kind::from_word(word)
        .ok_or_else(|| usage(format_args!("--learner {word:?} is not known; give rfwr or lwpr")))
}

/// The learner that is asked for: on the command line, by the settings, by the session.
fn choose_kind(
    asked: Option<Kind>,
    file: Option<&LearnerFile>,
    data: &Data,
) -> Result<Kind, RunError> {
    let session = data.learner.as_ref().map(|(params, _)| params.kind);
    let of_file = file.and_then(LearnerFile::kind);
    if let (Some(asked), Some(of_file), Some(file)) = (asked, of_file, file)
        && asked != of_file
    {
        return Err(usage(format_args!(
            "{}: these are settings for {}, and --learner asks for {}: leave --learner out, or \
             give other settings",
            file.shown(),
            of_file.word(),
            asked.word()
        )));
    }
    Ok(asked.or(of_file).or(session).unwrap_or_default())
}

/// Reads what is to be learned, or the head of it; none when a signal came first.
fn gather(words: &cli::Fit, shutdown: &Shutdown) -> Result<Option<Data>, RunError> {
    let inputs = words.inputs.as_deref().map(|names| named("--inputs", names)).transpose()?;
    let outputs = words.outputs.as_deref().map(|names| named("--outputs", names)).transpose()?;
    if words.data.is_dir() {
        return Ok(Some(recorded(session::read(
            &words.data,
            inputs.as_deref(),
            outputs.as_deref(),
        )?)));
    }
    let (Some(inputs), Some(outputs)) = (inputs, outputs) else {
        return Err(usage(format_args!(
            "{}: say which columns of the table to learn from and which to learn, such as \
             --inputs x1,x2 --outputs y{}",
            words.data.display(),
            columns_of(&words.data)?
        )));
    };
    let columns = [&inputs[..], &outputs[..]].concat();
    let path = words.data.clone();
    let open = move || {
        if path == Path::new("-") {
            let kept: Result<Kept, TableError> =
                fitting::keep("standard input", io::stdin().lock(), &columns);
            Ok(Source::Kept(kept?))
        } else {
            Source::open(&path, &columns)
        }
    };
    let data = |source| Data {
        source,
        inputs,
        outputs,
        learner: None,
        task: TABLE.to_owned(),
        preset: TABLE.to_owned(),
        // The learner watched and did nothing.
        mode: Mode::Sequential,
        notices: Vec::new(),
    };
    // Only a session's rows of actions are samples, and its folder says which.
    let is_steps = words.data.file_name().is_some_and(|name| name == "steps.csv")
        && words.data.with_file_name("session.json").exists();
    if is_steps {
        tell("this table belongs to a recorded session: to learn its main phase, give its folder");
    }
    Ok(await_data(open, shutdown)?.map(data))
}

/// What columns there are, for a message; nothing where that takes the data away.
fn columns_of(path: &Path) -> Result<String, RunError> {
    if path == Path::new("-") {
        return Ok(String::new());
    }
    let refused =
        |cause| usage(format_args!("the data {} cannot be read: {cause}", path.display()));
    // Opening a pipe would wait for its other end.
    if !fs::metadata(path).map_err(refused)?.is_file() {
        return Ok(String::new());
    }
    let file = File::open(path).map_err(refused)?;
    let heads = table::heads(&path.display().to_string(), file).map_err(usage)?;
    Ok(format!("; its columns are {heads}"))
}

fn recorded(recorded: Recorded) -> Data {
    let Recorded { sidecar, learner, action_limit, inputs, outputs, samples, notices } = recorded;
    Data {
        source: Source::Kept(samples),
        inputs,
        outputs,
        learner: Some((learner, action_limit)),
        task: sidecar.task,
        preset: sidecar.preset,
        mode: sidecar.mode,
        notices,
    }
}

fn named(option: &str, names: &[String]) -> Result<Vec<String>, RunError> {
    let names: Vec<String> = names.iter().map(|name| name.trim().to_owned()).collect();
    if names.iter().any(String::is_empty) {
        return Err(usage(format_args!(
            "{option}: a name is empty; give the columns' names with commas between, such as x1,x2"
        )));
    }
    Ok(names)
}

/// Runs `open` aside: a pipe may let one wait, and a signal must be heard meanwhile.
fn await_data(
    open: impl FnOnce() -> Result<Source, FitError> + Send + 'static,
    shutdown: &Shutdown,
) -> Result<Option<Source>, RunError> {
    let (done, opened) = sync_channel(1);
    std::thread::Builder::new()
        .name("coadapt-data".to_owned())
        .spawn(move || done.send(open()))
        .map_err(|error| RunError::Failed(format!("the data could not be read: {error}")))?;
    loop {
        match opened.recv_timeout(PATIENCE) {
            Ok(source) => return Ok(Some(source?)),
            Err(_) if shutdown.signal().is_some() => return Ok(None),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(RunError::Failed("reading the data failed".to_owned()));
            }
        }
    }
}

fn open_query(path: &Path, inputs: &[String]) -> Result<(Table<BufReader<File>>, u64), RunError> {
    let name = path.display().to_string();
    let refused = |cause| usage(format_args!("the query {name} cannot be read: {cause}"));
    let file = File::open(path).map_err(refused)?;
    let about = file.metadata().map_err(refused)?;
    if about.is_dir() {
        return Err(usage(format_args!("the query {name} is a folder; give a CSV table")));
    }
    Ok((Table::open(&name, BufReader::new(file), inputs).map_err(usage)?, about.len()))
}

fn interrupted(shutdown: &Shutdown) -> ExitCode {
    tell("interrupted: nothing was written");
    shutdown.signal().map_or(ExitCode::FAILURE, signal_code)
}

fn tell_unused(file: Option<&LearnerFile>, kind: Kind) {
    let Some(file) = file else { return };
    let unused = file.unused(kind);
    if !unused.is_empty() {
        let (shown, word, keys) = (file.shown(), kind.word(), unused.join(", "));
        tell(&format!("{shown}: {word} has no {keys}, which is left out"));
    }
}

/// Says what may surprise in the results.
fn warn(fitted: &Fitted, learner: &Model) {
    if let Some((line, why)) = fitted.first_refused {
        let (noun, verb) =
            if fitted.refused == 1 { ("sample", "was") } else { ("samples", "were") };
        tell(&format!(
            "{} {noun} {verb} refused and changed nothing; the first, in line {line}: {why}",
            fitted.refused
        ));
    }
    let fields = learner.fields();
    if fields > MANY_FIELDS && fields as u64 > fitted.samples / FEW_SAMPLES {
        tell(&format!(
            "{fields} receptive fields for {} samples: the fields are narrow beside the data; \
             give norm_in the inputs' spans in --settings, or a smaller init_d",
            fitted.samples
        ));
    }
}

fn policy_of(data: Data, learner: Model) -> Policy<Model> {
    Policy {
        version: record::VERSION.to_owned(),
        task: data.task,
        preset: data.preset,
        mode: data.mode,
        percent: 100,
        features: data.inputs,
        outputs: data.outputs,
        action_limit: data.learner.map(|(_, limit)| limit),
        learner,
    }
}
