//! The screens as they look, at 80×24 and 120×40, and that no terminal size or state of the
//! plant breaks them.

#![expect(clippy::unwrap_used, reason = "a screen that cannot be drawn has failed its test")]

use coadapt::control::snapshot::Snapshot;
use coadapt::operator::Device;
use coadapt::profile::Document;
use coadapt::record::EpisodeRow;
use coadapt::report::achieved::yardstick;
use coadapt::report::metrics::RegionEnd;
use coadapt::session::machine::{Finish, Stage};
use coadapt::session::plan::{Instructions, Params, PhasePlan, Plan};
use coadapt::session::{Moment, Phase};
use coadapt::sharing::weight::Opened;
use coadapt::signal::{End, Intent, Seconds, State, Tallied, Tick};
use coadapt::task::swing_up;
use coadapt::tui::live::film::{Film, Lane};
use coadapt::tui::live::{self, History, Info, Seat, Ui, View};
use coadapt::tui::palette::{Glyphs, Look, Palette, Role};
use coadapt::tui::plant::Badge;
use coadapt::tui::results;
use coadapt::tui::scene::Scene;
use coadapt::tui::scene::cart_pole::Geometry;
use coadapt::tui::scene::{ball_beam, mountain_car, regions};
use proptest::prelude::*;
use ratatui::backend::{CrosstermBackend, TestBackend};
use ratatui::layout::Rect;
use ratatui::{Terminal, TerminalOptions, Viewport};
use std::path::Path;

fn info() -> Info {
    let params = Params::default();
    let Instructions { introduction, simultaneous, autonomous, .. } = params.instructions.clone();
    Info {
        task: "balance".to_owned(),
        preset: "thesis".to_owned(),
        mode: "simultaneous".to_owned(),
        robot_watches: false,
        learner: "rfwr".to_owned(),
        subject: "S07".to_owned(),
        trial: 2,
        phases: Plan::new(&params, Seconds(0.02), 1, true).phases,
        instructions: vec![
            (Phase::Introduction, introduction),
            (Phase::Main, simultaneous),
            (Phase::Autonomous, autonomous),
        ],
        tick_s: 0.02,
        hold_s: params.hold_s,
        autonomous_hold_s: params.autonomous_hold_s,
        break_s: params.break_s,
        gate: 0.4,
        gate_is_timer: true,
        by_episode: false,
        longest_taught: 1000,
        longest_tested: 1000,
        action_limit: 10.0,
        action_unit: "N".to_owned(),
        scene: Scene::CartPole(Geometry {
            pole_length_m: 1.0,
            track_length_m: Some(1.0),
            fail_angle_rad: Some(30_f64.to_radians()),
        }),
        regions: None,
        field_cap: 100,
        operator: "keyboard, releases reported".to_owned(),
        buttons: String::new(),
        device_state: String::new(),
        device: Some(Device::Keyboard),
        sensitivity: 1.0,
    }
}

/// Table 1 of the thesis.
const BORDERS: regions::Borders = regions::Borders {
    down_rad: 120_f64.to_radians(),
    top_slow_rad: 30_f64.to_radians(),
    top_fast_rad: 40_f64.to_radians(),
    down_fast: 8.0,
    middle_fast: 3.0,
    top_fast: 1.0,
    fastest: 20.0,
};

/// Swing-up: the whole circle, and the map.
fn swing_up() -> (Info, Snapshot) {
    let mut info = Info { task: "swing-up".to_owned(), regions: Some(BORDERS), ..info() };
    info.scene = Scene::CartPole(Geometry {
        pole_length_m: 1.0,
        track_length_m: Some(1.0),
        fail_angle_rad: None,
    });
    let mut snapshot = running(Phase::Main);
    snapshot.state = State::new([0.2, 0.4, 1.2, -2.2]);
    snapshot.region = 2;
    snapshot.shares = [0.03, 0.05, 0.22, 0.48, 0.74, 0.61, 1.0, 1.0];
    snapshot.successes = [0.97, 0.95, 0.74, 0.52, 0.31, 0.4, 0.0, 0.0];
    snapshot.frozen[0] = true;
    snapshot.tallied = Tallied::new([-0.12, 0.31, 4.2]);
    info.gate = 0.0;
    info.phases = phases_of("swing-up");
    (info, snapshot)
}

