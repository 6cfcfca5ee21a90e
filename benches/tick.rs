//! What a whole control tick costs, from sensing to publishing: main phase on the cart-pole,
//! a learner of 100 receptive fields, with and without a recorder. First the percentiles
//! over many ticks, then criterion's statistics.

#![expect(clippy::expect_used, reason = "a benchmark that cannot be set up says why and ends")]
#![expect(clippy::print_stdout, reason = "percentiles are no matter of criterion's")]

use std::collections::BTreeMap;
use std::path::Path;

use coadapt::clock::{Clock, Pacer, VirtualClock, WallClock};
use coadapt::control::cycle::{Crew, Cycle, Rules};
use coadapt::control::scribe::{Origin, Scribe};
use coadapt::control::snapshot::{Watcher, channel};
use coadapt::control::witness::{Nobody, Witness};
use coadapt::learner::{Learner, Model, Params};
use coadapt::operator::simulated::cart_pole::Balancer;
use coadapt::operator::simulated::{self, Kind, Skill};
use coadapt::plant::cart_pole;
use coadapt::profile::{Document, Profile};
use coadapt::random::{Place, Purpose, stream};
use coadapt::record::sidecar::Host;
use coadapt::record::{Columns, Folder, Manner, Recorder, Sidecar, Status, VERSION};
use coadapt::session::machine::Stage;
use coadapt::session::plan::Plan;
use coadapt::session::{Moment, Phase, Trial};
use coadapt::sharing::Mode;
use coadapt::study::evaluate::simulated_backend;
use criterion::{Criterion, criterion_group, criterion_main};
use rand::RngExt;

const SEED: u64 = 1;
const FIELDS: usize = 100;
const TICKS: u32 = 100_000;

/// A session of nothing but main.
const PROFILE: &str = r#"(
    task: "balance",
    session: (phases: [main], main_rollouts: Some(1000000), hold_s: 0.0),
)"#;

fn profile() -> Profile {
    Document::from_text("tick", PROFILE).read().expect("the profile is right")
}

/// A learner that was taught a balancing policy all over the state space, until it had all
/// its fields and trusts them.
fn taught(profile: &Profile) -> Model {
    let params = Params {
        init_d: 7.0,
        w_gen: 0.2,
        w_prune: 1.0,
        max_fields: u32::try_from(FIELDS).unwrap_or(u32::MAX),
        ..profile.learner.clone()
    };
    let mut learner = params.build(4, 10.0).expect("the parameters are right");
    let mut rng = stream(SEED, Purpose::Starts, Place::default());
    for _ in 0..20_000 {
        let scaled: [f64; 4] = std::array::from_fn(|_| rng.random_range(-1.0..=1.0));
        let x: [f64; 4] = std::array::from_fn(|i| scaled[i] * params.norm_in[i]);
        let y = 2.4 * scaled[0] + 5.4 * scaled[1] + 5.25 * scaled[2] + 13.5 * scaled[3];
        learner.update(&x, &[y.clamp(-10.0, 10.0)], 1.0).expect("the sample is finite");
    }
    assert_eq!(learner.fields(), FIELDS);
    learner
}

fn sidecar(profile: &Profile) -> Sidecar {
    Sidecar {
        version: VERSION.to_owned(),
        task: profile.experiment.name().to_owned(),
        preset: profile.preset.clone(),
        mode: Mode::Simultaneous,
        assigned: false,
        learner: "rfwr".to_owned(),
        operator: "simulated:expert".to_owned(),
        backend: "simulated".to_owned(),
        subject: "bench".parse().expect("a subject's name"),
        trial: Trial(1),
        seed: SEED,
        status: Status::Running,
        started: String::new(),
        ended: None,
        key_releases: None,
        devices: Vec::new(),
        host: Host::default(),
        timing: None,
        planned: vec![Phase::Main],
        profile_ron: profile.to_ron(),
        profile: serde_json::Value::Null,
        phases: BTreeMap::new(),
        resumed: Vec::new(),
    }
}

