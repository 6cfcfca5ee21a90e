//! What an update and a prediction of the learners cost: first a table of processor times
//! beside those of the LWPR C library, scaled to this machine; then how long single
//! predictions take; then criterion's statistics.
//!
//! Pin it to a core: `taskset -c 0 cargo bench --bench learner`.

#![expect(clippy::expect_used, reason = "a benchmark that cannot be set up says why and ends")]
#![expect(clippy::disallowed_methods, reason = "a benchmark reads clocks")]
#![expect(clippy::print_stdout, reason = "tables are no matter of criterion's")]

#[path = "../examples/common/cross.rs"]
mod cross;

use std::hint::black_box;
use std::time::Instant;

use coadapt::learner::{Learner, Model, lwpr, rfwr};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use cross::{CROSS, POLICY, WAVES, Workload};
use rustix::time::{ClockId, clock_gettime};

/// Samples that are timed.
const FRESH: usize = 10_000;
/// Predictions of which each is timed alone.
const SINGLE: usize = 1_000_000;
/// What a link of [`calibration`] cost where the C library was measured, ns.
const EXP_THERE: f64 = 9.4;

/// A learner to be timed, and what comparable ones took elsewhere, ns of processor time.
#[derive(Clone, Copy)]
struct Row {
    workload: Workload,
    init_d: f64,
    full: bool,
    lwpr: bool,
    /// An update and a prediction of the rival.
    rival: (f64, f64),
}

/// The rivals of `lwpr` rows are the LWPR C library (gcc -O3 -march=native), of the others a
/// transcription of the RFWR reference into C++. `init_d` is such that the learners have as
/// many fields as theirs had.
fn rows() -> Vec<Row> {
    let row =
        |workload: Workload, init_d, full, lwpr, rival| Row { workload, init_d, full, lwpr, rival };
    vec![
        row(CROSS, 61.0, false, true, (1570.0, 920.0)),
        row(CROSS, 61.0, true, true, (1930.0, 910.0)),
        row(POLICY, 6.8, false, true, (6630.0, 3390.0)),
        row(POLICY, 6.8, true, true, (10610.0, 3370.0)),
        row(WAVES, 0.87, false, true, (18250.0, 9520.0)),
        row(WAVES, 0.87, true, true, (86000.0, 9130.0)),
        row(CROSS, 62.0, false, false, (2460.0, 1460.0)),
        row(CROSS, 62.0, true, false, (2100.0, 820.0)),
        row(POLICY, 6.8, false, false, (7540.0, 1650.0)),
        row(POLICY, 6.8, true, false, (12330.0, 2130.0)),
        row(WAVES, 0.85, false, false, (69400.0, 2890.0)),
        row(WAVES, 0.85, true, false, (151_200.0, 4120.0)),
    ]
}

type Samples = Vec<(Vec<f64>, [f64; 1])>;

impl Row {
    fn name(self) -> String {
        let learner = if self.lwpr { "LWPR" } else { "RFWR" };
        let shape = if self.full { "full, meta" } else { "diagonal" };
        format!("{learner} {}, {shape}", self.workload.name)
    }

    /// The learner after its practice, and fresh samples.
    fn prepare(self) -> (Model, Samples) {
        let Workload { inputs, init_alpha, practice, .. } = self.workload;
        let (diag_only, meta, penalty, w_gen) = (!self.full, self.full, 1e-6, 0.2);
        let mut model = if self.lwpr {
            let init_d = lwpr::InitialMetric::Scalar(self.init_d);
            let plain = lwpr::Settings::new(inputs, 1);
            let w_prune = 1.0;
            let settings = lwpr::Settings {
                diag_only,
                meta,
                penalty,
                init_alpha,
                init_d,
                w_gen,
                w_prune,
                ..plain
            };
            Model::Lwpr(lwpr::Lwpr::new(settings).expect("the settings are right"))
        } else {
            let init_d = rfwr::InitialMetric::Scalar(self.init_d);
            let plain = rfwr::Settings::new(inputs, 1);
            let w_prune = 1.0;
            let settings = rfwr::Settings {
                diag_only,
                meta,
                penalty,
                init_alpha,
                init_d,
                w_gen,
                w_prune,
                ..plain
            };
            Model::Rfwr(rfwr::Rfwr::new(settings).expect("the settings are right"))
        };
        let mut samples = self.workload.samples(1);
        for (x, y) in samples.by_ref().take(practice as usize) {
            model.update(&x, &[y], 1.0).expect("a sample is finite");
        }
        (model, samples.take(FRESH).map(|(x, y)| (x, [y])).collect())
    }
}

