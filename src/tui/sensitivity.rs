//! The slider of a device's sensitivity, the same on every screen.

use super::palette::Glyphs;
use super::text::{fixed, place};

/// The slider's ends: 10^(±26/20) is about 0.05 and 20.
const LEVELS: f64 = 26.0;

/// Where the slider stands, 0 to 1.
#[must_use]
pub fn part(sensitivity: f64) -> f64 {
    (level(sensitivity) + LEVELS) / (2.0 * LEVELS)
}

/// A step of an eighth or so more or less, evenly along the slider.
#[must_use]
pub fn stepped(sensitivity: f64, more: bool) -> f64 {
    let level = (level(sensitivity) + if more { 1.0 } else { -1.0 }).clamp(-LEVELS, LEVELS);
    let value = 10.0_f64.powf(level / 20.0);
    // Three digits that count: with two decimals the slider would stick at its lower end.
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// The slider as a line of text.
#[must_use]
pub fn line(sensitivity: f64, glyphs: Glyphs) -> String {
    const WIDTH: u16 = 25;
    let knob = place((part(sensitivity) * f64::from(WIDTH - 1)).round());
    let (knob_sign, rail, ends) = match glyphs {
        Glyphs::Ascii => ('O', '-', ('|', '|')),
        _ => ('●', '─', ('├', '┤')),
    };
    let bar: String = (0..WIDTH).map(|at| if at == knob { knob_sign } else { rail }).collect();
    format!("sensitivity  - {}{bar}{} +  {}", ends.0, ends.1, fixed(sensitivity, 5, 2))
}

fn level(sensitivity: f64) -> f64 {
    (sensitivity.log10() * 20.0).round().clamp(-LEVELS, LEVELS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_lead_from_end_to_end_and_back_and_stay_within_the_bounds() {
        let mut value = 1.0;
        for _ in 0..40 {
            value = stepped(value, true);
        }
        assert_eq!(part(value), 1.0);
        assert!(value <= 20.0, "{value}");
        for _ in 0..80 {
            value = stepped(value, false);
        }
        assert_eq!(part(value), 0.0);
        assert!(value >= 0.05, "{value}");
        assert_eq!(stepped(stepped(1.0, true), false), 1.0);
        let shown = line(1.0, Glyphs::Braille);
        assert!(shown.contains('●') && shown.ends_with("1.00"));
        assert!(line(2.0, Glyphs::Ascii).is_ascii());
    }
}