#[test]
fn the_map_beside_the_whole_circle() {
    let (info, snapshot) = swing_up();
    both("swing_up", &info, &snapshot, &Ui::default());
    let hidden = Ui { show_progress: false, ..Ui::default() };
    small("swing_up_progress_hidden", &info, &snapshot, &hidden);
    let subject = Ui { subject_view: true, ..Ui::default() };
    small("swing_up_subject", &info, &snapshot, &subject);
}

#[test]
fn a_region_that_is_handed_over_says_so() {
    let (info, mut snapshot) = swing_up();
    snapshot.state = State::new([0.2, 0.4, 3.0, -2.2]);
    snapshot.region = 0;
    let screen = picture(80, 24, &info, &snapshot, &Ui::default()).to_string();
    assert!(screen.contains("handed over") && screen.contains("DOWN SLOW"), "{screen}");
}

/// The phases of a task's plain profile.
fn phases_of(task: &str) -> Vec<PhasePlan> {
    let document = Document::find(task, Path::new("tests/data/no-such-folder")).unwrap();
    let profile = document.read().unwrap();
    Plan::new(&profile.session, profile.tick(), 1, true).phases
}

#[test]
fn swing_up_in_every_phase() {
    let (info, mut snapshot) = swing_up();
    for phase in [Phase::Introduction, Phase::Autonomous, Phase::ZeroControl] {
        snapshot.stage = Stage::Running(moment(phase));
        if phase != Phase::Introduction {
            snapshot.human = Intent::Absent;
        }
        small(&format!("swing_up_{}", phase.word()), &info, &snapshot, &Ui::default());
    }
}

#[test]
fn the_ball_on_its_beam() {
    let (mut info, mut snapshot) = (info(), running(Phase::Main));
    info.task = "speed-up".to_owned();
    info.phases = phases_of("speed-up");
    info.gate = 0.0;
    info.action_unit = "V".to_owned();
    info.scene = Scene::BallBeam(ball_beam::Geometry {
        beam_half_length_m: 0.2125,
        limit_m: 0.17,
        servo_limit_rad: 1.46,
        beam_limit_rad: 5_f64.to_radians(),
    });
    snapshot.state = State::new([0.05, 0.18, 0.6, 0.0]);
    snapshot.tallied = Tallied::new([0.124, 0.0]);
    both("speed_up", &info, &snapshot, &Ui::default());
    snapshot.state = State::new([0.19, 0.11, 0.9, 0.0]);
    snapshot.tallied = Tallied::new([0.124, 3.0]);
    small("speed_up_hit", &info, &snapshot, &Ui::default());
}

#[test]
fn the_car_in_its_valley() {
    let (mut info, mut snapshot) = (info(), running(Phase::Main));
    info.task = "mountain-car".to_owned();
    info.by_episode = true;
    (info.longest_taught, info.longest_tested) = (500, 500);
    info.gate = 0.5;
    info.action_limit = 1.0;
    info.action_unit = String::new();
    info.tick_s = 0.04;
    info.scene =
        Scene::MountainCar(mountain_car::Geometry { left: -1.2, goal: 0.5, speed_limit: 0.07 });
    snapshot.state = State::new([-0.2, 0.03]);
    snapshot.gate = Some(Opened { step: 3, tau: 20.0 });
    snapshot.human = Intent::fresh(1.0);
    snapshot.machine = Some(0.62);
    snapshot.applied = 0.86;
    both("mountain_car", &info, &snapshot, &Ui::default());
}

fn moment(phase: Phase) -> Moment {
    let rollout = if phase == Phase::Introduction { 8 } else { 38 };
    Moment { step: 241, steps_before: 6_920, rollout, ..Moment::start_of(phase) }
}

/// A swing in the middle of main.
fn running(phase: Phase) -> Snapshot {
    let mut snapshot = Snapshot::before(Stage::Running(moment(phase)));
    snapshot.tick = Tick(9_000);
    snapshot.state = State::new([0.08, -0.2, 9_f64.to_radians(), 24_f64.to_radians()]);
    snapshot.human = Intent::fresh(-3.5);
    snapshot.machine = Some(-6.2);
    snapshot.action = -4.5;
    snapshot.applied = -4.5;
    snapshot.shares[0] = 0.63;
    snapshot.successes[0] = 0.71;
    snapshot.gate = Some(Opened { step: 2_413, tau: 2_633.4 });
    snapshot.fields = 64;
    snapshot.learned = 7_214;
    snapshot.lateness = Seconds(0.0001);
    snapshot
}

