//! Swing-up and balance: from hanging at rest to upright, and keep it there (thesis 3.1).
//!
//! Six regions of angle and speed (Table 1) each have a share of their own. What counts is
//! the height of the pole's tip, as the pseudo-height cos θ: 1 upright, −1 hanging.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::{Occasion, Tally, Task, steps_of};
use crate::check::{Check, Checker};
use crate::plant::cart_pole::{self, CartPole};
use crate::sharing::region::{Region, Scale};
use crate::signal::{End, Features, Seconds, State, Tallied};

/// The rules of the swing-up task. Defaults: Table 1, with the readings of the errata.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// A steered rollout is this long, s.
    pub rollout_s: f64,
    /// A test of the robot alone, or of nobody, is this long, s.
    pub test_s: f64,
    /// A test starts from hanging with this angular velocity, degrees/s, to one side and
    /// the other in turn.
    pub test_push_deg_s: f64,
    /// The down regions end at this angle from upright, degrees.
    pub down_deg: f64,
    /// The slow top region begins below this angle, degrees.
    pub top_slow_deg: f64,
    /// The fast top region begins below this angle, degrees.
    pub top_fast_deg: f64,
    /// Fast is this angular velocity or more while down, rad/s,
    pub down_fast_rad_s: f64,
    /// in the middle,
    pub middle_fast_rad_s: f64,
    /// and at the top.
    pub top_fast_rad_s: f64,
    /// A mean height as at this angle is full success: down slow, degrees;
    pub down_slow_goal_deg: f64,
    /// down fast;
    pub down_fast_goal_deg: f64,
    /// middle slow;
    pub middle_slow_goal_deg: f64,
    /// middle fast;
    pub middle_fast_goal_deg: f64,
    /// top slow;
    pub top_slow_goal_deg: f64,
    /// top fast.
    pub top_fast_goal_deg: f64,
    /// The pole is held at the top while it stays within ± this angle, degrees (ours).
    pub hold_deg: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            rollout_s: 20.0,
            test_s: 30.0,
            test_push_deg_s: 30.0,
            down_deg: 120.0,
            top_slow_deg: 30.0,
            top_fast_deg: 40.0,
            down_fast_rad_s: 8.0,
            middle_fast_rad_s: 3.0,
            top_fast_rad_s: 1.0,
            down_slow_goal_deg: 160.0,
            down_fast_goal_deg: 160.0,
            middle_slow_goal_deg: 70.0,
            middle_fast_goal_deg: 60.0,
            top_slow_goal_deg: 4.0,
            top_fast_goal_deg: 20.0,
            hold_deg: 30.0,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.range("rollout_s", self.rollout_s, 1.0..=3600.0);
        c.range("test_s", self.test_s, 1.0..=3600.0);
        c.range("test_push_deg_s", self.test_push_deg_s, 0.0..=720.0);
        c.range("down_deg", self.down_deg, 60.0..=179.0);
        c.range("top_slow_deg", self.top_slow_deg, 1.0..=90.0);
        c.range("top_fast_deg", self.top_fast_deg, 1.0..=90.0);
        let widest = self.top_slow_deg.max(self.top_fast_deg);
        let has_middle = widest < self.down_deg;
        c.demand(
            has_middle,
            "down_deg",
            self.down_deg,
            "above top_slow_deg and top_fast_deg, or there would be no middle",
        );
        for (key, speed) in [
            ("down_fast_rad_s", self.down_fast_rad_s),
            ("middle_fast_rad_s", self.middle_fast_rad_s),
            ("top_fast_rad_s", self.top_fast_rad_s),
        ] {
            c.range(key, speed, 0.1..=100.0);
        }
        let lowest = [180.0, 180.0, self.down_deg, self.down_deg];
        let lowest = lowest.into_iter().chain([self.top_slow_deg, self.top_fast_deg]);
        for ((key, goal), lowest) in self.goals().into_iter().zip(lowest) {
            c.range(key, goal, 0.0..=179.0);
            c.demand(
                // Where there is no middle that is the fault, not its goals.
                goal < lowest || !has_middle,
                key,
                goal,
                "an angle above the region's lowest one, where success is 0",
            );
        }
        c.range("hold_deg", self.hold_deg, 1.0..=90.0);
    }
}

