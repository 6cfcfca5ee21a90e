//! Replays as they look, at 80×24 and 120×40, and what keys do to them; and what a watcher sees.

#![expect(clippy::unwrap_used, reason = "a screen that cannot be drawn has failed its test")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use coadapt::control::recording::Recording;
use coadapt::control::snapshot::Snapshot;
use coadapt::operator::Device;
use coadapt::profile::{Document, Profile};
use coadapt::session::machine::{Finish, Stage};
use coadapt::session::plan::Plan;
use coadapt::session::{Moment, Phase};
use coadapt::signal::{Seconds, State};
use coadapt::task::Occasion;
use coadapt::tui::live::{History, Info, Ui};
use coadapt::tui::palette::{Glyphs, Look};
use coadapt::tui::replay::{self, Player, Reaction};
use coadapt::tui::scene::{self, Scene};
use coadapt::tui::watch;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

fn profile(task: &str) -> Profile {
    Document::find(task, Path::new("tests/data/no-such-folder")).unwrap().read().unwrap()
}

/// The facts of a session of `task`'s plain profile.
fn info(task: &str) -> Info {
    let profile = profile(task);
    let rules = profile.experiment.task(profile.tick());
    Info {
        task: task.to_owned(),
        preset: profile.preset.clone(),
        mode: "simultaneous".to_owned(),
        robot_watches: false,
        learner: "rfwr".to_owned(),
        subject: "S07".to_owned(),
        trial: 2,
        phases: Plan::new(&profile.session, profile.tick(), 1, true).phases,
        instructions: Vec::new(),
        tick_s: profile.tick().0,
        hold_s: 3.0,
        autonomous_hold_s: 0.5,
        break_s: 60.0,
        gate: profile.sharing.gate,
        gate_is_timer: false,
        by_episode: profile.sharing.window_episodes.is_some(),
        longest_taught: rules.longest(Occasion::Taught),
        longest_tested: rules.longest(Occasion::Tested),
        action_limit: rules.action_limit(),
        action_unit: profile.experiment.action_unit().to_owned(),
        scene: Scene::of(&profile.experiment),
        regions: scene::regions_of(&profile.experiment),
        field_cap: profile.learner.max_fields,
        operator: "keyboard".to_owned(),
        buttons: String::new(),
        device_state: String::new(),
        device: Some(Device::Keyboard),
        sensitivity: 1.0,
    }
}

/// A triangle between −1 and 1 in the time of 80 steps.
fn swing(step: u32) -> f64 {
    let part = f64::from(step % 80) / 20.0;
    if part < 1.0 {
        part
    } else if part < 3.0 {
        2.0 - part
    } else {
        part - 4.0
    }
}

/// A rollout to be recorded: phase, number, steps, end.
type Recorded = (&'static str, u32, u32, &'static str);

/// Two of practice, three of main of which one was discarded at first, and two alone.
const SESSION: [Recorded; 8] = [
    ("introduction", 1, 40, "failed"),
    ("introduction", 2, 60, "failed"),
    ("main", 1, 100, "failed"),
    ("main", 2, 30, "discarded"),
    ("main", 2, 700, "failed"),
    ("main", 3, 250, "failed"),
    ("autonomous", 1, 120, "failed"),
    ("autonomous", 2, 90, ""),
];