fn hold() -> Snapshot {
    let at = Moment { step: 0, ..moment(Phase::Main) };
    let mut snapshot = running(Phase::Main);
    snapshot.stage = Stage::Hold { moment: at, ticks_left: 90 };
    snapshot.state = State::new([0.0, 0.0, 3_f64.to_radians(), 0.0]);
    snapshot.human = Intent::fresh(0.0);
    snapshot.machine = None;
    snapshot
}

fn row(phase: Phase, episode: u32) -> EpisodeRow {
    let n = f64::from(episode);
    let wobble = 1.0 + 0.4 * (n * 2.4).sin();
    let (duration, share, success) = match phase {
        Phase::Introduction => (1.5 * wobble, None, None),
        Phase::Main => {
            let share = if episode < 20 { 1.0 } else { (-(n - 20.0) / 40.0).exp() };
            ((1.0 + n / 9.0) * wobble, Some(share), Some((n / 60.0).min(0.86)))
        }
        Phase::Autonomous => (12.0 * wobble, Some(0.0), None),
        Phase::ZeroControl => (0.9 * wobble, None, None),
    };
    EpisodeRow {
        phase,
        episode,
        start: (10.0 * (n - 1.0) / 99.0 - 5.0).to_radians(),
        steps: 100,
        duration_s: duration.min(20.0),
        end: End::Failed,
        total: 70.0,
        mean_reward: 0.7,
        share,
        success,
        receptive_fields: Some(50),
        tallied: Tallied::default(),
    }
}

/// Makes of `row` one that `task` could have had: balance's rows are so already.
fn played(row: &mut EpisodeRow, task: &str) {
    let part = row.duration_s / 20.0;
    match task {
        "swing-up" => row.tallied = Tallied::new([0.8 * part, 0.31, 4.2]),
        "speed-up" => row.tallied = Tallied::new([0.06 + 0.2 * part, 2.0, 0.0]),
        "mountain-car" => {
            row.steps = if row.episode % 4 == 3 { 500 } else { 180 - row.episode.min(60) };
            row.end = if row.steps < 500 { End::Goal } else { End::Cap };
        }
        _ => {}
    }
}

fn history(rollouts_of_main: u32) -> History {
    let introduction = (1..=20).map(|k| row(Phase::Introduction, k));
    let main = (1..=rollouts_of_main).map(|k| row(Phase::Main, k));
    History {
        rollouts: introduction.chain(main).collect(),
        success: (0..60_u8).map(|k| f64::from(k) / 60.0 * 0.71).collect(),
    }
}

/// The screen as text.
fn picture(width: u16, height: u16, info: &Info, snapshot: &Snapshot, ui: &Ui) -> TestBackend {
    let mut history = history(37);
    for row in &mut history.rollouts {
        played(row, &info.task);
    }
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    let view = View { info, scene: snapshot, panel: snapshot, history: &history, ui };
    terminal.draw(|frame| live::draw(frame, &view)).unwrap();
    terminal.backend().clone()
}

fn both(name: &str, info: &Info, snapshot: &Snapshot, ui: &Ui) {
    insta::assert_snapshot!(format!("{name}_80x24"), picture(80, 24, info, snapshot, ui));
    insta::assert_snapshot!(format!("{name}_120x40"), picture(120, 40, info, snapshot, ui));
}

fn small(name: &str, info: &Info, snapshot: &Snapshot, ui: &Ui) {
    insta::assert_snapshot!(name, picture(80, 24, info, snapshot, ui));
}

#[test]
fn a_swing_in_main() {
    both("main", &info(), &running(Phase::Main), &Ui::default());
}

#[test]
fn before_the_gate() {
    let mut snapshot = running(Phase::Main);
    snapshot.gate = None;
    snapshot.shares[0] = 1.0;
    snapshot.successes[0] = 0.23;
    small("before_the_gate", &info(), &snapshot, &Ui::default());
}

#[test]
fn the_countdown() {
    both("countdown", &info(), &hold(), &Ui::default());
}

