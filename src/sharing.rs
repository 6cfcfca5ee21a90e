//! The heart of the thesis: who has how much of the controls, and how that changes.
//!
//! The plant receives `u = w·u_h + (1 − w)·u_m` (eq. 5, 29). In each region of the state
//! space the share w of the person follows τẇ = −w + 1 − success (eq. 6–8, 11, 20), where
//! success is a moving average of a measure of how well the task goes (eq. 9, 19, 28).

pub mod region;
pub mod success;
pub mod weight;

use serde::{Deserialize, Serialize};

use crate::check::{Check, Checker};
use region::Region;
use success::{Fill, Window};
use weight::{Dynamics, Weight};

/// What the robot does while it learns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// The robot takes over as success rises.
    #[default]
    Simultaneous,
    /// The robot only watches: w ≡ 1.
    Sequential,
}

impl Mode {
    /// The word used in file names and on the screen.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Simultaneous => "simultaneous",
            Self::Sequential => "sequential",
        }
    }
}

/// The mixed action `u = w·u_h + (1 − w)·u_m` (eq. 5).
///
/// At w = 1 and w = 0 the other's action has no effect whatever it is.
#[must_use]
pub fn mix(share: f64, human: f64, machine: f64) -> f64 {
    if share >= 1.0 {
        human
    } else if share <= 0.0 {
        machine
    } else {
        share * human + (1.0 - share) * machine
    }
}

/// The nearest to `action` of full effort back, none and full effort ahead, where the largest
/// action is `limit`; halves count as none.
#[must_use]
pub fn rounded(action: f64, limit: f64) -> f64 {
    if action.abs() > limit / 2.0 { limit.copysign(action) } else { 0.0 }
}

/// What stays as it is once a region is handed over (3.1.5: "freezing the learning for
/// regions that attain high level autonomy").
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Freeze {
    /// Nothing: control flows back whenever success falls.
    #[default]
    Off,
    /// The share: the region stays the robot's.
    Share,
    /// The share, and what the robot has learned: samples from the region teach no more.
    ShareAndLearner,
}

/// The parameters of sharing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// The success window α, in control steps spent in the region.
    pub window_steps: u32,
    /// α in episodes; where it is set, shares move once an episode, by its mean measure.
    pub window_episodes: Option<u32>,
    /// What stands for the samples that a window does not have yet.
    pub window_fill: Fill,
    /// w stays 1 until success first reaches this (3.2.2); 0 for no gate.
    pub gate: f64,
    /// The time constant of w in steps; `None`: from the gate by eq. 23.
    pub tau_steps: Option<f64>,
    /// A time constant found by eq. 23 is at least this, in steps.
    pub tau_floor_steps: f64,
    /// The time constant of w in episodes, where shares move once an episode; `None`: from
    /// the gate.
    pub tau_episodes: Option<f64>,
    /// One found from the gate is at least this, in episodes.
    pub tau_floor_episodes: f64,
    /// What stays as it is once a region is handed over,
    pub freeze: Freeze,
    /// which it is when its share is below this, its window is full,
    pub freeze_share: f64,
    /// and its success is at least this.
    pub freeze_success: f64,
    /// Whether the mixed action is made the nearest of fully back, none and fully ahead, the
    /// only ones that an agent knows.
    pub round_mix: bool,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            window_steps: 4000,
            window_episodes: None,
            window_fill: Fill::Minimum,
            gate: 0.4,
            tau_steps: None,
            tau_floor_steps: 1.0,
            tau_episodes: None,
            tau_floor_episodes: 1.0,
            freeze: Freeze::Off,
            freeze_share: 0.05,
            freeze_success: 0.0,
            round_mix: false,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        const TAU: std::ops::RangeInclusive<f64> = 1.0..=1e9;
        c.count("window_steps", self.window_steps, 1..=10_000_000);
        c.range("gate", self.gate, 0.0..=0.99);
        let (key, tau) = if let Some(episodes) = self.window_episodes {
            c.count("window_episodes", episodes, 1..=10_000_000);
            c.demand(
                self.tau_steps.is_none(),
                "tau_steps",
                format_args!("{:?}", self.tau_steps),
                "None where window_episodes is set: tau_episodes counts there",
            );
            ("tau_episodes", self.tau_episodes)
        } else {
            c.demand(
                self.tau_episodes.is_none(),
                "tau_episodes",
                format_args!("{:?}", self.tau_episodes),
                "None where window_episodes is None: tau_steps counts there",
            );
            ("tau_steps", self.tau_steps)
        };
        match tau {
            Some(tau) => c.range(key, tau, TAU),
            None => c.demand(
                self.gate > 0.0,
                "gate",
                self.gate,
                &format!(
                    "above 0 when {key} is None, since τ is then found from the gate (eq. 23)"
                ),
            ),
        }
        c.range("tau_floor_steps", self.tau_floor_steps, TAU);
        c.range("tau_floor_episodes", self.tau_floor_episodes, TAU);
        c.range("freeze_share", self.freeze_share, 0.0..=0.99);
        c.range("freeze_success", self.freeze_success, 0.0..=1.0);
    }
}