/// Writes a session of balance, all of whose numbers are made up of simple sums.
fn record(folder: &Path) {
    let mut steps = "phase,episode,step,t,x,x_dot,theta,theta_dot,u_human,u_machine,share,u,\
                     u_applied,reward,success,region,lateness_us,raw\n"
        .to_owned();
    let mut episodes = "phase,episode,start,steps,duration_s,end,return,mean_reward,share,\
                        success,receptive_fields\n"
        .to_owned();
    let mut taught = 0;
    for (phase, episode, count, end) in SESSION {
        for step in 0..count {
            let (t, x, theta) = (f64::from(step) * 0.02, 0.2 * swing(step / 2), 0.3 * swing(step));
            let (human, robot) = (8.0 * swing(step + 30), 6.0 * swing(step + 20));
            let share = if taught > 300 { 0.5 } else { 1.0 };
            let _ = write!(steps, "{phase},{episode},{step},{t},{x},0.1,{theta},0.4,");
            let _ = match phase {
                "main" => {
                    taught += u32::from(end != "discarded");
                    let u = share * human + (1.0 - share) * robot;
                    let success = f64::from(taught) / 1500.0;
                    writeln!(steps, "{human},{robot},{share},{u},{u},0.9,{success},all,12,0.5")
                }
                "introduction" => writeln!(steps, "{human},,1,{human},{human},0.9,,all,0,"),
                _ => writeln!(steps, ",{robot},0,{robot},{robot},0.9,,all,0,"),
            };
        }
        if end.is_empty() {
            // Killed in the middle of a row.
            steps.push_str("autonomous,2,90,1.8,0.0");
            continue;
        }
        let (t, theta) = (f64::from(count) * 0.02, 31_f64.to_radians());
        let _ = writeln!(steps, "{phase},{episode},{count},{t},0.1,0.2,{theta},1.5,,,,,,,,,0,");
        let (total, fields) = (f64::from(count) * 0.9, if phase == "main" { "7" } else { "" });
        let _ =
            writeln!(episodes, "{phase},{episode},0.1,{count},{t},{end},{total},0.9,,,{fields}");
    }
    let gate = "success reached the gate at step 301; tau 328.5 steps";
    let events = format!(
        "time,phase,episode,step,event,cause\n,main,1,99,gate_opened,success reached the gate at \
         step 100; tau 99 steps\n,main,2,200,gate_opened,{gate}\n"
    );
    fs::write(folder.join("steps.csv"), steps).unwrap();
    fs::write(folder.join("episodes.csv"), episodes).unwrap();
    fs::write(folder.join("events.csv"), events).unwrap();
}

fn recording() -> Recording {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path());
    read(folder.path())
}

fn read(folder: &Path) -> Recording {
    let profile = profile("balance");
    Recording::read(folder, profile.experiment.task(profile.tick()), true).unwrap()
}

fn player() -> Player {
    Player::new(recording(), info("balance"), Look::default())
}

fn press(player: &mut Player, keys: &str) {
    for key in keys.chars() {
        let code = match key {
            '\r' => KeyCode::Enter,
            '<' => KeyCode::Left,
            '>' => KeyCode::Right,
            '^' => KeyCode::Home,
            '$' => KeyCode::End,
            '!' => KeyCode::Esc,
            key => KeyCode::Char(key),
        };
        assert_eq!(player.key(KeyEvent::new(code, KeyModifiers::NONE)), Reaction::Stay);
    }
}

fn picture(player: &Player, (width, height): (u16, u16)) -> TestBackend {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    let mut history = History::default();
    // One of another rollout is never drawn.
    let panel = Snapshot::before(Stage::Finished(Finish::Complete));
    terminal.draw(|frame| replay::draw(frame, player, &panel, &mut history)).unwrap();
    terminal.backend().clone()
}

fn both(name: &str, player: &Player) {
    insta::assert_snapshot!(format!("{name}_80x24"), picture(player, (80, 24)));
    insta::assert_snapshot!(format!("{name}_120x40"), picture(player, (120, 40)));
}

/// Rows of the recording before its rollout `index`.
fn before(index: usize) -> usize {
    let rows = |(_, _, steps, end): &Recorded| *steps as usize + usize::from(!end.is_empty());
    SESSION[..index].iter().map(rows).sum()
}

#[test]
fn a_replay_in_the_middle_of_main() {
    let mut player = player();
    press(&mut player, "N2\r>>>>>>>>>>>> ");
    both("replay_main", &player);
    press(&mut player, "yr");
    insta::assert_snapshot!("replay_one_curve_80x24", picture(&player, (80, 24)));
    press(&mut player, "m?");
    insta::assert_snapshot!("replay_help_80x24", picture(&player, (80, 24)));
    press(&mut player, "?v");
    insta::assert_snapshot!("replay_subject_80x24", picture(&player, (80, 24)));
}

