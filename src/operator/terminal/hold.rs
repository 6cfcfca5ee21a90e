//! Which way the keys push, from key events with their times; no clock in here.
//!
//! Where the terminal reports releases, a key pushes from press to release. Where it does
//! not, a press pushes for a tap's time and each repeat for a little longer than the
//! measured time between repeats. The key pressed last wins; a stop key ends every push,
//! and only a new press starts one again.

use crate::signal::Seconds;

/// What a steering key stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Push to the left: negative.
    Left,
    /// Push to the right: positive.
    Right,
    /// Push no more.
    Stop,
}

/// How the program knows that a key was let go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KeyReleases {
    /// The terminal says so.
    Reported,
    /// Guessed: the key's repeats stopped coming.
    #[default]
    Estimated,
}

impl KeyReleases {
    /// The words for the screen and for `session.json`.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Reported => "reported by the terminal",
            Self::Estimated => "estimated from key repeats",
        }
    }
}

/// The times of a [`Hold`], s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// How long a single press pushes when releases are estimated.
    pub tap_hold_s: f64,
    /// How long a repeat pushes then; `None`: learned from the repeats.
    pub repeat_hold_s: Option<f64>,
    /// How long a push takes to grow to its full strength,
    pub rise_s: f64,
    /// and a full one to fall to nothing once its key is let go.
    pub fall_s: f64,
}

/// A repeat pushes for this many intervals between repeats, when learned.
const REPEAT_MARGIN: f64 = 1.6;
/// The bounds of what a repeat may push when learned, s.
const LEARNED_HOLD_S: (f64, f64) = (0.05, 0.2);
/// Presses of one key closer than this are its repeats: no finger taps as fast.
const REPEAT_GAP_S: f64 = LEARNED_HOLD_S.1 / REPEAT_MARGIN;
/// Repeats closer than this came in one burst of a slow line and tell no interval.
const BURST_GAP_S: f64 = 0.005;
/// How much a new interval counts against those measured before.
const NEW_INTERVAL: f64 = 0.25;

/// A push that is going on.
#[derive(Clone, Copy, Debug)]
struct Push {
    to: Direction,
    since: Seconds,
    /// When it ends by itself; reported keys end by their release alone.
    until: Option<Seconds>,
}

/// What is left of a push whose key was let go.
#[derive(Clone, Copy, Debug)]
struct Fall {
    to: Direction,
    from: f64,
    since: Seconds,
}

/// The keys' state. Times must not run backwards.
#[derive(Clone, Debug)]
pub struct Hold {
    timing: Timing,
    releases: KeyReleases,
    push: Option<Push>,
    fall: Option<Fall>,
    /// The keys held, left and right, as reported.
    held: [bool; 2],
    last_event: Option<(Direction, Seconds)>,
    interval: Option<f64>,
}

impl Hold {
    /// No key held, releases estimated until known better.
    #[must_use]
    pub const fn new(timing: Timing) -> Self {
        Self {
            timing,
            releases: KeyReleases::Estimated,
            push: None,
            fall: None,
            held: [false; 2],
            last_event: None,
            interval: None,
        }
    }

    /// How releases are known.
    #[must_use]
    pub const fn knowledge(&self) -> KeyReleases {
        self.releases
    }

    /// Says whether the terminal reports releases; a change lets all keys go.
    pub fn set_knowledge(&mut self, releases: KeyReleases) {
        if self.releases != releases {
            self.releases = releases;
            self.release_all();
        }
    }

    /// How late it may be known that a key was let go; `None` where that is reported.
    #[must_use]
    pub fn lateness(&self) -> Option<Seconds> {
        (self.releases == KeyReleases::Estimated).then(|| Seconds(self.repeat_hold()))
    }

    /// The time of the last key event, if there was one.
    #[must_use]
    pub fn last_event(&self) -> Option<Seconds> {
        self.last_event.map(|(_, at)| at)
    }

    /// A key went down. Terminals without releases send repeats as presses, too.
    pub fn press(&mut self, direction: Direction, now: Seconds) {
        let gap = self.note(direction, now);
        match (direction, self.releases) {
            (Direction::Stop, _) => self.release_all(),
            (_, KeyReleases::Reported) => {
                self.set_held(direction, true);
                self.start(direction, now, None);
            }
            (_, KeyReleases::Estimated) => self.extend(direction, now, gap),
        }
    }

