//! How well simulated people do their tasks without a robot, on virtual time.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

use coadapt::operator::simulated::{Kind, Skill, ball_beam, mountain_car, swing_up};
use coadapt::operator::{Operator, Practice, View};
use coadapt::plant::{self, Plant};
use coadapt::random::{Place, Purpose, stream};
use coadapt::signal::{Action, Seconds, State};
use rand::RngExt;

/// A person at a plant.
struct Desk<P, O> {
    plant: P,
    operator: O,
    seed: u64,
    tick: Seconds,
}

impl<P: Plant, O: Operator> Desk<P, O> {
    /// The states and actions of a rollout of at most `ticks`, until `over`.
    fn rollout(
        &mut self,
        number: u32,
        practised: Seconds,
        start: State,
        ticks: u32,
        over: impl Fn(&State) -> bool,
    ) -> Vec<(State, Action)> {
        let place = Place { phase: 2, rollout: number, attempt: 0 };
        self.plant.reseed(stream(self.seed, Purpose::Friction, place));
        self.operator.begin(place, Practice { rollouts: number - 1, time: practised });
        let mut state = start;
        let mut rows = Vec::new();
        for tick in 0..ticks {
            let time = self.tick * f64::from(tick);
            let view = View { state: &state, now: time, rollout_time: time };
            let action = self.operator.intent(view).action();
            rows.push((state, action));
            state = self.plant.step(&state, action);
            if over(&state) {
                break;
            }
        }
        rows
    }
}

fn mean(values: &[f64]) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "few values")]
    let count = values.len().max(1) as f64;
    values.iter().sum::<f64>() / count
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

const TICK: Seconds = Seconds(0.02);
/// Practice before what is measured: the introduction.
const INTRODUCTION: Seconds = Seconds(180.0);

/// What came of swinging up for some time.
#[derive(Clone, Copy, Debug)]
struct Swung {
    height: f64,
    top_share: f64,
    longest_hold_s: f64,
    /// Until the pole was within 30° of upright for 0.5 s; infinite if never.
    up_s: f64,
}

/// A rollout that begins hanging at rest, after so much practice.
fn swing_up(
    params: &swing_up::Params,
    skill: Skill,
    kind: Kind,
    seed: u64,
    practised: Seconds,
    seconds: u32,
) -> Swung {
    let physics = plant::cart_pole::Params { pole_length_m: 0.6, ..Default::default() };
    let mut desk = Desk {
        operator: swing_up::Swinger::new(params, skill, kind, seed, TICK, &physics),
        plant: plant::cart_pole::CartPole::new(physics, TICK),
        seed,
        tick: TICK,
    };
    let hanging = State::new([0.0, 0.0, std::f64::consts::PI, 0.0]);
    let rows = desk.rollout(1, practised, hanging, seconds * 50, |_| false);
    let heights: Vec<f64> = rows.iter().map(|(state, _)| state[2].cos()).collect();
    let (mut longest, mut hold, mut top, mut up_s) = (0.0_f64, 0.0, 0.0, f64::INFINITY);
    for (tick, height) in heights.iter().enumerate() {
        if *height > 30_f64.to_radians().cos() {
            hold += TICK.0;
            top += TICK.0;
        } else {
            hold = 0.0;
        }
        if hold > 0.5 && up_s.is_infinite() {
            #[expect(clippy::cast_precision_loss, reason = "few ticks")]
            let now = tick as f64 * TICK.0;
            up_s = now - 0.5;
        }
        longest = longest.max(hold);
    }
    Swung {
        height: mean(&heights),
        top_share: top / f64::from(seconds),
        longest_hold_s: longest,
        up_s,
    }
}

/// What came of rolling the ball.
#[derive(Clone, Copy, Debug)]
struct Rolled {
    /// R of eq. 27 without learning or help, m/s.
    reward: f64,
    /// How often a minute an end stopped the ball.
    hits_min: f64,
}

fn roll(
    params: &ball_beam::Params,
    skill: Skill,
    kind: Kind,
    seed: u64,
    practised: Seconds,
    seconds: u32,
) -> Rolled {
    let physics = plant::ball_beam::Params::default();
    let end = physics.beam_half_length_m;
    let mut desk = Desk {
        operator: ball_beam::Roller::new(params, skill, kind, seed, TICK, &physics),
        plant: plant::ball_beam::BallBeam::new(physics, TICK),
        seed,
        tick: TICK,
    };
    let rows = desk.rollout(1, practised, State::new([0.0; 4]), seconds * 50, |_| false);
    let reward = |state: &State| state[1].abs() - if state[0].abs() > 0.17 { 1.0 } else { 0.0 };
    let rewards: Vec<f64> = rows.iter().map(|(state, _)| reward(state)).collect();
    let hits = rows
        .windows(2)
        .filter(|pair| pair[1].0[0].abs() >= end && pair[0].0[0].abs() < end)
        .count();
    #[expect(clippy::cast_precision_loss, reason = "few hits")]
    let hits = hits as f64;
    Rolled { reward: mean(&rewards), hits_min: hits * 60.0 / f64::from(seconds) }
}