#[test]
fn a_replay_at_ends_and_in_other_phases() {
    let mut player = player();
    press(&mut player, "Nn,,,,,,,,,,");
    // Back by steps into the rollout before: at its last state, then in it.
    press(&mut player, ".........");
    both("replay_failed", &player);
    press(&mut player, "NN+++");
    player.pass(Seconds(0.1));
    both("replay_autonomous", &player);
    press(&mut player, "$");
    insta::assert_snapshot!("replay_cut_80x24", picture(&player, (80, 24)));
    let plain = Look { glyphs: Glyphs::Ascii, ..Look::default() };
    let mut player = Player::new(recording(), info("balance"), plain);
    press(&mut player, "N>>  12");
    let screen = picture(&player, (80, 24)).to_string();
    insta::assert_snapshot!("replay_ascii_80x24", screen);
    assert!(screen.contains("to rollout 12_"));
}

#[test]
fn keys_lead_through_rollouts_phases_and_time() {
    let mut player = player();
    assert!(player.is_playing());
    press(&mut player, "n");
    assert_eq!(player.row(), before(1));
    press(&mut player, "p");
    assert_eq!(player.row(), 0);
    press(&mut player, "N");
    assert_eq!(player.row(), before(2));
    press(&mut player, "nn");
    assert_eq!(player.row(), before(4));
    press(&mut player, ">p");
    assert_eq!(player.row(), before(4), "first to the beginning of this one");
    press(&mut player, "p");
    assert_eq!(player.row(), before(3));
    press(&mut player, "P");
    assert_eq!(player.row(), before(2));
    press(&mut player, "P");
    assert_eq!(player.row(), 0);
    press(&mut player, "N3\r");
    assert_eq!(player.row(), before(5));
    press(&mut player, "2\r");
    assert_eq!(player.row(), before(4), "of attempts the last");
    press(&mut player, "3!\r");
    assert_eq!(player.row(), before(4), "forgotten");
    press(&mut player, "99\r");
    assert!(picture(&player, (80, 24)).to_string().contains("no rollout 99 in main: 1 to 3"));
    press(&mut player, ">");
    assert_eq!(player.row(), before(4) + 50);
    press(&mut player, "..,");
    assert_eq!((player.row(), player.is_playing()), (before(4) + 51, false));
    press(&mut player, "<<<<<^<,");
    assert_eq!(player.row(), 0);
    press(&mut player, "$.>nN");
    assert_eq!(player.row(), before(8) - 1);
    press(&mut player, " ");
    assert_eq!((player.row(), player.is_playing()), (0, true), "again from the beginning");
    let quit = |code, modifiers| player_key(code, modifiers);
    assert_eq!(quit('q', KeyModifiers::NONE), Reaction::Quit);
    assert_eq!(quit('c', KeyModifiers::CONTROL), Reaction::Interrupt);
}

fn player_key(key: char, modifiers: KeyModifiers) -> Reaction {
    player().key(KeyEvent::new(KeyCode::Char(key), modifiers))
}

#[test]
fn time_passes_at_every_speed_and_stops_at_the_end() {
    let mut player = player();
    player.pass(Seconds(1.0));
    assert_eq!(player.row(), 50);
    press(&mut player, "^----------");
    assert_eq!(player.speed(), 0.1);
    player.pass(Seconds(1.01));
    assert_eq!(player.row(), 5);
    press(&mut player, "^++++++++++");
    assert_eq!(player.speed(), 100.0);
    // A picture's time, at a hundred times: every picture is whole, whatever is passed over.
    player.pass(Seconds(0.04));
    assert_eq!(player.row(), 200);
    for _ in 0..20 {
        player.pass(Seconds(0.033));
        let screen = picture(&player, (80, 24)).to_string();
        assert!(screen.contains("motor") && screen.contains("/00:27"), "{screen}");
    }
    player.pass(Seconds(10.0));
    assert_eq!((player.row(), player.is_playing()), (before(8) - 1, false));
}

