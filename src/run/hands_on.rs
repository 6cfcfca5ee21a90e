//! What is typed at an emulated device: a person's hand at its plant.

use std::io::{self, BufRead};
use std::str::FromStr;
use std::sync::mpsc::{Receiver, sync_channel};

use super::RunError;
use crate::backend::emulator::hand::Hand;
use crate::signal::Seconds;

/// What a person at a terminal should know.
pub(super) const HINT: &str = "Enter steadies the pole by hand; help tells what else a hand can do";

/// What can be typed.
pub(super) const HELP: &str = "\
steady, or Enter   a hand brings the pole to hang at rest
raise              a hand holds the pole upright for 3 s, then lets go
push N             a hand moves the cart by N cm while the motor is off; -N the other way
unplug S           the cable is pulled for S seconds";

/// What a line asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Doing {
    /// A hand at the plant.
    Hand(Hand),
    /// The cable is pulled for so long.
    Unplug(Seconds),
    /// What can be typed.
    Help,
}

impl FromStr for Doing {
    type Err = String;

    fn from_str(line: &str) -> Result<Self, String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            [] | ["steady"] => Ok(Self::Hand(Hand::Steady)),
            ["raise"] => Ok(Self::Hand(Hand::Raise)),
            ["push", way] => {
                let cm = number(way, -100.0, 100.0)?;
                Ok(Self::Hand(Hand::Push { by_m: cm / 100.0 }))
            }
            ["unplug", time] => Ok(Self::Unplug(Seconds(number(time, 0.0, 3600.0)?))),
            ["help"] => Ok(Self::Help),
            _ => Err(format!("`{}` is nothing that a hand can do: see help", line.trim())),
        }
    }
}

fn number(word: &str, least: f64, most: f64) -> Result<f64, String> {
    let within = word.parse().ok().filter(|number| (least..=most).contains(number));
    within.ok_or_else(|| format!("`{word}` is no number from {least} to {most}"))
}

/// The lines of standard input, as they come. The end of input ends nothing.
pub(super) fn listen() -> Result<Receiver<String>, RunError> {
    let (sender, lines) = sync_channel(16);
    std::thread::Builder::new()
        .name("coadapt-hand".to_owned())
        .spawn(move || {
            for line in io::stdin().lock().lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        })
        .map_err(|error| RunError::Failed(format!("no thread for standard input: {error}")))?;
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_say_what_a_hand_does() {
        let hand = |hand| Ok(Doing::Hand(hand));
        assert_eq!("".parse(), hand(Hand::Steady));
        assert_eq!(" steady ".parse(), hand(Hand::Steady));
        assert_eq!("raise".parse(), hand(Hand::Raise));
        assert_eq!("push -5".parse(), hand(Hand::Push { by_m: -0.05 }));
        assert_eq!("unplug 2.5".parse(), Ok(Doing::Unplug(Seconds(2.5))));
        assert_eq!("help".parse(), Ok(Doing::Help));
        for wrong in ["fly", "push", "push far", "push nan", "push 1e9", "unplug -1", "raise 2"] {
            assert!(wrong.parse::<Doing>().is_err(), "{wrong}");
        }
    }
}
