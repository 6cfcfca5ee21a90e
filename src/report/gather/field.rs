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

/// Directions in which an outline is first traced.
const DIRECTIONS: u32 = 36;

/// Of neighbouring points further apart than this, in lengths that matter, the direction between
/// is traced too: the tips of a long thin field have few directions.
const APART: f64 = 0.1;

/// How often a gap between two first directions is halved at most.
const HALVINGS: u32 = 7;

/// How far from the plane's middle an outline is followed, in lengths that matter: a field may reach
/// for ever where nothing was ever seen.
const REACH: f64 = 2.0;

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
    /// axis that matters; a field that reaches beyond two of them is cut there. Nothing where the
    /// middle lies outside.
    pub fn outline(
        &self,
        middle: (f64, f64),
        scale: (f64, f64),
        features: impl Fn((f64, f64)) -> Vec<f64>,
    ) -> Vec<(f64, f64)> {
        let is_inside = |(x, y): (f64, f64)| {
            x.abs() < REACH * scale.0
                && y.abs() < REACH * scale.1
                && self.distance(&features((x, y))) < 1.0
        };
        if self.norms.len() != self.centre.len() || !is_inside(middle) {
            return Vec::new();
        }
        let edge = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let at = |r: f64| (middle.0 + r * cos * scale.0, middle.1 + r * sin * scale.1);
            // Far out, then halfway between inside and outside, again and again.
            let (mut inside, mut outside) = (0.0, 1.0 / 64.0);
            while is_inside(at(outside)) {
                inside = outside;
                outside *= 1.5;
            }
            for _ in 0..14 {
                let half = f64::midpoint(inside, outside);
                if is_inside(at(half)) { inside = half } else { outside = half }
            }
            at(inside)
        };
        let angle = |turn: u32| TAU * f64::from(turn) / f64::from(DIRECTIONS);
        let mut points = vec![edge(0.0)];
        for turn in 0..DIRECTIONS {
            let (from, to) = (angle(turn), angle(turn + 1));
            follow(
                &edge,
                scale,
                (from, points[points.len() - 1]),
                (to, edge(to)),
                HALVINGS,
                &mut points,
            );
        }
        points
    }
}

/// An angle and the point of an outline there.
type Traced = (f64, (f64, f64));

/// Puts the outline after `from` up to and with `to`, in steps that are small for the eye.
fn follow(
    edge: &impl Fn(f64) -> (f64, f64),
    scale: (f64, f64),
    from: Traced,
    to: Traced,
    halvings: u32,
    points: &mut Vec<(f64, f64)>,
) {
    let apart = ((to.1.0 - from.1.0) / scale.0).hypot((to.1.1 - from.1.1) / scale.1);
    if halvings == 0 || apart < APART {
        points.push(to.1);
        return;
    }
    let half = f64::midpoint(from.0, to.0);
    let between = (half, edge(half));
    follow(edge, scale, from, between, halvings - 1, points);
    follow(edge, scale, between, to, halvings - 1, points);
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
        let outline = field.outline((1.0, -10.0), (5.0, 10.0), |(x, y)| vec![x, y]);
        for (x, y) in &outline {
            let on = ((x - 1.0) / 1.0).powi(2) + ((y + 10.0) / 2.0).powi(2);
            assert!((on - 1.0).abs() < 1e-2, "{x} {y}: {on}");
        }
        assert!((outline[0].0 - 2.0).abs() < 1e-3);
        assert!(field.outline((9.0, 9.0), (5.0, 10.0), |(x, y)| vec![x, y]).is_empty());
    }

    /// Half-axes 0.1 and 100, of which two lengths are seen: its tips would be a few far points.
    #[test]
    fn a_long_thin_field_is_followed_in_small_steps_and_cut_where_nothing_was_seen() {
        let field = Field {
            centre: vec![0.0, 0.0],
            metric: vec![100.0, 0.0, 0.0, 1e-4],
            norms: vec![1.0; 2],
        };
        let outline = field.outline((0.0, 0.0), (1.0, 1.0), |(x, y)| vec![x, y]);
        assert!(outline.iter().all(|(x, y)| x.abs() <= 0.1 && y.abs() <= 2.0));
        assert!(outline.iter().any(|(_, y)| *y > 1.99), "it is cut at two lengths");
        for pair in outline.windows(2) {
            let step = (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1);
            assert!(step < 0.25, "a step of {step}");
        }
    }
}