#[test]
fn numbers_are_those_that_the_session_had() {
    let recording = recording();
    assert_eq!(recording.len(), before(8));
    assert_eq!(recording.spans().len(), 8);
    let attempts: Vec<u16> = recording.spans().iter().map(|span| span.moment.attempt).collect();
    assert_eq!(attempts, [0, 0, 0, 0, 1, 0, 0, 0]);
    let counted: Vec<u64> = recording.spans().iter().map(|span| span.moment.steps_before).collect();
    assert_eq!(counted, [0, 40, 0, 100, 100, 800, 0, 120]);
    let at = |rollout, step| recording.snapshot(before(rollout) + step);
    // The gate of the last attempt counts, from its row on.
    assert_eq!((at(4, 199).gate, at(4, 200).gate.map(|gate| gate.step)), (None, Some(301)));
    assert_eq!((at(4, 100).shares[0], at(5, 100).shares[0]), (1.0, 0.5));
    // What the discarded rollout moved was taken back.
    assert_eq!(at(4, 0).successes[0], 101.0 / 1500.0);
    assert_eq!((at(3, 0).fields, at(5, 0).fields), (7, 7));
    assert_eq!(at(6, 10).shares[0], 0.0);
    assert_eq!(at(1, 10).shares[0], 1.0);
    assert_eq!(at(2, 0).lateness, Seconds(12e-6));
    assert!(matches!(at(0, 40).stage, Stage::Hold { .. }), "held at its end");
    let over = |rollout, step| recording.rollouts(before(rollout) + step).len();
    assert_eq!((over(0, 39), over(0, 40), over(1, 0), over(7, 89)), (0, 1, 1, 7));
    assert_eq!(recording.snapshot(usize::MAX).tick.0, before(8) as u64 - 1);
}

#[test]
fn a_damaged_row_ends_the_replay_and_is_named() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path());
    let path = folder.path().join("steps.csv");
    let whole = fs::read_to_string(&path).unwrap();
    fs::write(&path, whole.replace("main,1,50,1,", "main,1,50,one,")).unwrap();
    let recording = read(folder.path());
    assert_eq!(recording.len(), before(2) + 50);
    let trouble = recording.trouble().unwrap();
    assert!(trouble.contains("column t") && trouble.contains("left out"), "{trouble}");
    for text in ["", "phase,epis", whole.lines().next().unwrap()] {
        fs::write(&path, text).unwrap();
        assert!(read(folder.path()).is_empty());
    }
}

#[test]
fn a_watcher_sees_everything_and_is_offered_no_controls() {
    let info = info("balance");
    let moment = Moment { rollout: 12, step: 412, ..Moment::start_of(Phase::Main) };
    let draw = |stage, ui: &Ui, size: (u16, u16)| {
        let mut seen = Snapshot::before(stage);
        seen.state = State::new([0.1, 0.0, 0.1, 0.4]);
        let mut terminal = Terminal::new(TestBackend::new(size.0, size.1)).unwrap();
        let history = History::default();
        terminal.draw(|frame| watch::draw(frame, &info, (&seen, &seen), &history, ui)).unwrap();
        terminal.backend().clone()
    };
    let ui = Ui::default();
    insta::assert_snapshot!("watch_80x24", draw(Stage::Running(moment), &ui, (80, 24)));
    insta::assert_snapshot!("watch_120x40", draw(Stage::Running(moment), &ui, (120, 40)));
    for stage in [
        Stage::Paused(moment),
        Stage::Stopped(moment),
        Stage::Instruction(moment),
        Stage::Break { next: moment, ticks_left: 100 },
    ] {
        let screen = draw(stage, &ui, (80, 24)).to_string();
        assert!(screen.contains("read-only"), "{screen}");
        assert!(!screen.contains("Enter") && !screen.contains("end the session"), "{screen}");
    }
    let mut terminal = Terminal::new(TestBackend::new(80, 24)).unwrap();
    let words = ["The next session of subject S07 is shown here.".to_owned()];
    let look = Look::default();
    terminal
        .draw(|frame| watch::draw_waiting(frame, "nothing to watch yet", &words, false, look))
        .unwrap();
    insta::assert_snapshot!("watch_waiting_80x24", terminal.backend());
}
