//! The effective profile, each value with its origin.

use super::document::{Document, Origin};
use super::report::Report;
use super::scan;

/// Origins begin in this column where the value is short enough.
const ORIGIN_COLUMN: usize = 48;

/// The effective profile of `document` as RON, every key; `with_origin` adds to each where
/// its value comes from: `// default`, `// balance.ron:12` or `// --set`. The text is a
/// profile that reads back as the same.
///
/// # Errors
/// The document is no profile.
pub fn show(document: &Document, with_origin: bool) -> Result<String, Report> {
    let text = document.read()?.to_ron();
    if !with_origin {
        return Ok(text + "\n");
    }
    let entries = scan::entries(&text).unwrap_or_default();
    let leaves = entries.iter().filter(|entry| !entry.is_section);
    // The last line of each value, with the origin of its key.
    let origins: Vec<(usize, String)> = leaves
        .map(|entry| {
            let origin = match document.origin(&entry.path) {
                Origin::Default => "default".to_owned(),
                Origin::File { line } => format!("{}.ron:{line}", document.name()),
                Origin::Set => "--set".to_owned(),
            };
            (scan::line_of(&text, entry.value.end), origin)
        })
        .collect();
    let lines = text.lines().enumerate().map(|(index, line)| {
        match origins.iter().find(|(number, _)| *number == index + 1) {
            Some((_, origin)) => format!("{line:<ORIGIN_COLUMN$} // {origin}\n"),
            None => format!("{line}\n"),
        }
    });
    Ok(lines.collect())
}
