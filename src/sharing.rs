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

/// The parameters of sharing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// The success window α, in control steps spent in the region.
    pub window_steps: u32,
    /// What stands for the samples that a window does not have yet.
    pub window_fill: Fill,
    /// w stays 1 until success first reaches this (3.2.2); 0 for no gate.
    pub gate: f64,
    /// The time constant of w in steps; `None`: from the gate by eq. 23.
    pub tau_steps: Option<f64>,
    /// A time constant found by eq. 23 is at least this, in steps.
    pub tau_floor_steps: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            window_steps: 4000,
            window_fill: Fill::Minimum,
            gate: 0.4,
            tau_steps: None,
            tau_floor_steps: 1.0,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.count("window_steps", self.window_steps, 1..=10_000_000);
        c.range("gate", self.gate, 0.0..=0.99);
        match self.tau_steps {
            Some(tau) => c.range("tau_steps", tau, 1.0..=1e9),
            None => c.demand(
                self.gate > 0.0,
                "gate",
                self.gate,
                "above 0 when tau_steps is None, since τ is then found from the gate (eq. 23)",
            ),
        }
        c.range("tau_floor_steps", self.tau_floor_steps, 1.0..=1e9);
    }
}

/// What one step's measure did to its region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observed {
    /// The region's success with this step's measure in its window.
    pub success: f64,
    /// Whether the gate opened at this very step.
    pub gate_opened: bool,
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
        let regions = regions
            .iter()
            .map(|region| RegionShare {
                window: Window::new(params.window_steps, params.window_fill, region.scale),
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

    /// Takes the measure of a controlled step spent in `region`: its window, then its
    /// share, move on.
    pub fn observe(&mut self, region: usize, measure: f64) -> Observed {
        let Some(here) = self.regions.get_mut(region) else {
            return Observed { success: 0.0, gate_opened: false };
        };
        here.window.push(measure);
        let success = here.window.success();
        let gate_opened = here.weight.step(success, &self.dynamics);
        Observed { success, gate_opened }
    }

    /// The step at which `region`'s gate opened and the time constant found there, in
    /// steps of that region.
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
        assert!((opened.tau_steps - tau.unwrap()).abs() < 1e-12);
        assert!(s.share(0) < 0.3);
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
}