impl Params {
    /// The goals with their keys, in the order of the regions.
    const fn goals(&self) -> [(&'static str, f64); 6] {
        [
            ("down_slow_goal_deg", self.down_slow_goal_deg),
            ("down_fast_goal_deg", self.down_fast_goal_deg),
            ("middle_slow_goal_deg", self.middle_slow_goal_deg),
            ("middle_fast_goal_deg", self.middle_fast_goal_deg),
            ("top_slow_goal_deg", self.top_slow_goal_deg),
            ("top_fast_goal_deg", self.top_fast_goal_deg),
        ]
    }
}

/// Where the regions of Table 1 meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Borders {
    /// Down ends here: cos θ.
    pub down: f64,
    /// The slow top begins here: cos θ,
    pub top_slow: f64,
    /// and the fast one here.
    pub top_fast: f64,
    /// Fast begins here while down, rad/s,
    pub down_speed: f64,
    /// in the middle,
    pub middle_speed: f64,
    /// and at the top.
    pub top_speed: f64,
}

impl Borders {
    /// The region of a pole at height `cos` that turns at `speed` ≥ 0, rad/s. Where the
    /// rows of Table 1 overlap, the fast top wins over the slow middle; a lower bound
    /// belongs to its region.
    #[must_use]
    pub fn region(&self, cos: f64, speed: f64) -> usize {
        let is_top_fast = cos >= self.top_fast && speed >= self.top_speed;
        let is_top_slow = cos >= self.top_slow && speed < self.top_speed;
        // Written so that an angle that is not a number counts as down.
        let is_middle = cos >= self.down;
        match (is_top_fast, is_top_slow, is_middle) {
            (true, ..) => 5,
            (_, true, _) => 4,
            (.., true) => 2 + usize::from(speed >= self.middle_speed),
            _ => usize::from(speed >= self.down_speed),
        }
    }
}

/// The names of the regions, in their order.
pub const REGIONS: [&str; 6] =
    ["down_slow", "down_fast", "middle_slow", "middle_fast", "top_slow", "top_fast"];

/// The swing-up task on a cart-pole that turns all the way round.
#[derive(Clone, Debug)]
pub struct SwingUp {
    rollout_steps: u32,
    test_steps: u32,
    test_push: f64,
    borders: Borders,
    regions: [Region; 6],
    hold_cos: f64,
    tick: f64,
    omega_squared: f64,
    force_limit: f64,
    track_length: Option<f64>,
}

impl SwingUp {
    /// The name outside.
    pub const NAME: &'static str = "swing-up";
    /// The names of what a rollout is measured by.
    pub const TALLY: [&'static str; 3] = ["mean_height", "top_share", "longest_hold_s"];
    const FEATURES: [&'static str; 5] = ["x", "x_dot", "cos_theta", "sin_theta", "theta_dot"];

    /// The task with ticks of `tick` on the given plant.
    #[must_use]
    pub fn new(params: &Params, plant: &cart_pole::Params, tick: Seconds) -> Self {
        let cos = |degrees: f64| degrees.to_radians().cos();
        let borders = Borders {
            down: cos(params.down_deg),
            top_slow: cos(params.top_slow_deg),
            top_fast: cos(params.top_fast_deg),
            down_speed: params.down_fast_rad_s,
            middle_speed: params.middle_fast_rad_s,
            top_speed: params.top_fast_rad_s,
        };
        let Borders { down, top_slow, top_fast, .. } = borders;
        let minimum = [-1.0, -1.0, down, down, top_slow, top_fast];
        let goals = params.goals();
        let regions = std::array::from_fn(|i| Region {
            name: REGIONS[i],
            scale: Scale { minimum: minimum[i], threshold: cos(goals[i].1) },
        });
        Self {
            rollout_steps: steps_of(params.rollout_s, tick),
            test_steps: steps_of(params.test_s, tick),
            test_push: params.test_push_deg_s.to_radians(),
            borders,
            regions,
            hold_cos: cos(params.hold_deg),
            tick: tick.0,
            // ω² = 3g / 4l of a uniform rod about its end; l is half the pole.
            omega_squared: 1.5 * plant.gravity_m_s2 / plant.pole_length_m,
            force_limit: plant.force_limit_n,
            track_length: plant.track_length_m,
        }
    }

    /// Where the regions meet.
    #[must_use]
    pub const fn borders(&self) -> Borders {
        self.borders
    }

    /// Hanging, turning at `speed`.
    fn hanging(speed: f64) -> State {
        State::new([0.0, 0.0, std::f64::consts::PI, speed])
    }
}

impl Task for SwingUp {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn columns(&self) -> &'static [&'static str] {
        &CartPole::COLUMNS
    }

    /// cos θ and sin θ in place of θ, which jumps once a turn (3.1.1).
    fn features(&self, state: &State) -> Features {
        let &[x, x_dot, theta, theta_dot] = &state[..] else { return Features::default() };
        let (sin, cos) = theta.sin_cos();
        Features::new([x, x_dot, cos, sin, theta_dot])
    }

    fn feature_names(&self) -> &'static [&'static str] {
        &Self::FEATURES
    }