#[test]
fn a_real_plants_motor_and_what_its_countdown_waits_for() {
    let motor = |words: &str, role| Some(Badge { words: words.to_owned(), role, is_armed: true });
    let mut ui = Ui { motor: motor("motor ARMED, hand on", Role::Go), ..Ui::default() };
    small("motor_armed", &info(), &running(Phase::Main), &ui);
    ui.motor = motor("motor ARMED: hold L1", Role::Strong);
    ui.waits = Some("the pole does not come to rest: steady it by hand".to_owned());
    small("motor_waits", &info(), &hold(), &ui);
    ui.subject_view = true;
    small("motor_waits_subject", &info(), &hold(), &ui);
    ui.help_open = true;
    let help = picture(80, 24, &info(), &hold(), &ui).to_string();
    assert!(help.contains("o opens the page of the plant"), "{help}");
}

#[test]
fn the_robot_watches() {
    let info = Info { mode: "sequential".to_owned(), robot_watches: true, ..info() };
    let mut snapshot = running(Phase::Main);
    snapshot.shares[0] = 1.0;
    small("sequential", &info, &snapshot, &Ui::default());
}

#[test]
fn practice_has_nobody_but_you() {
    let mut snapshot = running(Phase::Introduction);
    snapshot.machine = None;
    small("introduction", &info(), &snapshot, &Ui::default());
}

#[test]
fn the_robot_alone_and_nobody() {
    let mut snapshot = running(Phase::Autonomous);
    snapshot.human = Intent::Absent;
    snapshot.speed = 16.0;
    small("autonomous", &info(), &snapshot, &Ui::default());
    snapshot.stage = Stage::Running(moment(Phase::ZeroControl));
    snapshot.machine = None;
    small("zero_control", &info(), &snapshot, &Ui::default());
}

#[test]
fn paused_stopped_finished() {
    let mut snapshot = running(Phase::Main);
    snapshot.stage = Stage::Paused(moment(Phase::Main));
    small("paused", &info(), &snapshot, &Ui::default());
    snapshot.stage = Stage::Stopped(moment(Phase::Main));
    small("stopped", &info(), &snapshot, &Ui::default());
    snapshot.stage = Stage::Finished(Finish::Complete);
    small("finished", &info(), &snapshot, &Ui::default());
}

#[test]
fn a_real_plant_that_was_stopped_says_what_goes_on() {
    let mut snapshot = running(Phase::Main);
    snapshot.stage = Stage::Stopped(moment(Phase::Main));
    let words = "motor STOPPED: o tells why".to_owned();
    let mut badge = Badge { words, role: Role::Alarm, is_armed: false };
    let ui = Ui { motor: Some(badge.clone()), ..Ui::default() };
    small("stopped_motor", &info(), &snapshot, &ui);
    badge.is_armed = true;
    let ui = Ui { motor: Some(badge), ..Ui::default() };
    let armed = picture(80, 24, &info(), &snapshot, &ui).to_string();
    assert!(armed.contains("The motor is armed again."), "{armed}");
    assert!(!armed.contains("arms the motor"), "{armed}");
}

#[test]
fn a_gamepad_that_is_gone_and_one_that_is_relayed() {
    let mut info = info();
    info.device = Some(Device::Gamepad);
    info.operator = "gamepad Xbox Wireless Controller, left_stick_x, SDL mapping".to_owned();
    let mut snapshot = running(Phase::Main);
    info.device_state = "relay 12 ms old, 3 lost, 0 bad".to_owned();
    small("relayed_gamepad", &info, &snapshot, &Ui::default());
    info.device_state = String::new();
    let trouble =
        "Xbox Wireless Controller is unplugged: plug it in, or press start on Gamepad F310";
    let ui = Ui { trouble: Some(trouble.to_owned()), ..Ui::default() };
    snapshot.human = Intent::Absent;
    small("absent_gamepad", &info, &snapshot, &ui);
    snapshot.stage = Stage::Paused(moment(Phase::Main));
    both("gone_gamepad", &info, &snapshot, &ui);
    snapshot.stage = Stage::Instruction(Moment::start_of(Phase::Main));
    small("briefing_without_gamepad", &info, &snapshot, &ui);
    // While the robot is alone its button is still the person's emergency stop.
    let shown = picture(80, 24, &info, &running(Phase::Autonomous), &ui).to_string();
    assert!(shown.contains("unplugged"), "{shown}");
}

