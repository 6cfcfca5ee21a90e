//! A progress bar on standard error, where somebody looks.

use std::io::{self, IsTerminal};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar of `count` things, called `noun`; none where nobody looks.
pub(super) fn bar(count: usize, noun: &str) -> Option<ProgressBar> {
    let is_dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
    if !io::stderr().is_terminal() || is_dumb || count == 0 {
        return None;
    }
    let target = ProgressDrawTarget::stderr_with_hz(5);
    let bar = ProgressBar::with_draw_target(Some(count as u64), target);
    let template =
        format!("{{pos}}/{{len}} {noun} {{wide_bar}} {{percent:>3}} %  {{eta:>4}} left{{msg}}");
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style.progress_chars("=> "));
    }
    // Drawn at once: the first may take minutes.
    bar.tick();
    Some(bar)
}