    /// A person starts from hanging at rest; a test with a push drawn within ± the set one.
    fn random_start(&self, occasion: Occasion, chance: &mut ChaCha8Rng) -> State {
        Self::hanging(match occasion {
            Occasion::Tested if self.test_push > 0.0 => {
                chance.random_range(-self.test_push..=self.test_push)
            }
            _ => 0.0,
        })
    }

    /// The same small push, to one side and the other in turn: without it some policies
    /// would never start (3.1.6).
    fn grid_start(&self, index: u32, _count: u32) -> State {
        Self::hanging(if index.is_multiple_of(2) { self.test_push } else { -self.test_push })
    }

    /// The push, rad/s.
    fn start_value(&self, start: &State) -> f64 {
        start.get(3).copied().unwrap_or(0.0)
    }

    /// The pseudo-height cos θ.
    fn reward(&self, state: &State, _next: &State) -> f64 {
        height(state)
    }

    /// Below the top, how far the pole's energy is from that of standing upright, in heights
    /// of half the pole's way up. Towards upright that passes into half the square of the
    /// part that falls over by itself, θ + θ̇/ω: 0 for a pole that just comes to rest there.
    /// At rest both are the missing height, and both vanish on the way to rest upright.
    fn cost(&self, state: &State) -> f64 {
        let &[_, _, theta, theta_dot] = &state[..] else { return f64::NAN };
        // With q = 2 sin θ/2 in place of θ that holds for tilts of any size.
        let (sin, cos) = (theta / 2.0).sin_cos();
        let q = 2.0 * sin * cos.signum();
        let p = theta_dot / self.omega_squared.sqrt();
        let energy = (p * p - q * q) / 2.0;
        let falls = (p + q) * (p + q) / 2.0;
        let border = self.borders.top_fast;
        let nearness = ((theta.cos() - border) / (1.0 - border)).clamp(0.0, 1.0);
        energy.abs() + nearness * (falls - energy.abs())
    }

    fn longest(&self, occasion: Occasion) -> u32 {
        match occasion {
            Occasion::Taught => self.rollout_steps,
            Occasion::Tested => self.test_steps,
        }
    }

    fn end(&self, state: &State, steps: u32, occasion: Occasion) -> Option<End> {
        let all = self.longest(occasion);
        if state.is_finite() { (steps >= all).then_some(End::Cap) } else { Some(End::Failed) }
    }

    fn regions(&self) -> &[Region] {
        &self.regions
    }

    fn region(&self, state: &State) -> usize {
        self.borders.region(height(state), speed(state))
    }

    fn tally_names(&self) -> &'static [&'static str] {
        &Self::TALLY
    }

    fn tally(&self) -> Box<dyn Tally> {
        Box::new(Heights {
            borders: self.borders,
            hold_cos: self.hold_cos,
            tick: self.tick,
            ..Heights::default()
        })
    }

    fn ends(&self) -> Option<(f64, f64)> {
        self.track_length.map(|length| (-length / 2.0, length / 2.0))
    }

    fn action_limit(&self) -> f64 {
        self.force_limit
    }
}

/// How high the pole was.
#[derive(Clone, Copy, Debug, Default)]
struct Heights {
    borders: Borders,
    hold_cos: f64,
    tick: f64,
    steps: u32,
    sum: f64,
    at_top: u32,
    held: u32,
    longest: u32,
}

impl Default for Borders {
    fn default() -> Self {
        SwingUp::new(&Params::default(), &cart_pole::Params::default(), Seconds(0.02)).borders
    }
}

impl Tally for Heights {
    fn step(&mut self, state: &State, _next: &State) {
        let cos = height(state);
        self.steps += 1;
        self.sum += cos;
        self.at_top += u32::from(self.borders.region(cos, speed(state)) >= 4);
        self.held = if cos >= self.hold_cos { self.held.saturating_add(1) } else { 0 };
        self.longest = self.longest.max(self.held);
    }

    fn tallied(&self) -> Tallied {
        let steps = f64::from(self.steps.max(1));
        let longest = f64::from(self.longest) * self.tick;
        Tallied::new([self.sum / steps, f64::from(self.at_top) / steps, longest])
    }

    /// The steps of the hold under way.
    fn unfinished(&self) -> Tallied {
        Tallied::new([f64::from(self.held)])
    }

    fn go_on(&mut self, unfinished: &Tallied) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a count of steps; nonsense saturates"
        )]
        let held = unfinished.first().copied().unwrap_or(0.0) as u32;
        self.held = held;
    }
}

