//! Eligibility traces: which values a step moves beside its own, and how much.

/// Parts below this are forgotten: they would move a value by less than it is known.
const NEGLIGIBLE: f64 = 1e-9;

/// Watkins' traces, replacing ones.
#[derive(Clone, Debug)]
pub(super) struct Traces {
    /// What a trace loses in a step, γλ.
    fading: f64,
    /// Places in the table and their parts, each place once.
    of: Vec<(usize, f64)>,
}

impl Traces {
    /// No traces yet, in a table of that many `values`: a step never needs more room.
    pub(super) fn new(fading: f64, values: usize) -> Self {
        Self { fading, of: Vec::with_capacity(values) }
    }

    pub(super) fn clear(&mut self) {
        self.of.clear();
    }

    /// A step moves the value at `place`, wholly, and those before it if the step was what
    /// the policy wanted: what came before led to the policy's return, not to an experiment's.
    pub(super) fn visit(&mut self, place: usize, is_on_policy: bool) {
        if is_on_policy {
            let fading = self.fading;
            self.of.retain_mut(|(other, part)| {
                *part *= fading;
                *other != place && *part > NEGLIGIBLE
            });
        } else {
            self.of.clear();
        }
        self.of.push((place, 1.0));
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, f64)> {
        self.of.iter().copied()
    }
}
