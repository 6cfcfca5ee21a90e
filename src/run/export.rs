//! `coadapt export …`

use std::process::ExitCode;

use super::words::usage;
use super::{RunError, say};
use crate::cli;
use crate::record::Error;
use crate::record::export::{self, Exported, Form};

/// Writes a session's tables for other programs.
pub(super) fn export(words: &cli::Export) -> Result<ExitCode, RunError> {
    let form = words.to;
    if !form.is_built_in() {
        return Err(RunError::Usage(how_to_build(form)));
    }
    let out = match &words.out {
        Some(out) => out.clone(),
        None => export::usual_name(&words.session, form).map_err(refused)?,
    };
    let exported = export::export(&words.session, form, &out).map_err(refused)?;
    say(&if words.json { json(words, &exported) } else { sentence(&exported) })?;
    Ok(ExitCode::SUCCESS)
}

/// Parquet and MCAP are features of the build.
fn how_to_build(form: Form) -> String {
    let word = form.word();
    format!(
        "this coadapt was built without {word}; in its source folder `cargo build --release --features \
         {word}` builds one that has it, in target/release; --to csv works with every build"
    )
}

/// A disk that refuses is a failure, a file that does not read a wrong input.
fn refused(error: Error) -> RunError {
    match error {
        Error::Io { action: "read", .. }
        | Error::Cell { .. }
        | Error::Unfit { .. }
        | Error::NoSession { .. } => usage(error),
        other => RunError::Failed(other.to_string()),
    }
}

fn sentence(exported: &Exported) -> String {
    let counts: Vec<String> =
        exported.counts.iter().map(|(name, count)| format!("{name} {count}")).collect();
    format!("{}: {}", exported.path.display(), counts.join(", "))
}

fn json(words: &cli::Export, exported: &Exported) -> String {
    let counts: serde_json::Map<String, serde_json::Value> =
        exported.counts.iter().map(|(name, count)| (name.clone(), (*count).into())).collect();
    serde_json::json!({
        "schema": 1,
        "session": words.session.display().to_string(),
        "to": words.to.word(),
        "path": exported.path.display().to_string(),
        "counts": counts,
    })
    .to_string()
}