/// What one measure did to its region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observed {
    /// The region's success with this measure in its window.
    pub success: f64,
    /// Whether the gate opened at it.
    pub gate_opened: bool,
    /// Whether the region was handed over for good at it.
    pub froze: bool,
}

/// The shares of all regions and all that moves them; the whole of it is stored in a
/// checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sharing {
    mode: Mode,
    dynamics: Dynamics,
    regions: Vec<RegionShare>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct RegionShare {
    window: Window,
    weight: Weight,
}

impl Sharing {
    /// Full control to the person in every one of `regions`, with empty windows.
    #[must_use]
    pub fn new(params: &Params, mode: Mode, regions: &[Region]) -> Self {
        let length = params.window_episodes.unwrap_or(params.window_steps);
        let regions = regions
            .iter()
            .map(|region| RegionShare {
                window: Window::new(length, params.window_fill, region.scale),
                weight: Weight::default(),
            })
            .collect();
        Self { mode, dynamics: Dynamics::of(params), regions }
    }

    /// The person's share w in `region`, to be used at this step.
    #[must_use]
    pub fn share(&self, region: usize) -> f64 {
        match self.mode {
            Mode::Sequential => 1.0,
            Mode::Simultaneous => self.regions.get(region).map_or(1.0, |r| r.weight.share()),
        }
    }

    /// The success of `region` after the steps seen so far.
    #[must_use]
    pub fn success(&self, region: usize) -> f64 {
        self.regions.get(region).map_or(0.0, |r| r.window.success())
    }

    /// Takes the measure of a controlled step spent in `region`, or of an episode: its
    /// window, then its share, move on.
    pub fn observe(&mut self, region: usize, measure: f64) -> Observed {
        let Some(here) = self.regions.get_mut(region) else {
            return Observed { success: 0.0, gate_opened: false, froze: false };
        };
        here.window.push(measure);
        let success = here.window.success();
        let gate_opened = here.weight.step(success, &self.dynamics);
        // Who only watches is handed nothing.
        let froze = self.mode == Mode::Simultaneous
            && here.window.is_full()
            && here.weight.freeze(success, &self.dynamics);
        Observed { success, gate_opened, froze }
    }

    /// Whether `region` is handed over for good.
    #[must_use]
    pub fn is_frozen(&self, region: usize) -> bool {
        self.mode == Mode::Simultaneous
            && self.regions.get(region).is_some_and(|r| r.weight.is_frozen())
    }

    /// Whether what happens in `region` teaches the robot no more.
    #[must_use]
    pub fn is_learner_frozen(&self, region: usize) -> bool {
        self.dynamics.freezes_learner() && self.is_frozen(region)
    }

    /// Whether what happens in `region` teaches the robot: not once it is handed over, where that
    /// freezes the learner, and with `from_gate` not before its gate has opened.
    #[must_use]
    pub fn teaches(&self, region: usize, from_gate: bool) -> bool {
        let waits = from_gate && self.gate(region).is_none();
        !waits && !self.is_learner_frozen(region)
    }

    /// The step, or episode, at which `region`'s gate opened and the time constant found
    /// there, in steps of that region, or in episodes.
    #[must_use]
    pub fn gate(&self, region: usize) -> Option<weight::Opened> {
        self.regions.get(region).and_then(|r| r.weight.opened())
    }
}

