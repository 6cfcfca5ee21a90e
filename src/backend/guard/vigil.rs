//! When the guard stops the motor: a pure function of the beats that it hears and of time.

use crate::signal::Seconds;

/// What a program says with each beat.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Watch {
    /// Nobody is armed: silence is fine.
    #[default]
    Idle,
    /// The motor may run: silence is not.
    Armed,
    /// The device homes and must get no byte at all.
    Mute,
}

impl Watch {
    const ALL: [Self; 3] = [Self::Idle, Self::Armed, Self::Mute];

    /// As it goes over the line.
    #[must_use]
    pub const fn byte(self) -> u8 {
        match self {
            Self::Idle => b'i',
            Self::Armed => b'a',
            Self::Mute => b'm',
        }
    }

    /// What a byte says, if anything.
    #[must_use]
    pub fn of(byte: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|watch| watch.byte() == byte)
    }
}

/// What the guard heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// A beat.
    Beat(Watch),
    /// The program is gone.
    End,
}

/// What the guard does next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Act {
    /// Listen until this time; `None`: until something comes.
    Listen(Option<Seconds>),
    /// Nobody is there to listen to: wait until this time.
    Wait(Seconds),
    /// Write the stop.
    Stop,
    /// Write it once more.
    StopAgain,
    /// Go: nothing is left to do.
    Leave,
}

/// How long the stop is repeated,
const LASTS: Seconds = Seconds(1.0);
/// and how often.
const EVERY: Seconds = Seconds(0.02);

/// The stop is being written again and again.
#[derive(Clone, Copy, Debug)]
struct Burst {
    next: Seconds,
    until: Seconds,
    /// It was written before.
    is_said: bool,
}

/// The guard's mind.
#[derive(Clone, Debug)]
pub struct Vigil {
    patience: Seconds,
    watch: Watch,
    /// When the last beat came, unless its silence has been dealt with.
    beat: Option<Seconds>,
    burst: Option<Burst>,
    is_alone: bool,
}

impl Vigil {
    /// Listens to a program that nobody has armed yet.
    #[must_use]
    pub const fn new(patience: Seconds) -> Self {
        Self { patience, watch: Watch::Idle, beat: None, burst: None, is_alone: false }
    }

    /// Takes what was heard at `now`.
    pub fn hear(&mut self, heard: Heard, now: Seconds) {
        match heard {
            Heard::Beat(watch) => {
                self.watch = watch;
                self.beat = Some(now);
                // A program that was stopped and goes on believes that it is armed until it has
                // noticed: only what it says otherwise ends the stop.
                if watch != Watch::Armed {
                    self.burst = None;
                }
            }
            Heard::End => {
                self.is_alone = true;
                self.stop_if_armed(now);
            }
        }
    }

    /// What to do at `now`; after each deed this is to be asked again.
    pub fn act(&mut self, now: Seconds) -> Act {
        self.burst = self.burst.filter(|burst| now < burst.until);
        if self.due().is_some_and(|due| now >= due) {
            self.beat = None;
            self.stop_if_armed(now);
        }
        if let Some(burst) = self.burst.as_mut().filter(|burst| now >= burst.next) {
            burst.next = now + EVERY;
            let was_said = std::mem::replace(&mut burst.is_said, true);
            return if was_said { Act::StopAgain } else { Act::Stop };
        }
        let next = self.burst.map(|burst| burst.next);
        match (self.is_alone, next) {
            (true, None) => Act::Leave,
            (true, Some(next)) => Act::Wait(next),
            (false, next) => Act::Listen(next.or_else(|| self.due())),
        }
    }

    /// When silence is too long.
    fn due(&self) -> Option<Seconds> {
        let is_watched = self.watch == Watch::Armed && !self.is_alone && self.burst.is_none();
        self.beat.filter(|_| is_watched).map(|beat| beat + self.patience)
    }

