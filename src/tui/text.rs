//! Numbers and little charts as text of a fixed width.

/// The places of a number on the screen: saturating, and 0 for what is no number.
#[must_use]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturating is what a place on the screen needs"
)]
pub const fn place(value: f64) -> u16 {
    value as u16
}

/// A count as a real number.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^52")]
pub const fn real(count: usize) -> f64 {
    count as f64
}

/// `value` right-aligned in `width` characters (0: as many as it takes); a dash where it is no
/// number or too long.
#[must_use]
pub fn fixed(value: f64, width: usize, decimals: usize) -> String {
    fit(&format!("{value:.decimals$}"), value, width)
}

/// Like [`fixed`], always with a sign.
#[must_use]
pub fn signed(value: f64, width: usize, decimals: usize) -> String {
    fit(&format!("{value:+.decimals$}"), value, width)
}

fn fit(digits: &str, value: f64, width: usize) -> String {
    // "−0.0" flickers beside "+0.0" where nothing moves.
    let is_zero = digits.chars().all(|c| matches!(c, '-' | '+' | '0' | '.'));
    let room = if width == 0 { 12 } else { width };
    let digits = match (value.is_finite() && digits.len() <= room, is_zero) {
        (true, true) => digits.replace(['+', '-'], " "),
        (true, false) => digits.replace('-', "−"),
        (false, _) => "–".to_owned(),
    };
    format!("{digits:>width$}")
}

/// A count right-aligned in `width` characters, shortened to thousands or millions.
#[must_use]
pub fn count(count: u64, width: usize) -> String {
    let full = count.to_string();
    let short = match count {
        _ if full.len() <= width => full,
        0..10_000_000 => format!("{}k", count / 1000),
        _ => format!("{}M", count / 1_000_000),
    };
    format!("{short:>width$}")
}

/// The last `width` of `values` as bars between 0 and `top`, right-aligned.
#[must_use]
pub fn sparkline(values: &[f64], width: usize, top: f64) -> String {
    const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let shown = &values[values.len().saturating_sub(width)..];
    let bars = shown.iter().map(|value| {
        let level = place((value / top * 7.0).round().clamp(0.0, 7.0));
        if value.is_finite() { BARS[usize::from(level)] } else { ' ' }
    });
    std::iter::repeat_n(' ', width - shown.len()).chain(bars).collect()
}

/// The mean of `values`; `None` of none.
#[must_use]
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / real(values.len()))
}

/// At each of `values`, the mean of it and up to `window` − 1 before it.
#[must_use]
pub fn moving_mean(values: &[f64], window: usize) -> Vec<f64> {
    (1..=values.len()).filter_map(|end| mean(&values[end.saturating_sub(window)..end])).collect()
}

/// Minutes and seconds.
#[must_use]
pub fn minutes(seconds: f64) -> String {
    let seconds = u32::from(place(seconds));
    format!("{:02}:{:02}", seconds / 60, seconds % 60)
}

/// Breaks `text` at blanks into lines of at most `width` characters.
#[must_use]
pub fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let Some(line) = lines.last_mut() else { break };
        let length = line.chars().count();
        if length > 0 && length + 1 + word.chars().count() > width {
            lines.push(word.to_owned());
        } else {
            if length > 0 {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}

/// `text` cut to `width` characters, with an ellipsis where something is missing.
#[must_use]
pub fn cut(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_owned();
    }
    text.chars().take(width.saturating_sub(1)).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_width_whatever_they_are() {
        for value in [0.0, -0.04, 9.99, -123.4, 1e300, f64::NAN, f64::NEG_INFINITY] {
            assert_eq!(signed(value, 6, 1).chars().count(), 6, "{value}");
            assert_eq!(fixed(value, 6, 2).chars().count(), 6, "{value}");
        }
        assert_eq!(signed(-3.46, 6, 1), "  −3.5");
        assert_eq!(signed(-0.01, 6, 1), "   0.0");
        for (n, shown) in [(7, "    7"), (99_999, "99999"), (100_000, " 100k"), (u64::MAX, "")] {
            assert!(count(n, 5).ends_with(shown));
        }
    }

    #[test]
    fn a_sparkline_shows_the_last_values() {
        assert_eq!(sparkline(&[0.0, 0.5, 1.0], 5, 1.0), "  ▁▅█");
        assert_eq!(sparkline(&[1.0, 0.0, 9.0], 2, 1.0), "▁█");
        assert_eq!(sparkline(&[f64::NAN, 0.0], 2, 0.0).chars().count(), 2);
    }

    #[test]
    fn a_moving_mean_begins_with_what_there_is() {
        assert_eq!(moving_mean(&[1.0, 3.0, 5.0], 2), [1.0, 2.0, 4.0]);
        assert_eq!(mean(&[]), None);
    }

    #[test]
    fn text_wraps_at_blanks() {
        assert_eq!(wrapped("one two  three", 7), ["one two", "three"]);
        assert_eq!(cut("abcdef", 4), "abc…");
        assert_eq!(minutes(271.4), "04:31");
    }
}
