//! The words of `coadapt study`.

use std::path::PathBuf;

use clap::{Args, Subcommand, value_parser};

use super::key_value;
use crate::study::batch::Shard;

const STUDY_EXAMPLES: &str = "\
Examples:
  coadapt study balance                         two modes, six types of people, 20 seeds
  coadapt study mountain-car --seeds 3 --out /tmp/car
  coadapt study balance --set learner.init_d=3,25,60        each value is a setting of its own
  coadapt study balance --shard 1/8             the first of eight shares of the runs
  coadapt study balance --slurm                 writes slurm.sh, an array of such shares
  coadapt study merge logs/studies/balance-*-of-8

A study is a RON file: profiles/studies/NAME.ron, built in, or a path; docs/STUDIES.md tells how to
write one. Finished runs are kept at once: the same command goes on where it was cut. Results do not
depend on the number of jobs. The folder gets results.csv (a row for every number), summary.json
(means, medians, 95 % intervals, differences seed by seed), table.txt (what is printed) and figures/
(the data of figures).";

/// The words of `study`.
#[derive(Args, Debug)]
#[command(after_help = STUDY_EXAMPLES, args_conflicts_with_subcommands = true)]
pub struct Study {
    /// What else can be done.
    #[command(subcommand)]
    pub command: Option<StudyCommand>,
    /// The study to be carried out.
    #[command(flatten)]
    pub words: StudyWords,
}

/// What can be done beside carrying out a study.
#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// Join the folders of shards, and say what is missing.
    Merge(Merge),
    /// The studies in `profiles/studies/` and those that are built in.
    List(StudyList),
}

/// The words of `study list`.
#[derive(Args, Debug)]
pub struct StudyList {
    /// Print one JSON object instead of lines.
    #[arg(long)]
    pub json: bool,
}

/// Which study, and how it is carried out.
#[derive(Args, Debug)]
pub struct StudyWords {
    /// A name in `profiles/studies/` or built in, or a path.
    #[arg(required = true)]
    pub study: Option<String>,
    /// Threads [default: one for each core].
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=4096))]
    pub jobs: Option<u32>,
    /// Only share K of N of the runs.
    #[arg(long, value_name = "K/N", conflicts_with = "slurm")]
    pub shard: Option<Shard>,
    /// So many seeds in place of the study's.
    #[arg(long, value_name = "N")]
    pub seeds: Option<u32>,
    /// Change a value of the profile in all runs; of several values with commas between, each is
    /// a setting of its own.
    #[arg(long, value_name = "KEY=VALUE,…", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// The folder for results [default: logs/studies/NAME].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Keep the step rows of every session, in DIR/steps.
    #[arg(long)]
    pub keep_steps: bool,
    /// Write the script of a Slurm array of JOBS shares [default: 10 minutes each], and run nothing
    /// but what tells how much a run needs.
    #[arg(
        long,
        value_name = "JOBS",
        num_args = 0..=1,
        value_parser = value_parser!(u32).range(1..=1000)
    )]
    pub slurm: Option<Option<u32>>,
    /// Print one JSON object instead of tables.
    #[arg(long)]
    pub json: bool,
}

/// The words of `study merge`.
#[derive(Args, Debug)]
pub struct Merge {
    /// The folders of shards.
    #[arg(required = true, value_name = "DIR")]
    pub folders: Vec<PathBuf>,
    /// The folder for the whole [default: logs/studies/NAME].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object instead of tables.
    #[arg(long)]
    pub json: bool,
}
