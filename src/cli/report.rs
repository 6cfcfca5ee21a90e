//! The words of `report`.

use std::path::PathBuf;

use clap::Args;

const REPORT_EXAMPLES: &str = "\
Examples:
  coadapt report logs                           all sessions and studies below it, on this terminal
  coadapt report logs --out report.html         the same as one page for a browser
  coadapt report logs/S07 logs/S08 --csv data   the data and an SVG of each figure, into a folder
  coadapt report logs --json > report.json

On a terminal the arrows turn the pages, s saves a figure (SVG and CSV), q ends; elsewhere the
report is plain text. What cannot be used is named and left out. Groups are of one task, preset,
profile and kind of operator; only complete sessions count in them, and each subject once.";

/// The words of `report`.
#[derive(Args, Debug)]
#[command(after_help = REPORT_EXAMPLES)]
pub struct Report {
    /// Folders of sessions and studies, or above some.
    #[arg(required = true, value_name = "DIR")]
    pub folders: Vec<PathBuf>,
    /// Write one self-contained HTML page.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Write the data of each figure and table, and each figure as SVG, into this folder.
    #[arg(long, value_name = "DIR")]
    pub csv: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}