fn plan(profile: &Profile) -> Plan {
    Plan::new(&profile.session, profile.tick(), SEED, false)
}

/// Records into a folder below `logs`, as a live session does.
fn scribe(profile: &Profile, logs: &Path) -> Scribe {
    let sidecar = sidecar(profile);
    let created = Folder::create(logs, &sidecar.subject, None, "balance", "simultaneous")
        .expect("a place to record");
    let columns = profile.experiment.columns();
    let both = Columns { state: columns, tally: &[] };
    let recorder = Recorder::start(created.folder, &both, Manner::Live, &sidecar)
        .expect("the recorder starts");
    let origin = Origin {
        task: sidecar.task,
        preset: sidecar.preset,
        mode: sidecar.mode,
        features: columns.iter().map(|&name| name.to_owned()).collect(),
        output: "u_human".to_owned(),
        action_limit: 10.0,
    };
    Scribe::new(recorder, origin, plan(profile), Vec::new(), String::new)
}

/// A session in its main phase, ticked at will.
struct Bench<W> {
    cycle: Cycle<W>,
    clock: VirtualClock,
    pacer: Pacer,
    watcher: Watcher,
}

impl<W: Witness> Bench<W> {
    fn new(profile: &Profile, learner: &Model, witness: W) -> Self {
        let tick = profile.tick();
        let plant = cart_pole::Params::default();
        let params = simulated::cart_pole::Params::default();
        let kind = Kind::default();
        let operator = Balancer::new(&params, Skill::Expert, kind, SEED, tick, &plant);
        let (publisher, watcher) = channel(Stage::Instruction(Moment::start_of(Phase::Main)));
        let rules = Rules {
            plan: plan(profile),
            tick,
            mode: Mode::Simultaneous,
            sharing: profile.sharing.clone(),
            teaching: profile.teaching.clone(),
            fresh: learner.clone(),
        };
        let crew = Crew {
            task: profile.experiment.task(tick),
            backend: simulated_backend(profile, SEED),
            operator: Box::new(operator),
            witness,
            publisher: Some(publisher),
        };
        let clock = VirtualClock::default();
        let pacer = Pacer::new(&clock);
        Self { cycle: Cycle::new(rules, crew, learner.clone(), None), clock, pacer, watcher }
    }

    fn step(&mut self) -> bool {
        self.cycle.step(&mut self.clock, &mut self.pacer)
    }

    /// Prints the percentiles of single ticks, those that end rollouts included.
    fn percentiles(&mut self, name: &str) {
        let wall = WallClock::start();
        let mut durations: Vec<f64> = (0..TICKS)
            .map(|_| {
                let before = wall.now();
                self.step();
                (wall.now() - before).0 * 1e6
            })
            .collect();
        durations.sort_unstable_by(f64::total_cmp);
        let seen = self.watcher.look();
        let last = durations.len() - 1;
        let [p50, p99, most] = [last / 2, last * 99 / 100, last].map(|rank| durations[rank]);
        println!(
            "{name}: {TICKS} ticks, p50 {p50:.2} µs, p99 {p99:.2} µs, max {most:.0} µs; \
             {} fields, {} samples learned, {} rows lost",
            seen.fields, seen.learned, seen.lost_rows
        );
    }
}

fn ticks(criterion: &mut Criterion) {
    let profile = profile();
    let learner = taught(&profile);
    let logs = tempfile::tempdir().expect("a place to record");
    let mut unrecorded = Bench::new(&profile, &learner, Nobody);
    let mut recorded = Bench::new(&profile, &learner, scribe(&profile, logs.path()));
    unrecorded.percentiles("tick");
    recorded.percentiles("tick, recorded");
    let mut group = criterion.benchmark_group(format!("control, {FIELDS} fields"));
    group.bench_function("tick", |b| b.iter(|| unrecorded.step()));
    group.bench_function("tick, recorded", |b| b.iter(|| recorded.step()));
    group.finish();
}

criterion_group!(benches, ticks);
criterion_main!(benches);
