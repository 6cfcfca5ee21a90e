//! The share w of the person and its dynamics.

use serde::{Deserialize, Serialize};

use super::Params;

/// How w moves; the same for all regions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dynamics {
    gate: f64,
    tau_steps: Option<f64>,
    tau_floor_steps: f64,
}

impl Dynamics {
    /// The dynamics that `params` describe.
    #[must_use]
    pub fn of(params: &Params) -> Self {
        Self {
            gate: params.gate,
            tau_steps: params.tau_steps,
            tau_floor_steps: params.tau_floor_steps,
        }
    }

    /// τ when the gate opens at step k: −k / ln gate (eq. 22–23), or the set one.
    fn tau(&self, step: u64) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "a step count far below 2^52")]
        let found = -(step as f64) / self.gate.ln();
        self.tau_steps.unwrap_or(found.max(self.tau_floor_steps))
    }
}

/// Where a gate opened.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Opened {
    /// The controlled step, from 1, at which success first reached the gate.
    pub step: u64,
    /// The time constant of w from then on, in steps.
    pub tau_steps: f64,
}

/// One region's share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Weight {
    share: f64,
    steps: u64,
    opened: Option<Opened>,
}

impl Default for Weight {
    fn default() -> Self {
        Self { share: 1.0, steps: 0, opened: None }
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
                self.opened =
                    Some(Opened { step: self.steps, tau_steps: dynamics.tau(self.steps) });
                true
            }
            None => false,
            Some(opened) => {
                let step = (1.0 - success - self.share) / opened.tau_steps;
                self.share = (self.share + step).clamp(0.0, 1.0);
                false
            }
        }
    }
}
