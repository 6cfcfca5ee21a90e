use super::*;
use proptest::prelude::*;

const PERIOD: Seconds = Seconds(0.02);
const LIMIT: f64 = 10.0;

/// A guard, and a plant that it is told of.
struct Bench {
    warden: Warden,
    now: f64,
    state: [f64; 4],
    held: i64,
}

impl Bench {
    fn new(params: Params) -> Self {
        let warden = Warden::new(params, LIMIT, PERIOD);
        Self { warden, now: 0.0, state: [0.0; 4], held: 0 }
    }

    fn armed(params: Params) -> Self {
        let mut bench = Self::new(params);
        bench.frame();
        bench.warden.arm(Seconds(bench.now)).unwrap();
        bench
    }

    /// A period passes and a state comes.
    fn frame(&mut self) {
        self.now += PERIOD.0;
        self.warden.observe(Observation {
            state: State::new(self.state),
            at: Seconds(self.now),
            device: Some(Seconds(self.now)),
            held: Some(self.held),
            stopped: None,
        });
    }

    /// What of `action` is allowed now.
    fn want(&mut self, action: f64) -> f64 {
        let at = Seconds(self.now);
        let wanted = Wanted { action, at, is_enabled: true };
        let allowed = self.warden.allow(Some(wanted), at);
        #[expect(clippy::cast_possible_truncation, reason = "a small number")]
        let command = (allowed * 100.0) as i64;
        self.warden.sent(command);
        self.held = command;
        allowed
    }

    fn step(&mut self, action: f64) -> f64 {
        self.frame();
        self.want(action)
    }

    fn fault(&self) -> Option<Fault> {
        match self.warden.standing() {
            Standing::Latched(fault) => Some(fault),
            _ => None,
        }
    }
}

fn free() -> Params {
    Params { slew_per_s: None, ..Params::default() }
}

#[test]
fn nothing_moves_before_a_person_arms_and_nothing_arms_without_a_state() {
    let mut bench = Bench::new(free());
    assert!(bench.warden.arm(Seconds(0.0)).is_err());
    assert_eq!(bench.step(5.0), 0.0);
    bench.warden.arm(Seconds(bench.now)).unwrap();
    assert_eq!(bench.step(5.0), 5.0);
    bench.warden.disarm();
    assert_eq!(bench.step(5.0), 0.0);
}

#[test]
fn an_action_is_saturated_slewed_and_turned_inward_beyond_the_soft_limit() {
    let mut bench = Bench::armed(Params { slew_per_s: Some(10.0), ..Params::default() });
    // A tenth of the limit times 10 /s times 20 ms: 2 a period.
    for expected in [2.0, 4.0, 6.0, 8.0, 10.0, 10.0] {
        assert!((bench.step(99.0) - expected).abs() < 1e-12);
    }
    assert_eq!(bench.step(3.0), 3.0, "towards 0 it is free");
    assert_eq!(bench.step(-9.0), -2.0, "to the other side it begins at 0");
    let mut bench = Bench::armed(free());
    bench.state[0] = 0.171;
    bench.warden.forget();
    bench.frame();
    bench.warden.arm(Seconds(bench.now)).unwrap();
    assert_eq!((bench.want(4.0), bench.want(-4.0)), (0.0, -4.0));
}

#[test]
fn a_cart_that_rolls_on_beyond_the_soft_limit_or_towards_the_hard_one_is_braked() {
    // Position and velocity, what is wanted, and what is allowed.
    for (x, v, wanted, allowed) in [
        (0.171, 0.05, 4.0, -5.0),
        (0.171, 0.05, -8.0, -8.0),
        (0.171, 0.5, -8.0, -10.0),
        (-0.171, -0.05, 0.0, 5.0),
        (0.171, -0.05, -3.0, -3.0),
        (0.171, -0.05, 3.0, 0.0),
        (0.16, 0.2, 4.0, 0.0),
        (0.16, 0.3, 4.0, -10.0),
        (0.16, 0.05, 4.0, 4.0),
    ] {
        let mut bench = Bench::new(free());
        bench.state = [x, v, 0.0, 0.0];
        bench.frame();
        bench.warden.arm(Seconds(bench.now)).unwrap();
        let given = bench.want(wanted);
        assert!((given - allowed).abs() < 1e-9, "{x} {v} {wanted}: {given}, not {allowed}");
    }
}