#[test]
fn what_the_subject_sees() {
    let ui = Ui { subject_view: true, ..Ui::default() };
    both("subject", &info(), &running(Phase::Main), &ui);
    small("subject_countdown", &info(), &hold(), &ui);
}

#[test]
fn hidden_progress_tells_neither_share_nor_success() {
    let ui = Ui { show_progress: false, ..Ui::default() };
    small("progress_hidden", &info(), &running(Phase::Main), &ui);
}

#[test]
fn plainer_glyphs() {
    for (name, glyphs) in [("half", Glyphs::Half), ("ascii", Glyphs::Ascii)] {
        let ui = Ui { look: Look { glyphs, ..Look::default() }, ..Ui::default() };
        small(name, &info(), &running(Phase::Main), &ui);
        let text = picture(80, 24, &info(), &hold(), &ui).to_string();
        assert!(glyphs != Glyphs::Ascii || text.is_ascii());
    }
}

#[test]
fn without_colours_there_are_only_bold_and_reverse() {
    let plain = Look { palette: Palette::Plain, ..Look::default() };
    let ui = Ui { look: plain, ..Ui::default() };
    let backend = picture(80, 24, &info(), &hold(), &ui);
    let mut styles: Vec<String> = backend
        .buffer()
        .content
        .iter()
        .map(|cell| format!("{:?} {:?} {:?}", cell.fg, cell.bg, cell.modifier))
        .collect();
    styles.sort();
    styles.dedup();
    insta::assert_snapshot!("no_colour_styles", styles.join("\n"));
}

#[test]
fn an_endless_track_scrolls() {
    let mut info = info();
    info.scene = Scene::CartPole(Geometry {
        pole_length_m: 1.0,
        track_length_m: None,
        fail_angle_rad: Some(30_f64.to_radians()),
    });
    let mut snapshot = running(Phase::Main);
    snapshot.state = State::new([3.1, 0.0, -0.4, 0.0]);
    small("endless", &info, &snapshot, &Ui::default());
}

#[test]
fn between_the_phases() {
    let mut snapshot = Snapshot::before(Stage::Instruction(Moment::start_of(Phase::Main)));
    both("briefing", &info(), &snapshot, &Ui::default());
    let next = Moment::start_of(Phase::Autonomous);
    snapshot.stage = Stage::Break { next, ticks_left: 2_150 };
    small("break", &info(), &snapshot, &Ui::default());
}

#[test]
fn a_turned_sensitivity_is_shown_in_place_of_the_keys() {
    for (glyphs, end) in [(Glyphs::Braille, "┤ +   1.41"), (Glyphs::Ascii, "| +   1.41")] {
        let look = Look { glyphs, ..Look::default() };
        let ui = Ui { tuned: Some(1.41), look, ..Ui::default() };
        let shown = picture(80, 24, &info(), &running(Phase::Main), &ui).to_string();
        let last = shown.trim_end().lines().last().unwrap();
        assert!(last.contains("sensitivity") && last.contains(end), "{last}");
    }
}

#[test]
fn the_keys_and_a_message() {
    let ui = Ui { help_open: true, ..Ui::default() };
    small("help", &info(), &running(Phase::Main), &ui);
    let message = "q again to end the session, any other key goes on".to_owned();
    let ui = Ui { message: Some(message), ..Ui::default() };
    small("message", &info(), &running(Phase::Main), &ui);
}

#[test]
fn a_small_terminal_says_so() {
    let snapshot = running(Phase::Main);
    for (width, height) in [(79, 24), (40, 10), (10, 3), (1, 1)] {
        let name = format!("small_{width}x{height}");
        let screen = picture(width, height, &info(), &snapshot, &Ui::default());
        insta::assert_snapshot!(name, screen);
    }
}

fn results() -> results::Info {
    let alone = [Phase::Autonomous, Phase::ZeroControl]
        .into_iter()
        .flat_map(|phase| (1..=100).map(move |k| row(phase, k)));
    results::Info {
        title: "balance · simultaneous · rfwr · S07 trial 002".to_owned(),
        finish: "complete".to_owned(),
        rollouts: history(100).rollouts.into_iter().chain(alone).collect(),
        folder: "logs/S07/002-balance-simultaneous".to_owned(),
        files: ["session.json", "steps.csv", "episodes.csv", "events.csv", "evaluation.csv"]
            .into_iter()
            .map(str::to_owned)
            .chain((1..=10).map(|k| format!("policy-{:03}.json", k * 10)))
            .collect(),
        alarm: None,
        summary: vec!["gate opened at step 2413, τ 2633 steps, final share 14 %".to_owned()],
        evaluation: Some((1..=10).map(|k| (k * 10, 1.4 * f64::from(k))).collect()),
        measure: yardstick("balance"),
        start: Some(results::Start::RELEASE),
        regions: Vec::new(),
    }
}

