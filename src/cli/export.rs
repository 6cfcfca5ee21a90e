//! The words of `export`.

use std::path::PathBuf;

use clap::Args;

use crate::record::export::Form;

const EXPORT_EXAMPLES: &str = "\
Examples:
  coadapt export logs/S07/001-balance-sequential --to csv
  coadapt export logs/S07/001-balance-sequential --to parquet --out /tmp/S07-1

csv: a folder with steps, episodes, events and (where there is one) evaluation, and columns.csv with
  the unit and meaning of every column. parquet: the same with units in the schemas. mcap: one file;
  its time is controlled time since the session began.
Every row says whose it is (subject, trial, task, preset, mode), so that tables of many sessions can
be put together. Discarded rollouts are there: attempt counts them, and end says discarded.
Parquet and MCAP are features of the build: cargo build --release --features parquet,mcap";

/// The words of `export`.
#[derive(Args, Debug)]
#[command(after_help = EXPORT_EXAMPLES)]
pub struct Export {
    /// The folder of a session: complete, cut, or still being recorded.
    pub session: PathBuf,
    /// csv, parquet or mcap.
    #[arg(long, value_name = "FORM")]
    pub to: Form,
    /// The folder, or MCAP file, to be made [default: SUBJECT-TRIAL-TASK-MODE-FORM, here].
    #[arg(long, value_name = "PATH")]
    pub out: Option<PathBuf>,
    /// Print one JSON object instead of a sentence.
    #[arg(long)]
    pub json: bool,
}
