//! From a device's raw deflection to a force.

/// How a raw deflection becomes an action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaping {
    /// Deflections up to this one count as rest; 0 to below 1.
    pub dead_zone: f64,
    /// Factor on the deflection; full deflection stays full.
    pub sensitivity: f64,
    /// The action at full deflection, in the plant's unit.
    pub limit: f64,
}

impl Shaping {
    /// The action for a deflection in [-1, 1]; what is not a number counts as rest.
    #[must_use]
    pub fn shape(&self, raw: f64) -> f64 {
        let beyond = (raw.clamp(-1.0, 1.0).abs() - self.dead_zone) / (1.0 - self.dead_zone);
        if beyond > 0.0 {
            (self.sensitivity * beyond.copysign(raw)).clamp(-1.0, 1.0) * self.limit
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rest_is_0_full_is_the_limit_and_nothing_exceeds_it() {
        let shaping = Shaping { dead_zone: 0.1, sensitivity: 1.0, limit: 10.0 };
        assert_eq!(shaping.shape(0.1), 0.0);
        assert_eq!(shaping.shape(f64::NAN), 0.0);
        assert_eq!(shaping.shape(1.0), 10.0);
        assert_eq!(shaping.shape(-7.0), -10.0);
        assert!((shaping.shape(-0.55) + 5.0).abs() < 1e-12);
        assert_eq!(Shaping { sensitivity: 3.0, ..shaping }.shape(0.9), 10.0);
    }
}