fn results_picture(width: u16, height: u16, info: &results::Info, s: &results::State) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| results::draw(frame, info, s)).unwrap();
    terminal.backend().to_string()
}

#[test]
fn results_after_a_stop_that_nobody_confirmed_say_so_on_every_page() {
    let alarm = Some("THE STOP WAS NOT CONFIRMED: switch the motor's supply off.");
    let info = results::Info { alarm, ..results() };
    for (width, height) in [(80, 24), (120, 40)] {
        let mut state = results::State::default();
        for _ in 0..4 {
            let screen = results_picture(width, height, &info, &state);
            assert!(screen.contains("CONFIRMED: switch the motor's supply off."), "{screen}");
            state.next();
        }
    }
}

#[test]
fn pages_of_results() {
    let mut state = results::State::default();
    let info = results();
    for page in 0..4 {
        let screen = results_picture(80, 24, &info, &state);
        insta::assert_snapshot!(format!("results_{page}"), screen);
        state.next();
    }
    insta::assert_snapshot!("results_120x40", results_picture(120, 40, &info, &state));
    let empty = results_picture(80, 24, &results::Info::default(), &state);
    insta::assert_snapshot!("results_empty", empty);
    state.look.glyphs = Glyphs::Ascii;
    assert!(results_picture(120, 40, &info, &state).is_ascii());
}

/// Results of the other tasks, whole.
#[test]
fn results_of_every_task() {
    for (task, tallied) in
        [("swing-up", [0.4, 0.31, 4.2]), ("speed-up", [0.12, 2.0, 0.0]), ("mountain-car", [0.0; 3])]
    {
        let mut info = results();
        info.title = format!("{task} · simultaneous · rfwr · S07 trial 002");
        for row in &mut info.rollouts {
            let part = row.duration_s / 20.0;
            row.tallied = Tallied::new(tallied.map(|number| number * (0.5 + part)));
            row.steps = 180 - 4 * row.episode.min(15);
        }
        info.measure = yardstick(task);
        info.start = None;
        let best = if task == "mountain-car" { 110.0 } else { tallied[0] };
        info.evaluation =
            Some((1..=10).map(|k| (k * 10, best * (0.5 + f64::from(k) / 20.0))).collect());
        if task == "swing-up" {
            info.regions = swing_up::REGIONS
                .iter()
                .zip([0.05, 0.05, 0.12, 0.44, 0.31, 0.6])
                .map(|(name, share)| RegionEnd {
                    name: (*name).to_owned(),
                    share,
                    success: 1.0 - share,
                })
                .collect();
        }
        let mut state = results::State::default();
        for page in 0..3 {
            let name = format!("results_{}_{page}", task.replace('-', "_"));
            insta::assert_snapshot!(name, results_picture(80, 24, &info, &state));
            state.next();
        }
        let name = format!("results_{}_120x40", task.replace('-', "_"));
        insta::assert_snapshot!(name, results_picture(120, 40, &info, &state));
    }
}

/// The shortest session there is: nothing is said twice or in the wrong number.
#[test]
fn results_of_single_rollouts() {
    let mut info = results();
    info.rollouts.retain(|row| row.episode == 1);
    info.start = None;
    let mut state = results::State::default();
    let first = results_picture(80, 24, &info, &state);
    assert!(first.contains("1 rollout ") && !first.contains("1 rollouts"), "{first}");
    assert!(first.lines().all(|line| line.split_whitespace().filter(|w| *w == "2").count() < 2));
    state.next();
    state.next();
    insta::assert_snapshot!("results_single", results_picture(80, 24, &info, &state));
}

