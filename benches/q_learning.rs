//! How fast the agent of chapter IV learns, in steps a second of one core's processor time: as
//! a library loop of Q-learning and the plant, through the control cycle, and beside Gymnasium
//! with a table in plain Python, all in one run on one machine.
//!
//! ```sh
//! python3 -m venv gym && gym/bin/pip install gymnasium==1.4.0
//! PYTHON=gym/bin/python taskset -c 0 cargo bench --bench q_learning
//! ```
//!
//! Without Gymnasium its row is left out. `docs/TASKS.md` has what came out.

#![expect(clippy::expect_used, reason = "a benchmark that cannot be set up says why and ends")]
#![expect(clippy::print_stdout, reason = "a table is no matter of criterion's")]

use std::hint::black_box;
use std::process::Command;

use coadapt::clock::{Pacer, VirtualClock};
use coadapt::control::cycle::{Crew, Cycle, Rules};
use coadapt::control::witness::Nobody;
use coadapt::operator::q_learning::{Agent, Params};
use coadapt::plant::Plant;
use coadapt::plant::mountain_car::{self, MountainCar};
use coadapt::profile::Document;
use coadapt::random::{Place, Purpose, stream};
use coadapt::session::plan::Plan;
use coadapt::sharing::Mode;
use coadapt::signal::{Action, State};
use coadapt::study::evaluate::simulated_backend;
use rustix::time::{ClockId, clock_gettime};

/// Episodes of a run, and runs.
const EPISODES: u32 = 60_000;
const SEEDS: u64 = 3;
/// Ticks of the control cycle.
const TICKS: u32 = 1_000_000;
const TAUGHT_TICKS: u32 = 200_000;

/// Processor time of this thread, s.
fn now() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    #[expect(clippy::cast_precision_loss, reason = "a benchmark's time")]
    let (seconds, nanoseconds) = (time.tv_sec as f64, time.tv_nsec as f64);
    seconds + nanoseconds * 1e-9
}

/// Prints how many steps a second `steps` did, and returns that.
fn rate(name: &str, steps: u64, seconds: f64) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "a benchmark's count")]
    let rate = steps as f64 / seconds;
    println!("{name:<44} {:>10.3} M steps/s {:>10.1} ns/step", rate / 1e6, 1e9 / rate);
    rate
}

/// A whole run of the thesis's agent; its steps.
fn learn(seed: u64) -> u64 {
    let car = mountain_car::Params::default();
    let (mut agent, mut plant) = (Agent::new(&Params::default(), &car), MountainCar::new(car));
    let mut steps = 0;
    for episode in 0..EPISODES {
        let place = Place { phase: 2, rollout: episode + 1, attempt: 0 };
        let mut chance = stream(seed, Purpose::Exploration, place);
        agent.begin(episode);
        let mut state = State::new([-0.7, 0.0]);
        let mut cell = agent.cell(&state);
        for _ in 0..500 {
            let throttle = agent.choose(cell, &mut chance);
            state = plant.step(&state, Action(throttle.part()));
            steps += 1;
            if state[0] >= 0.5 {
                agent.learn(cell, throttle, 100.0, None);
                break;
            }
            let next = agent.cell(&state);
            agent.learn(cell, throttle, -1.0, Some(next));
            cell = next;
        }
    }
    black_box(agent);
    steps
}

/// The plant alone, back and forth.
fn drive() -> u64 {
    let mut plant = MountainCar::new(mountain_car::Params::default());
    let mut state = State::new([-0.7, 0.0]);
    let steps = 20_000_000;
    for _ in 0..steps {
        let throttle = if state[1] < 0.0 { -1.0 } else { 1.0 };
        state = plant.step(&state, Action(throttle));
        if state[0] >= 0.5 {
            state = State::new([-0.7, 0.0]);
        }
    }
    black_box(state);
    steps
}

/// The same agent as the operator of a session's `phase`, which nobody writes down.
fn tick(phase: &str, ticks: u32) -> f64 {
    let text = format!(
        "(task: \"mountain-car\", session: (phases: [{phase}], {phase}_rollouts: Some(1000000), \
         hold_s: 0.0))"
    );
    let profile = Document::from_text("bench", text).read().expect("the profile is right");
    let tick = profile.tick();
    let fresh = profile.learner.build(2, 1.0).expect("the parameters are right");
    let rules = Rules {
        plan: Plan::new(&profile.session, tick, 1, false),
        tick,
        mode: Mode::Simultaneous,
        sharing: profile.sharing.clone(),
        teaching: profile.teaching.clone(),
        fresh: fresh.clone(),
    };
    let crew = Crew {
        task: profile.experiment.task(tick),
        backend: simulated_backend(&profile, 1),
        operator: Box::new(profile.experiment.agent(1).expect("the mountain car has an agent")),
        witness: Nobody,
        publisher: None,
    };
    let mut clock = VirtualClock::default();
    let mut pacer = Pacer::new(&clock);
    let mut cycle = Cycle::new(rules, crew, fresh, None);
    let before = now();
    for _ in 0..ticks {
        cycle.step(&mut clock, &mut pacer);
    }
    now() - before
}

/// The rival's steps, and the processor time they took, s.
fn gymnasium() -> Option<(u64, f64)> {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/q_learning.py");
    let output = Command::new(python).arg(script).output().ok().filter(|o| o.status.success())?;
    let text = String::from_utf8(output.stdout).ok()?;
    let (steps, seconds) = text.trim().split_once(' ')?;
    Some((steps.parse().ok()?, seconds.parse().ok()?))
}

fn main() {
    // `cargo test --benches` only wants to know that it runs.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let before = now();
    rate("plant alone", drive(), now() - before);
    let mut best = 0.0_f64;
    for seed in 1..=SEEDS {
        let before = now();
        let steps = learn(seed);
        let name = format!("Q-learning and plant, {EPISODES} episodes, seed {seed}");
        best = best.max(rate(&name, steps, now() - before));
    }
    let practice = tick("introduction", TICKS);
    rate("through the control cycle, no learner", TICKS.into(), practice);
    let main = tick("main", TAUGHT_TICKS);
    rate("through the control cycle, LWPR learning", TAUGHT_TICKS.into(), main);
    match gymnasium() {
        Some((steps, seconds)) => {
            let rival = rate("Gymnasium, a table in plain Python", steps, seconds);
            println!("the library loop is {:.0} times as fast as Gymnasium", best / rival);
        }
        None => println!(
            "Gymnasium is left out: `pip install gymnasium`, and name its python: PYTHON=…"
        ),
    }
}