#[cfg(test)]
mod tests {
    use super::region::{Region, Scale};
    use super::*;

    const WHOLE: [Region; 1] =
        [Region { name: "all", scale: Scale { minimum: 0.0, threshold: 1.0 } }];

    fn sharing(mode: Mode, window_steps: u32) -> Sharing {
        Sharing::new(&Params { window_steps, ..Params::default() }, mode, &WHOLE)
    }

    #[test]
    fn the_ends_of_the_share_ignore_the_other_one() {
        assert_eq!(mix(1.0, 3.0, f64::NAN), 3.0);
        assert_eq!(mix(0.0, f64::NAN, -2.0), -2.0);
        assert_eq!(mix(0.25, 4.0, -4.0), -2.0);
    }

    #[test]
    fn w_stays_one_until_the_gate_and_then_follows_equation_20() {
        let mut s = sharing(Mode::Simultaneous, 100);
        let mut expected = 1.0;
        let mut tau = None;
        for k in 1..=400_u32 {
            assert!((s.share(0) - expected).abs() < 1e-15, "step {k}");
            let seen = s.observe(0, 0.75);
            let success = 0.75 * f64::from(k.min(100)) / 100.0;
            assert!((seen.success - success).abs() < 1e-12);
            match tau {
                None if success >= 0.4 => {
                    assert!(seen.gate_opened);
                    assert_eq!(k, 54);
                    tau = Some(-54.0 / 0.4_f64.ln());
                }
                None => assert!(!seen.gate_opened),
                Some(tau) => expected += (1.0 - seen.success - expected) / tau,
            }
        }
        let opened = s.gate(0).unwrap();
        assert_eq!(opened.step, 54);
        assert!((opened.tau - tau.unwrap()).abs() < 1e-12);
        assert!(s.share(0) < 0.3);
    }

    #[test]
    fn learning_may_wait_for_the_gate() {
        for mode in [Mode::Simultaneous, Mode::Sequential] {
            let mut s = sharing(mode, 10);
            let taught: Vec<(bool, bool)> = (0..6)
                .map(|_| {
                    s.observe(0, 1.0);
                    (s.teaches(0, true), s.teaches(0, false))
                })
                .collect();
            // Success is 0.4 at the fourth.
            let waits = |taught| (taught, true);
            assert_eq!(taught, [false, false, false, true, true, true].map(waits));
        }
    }

    #[test]
    fn a_rounded_action_is_full_or_none() {
        let actions = [-3.0, -2.1, -2.0, 0.0, 1.9, 2.1].map(|action| rounded(action, 4.0));
        assert_eq!(actions, [-4.0, -4.0, 0.0, 0.0, 0.0, 4.0]);
    }

    #[test]
    fn sequential_mode_leaves_the_person_in_control() {
        let mut s = sharing(Mode::Sequential, 10);
        for _ in 0..500 {
            s.observe(0, 1.0);
        }
        assert_eq!(s.share(0), 1.0);
        assert!(s.success(0) > 0.999);
    }

    #[test]
    fn success_falls_and_control_flows_back() {
        let mut s = sharing(Mode::Simultaneous, 20);
        for _ in 0..500 {
            s.observe(0, 1.0);
        }
        let low = s.share(0);
        for _ in 0..500 {
            s.observe(0, 0.0);
        }
        assert!(low < 0.01 && s.share(0) > 0.99);
    }

    #[test]
    fn regions_do_not_touch_each_other() {
        let two = [WHOLE[0], Region { name: "other", ..WHOLE[0] }];
        let mut s = Sharing::new(
            &Params { window_steps: 10, ..Params::default() },
            Mode::Simultaneous,
            &two,
        );
        for _ in 0..100 {
            s.observe(1, 1.0);
        }
        assert_eq!((s.share(0), s.success(0)), (1.0, 0.0));
        assert!(s.share(1) < 0.1);
    }