#[test]
fn results_of_another_measure() {
    let mut info = results();
    for row in &mut info.rollouts {
        row.tallied = Tallied::new([(row.duration_s / 6.0 - 1.0).min(0.97), 0.3, 2.0]);
    }
    info.measure = yardstick("swing-up");
    info.start = None;
    info.evaluation = None;
    let mut state = results::State::default();
    insta::assert_snapshot!("results_height_0", results_picture(80, 24, &info, &state));
    state.next();
    state.next();
    insta::assert_snapshot!("results_height_2", results_picture(80, 24, &info, &state));
}

/// What a terminal receives in `frames` frames of a balancing swing: 30 frames a second,
/// numbers ten times a second.
fn bytes(
    (width, height): (u16, u16),
    frames: u32,
    info: &Info,
    scene: impl Fn(u32) -> Snapshot,
) -> usize {
    let (history, ui) = (history(37), Ui::default());
    let mut sent: Vec<u8> = Vec::new();
    let viewport = Viewport::Fixed(Rect::new(0, 0, width, height));
    let backend = CrosstermBackend::new(&mut sent);
    let mut terminal = Terminal::with_options(backend, TerminalOptions { viewport }).unwrap();
    let mut panel = running(Phase::Main);
    for k in 0..=frames {
        let scene = scene(k);
        if k % 3 == 0 {
            panel = scene;
        }
        let view = View { info, scene: &scene, panel: &panel, history: &history, ui: &ui };
        terminal.draw(|frame| live::draw(frame, &view)).unwrap();
    }
    drop(terminal);
    sent.len()
}

/// Frame `k` of a swing with a fast and a slow part, a hand that pushes to and fro.
fn swinging(k: u32) -> Snapshot {
    let t = f64::from(k) / 30.0;
    let mut scene = running(Phase::Main);
    let angle = 6.0 * (2.6 * t).sin() + 2.0 * (6.1 * t).sin();
    let x = 0.12 * (0.9 * t).sin() + 0.05 * (2.6 * t).sin();
    let turn = 15.6 * (2.6 * t).cos() + 12.2 * (6.1 * t).cos();
    scene.state = State::new([x, 0.0, angle.to_radians(), turn.to_radians()]);
    scene.human = Intent::fresh(if (9.0 * t).sin() > 0.0 { 10.0 } else { -10.0 });
    let machine = 4.0 * (2.6 * t).sin();
    scene.machine = Some(machine);
    scene.applied = 0.63 * scene.human.action().0 + 0.37 * machine;
    scene.learned += u64::from(k) * 50 / 30;
    scene.stage = Stage::Running(Moment { step: k * 50 / 30, ..moment(Phase::Main) });
    scene.lateness = Seconds(0.0001 * f64::from(k % 4));
    scene
}

#[test]
#[expect(clippy::print_stderr, reason = "a figure worth seeing beside the limit")]
fn a_swing_costs_few_bytes() {
    // Synchronised updates add 16 bytes to each frame.
    let mean = |size| {
        let sent = |frames| bytes(size, frames, &info(), swinging);
        (sent(300) - sent(0)) / 300 + 16
    };
    let (usual, large) = (mean((80, 24)), mean((120, 40)));
    eprintln!("bytes a frame: {usual} at 80×24, {large} at 120×40");
    assert!(usual <= 260, "{usual} bytes a frame: over 8 kB/s at 30 frames a second");
}

/// Frame `k` of a pole that swings higher and higher and goes round, with its map.
fn swinging_up(k: u32) -> Snapshot {
    let t = f64::from(k) / 30.0;
    let (sin, cos) = (5.0 * t).sin_cos();
    let angle = std::f64::consts::PI + 0.35 * t * sin;
    let turn = 0.35 * sin + 0.35 * t * 5.0 * cos;
    let mut scene = Snapshot { shares: swing_up().1.shares, ..swinging(k) };
    let fast = usize::from(turn.abs() > 3.0);
    scene.region = fast + if angle.cos() < -0.5 { 0 } else { 2 };
    scene.state = State::new([0.1 * sin, 0.5 * cos, angle, turn]);
    scene
}

#[test]
#[expect(clippy::print_stderr, reason = "a figure worth seeing beside the limit")]
fn a_swing_up_costs_not_many_more() {
    let (info, _) = swing_up();
    let sent = |frames| bytes((80, 24), frames, &info, swinging_up);
    let usual = (sent(300) - sent(0)) / 300 + 16;
    eprintln!("bytes a frame: {usual} at 80×24");
    assert!(usual <= 520, "{usual} bytes a frame: over 16 kB/s at 30 frames a second");
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![any::<f64>(), -2.0..2.0, Just(f64::NAN), Just(f64::INFINITY), Just(0.0)]
}