/// Processor time of this thread, ns.
fn processor_ns() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    #[expect(clippy::cast_precision_loss, reason = "far below 2⁵³")]
    let ns = (time.tv_sec * 1_000_000_000 + time.tv_nsec) as f64;
    ns
}

/// The median of five times, for one of so many calls each.
fn median_of_five(calls: u32, mut run: impl FnMut() -> f64) -> f64 {
    let mut times: Vec<f64> = (0..5).map(|_| run() / f64::from(calls)).collect();
    times.sort_by(f64::total_cmp);
    times[2]
}

/// What one exponential costs that waits for the one before it, ns.
fn calibration() -> f64 {
    median_of_five(1_000_000, || {
        let (start, mut value) = (processor_ns(), 0.5_f64);
        for _ in 0..1_000_000 {
            value = (-value).exp();
        }
        black_box(value);
        processor_ns() - start
    })
}

/// An update and a prediction of the learner, ns, and its fields on average meanwhile.
fn times(model: &Model, fresh: &Samples) -> (f64, f64, usize) {
    let mut grown = model.clone();
    let update = median_of_five(10_000, || {
        grown = model.clone();
        let start = processor_ns();
        for (x, y) in fresh {
            grown.update(black_box(x), y, 1.0).expect("a sample is finite");
        }
        processor_ns() - start
    });
    let predict = median_of_five(10_000, || {
        let (start, mut y) = (processor_ns(), [0.0]);
        for (x, _) in fresh {
            model.predict(black_box(x), &mut y);
            black_box(y);
        }
        processor_ns() - start
    });
    (update, predict, usize::midpoint(model.fields(), grown.fields()))
}

/// How many nanoseconds single predictions take: the median, 99 of 100, and the longest.
fn single(model: &Model, fresh: &Samples) -> [u64; 3] {
    let mut y = [0.0];
    let mut times: Vec<u64> = Vec::with_capacity(SINGLE);
    for (x, _) in fresh.iter().cycle().take(SINGLE) {
        let start = Instant::now();
        model.predict(black_box(x), &mut y);
        black_box(y);
        times.push(u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX));
    }
    times.sort_unstable();
    [times[SINGLE / 2], times[SINGLE / 100 * 99], times[SINGLE - 1]]
}

fn table(_: &mut Criterion) {
    let scale = calibration() / EXP_THERE;
    println!("an exponential takes {:.2} ns: the rivals' times x {scale:.3}", scale * EXP_THERE);
    println!(
        "learner                       fields  update        predict       predict p50/p99/max"
    );
    for row in rows() {
        let (model, fresh) = row.prepare();
        let (update, predict, fields) = times(&model, &fresh);
        let faster = [row.rival.0 / update, row.rival.1 / predict].map(|ratio| ratio * scale);
        let [median, p99, longest] = single(&model, &fresh);
        println!(
            "{:29} {fields:6}  {update:6.0} {:4.1}x  {predict:6.0} {:4.1}x  {median}/{p99}/{longest}",
            row.name(),
            faster[0],
            faster[1],
        );
    }
}

fn learners(criterion: &mut Criterion) {
    for row in rows() {
        let (model, fresh) = row.prepare();
        let mut group = criterion.benchmark_group(row.name());
        let mut queries = fresh.iter().cycle();
        group.bench_function(BenchmarkId::from_parameter("predict"), |b| {
            let mut y = [0.0];
            b.iter(|| queries.next().map(|(x, _)| model.predict(black_box(x), &mut y)));
        });
        let (mut learner, mut samples) = (model.clone(), fresh.iter().cycle());
        group.bench_function(BenchmarkId::from_parameter("update"), |b| {
            b.iter(|| samples.next().map(|(x, y)| learner.update(black_box(x), y, 1.0)));
        });
        group.finish();
    }
}

criterion_group!(benches, table, learners);
criterion_main!(benches);
