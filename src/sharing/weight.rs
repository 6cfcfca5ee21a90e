//! The share w of the person and its dynamics.

use serde::{Deserialize, Serialize};

use super::{Freeze, Params};

/// How w moves; the same for all regions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dynamics {
    gate: f64,
    /// The set time constant, in steps or episodes.
    tau: Option<f64>,
    tau_floor: f64,
    freeze: Freeze,
    freeze_share: f64,
    #[serde(default)]
    freeze_success: f64,
}

impl Dynamics {
    /// The dynamics that `params` describe.
    #[must_use]
    pub fn of(params: &Params) -> Self {
        let (tau, tau_floor) = match params.window_episodes {
            Some(_) => (params.tau_episodes, params.tau_floor_episodes),
            None => (params.tau_steps, params.tau_floor_steps),
        };
        Self {
            gate: params.gate,
            tau,
            tau_floor,
            freeze: params.freeze,
            freeze_share: params.freeze_share,
            freeze_success: params.freeze_success,
        }
    }

    /// Whether a region that is handed over teaches no more.
    #[must_use]
    pub fn freezes_learner(&self) -> bool {
        self.freeze == Freeze::ShareAndLearner
    }

    /// τ when the gate opens at step, or episode, k: −k / ln gate (eq. 22–23), or the set one.
    fn tau(&self, step: u64) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "a step count far below 2^52")]
        let found = -(step as f64) / self.gate.ln();
        self.tau.unwrap_or(found.max(self.tau_floor))
    }
}

/// Where a gate opened.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Opened {
    /// The controlled step of the region, or the episode, from 1, at which success first
    /// reached the gate.
    pub step: u64,
    /// The time constant of w from then on, in the same unit.
    pub tau: f64,
}

/// One region's share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Weight {
    share: f64,
    steps: u64,
    opened: Option<Opened>,
    /// Whether the share stays as it is for good.
    #[serde(default)]
    frozen: bool,
}

impl Default for Weight {
    fn default() -> Self {
        Self { share: 1.0, steps: 0, opened: None, frozen: false }
    }
}

impl Weight {
    /// The person's share w, 0 to 1.
    #[must_use]
    pub const fn share(&self) -> f64 {
        self.share
    }

    /// Where the gate opened, once it has; it opens once.
    #[must_use]
    pub const fn opened(&self) -> Option<Opened> {
        self.opened
    }

    /// One controlled step with the success that it led to. Says whether the gate opened
    /// at it; w moves from the step after that: w += (1 − success − w)/τ (eq. 20).
    pub fn step(&mut self, success: f64, dynamics: &Dynamics) -> bool {
        self.steps += 1;
        match self.opened {
            None if success >= dynamics.gate => {
                self.opened = Some(Opened { step: self.steps, tau: dynamics.tau(self.steps) });
                true
            }
            None => false,
            Some(_) if self.frozen => false,
            Some(opened) => {
                let step = (1.0 - success - self.share) / opened.tau;
                self.share = (self.share + step).clamp(0.0, 1.0);
                false
            }
        }
    }

    /// Whether the share stays as it is for good.
    #[must_use]
    pub const fn is_frozen(&self) -> bool {
        self.frozen
    }

    /// Freezes the share once it is low enough and `success` high enough, where `dynamics` say
    /// so; true when that happens. To be asked only with a full window, or an early success would decide.
    pub fn freeze(&mut self, success: f64, dynamics: &Dynamics) -> bool {
        let is_due = dynamics.freeze != Freeze::Off
            && self.share < dynamics.freeze_share
            && success >= dynamics.freeze_success;
        let happens = is_due && !self.frozen;
        self.frozen |= is_due;
        happens
    }
}