#[test]
fn every_fault_latches_with_its_name_and_only_a_person_arms_again() {
    type Break = fn(&mut Bench);
    let breaks: [(&str, Break); 14] = [
        ("no finite number: a fault of this program", |b| {
            b.step(f64::NAN);
        }),
        ("no finite number: look", |b| b.state[2] = f64::NAN),
        ("beyond the hard limit", |b| {
            for _ in 0..10 {
                b.state[0] += 0.02;
                b.state[2] += 0.01;
                b.step(0.0);
            }
        }),
        ("position jumped", |b| b.state[0] = -0.1),
        ("angle jumped", |b| b.state[2] = 2.5),
        ("no state came", |b| b.now += 0.2),
        ("damaged frames", |b| (0..6).for_each(|_| b.warden.damaged(Seconds(b.now)))),
        ("was reset", |b| {
            let seen = b.warden.latest().copied().unwrap();
            b.warden.observe(Observation { device: Some(Seconds(0.0)), ..seen });
        }),
        ("was reset", |b| {
            let seen = b.warden.latest().copied().unwrap();
            b.warden.observe(seen);
        }),
        ("though it is pushed", |b| {
            for _ in 0..30 {
                b.step(4.0);
            }
        }),
        ("though the cart moves", |b| {
            for k in 0..40 {
                b.state[0] = 0.01 * f64::from(k % 2);
                b.step(1.0);
            }
        }),
        ("stood still", |b| b.warden.pass(Seconds(b.now + 5.0))),
        ("holds the command", |b| {
            for _ in 0..3 {
                b.held = 1234;
                b.frame();
            }
        }),
        ("by itself", |b| {
            let seen = b.warden.latest().copied().unwrap();
            b.warden.observe(Observation { stopped: Some("its watchdog"), ..seen });
        }),
    ];
    for (words, break_it) in breaks {
        let mut bench = Bench::armed(free());
        bench.step(1.0);
        break_it(&mut bench);
        bench.frame();
        let fault = bench.fault().unwrap_or_else(|| panic!("{words}: nothing latched"));
        assert!(fault.to_string().contains(words), "{words}: {fault}");
        assert_eq!(bench.want(5.0), 0.0);
        assert!(bench.warden.arm(Seconds(bench.now)).is_err(), "{words}");
        // Another fault does not hide the first.
        bench.warden.latch(Fault::Stopped);
        assert_eq!(bench.fault(), Some(fault));
        bench.warden.clear();
        assert_eq!(bench.step(5.0), 0.0, "{words}: clearing arms nothing");
    }
}

#[test]
fn a_caller_that_stands_still_or_lets_the_switch_go_wants_nothing() {
    let mut bench = Bench::armed(free());
    let wanted = Wanted { action: 5.0, at: Seconds(bench.now), is_enabled: true };
    for k in 0..6 {
        bench.frame();
        let allowed = bench.warden.allow(Some(wanted), Seconds(bench.now));
        assert_eq!(allowed, if k < 3 { 5.0 } else { 0.0 }, "{k}");
    }
    let at = Seconds(bench.now);
    let let_go = Wanted { action: 5.0, at, is_enabled: false };
    assert_eq!(bench.warden.allow(Some(let_go), at), 0.0);
    assert_eq!(bench.warden.standing(), Standing::Armed, "that is no fault");
    assert_eq!(bench.warden.allow(None, at), 0.0);
}

#[test]
fn an_echo_that_comes_a_period_late_is_none_of_another_command() {
    let mut bench = Bench::armed(free());
    let mut before = 0;
    for k in 0..100_i32 {
        bench.frame();
        let now = bench.held;
        bench.want(f64::from(k % 7) - 3.0);
        // The device repeats what it held before the latest one.
        (bench.held, before) = (before, bench.held);
        let _ = now;
    }
    assert_eq!(bench.fault(), None);
}

proptest! {
    /// Whatever is sensed and wanted, no action is beyond the limits, none points outward
    /// beyond the soft limit, and after a fault all are 0.
    #[test]
    fn nothing_beyond_the_limits_is_ever_allowed(
        steps in prop::collection::vec((any::<f64>(), -0.25..0.25_f64, -4.0..4.0_f64, 0..9_u8), 1..200),
        slew in prop::option::of(0.1..100.0_f64),
    ) {
        let mut bench = Bench::armed(Params { slew_per_s: slew, ..Params::default() });
        let mut last = 0.0_f64;
        for (action, position, angle, what) in steps {
            match what {
                0 => bench.state = [position, 0.0, angle, 0.0],
                1 => bench.now += position.abs(),
                2 => bench.warden.damaged(Seconds(bench.now)),
                3 => bench.warden.clear(),
                _ => bench.state[0] += position * 0.1,
            }
            let was_latched = bench.fault().is_some();
            let allowed = bench.step(action);
            prop_assert!(allowed.is_finite() && allowed.abs() <= LIMIT);
            if bench.state[0].abs() > 0.17 {
                prop_assert!(allowed * bench.state[0] <= 0.0);
            }
            if let Some(slew) = slew {
                let step = slew * LIMIT * PERIOD.0 + 1e-9;
                prop_assert!(allowed.abs() <= last.abs() + step);
            }
            if was_latched || bench.warden.standing() != Standing::Armed {
                prop_assert_eq!(allowed, 0.0);
            }
            last = allowed;
        }
    }
}