    fn stop_if_armed(&mut self, now: Seconds) {
        if self.watch == Watch::Armed {
            let until = now + LASTS;
            let fresh = Burst { next: now, until, is_said: false };
            self.burst = Some(self.burst.map_or(fresh, |burst| Burst { until, ..burst }));
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A guard on virtual time, and when it wrote a stop.
    struct Night {
        vigil: Vigil,
        now: Seconds,
        stops: Vec<f64>,
        /// How many of these were the whole burst.
        bursts: usize,
        has_left: bool,
    }

    impl Night {
        fn new() -> Self {
            let vigil = Vigil::new(Seconds(0.1));
            Self { vigil, now: Seconds(0.0), stops: Vec::new(), bursts: 0, has_left: false }
        }

        fn hear(&mut self, heard: Heard) {
            self.vigil.hear(heard, self.now);
            self.pass(0.0);
        }

        /// Time passes without a sound.
        fn pass(&mut self, time: f64) {
            let end = self.now + Seconds(time);
            loop {
                let until = match self.vigil.act(self.now) {
                    act @ (Act::Stop | Act::StopAgain) => {
                        self.stops.push(self.now.0);
                        self.bursts += usize::from(act == Act::Stop);
                        continue;
                    }
                    Act::Leave => {
                        self.has_left = true;
                        break;
                    }
                    Act::Listen(None) => break,
                    Act::Listen(Some(until)) | Act::Wait(until) => until,
                };
                assert!(until > self.now, "it would turn in circles");
                if until > end {
                    break;
                }
                self.now = until;
            }
            self.now = end;
        }

        /// Beats every 20 ms.
        fn beats(&mut self, watch: Watch, time: f64) {
            let end = self.now + Seconds(time);
            while self.now < end {
                self.hear(Heard::Beat(watch));
                self.pass(0.02);
            }
        }
    }

    #[test]
    fn a_beating_heart_and_an_orderly_end_need_no_stop() {
        let mut night = Night::new();
        night.beats(Watch::Idle, 0.5);
        night.beats(Watch::Armed, 60.0);
        night.hear(Heard::Beat(Watch::Idle));
        night.hear(Heard::End);
        assert!(night.has_left);
        assert!(night.stops.is_empty(), "{:?}", night.stops);
    }

    #[test]
    fn an_end_while_armed_stops_the_motor_for_a_second() {
        let mut night = Night::new();
        night.beats(Watch::Armed, 0.1);
        let end = night.now.0;
        night.hear(Heard::End);
        assert_eq!(night.stops, [end]);
        night.pass(0.9);
        assert!(!night.has_left);
        night.pass(0.2);
        assert!(night.has_left);
        assert!((49..=51).contains(&night.stops.len()), "{}", night.stops.len());
        assert!(night.stops.iter().all(|at| *at <= end + 1.0));
        assert!(night.stops.windows(2).all(|pair| pair[1] - pair[0] < 0.021));
        assert_eq!(night.bursts, 1, "a board that is spoken to by two has no room for more");
    }

    #[test]
    fn silence_while_armed_stops_the_motor_once_and_the_watch_goes_on() {
        let mut night = Night::new();
        night.beats(Watch::Armed, 0.1);
        let last = night.now.0 - 0.02;
        night.pass(30.0);
        assert!((night.stops[0] - last - 0.1).abs() < 1e-9, "{}", night.stops[0]);
        assert!((49..=51).contains(&night.stops.len()), "{}", night.stops.len());
        assert!(!night.has_left);
        // It went on after all, and is silent again.
        night.stops.clear();
        night.beats(Watch::Armed, 0.5);
        assert!(night.stops.is_empty(), "{:?}", night.stops);
        night.pass(0.2);
        assert!(!night.stops.is_empty());
        assert_eq!(night.bursts, 2);
        // Killed while it was stopped.
        night.pass(5.0);
        night.stops.clear();
        night.hear(Heard::End);
        night.pass(2.0);
        assert!(night.has_left && night.stops.len() > 40);
    }

    #[test]
    fn only_another_word_ends_the_stop() {
        for (watch, ends) in [(Watch::Armed, false), (Watch::Idle, true), (Watch::Mute, true)] {
            let mut night = Night::new();
            night.hear(Heard::Beat(Watch::Armed));
            night.pass(0.3);
            night.stops.clear();
            night.beats(watch, 0.5);
            assert_eq!(night.stops.is_empty(), ends, "{watch:?}");
        }
    }

    #[test]
    fn a_homing_device_gets_no_byte() {
        let mut night = Night::new();
        night.beats(Watch::Armed, 0.1);
        night.hear(Heard::Beat(Watch::Mute));
        night.pass(20.0);
        night.hear(Heard::End);
        assert!(night.has_left);
        assert!(night.stops.is_empty(), "{:?}", night.stops);
    }

    #[test]
    fn nobody_who_never_armed_is_stopped() {
        let mut night = Night::new();
        night.pass(10.0);
        night.hear(Heard::End);
        assert!(night.has_left);
        assert!(night.stops.is_empty(), "{:?}", night.stops);
    }

    #[test]
    fn words_survive_the_line() {
        for watch in Watch::ALL {
            assert_eq!(Watch::of(watch.byte()), Some(watch));
        }
        assert_eq!(Watch::of(0), None);
    }

    proptest! {
        /// Whatever came before, an armed program that falls silent is stopped within its
        /// patience, and one that dies at once; any other gets not a byte from then on.
        #[test]
        fn the_last_word_decides(
            before in prop::collection::vec((0_usize..3, 0.0..2.0), 0..20),
            last in 0_usize..3,
            dies in any::<bool>(),
        ) {
            let mut night = Night::new();
            for (watch, time) in before {
                night.hear(Heard::Beat(Watch::ALL[watch]));
                night.pass(time);
            }
            night.hear(Heard::Beat(Watch::ALL[last]));
            let at = night.now.0;
            night.stops.clear();
            let patience = if dies { 0.0 } else { 0.1 };
            if dies {
                night.hear(Heard::End);
            }
            night.pass(3.0);
            let is_armed = Watch::ALL[last] == Watch::Armed;
            prop_assert_eq!(!night.stops.is_empty(), is_armed);
            if is_armed {
                // A stop that is already being repeated goes on at its own pace.
                prop_assert!(night.stops[0] <= at + patience + EVERY.0 + 1e-9);
            }
            prop_assert_eq!(night.has_left, dies);
        }
    }
}