fn any_stage() -> impl Strategy<Value = Stage> {
    let moment = (0..4_usize, any::<u32>(), any::<u32>(), any::<u64>()).prop_map(
        |(phase, rollout, step, steps_before)| Moment {
            phase: Phase::ALL[phase],
            rollout,
            attempt: 0,
            step,
            steps_before,
        },
    );
    (0..8_u8, moment, any::<u32>()).prop_map(|(kind, moment, ticks_left)| match kind {
        0 => Stage::Instruction(moment),
        1 => Stage::Break { next: moment, ticks_left },
        2 => Stage::Hold { moment, ticks_left },
        3 => Stage::Paused(moment),
        4 => Stage::Stopped(moment),
        5 => Stage::Finished(Finish::Aborted),
        _ => Stage::Running(moment),
    })
}

/// Found by chance below: a chart's scale overflowed.
#[test]
fn results_of_absurd_size_are_drawn() {
    for size in [2.903_570_561_308_767e307, -1e308, f64::MAX, f64::NAN, f64::INFINITY] {
        let mut info = results();
        for row in &mut info.rollouts {
            (row.duration_s, row.start) = (size, -size);
        }
        let mut state = results::State::default();
        for _page in 0..4 {
            results_picture(80, 24, &info, &state);
            results_picture(120, 40, &info, &state);
            state.next();
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn no_size_and_no_state_breaks_a_screen(
        (width, height) in (1..200_u16, 1..60_u16),
        stage in any_stage(),
        numbers in prop::array::uniform12(any_number()),
        (glyphs, flags, region) in (0..3_u8, any::<u8>(), any::<usize>()),
    ) {
        let [x, v, angle, turn, human, machine, applied, share, success, late, speed, tau] = numbers;
        let mut snapshot = Snapshot::before(stage);
        snapshot.state = State::new([x, v, angle, turn]);
        snapshot.human = Intent::fresh(human);
        snapshot.machine = Some(machine);
        snapshot.applied = applied;
        snapshot.shares = [share; 8];
        snapshot.successes = [success; 8];
        snapshot.lateness = Seconds(late);
        snapshot.speed = speed;
        snapshot.gate = Some(Opened { step: u64::MAX, tau });
        snapshot.region = region;
        snapshot.learned = u64::MAX;
        let glyphs = [Glyphs::Braille, Glyphs::Half, Glyphs::Ascii][usize::from(glyphs)];
        let lane = |label, role| Lane { label, role, values: vec![Some(x), None, Some(applied)] };
        let film = Film {
            speed,
            position_s: x,
            length_s: v,
            borders: vec![share, success],
            lanes: vec![lane("you", Role::You), lane("robot", Role::Robot)],
            window: region % 9,
            end: Some("字".repeat(60)),
            ..Film::default()
        };
        let ui = Ui {
            seat: [Seat::Controls, Seat::Beside, Seat::Replay(film)][usize::from(flags) % 3].clone(),
            show_progress: flags & 1 == 0,
            subject_view: flags & 2 == 0,
            help_open: flags & 4 == 0,
            trouble: None,
            message: (flags & 8 == 0).then(|| "字".repeat(60)),
            tuned: (flags & 32 == 0).then_some(speed),
            motor: None,
            waits: (flags & 64 == 0).then(|| "字".repeat(60)),
            look: Look { glyphs, ..Look::default() },
        };
        let mut info = info();
        if flags & 16 == 0 {
            info.scene = Scene::CartPole(Geometry {
                pole_length_m: x,
                track_length_m: None,
                fail_angle_rad: (flags & 32 == 0).then_some(v),
            });
            info.regions = (flags & 64 == 0).then_some(BORDERS);
        }
        picture(width, height, &info, &snapshot, &ui);
        let mut state = results::State::new(ui.look);
        state.help_open = ui.help_open;
        let mut info = results();
        info.rollouts.truncate(usize::from(flags));
        if let Some(row) = info.rollouts.first_mut() {
            (row.duration_s, row.start) = (x, v);
        }
        results_picture(width, height, &info, &state);
    }
}