/// The pseudo-height cos θ.
fn height(state: &State) -> f64 {
    state.get(2).copied().unwrap_or(f64::NAN).cos()
}

/// |θ̇|, rad/s.
fn speed(state: &State) -> f64 {
    state.get(3).copied().unwrap_or(0.0).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn task() -> SwingUp {
        SwingUp::new(&Params::default(), &cart_pole::Params::default(), Seconds(0.02))
    }

    fn at(degrees: f64, speed: f64) -> State {
        State::new([0.0, 0.0, degrees.to_radians(), speed])
    }

    /// Table 1 on, just below and just above every border, and what the errata say where its
    /// rows overlap. Angles just beside a border: cos does not tell equal ones apart to the
    /// last bit.
    #[test]
    fn the_map_is_table_1() {
        const EDGE: f64 = 1e-9;
        let table = [
            (180.0, 0.0, "down_slow"),
            (180.0, 7.999, "down_slow"),
            (180.0, 8.0, "down_fast"),
            (180.0, 25.0, "down_fast"),
            (120.0 + EDGE, 7.999, "down_slow"),
            (120.0 + EDGE, 8.0, "down_fast"),
            (120.0 - EDGE, 0.0, "middle_slow"),
            (120.0 - EDGE, 2.999, "middle_slow"),
            (120.0 - EDGE, 3.0, "middle_fast"),
            (120.0 - EDGE, 8.0, "middle_fast"),
            (40.0 + EDGE, 1.0, "middle_slow"),
            (40.0 + EDGE, 3.0, "middle_fast"),
            (40.0 - EDGE, 0.999, "middle_slow"),
            // The rows of middle slow and top fast overlap here: the fast top wins.
            (40.0 - EDGE, 1.0, "top_fast"),
            (35.0, 2.0, "top_fast"),
            (35.0, 0.5, "middle_slow"),
            (30.0 + EDGE, 0.999, "middle_slow"),
            (30.0 - EDGE, 0.999, "top_slow"),
            (30.0 - EDGE, 1.0, "top_fast"),
            (0.0, 0.0, "top_slow"),
            (0.0, 0.999, "top_slow"),
            (0.0, 1.0, "top_fast"),
            (0.0, 21.0, "top_fast"),
        ];
        let task = task();
        for (degrees, speed, region) in table {
            // To either side, in either direction, and after whole turns.
            for (turns, side) in [(0.0, 1.0), (0.0, -1.0), (2.0, 1.0), (-1.0, -1.0)] {
                for speed in [speed, -speed] {
                    let state = at(side * degrees + 360.0 * turns, speed);
                    let found = task.regions()[task.region(&state)].name;
                    // Whole turns cost the last digits of an angle beside a border.
                    let is_beside = (degrees - degrees.round()).abs() > 0.0 && turns != 0.0;
                    assert!(is_beside || found == region, "{degrees}° {speed}: {found}");
                }
            }
        }
    }

    #[test]
    fn a_hold_counts_on_in_a_rollout_that_goes_on() {
        let task = task();
        let (up, down) = (at(5.0, 0.0), at(180.0, 0.0));
        let mut before = task.tally();
        for state in [&up, &down, &up, &up, &up] {
            before.step(state, state);
        }
        let mut after = task.tally();
        after.go_on(&before.unfinished());
        assert_eq!(after.tallied()[2], 0.0, "it is this rollout's once it holds in it");
        after.step(&up, &up);
        after.step(&down, &up);
        assert!((after.tallied()[2] - 0.08).abs() < 1e-12);
        assert_eq!(after.unfinished()[0], 0.0);
        let mut fallen = task.tally();
        fallen.go_on(&before.unfinished());
        fallen.step(&down, &down);
        assert_eq!(fallen.tallied()[2], 0.0);
    }

    /// Eq. 9: success is 0 at a region's lowest height and 1 at its goal's.
    #[test]
    fn success_runs_from_the_lowest_height_of_a_region_to_its_goal() {
        let task = task();
        let ends = [
            ("down_slow", 180.0, 160.0),
            ("down_fast", 180.0, 160.0),
            ("middle_slow", 120.0, 70.0),
            ("middle_fast", 120.0, 60.0),
            ("top_slow", 30.0, 4.0),
            ("top_fast", 40.0, 20.0),
        ];
        for (region, (name, lowest, goal)) in task.regions().iter().zip(ends) {
            assert_eq!(region.name, name);
            let success = |degrees: f64| region.scale.success(degrees.to_radians().cos());
            assert!(success(lowest).abs() < 1e-12 && (success(goal) - 1.0).abs() < 1e-12);
            assert_eq!(success(goal / 2.0), 1.0, "it saturates");
        }
    }

    #[test]
    fn heights_time_at_the_top_and_the_longest_hold_are_counted() {
        let task = task();
        let mut tally = task.tally();
        let next = at(0.0, 0.0);
        // Two steps within the hold, one fast at 35°, three within, and hanging.
        for degrees in [10.0, 29.0, 35.0, 5.0, 5.0, 5.0, 180.0, 180.0] {
            let speed = if degrees == 35.0 { 2.0 } else { 0.0 };
            tally.step(&at(degrees, speed), &next);
        }
        let tallied = tally.tallied();
        let cos = |degrees: f64| degrees.to_radians().cos();
        let sum = cos(10.0) + cos(29.0) + cos(35.0) + 3.0 * cos(5.0) - 2.0;
        assert!((tallied[0] - sum / 8.0).abs() < 1e-12);
        assert!((tallied[1] - 6.0 / 8.0).abs() < 1e-12);
        assert!((tallied[2] - 0.06).abs() < 1e-12);
    }

    #[test]
    fn a_person_starts_at_rest_and_a_test_with_a_push_to_either_side() {
        use crate::random::{Place, Purpose, stream};
        let task = task();
        let mut chance = stream(1, Purpose::Starts, Place::default());
        let taught = task.random_start(Occasion::Taught, &mut chance);
        assert_eq!((taught[2], taught[3]), (std::f64::consts::PI, 0.0));
        let pushes = [0, 1, 2].map(|k| task.grid_start(k, 3)[3].to_degrees());
        assert!((pushes[0] - 30.0).abs() < 1e-12 && pushes[1] == -pushes[0]);
        assert_eq!(pushes[2], pushes[0]);
        assert_eq!(task.end(&taught, 999, Occasion::Taught), None);
        assert_eq!(task.end(&taught, 1000, Occasion::Taught), Some(End::Cap));
        assert_eq!(task.end(&taught, 1000, Occasion::Tested), None);
        assert_eq!(task.end(&taught, 1500, Occasion::Tested), Some(End::Cap));
        assert_eq!(task.end(&at(f64::NAN, 0.0), 1, Occasion::Tested), Some(End::Failed));
    }

    /// No border of a region, nor a whole turn, is a reward or a punishment by itself.
    #[test]
    fn the_cost_has_no_jumps() {
        let task = task();
        for step in -800..800 {
            for speed in [-12.0, -4.0, -1.0, 0.0, 0.5, 1.0, 3.0, 8.0] {
                let degrees = f64::from(step) * 0.5;
                let cost = |more: f64| task.cost(&at(degrees + more, speed));
                let jump = (cost(1e-7) - cost(-1e-7)).abs();
                assert!(jump < 1e-6, "{degrees}°, {speed} rad/s: {jump}");
                let turned = (cost(360.0) - cost(0.0)).abs();
                assert!(turned < 1e-9, "{degrees}°, {speed} rad/s: {turned}");
            }
        }
    }

    /// A pole that swings up to rest upright has no cost on all of its way; one that swings
    /// away from there has, as long as it is at the top.
    #[test]
    fn the_way_up_costs_nothing_and_falling_away_does() {
        let task = task();
        for degrees in [5.0, 15.0, 25.0, 35.0, 60.0, 120.0_f64] {
            let half = (degrees.to_radians() / 2.0).sin();
            let speed = 2.0 * half * task.omega_squared.sqrt();
            assert!(task.cost(&at(degrees, -speed)) < 1e-12, "{degrees}");
            assert!(task.cost(&at(-degrees, speed)) < 1e-12, "{degrees}");
            let falls = task.cost(&at(degrees, speed));
            assert!((falls > 1e-3) == (degrees < 40.0), "{degrees}: {falls}");
            let at_rest = 1.0 - degrees.to_radians().cos();
            assert!((task.cost(&at(degrees, 0.0)) - at_rest).abs() < 1e-12, "{degrees}");
        }
    }

    /// Pumping lowers the cost from hanging on; standing upright has none.
    #[test]
    fn the_cost_is_the_missing_energy_and_at_the_top_the_distance() {
        let task = task();
        assert!((task.cost(&at(180.0, 0.0)) - 2.0).abs() < 1e-12);
        assert!(task.cost(&at(180.0, 5.0)) < task.cost(&at(180.0, 2.0)));
        assert!(task.cost(&at(0.0, 0.0)) < 1e-12);
        assert!(task.cost(&at(10.0, 0.0)) < task.cost(&at(20.0, 0.0)));
    }
}