    #[test]
    fn a_region_is_handed_over_for_good_once_its_window_is_full() {
        for freeze in [Freeze::Off, Freeze::Share, Freeze::ShareAndLearner] {
            let params = Params {
                window_steps: 400,
                tau_steps: Some(10.0),
                gate: 0.0,
                window_fill: Fill::Partial,
                freeze,
                ..Params::default()
            };
            let mut s = Sharing::new(&params, Mode::Simultaneous, &WHOLE);
            let froze: Vec<u32> = (1..=500).filter(|_| s.observe(0, 1.0).froze).collect();
            // The share is low long before; the window is full at its 400th step.
            assert_eq!(froze, if freeze == Freeze::Off { vec![] } else { vec![400] });
            let low = s.share(0);
            for _ in 0..800 {
                s.observe(0, 0.0);
            }
            assert_eq!(s.success(0), 0.0, "success moves on");
            assert_eq!(s.share(0) == low, freeze != Freeze::Off, "{freeze:?}");
            assert_eq!(s.is_frozen(0), freeze != Freeze::Off);
            assert_eq!(s.is_learner_frozen(0), freeze == Freeze::ShareAndLearner);
        }
    }

    #[test]
    fn a_region_may_be_handed_over_at_a_success_only() {
        let params = Params {
            window_steps: 10,
            tau_steps: Some(2.0),
            gate: 0.0,
            freeze: Freeze::Share,
            freeze_share: 0.5,
            freeze_success: 1.0,
            ..Params::default()
        };
        let mut s = Sharing::new(&params, Mode::Simultaneous, &WHOLE);
        for _ in 0..100 {
            assert!(!s.observe(0, 0.9).froze);
        }
        assert!(s.share(0) < 0.2);
        let froze: Vec<u32> = (1..=20).filter(|_| s.observe(0, 1.0).froze).collect();
        assert_eq!(froze, [10]);
    }

    #[test]
    fn who_only_watches_is_never_handed_anything() {
        let params = Params {
            window_steps: 5,
            tau_steps: Some(2.0),
            gate: 0.0,
            freeze: Freeze::ShareAndLearner,
            ..Params::default()
        };
        let mut s = Sharing::new(&params, Mode::Sequential, &WHOLE);
        for _ in 0..100 {
            assert!(!s.observe(0, 1.0).froze);
        }
        assert!(!s.is_frozen(0) && !s.is_learner_frozen(0));
    }

    /// Three episodes by hand: the gate at the second, τ = −2 / ln 0.5 or the floor.
    #[test]
    fn shares_by_episode_count_in_episodes() {
        for (floor, tau) in [(1.0, 2.0 / std::f64::consts::LN_2), (20.0, 20.0)] {
            let params = Params {
                window_episodes: Some(2),
                window_fill: Fill::Partial,
                gate: 0.5,
                tau_floor_episodes: floor,
                ..Params::default()
            };
            let mut s = Sharing::new(&params, Mode::Simultaneous, &WHOLE);
            assert!(!s.observe(0, 0.3).gate_opened);
            let second = s.observe(0, 0.9);
            assert!(second.gate_opened && (second.success - 0.6).abs() < 1e-12);
            let opened = s.gate(0).unwrap();
            assert_eq!(opened.step, 2);
            assert!((opened.tau - tau).abs() < 1e-12);
            assert_eq!(s.share(0), 1.0);
            s.observe(0, 0.7);
            assert!((s.share(0) - (1.0 - 0.8 / tau)).abs() < 1e-12);
        }
    }

    #[test]
    fn keys_of_the_other_pace_are_refused_with_what_to_do() {
        let refused = |params: &Params| {
            let mut faults = Vec::new();
            params.check(&mut Checker::new(&mut faults));
            faults.into_iter().map(|f| format!("{}: {}", f.key, f.allowed)).collect::<Vec<_>>()
        };
        let by_episode = Params { window_episodes: Some(20), ..Params::default() };
        assert_eq!(refused(&by_episode), [""; 0]);
        let wrong = refused(&Params { tau_steps: Some(9.0), ..by_episode });
        assert!(wrong.len() == 1 && wrong[0].contains("tau_episodes counts there"), "{wrong:?}");
        let wrong = refused(&Params { tau_episodes: Some(9.0), ..Params::default() });
        assert!(wrong.len() == 1 && wrong[0].contains("tau_steps counts there"), "{wrong:?}");
    }
}