    /// A key is still down.
    pub fn repeat(&mut self, direction: Direction, now: Seconds) {
        let gap = self.note(direction, now);
        match (direction, self.releases) {
            (Direction::Stop, _) => self.release_all(),
            // After a stop or a pause only a new press pushes again.
            (_, KeyReleases::Reported) => {}
            (_, KeyReleases::Estimated) => self.extend(direction, now, gap),
        }
    }

    /// A key went up: the terminal reports releases, whatever was believed before.
    pub fn release(&mut self, direction: Direction, now: Seconds) {
        if self.releases == KeyReleases::Estimated {
            self.releases = KeyReleases::Reported;
            // A push that is going on has its release still to come.
            if let Some(push) = &mut self.push {
                if push.until.take().is_some_and(|until| until > now) {
                    let to = push.to;
                    self.set_held(to, true);
                } else {
                    self.push = None;
                }
            }
        }
        self.last_event = Some((direction, now));
        self.set_held(direction, false);
        if self.push.is_some_and(|push| push.to == direction) {
            self.fall = self.falling(now);
            self.push = None;
            let other = match self.held {
                [true, _] => Direction::Left,
                [_, true] => Direction::Right,
                _ => return,
            };
            self.start(other, now, None);
        }
    }

    /// Lets all keys go: the focus is lost, or the session pauses.
    pub fn release_all(&mut self) {
        self.held = [false; 2];
        self.push = None;
        self.fall = None;
        // The next press is a new one, not a repeat.
        self.last_event = self.last_event.map(|(_, at)| (Direction::Stop, at));
    }

    /// The push at `now`, from -1 (left) to 1 (right).
    #[must_use]
    pub fn push(&self, now: Seconds) -> f64 {
        let (to, strength) = match self.push {
            Some(push) if push.until.is_none_or(|until| now < until) => {
                (push.to, self.grown(&push, now))
            }
            _ => match self.falling(now) {
                Some(fall) => (fall.to, fall.from),
                None => return 0.0,
            },
        };
        match to {
            Direction::Left => -strength,
            Direction::Right => strength,
            Direction::Stop => 0.0,
        }
    }

    /// How strong `push` is at `now`.
    fn grown(&self, push: &Push, now: Seconds) -> f64 {
        if self.timing.rise_s > 0.0 {
            ((now - push.since).0 / self.timing.rise_s).clamp(0.0, 1.0)
        } else {
            1.0
        }
    }

    /// What is left at `now` of the push under way if it ends then, or of the one that ended.
    fn falling(&self, now: Seconds) -> Option<Fall> {
        let fall = match self.push {
            Some(push) => {
                let since = push.until.filter(|until| *until < now).unwrap_or(now);
                Fall { to: push.to, from: self.grown(&push, since), since }
            }
            None => self.fall?,
        };
        let fallen = (now - fall.since).0 / self.timing.fall_s;
        let left = fall.from - if self.timing.fall_s > 0.0 { fallen } else { fall.from };
        // What rounding leaves of a push is none.
        (left > 1e-9).then_some(Fall { to: fall.to, from: left, since: now })
    }

    /// Notes the event and returns the time since the same key's last, if it was the last.
    fn note(&mut self, direction: Direction, now: Seconds) -> Option<f64> {
        let before = self.last_event.replace((direction, now));
        before.filter(|(last, _)| *last == direction).map(|(_, at)| (now - at).0)
    }

    /// A press or repeat without knowledge of releases, `gap` after the same key's last.
    fn extend(&mut self, direction: Direction, now: Seconds, gap: Option<f64>) {
        let gap = gap.filter(|gap| *gap <= REPEAT_GAP_S);
        if let Some(gap) = gap.filter(|gap| *gap >= BURST_GAP_S) {
            let known = self.interval.unwrap_or(gap);
            self.interval = Some(known + NEW_INTERVAL * (gap - known));
        }
        let hold = if gap.is_some() { self.repeat_hold() } else { self.timing.tap_hold_s };
        self.start(direction, now, Some(now + Seconds(hold)));
    }

    fn repeat_hold(&self) -> f64 {
        let learned =
            |interval: f64| (REPEAT_MARGIN * interval).clamp(LEARNED_HOLD_S.0, LEARNED_HOLD_S.1);
        self.timing.repeat_hold_s.or(self.interval.map(learned)).unwrap_or(self.timing.tap_hold_s)
    }