/// The steps of `rollouts` drives from (−0.7, 0), 500 at most.
fn drive(
    params: &mountain_car::Params,
    skill: Skill,
    kind: Kind,
    seed: u64,
    practised: Seconds,
    rollouts: u32,
) -> Vec<f64> {
    const TICK: Seconds = Seconds(0.04);
    let physics = plant::mountain_car::Params::default();
    let mut desk = Desk {
        operator: mountain_car::Driver::new(params, skill, kind, seed, TICK, &physics),
        plant: plant::mountain_car::MountainCar::new(physics),
        seed,
        tick: TICK,
    };
    let mut time = practised;
    (1..=rollouts)
        .map(|number| {
            let start = State::new([-0.7, 0.0]);
            let rows = desk.rollout(number, time, start, 500, |state| state[0] >= 0.5);
            #[expect(clippy::cast_precision_loss, reason = "at most 500")]
            let steps = rows.len() as f64;
            time = time + TICK * steps;
            steps
        })
        .collect()
}

/// Parameters for trying things out: `COADAPT_TRY` in RON.
fn tried<T: Default + for<'de> serde::Deserialize<'de>>(task: &str) -> T {
    match std::env::var(format!("COADAPT_TRY_{task}")) {
        Ok(text) => ron::from_str(&text).unwrap(),
        Err(_) => T::default(),
    }
}

#[test]
#[ignore = "prints the tables of the modules' docs"]
fn measure() {
    let seeds = 1..=20_u64;
    let kinds: &[Kind] = if std::env::var("QUICK").is_ok() { &Kind::ALL[..1] } else { &Kind::ALL };
    let only = std::env::var("ONLY").unwrap_or_default();
    for kind in kinds {
        for skill in Skill::ALL {
            for practised in [INTRODUCTION, INTRODUCTION + Seconds(1000.0)] {
                let label = format!("{kind:13} {skill:8} {:5}", practised.0);
                if "SWING".contains(&only) {
                    let params = tried("SWING");
                    let all: Vec<Swung> = seeds
                        .clone()
                        .map(|seed| swing_up(&params, skill, *kind, seed, practised, 120))
                        .collect();
                    let of = |number: fn(&Swung) -> f64| all.iter().map(number).collect::<Vec<_>>();
                    eprintln!(
                        "swing {label} height {:5.2} top {:.2} longest {:5.2} (median {:5.2}) up {:5.1} s",
                        mean(&of(|s| s.height)),
                        mean(&of(|s| s.top_share)),
                        mean(&of(|s| s.longest_hold_s)),
                        median(of(|s| s.longest_hold_s)),
                        median(of(|s| s.up_s)),
                    );
                }
                if "BALL".contains(&only) {
                    let params = tried("BALL");
                    let all: Vec<Rolled> = seeds
                        .clone()
                        .map(|seed| roll(&params, skill, *kind, seed, practised, 120))
                        .collect();
                    let of =
                        |number: fn(&Rolled) -> f64| all.iter().map(number).collect::<Vec<_>>();
                    let rewards = of(|s| s.reward);
                    let least = rewards.iter().copied().fold(f64::INFINITY, f64::min);
                    eprintln!(
                        "ball  {label} R {:6.3} (least {least:6.3}) hits/min {:5.1}",
                        mean(&rewards),
                        mean(&of(|s| s.hits_min)),
                    );
                }
                if "CAR".contains(&only) {
                    let params = tried("CAR");
                    let all: Vec<f64> = seeds
                        .clone()
                        .flat_map(|seed| drive(&params, skill, *kind, seed, practised, 10))
                        .collect();
                    let most = all.iter().copied().fold(0.0, f64::max);
                    eprintln!(
                        "car   {label} steps {:5.1} median {:5.1} most {most}",
                        mean(&all),
                        median(all.clone())
                    );
                }
            }
        }
    }
    let _ = stream(0, Purpose::Starts, Place::default()).random::<f64>();
}
