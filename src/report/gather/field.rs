//! Receptive fields as they lie in the plane of a phase portrait.

use std::f64::consts::TAU;

use crate::learner::{Learner as _, Model};

/// A receptive field: (x − c)ᵀ D (x − c) = 1 is its outline, in units of the norms.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    centre: Vec<f64>,
    /// D, n × n by rows.
    metric: Vec<f64>,
    norms: Vec<f64>,
}

/// A centre and its metric.
type Shape = (Vec<f64>, Vec<f64>);

/// Directions in which an outline is traced.
const DIRECTIONS: u32 = 36;

impl Field {
    /// The fields of `model`, those of its first output.
    #[must_use]
    pub fn all(model: &Model) -> Vec<Self> {
        let (norms, shapes): (&[f64], Vec<Shape>) = match model {
            Model::Rfwr(rfwr) => (
                &rfwr.settings().norm_in,
                (0..rfwr.fields()).map(|k| (rfwr.centre(k), rfwr.metric(k))).collect(),
            ),
            Model::Lwpr(lwpr) => (
                &lwpr.settings().norm_in,
                lwpr.submodels().first().map_or_else(Vec::new, |first| {
                    (0..first.len()).map(|k| (first.centre(k), first.metric(k))).collect()
                }),
            ),
        };
        shapes
            .into_iter()
            .map(|(centre, metric)| Self {
                metric: whole(metric, centre.len()),
                centre,
                norms: norms.to_vec(),
            })
            .collect()
    }

    /// Its centre, in the units of the features.
    #[must_use]
    pub fn centre(&self) -> Vec<f64> {
        self.centre.iter().zip(&self.norms).map(|(centre, norm)| centre * norm).collect()
    }

    /// (x − c)ᵀ D (x − c) at `features`.
    fn distance(&self, features: &[f64]) -> f64 {
        let n = self.centre.len();
        let away: Vec<f64> = features
            .iter()
            .zip(&self.norms)
            .zip(&self.centre)
            .map(|((x, norm), centre)| x / norm - centre)
            .collect();
        let row = |a: usize| (0..n).map(|b| self.metric[a * n + b] * away[b]).sum::<f64>();
        (0..n).map(|a| away[a] * row(a)).sum()
    }

    /// Its outline around `middle` in a plane: `features` says what the learner sees at a point,
    /// where all that the plane does not show is as at the centre. `scale` is a length of each
    /// axis that matters. Nothing where the middle lies outside.
    pub fn outline(
        &self,
        middle: (f64, f64),
        scale: (f64, f64),
        features: impl Fn((f64, f64)) -> Vec<f64>,
    ) -> Vec<(f64, f64)> {
        let is_inside = |point| self.distance(&features(point)) < 1.0;
        if self.norms.len() != self.centre.len() || !is_inside(middle) {
            return Vec::new();
        }
        (0..=DIRECTIONS)
            .map(|turn| {
                let (sin, cos) = (TAU * f64::from(turn) / f64::from(DIRECTIONS)).sin_cos();
                let at = |r: f64| (middle.0 + r * cos * scale.0, middle.1 + r * sin * scale.1);
                // Far out, then halfway between inside and outside, again and again.
                let (mut inside, mut outside) = (0.0, 1.0 / 64.0);
                while outside < 4.0 && is_inside(at(outside)) {
                    inside = outside;
                    outside *= 1.5;
                }
                for _ in 0..14 {
                    let half = f64::midpoint(inside, outside);
                    if is_inside(at(half)) { inside = half } else { outside = half }
                }
                at(inside)
            })
            .collect()
    }
}

/// D as a whole matrix, from that or from its diagonal.
fn whole(metric: Vec<f64>, n: usize) -> Vec<f64> {
    if metric.len() != n || n == 1 {
        return metric;
    }
    (0..n * n).map(|at| if at / n == at % n { metric[at / n] } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_is_the_ellipse_of_the_metric() {
        // Half-axes 1/√4 = 0.5 and 1/√25 = 0.2, times the norms 2 and 10.
        let field = Field {
            centre: vec![0.5, -1.0],
            metric: whole(vec![4.0, 25.0], 2),
            norms: vec![2.0, 10.0],
        };
        assert_eq!(field.centre(), [1.0, -10.0]);
        let outline = field.outline((1.0, -10.0), (1.0, 1.0), |(x, y)| vec![x, y]);
        for (x, y) in &outline {
            let on = ((x - 1.0) / 1.0).powi(2) + ((y + 10.0) / 2.0).powi(2);
            assert!((on - 1.0).abs() < 1e-2, "{x} {y}: {on}");
        }
        assert!((outline[0].0 - 2.0).abs() < 1e-3);
        assert!(field.outline((9.0, 9.0), (1.0, 1.0), |(x, y)| vec![x, y]).is_empty());
    }
}