    /// Pushes to `to` from now, or on if it does already; never ends a push earlier.
    fn start(&mut self, to: Direction, now: Seconds, until: Option<Seconds>) {
        match &mut self.push {
            Some(push) if push.to == to && push.until.is_none_or(|end| end > now) => {
                push.until = match (push.until, until) {
                    (Some(old), Some(new)) if old > new => Some(old),
                    _ => until,
                };
            }
            _ => {
                // What is left of the last push in this direction is not to be grown again.
                let left = self.falling(now).filter(|fall| fall.to == to);
                let ahead = left.map_or(0.0, |fall| fall.from * self.timing.rise_s);
                self.fall = None;
                self.push = Some(Push { to, since: now - Seconds(ahead), until });
            }
        }
    }

    fn set_held(&mut self, direction: Direction, down: bool) {
        match direction {
            Direction::Left => self.held[0] = down,
            Direction::Right => self.held[1] = down,
            Direction::Stop => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Direction::{Left, Right, Stop};
    use proptest::prelude::*;

    const TIMING: Timing =
        Timing { tap_hold_s: 0.12, repeat_hold_s: None, rise_s: 0.0, fall_s: 0.0 };

    fn at(s: f64) -> Seconds {
        Seconds(s)
    }

    #[test]
    fn a_reported_key_pushes_until_its_release_and_the_last_pressed_wins() {
        let mut hold = Hold::new(TIMING);
        hold.set_knowledge(KeyReleases::Reported);
        hold.press(Left, at(1.0));
        assert_eq!(hold.push(at(9.0)), -1.0);
        hold.press(Right, at(9.0));
        assert_eq!(hold.push(at(9.0)), 1.0);
        hold.release(Right, at(9.5));
        assert_eq!(hold.push(at(9.5)), -1.0);
        hold.press(Stop, at(9.6));
        hold.repeat(Left, at(9.7));
        assert_eq!(hold.push(at(9.8)), 0.0);
    }

    #[test]
    fn an_estimated_key_pushes_for_a_tap_rests_in_the_gap_and_follows_the_repeats() {
        let mut hold = Hold::new(TIMING);
        hold.press(Right, at(0.0));
        assert_eq!(hold.push(at(0.119)), 1.0);
        assert_eq!(hold.push(at(0.12)), 0.0);
        let mut now = 0.5;
        for _ in 0..20 {
            hold.press(Right, at(now));
            now += 0.04;
        }
        let last = now - 0.04;
        assert_eq!(hold.push(at(last + 0.06)), 1.0);
        assert_eq!(hold.push(at(last + 0.065)), 0.0);
        hold.press(Left, at(last + 0.07));
        assert_eq!(hold.push(at(last + 0.08)), -1.0);
        hold.press(Stop, at(last + 0.09));
        assert_eq!(hold.push(at(last + 0.09)), 0.0);
        assert_eq!(hold.knowledge(), KeyReleases::Estimated);
    }

    #[test]
    fn a_push_grows_linearly_and_ends_at_once() {
        let mut hold = Hold::new(Timing { rise_s: 0.06, ..TIMING });
        hold.set_knowledge(KeyReleases::Reported);
        hold.press(Left, at(0.0));
        assert_eq!(hold.push(at(0.0)), 0.0);
        assert!((hold.push(at(0.03)) + 0.5).abs() < 1e-12);
        assert_eq!(hold.push(at(0.06)), -1.0);
        hold.release(Left, at(0.07));
        assert_eq!(hold.push(at(0.07)), 0.0);
    }

    #[test]
    fn a_push_falls_linearly_and_its_rest_is_not_grown_again() {
        let mut hold = Hold::new(Timing { rise_s: 0.1, fall_s: 0.2, ..TIMING });
        hold.set_knowledge(KeyReleases::Reported);
        hold.press(Right, at(0.0));
        hold.release(Right, at(1.0));
        assert!((hold.push(at(1.05)) - 0.75).abs() < 1e-12);
        hold.press(Right, at(1.1));
        assert!((hold.push(at(1.1)) - 0.5).abs() < 1e-12);
        assert!((hold.push(at(1.15)) - 1.0).abs() < 1e-12);
        // The other way begins from nothing, and a stop leaves nothing.
        hold.release(Right, at(1.2));
        hold.press(Left, at(1.25));
        assert_eq!(hold.push(at(1.25)), 0.0);
        assert!((hold.push(at(1.3)) + 0.5).abs() < 1e-12);
        hold.press(Stop, at(1.4));
        assert_eq!(hold.push(at(1.4)), 0.0);
        hold.press(Left, at(2.0));
        hold.release(Left, at(3.0));
        assert_eq!(hold.push(at(3.2)), 0.0);
    }

    #[test]
    fn an_estimated_push_falls_from_where_its_time_was_over() {
        let mut hold = Hold::new(Timing { fall_s: 0.1, ..TIMING });
        hold.press(Left, at(0.0));
        assert_eq!(hold.push(at(0.119)), -1.0);
        assert!((hold.push(at(0.17)) + 0.5).abs() < 1e-12);
        assert_eq!(hold.push(at(0.23)), 0.0);
    }

    #[test]
    fn the_first_release_changes_what_is_known() {
        let mut hold = Hold::new(TIMING);
        hold.press(Left, at(0.0));
        hold.release(Left, at(0.05));
        assert_eq!(hold.push(at(0.06)), 0.0);
        assert_eq!(hold.knowledge(), KeyReleases::Reported);
        hold.press(Left, at(1.0));
        assert_eq!(hold.push(at(5.0)), -1.0);
    }

    /// What can happen to the keys.
    #[derive(Clone, Copy, Debug)]
    enum Happening {
        Press(Direction),
        Repeat(Direction),
        Release(Direction),
        FocusLost,
        Knows(KeyReleases),
    }

    use Happening::{FocusLost, Knows, Press, Release, Repeat};

    const HAPPENINGS: [Happening; 12] = [
        Press(Left),
        Press(Right),
        Press(Stop),
        Repeat(Left),
        Repeat(Right),
        Repeat(Stop),
        Release(Left),
        Release(Right),
        Release(Stop),
        FocusLost,
        Knows(KeyReleases::Reported),
        Knows(KeyReleases::Estimated),
    ];

    /// Longer than any estimated key pushes.
    const SILENCE: f64 = 0.2;

    fn happen(hold: &mut Hold, happening: Happening, now: f64) {
        match happening {
            Press(key) => hold.press(key, at(now)),
            Repeat(key) => hold.repeat(key, at(now)),
            Release(key) => hold.release(key, at(now)),
            FocusLost => hold.release_all(),
            Knows(releases) => hold.set_knowledge(releases),
        }
    }

    /// The keys that a person holds after `happenings`, if the terminal tells all of it.
    fn held_after(happenings: &[Happening]) -> Vec<Direction> {
        let mut held = Vec::new();
        for happening in happenings {
            match *happening {
                Press(key) | Repeat(key) if !held.contains(&key) => held.push(key),
                Release(key) => held.retain(|other| *other != key),
                FocusLost => held.clear(),
                _ => {}
            }
        }
        held
    }

    /// After `happenings`, each as long after the last as `waits` say, and every key let go in
    /// either order or silent for long: no push is left.
    fn leaves_nothing(
        timing: Timing,
        happenings: &[Happening],
        waits: &[f64],
    ) -> Result<(), String> {
        let mut hold = Hold::new(timing);
        let mut now = 0.0;
        for (happening, wait) in happenings.iter().zip(waits) {
            now += wait;
            happen(&mut hold, *happening, now);
            let push = hold.push(at(now));
            if push.is_nan() || push.abs() > 1.0 {
                return Err(format!("a push of {push}"));
            }
        }
        let silent = now + SILENCE + timing.fall_s;
        if hold.knowledge() == KeyReleases::Estimated && hold.push(at(silent)) != 0.0 {
            return Err(format!("{} after silence", hold.push(at(silent))));
        }
        let mut held = held_after(happenings);
        for _ in 0..2 {
            let mut hold = hold.clone();
            for key in &held {
                hold.release(*key, at(now));
            }
            // Without a release, and nothing held, it is still estimated.
            let known = hold.knowledge() == KeyReleases::Reported;
            let push = hold.push(at(if known { now + timing.fall_s } else { silent }));
            if push != 0.0 {
                return Err(format!("{push} after all releases"));
            }
            held.reverse();
        }
        Ok(())
    }

    /// Every number of `digits` digits to the base of `choices`.
    fn all(choices: usize, digits: u32) -> impl Iterator<Item = Vec<usize>> {
        (0..choices.pow(digits)).map(move |number| {
            (0..digits).map(|digit| number / choices.pow(digit) % choices).collect()
        })
    }

    #[test]
    fn no_short_order_of_events_leaves_a_push_behind() {
        // At once, within a tap, as a repeat that is late, after a tap.
        let steps = [0.0, 0.04, 0.11, 0.3];
        for (length, fall_s) in [(1, 0.0), (2, 0.1), (3, 0.0), (3, 0.1), (4, 0.0)] {
            let timing = Timing { fall_s, ..TIMING };
            for order in all(HAPPENINGS.len(), length) {
                let happenings: Vec<_> = order.iter().map(|which| HAPPENINGS[*which]).collect();
                for waits in all(if length < 4 { steps.len() } else { 2 }, length) {
                    let waits: Vec<_> = waits.iter().map(|which| steps[*which]).collect();
                    let left = leaves_nothing(timing, &happenings, &waits);
                    assert_eq!(left, Ok(()), "{happenings:?} {waits:?} {timing:?}");
                }
            }
        }
    }

    /// Where the terminal tells all, the push is that of the key pressed last of those held;
    /// a stop or a lost focus lets all go until the next press.
    #[test]
    fn reported_keys_push_as_they_are_held_in_every_short_order() {
        let told: Vec<Happening> = HAPPENINGS[..10].to_vec();
        for order in all(told.len(), 5) {
            let mut hold = Hold::new(TIMING);
            hold.set_knowledge(KeyReleases::Reported);
            // The keys that push, the last one first to be heard.
            let mut pushing: Vec<Direction> = Vec::new();
            for which in &order {
                match told[*which] {
                    Press(Stop) | Repeat(Stop) | FocusLost => pushing.clear(),
                    Press(key) => {
                        pushing.retain(|other| *other != key);
                        pushing.push(key);
                    }
                    Release(key) => pushing.retain(|other| *other != key),
                    Repeat(_) | Knows(_) => {}
                }
                happen(&mut hold, told[*which], 0.0);
                let expected = match pushing.last() {
                    Some(Left) => -1.0,
                    Some(Right) => 1.0,
                    _ => 0.0,
                };
                assert_eq!(hold.push(at(0.0)), expected, "{order:?}");
            }
        }
    }

    proptest! {
        #[test]
        fn no_long_order_of_events_leaves_a_push_behind(
            (rise_s, fall_s) in (0.0..0.3_f64, 0.0..0.3_f64),
            repeat_hold_s in proptest::option::of(0.02..0.2_f64),
            events in proptest::collection::vec((0..12_usize, 0.0..0.3_f64), 0..80),
        ) {
            let timing = Timing { repeat_hold_s, rise_s, fall_s, ..TIMING };
            let (order, waits): (Vec<_>, Vec<_>) = events.into_iter().unzip();
            let happenings: Vec<_> = order.into_iter().map(|which| HAPPENINGS[which]).collect();
            prop_assert_eq!(leaves_nothing(timing, &happenings, &waits), Ok(()));
        }

        #[test]
        fn keys_that_all_end_released_leave_0(
            known in any::<bool>(),
            (rise_s, fall_s) in (0.0..0.3_f64, 0.0..0.3_f64),
            events in proptest::collection::vec((0..3_u8, 0..3_u8, 0.0..0.5_f64), 0..60),
        ) {
            let mut hold = Hold::new(Timing { rise_s, fall_s, ..TIMING });
            if known {
                hold.set_knowledge(KeyReleases::Reported);
            }
            let mut now = 0.0;
            for (kind, key, wait) in events {
                now += wait;
                let key = [Left, Right, Stop][usize::from(key)];
                match kind {
                    0 => hold.press(key, at(now)),
                    1 => hold.repeat(key, at(now)),
                    _ => hold.release(key, at(now)),
                }
                prop_assert!(hold.push(at(now)).abs() <= 1.0);
            }
            for key in [Left, Right, Stop] {
                hold.release(key, at(now));
            }
            prop_assert_eq!(hold.push(at(now + fall_s)), 0.0);
        }
    }
}
