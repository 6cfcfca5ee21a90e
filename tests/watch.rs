//! Sessions that others look at, through a real socket.

#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

#[path = "program/desk.rs"]
mod desk;

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;

use coadapt::clock::{Clock, WallClock};
use coadapt::control::snapshot::{self, Publisher, Snapshot};
use coadapt::control::watch::line::{Hello, Line, Strange};
use coadapt::control::watch::{Following, Found, Place, Post};
use coadapt::record::{EpisodeRow, Sidecar, read_sidecar};
use coadapt::session::machine::{Finish, Stage};
use coadapt::session::{Moment, Phase};
use coadapt::signal::{End, Seconds, Tallied, Tick};
use desk::{Desk, names, text};

/// Waits until something is so.
fn soon(what: &str, mut is: impl FnMut() -> bool) {
    let mut clock = WallClock::start();
    while !is() {
        assert!(clock.now() < Seconds(60.0), "{what}: it never came");
        clock.wait_until(clock.now() + Seconds(0.005));
    }
}

/// The facts of a session.
fn sidecar(desk: &Desk) -> Sidecar {
    desk.succeed("run balance --headless --operator none --seed 1 --rollouts 1 --phases main");
    read_sidecar(&desk.at("logs/anon/001-balance-simultaneous/session.json")).unwrap()
}

/// A session of our own, and where it is watched.
struct Show {
    publisher: Publisher,
    post: Option<Post>,
    place: Place,
    folder: PathBuf,
}

fn moment(step: u32) -> Moment {
    Moment { step, ..Moment::start_of(Phase::Main) }
}

fn seen(tick: u64) -> Snapshot {
    let mut seen = Snapshot::before(Stage::Running(moment(u32::try_from(tick).unwrap())));
    seen.tick = Tick(tick);
    seen
}

fn rollout(episode: u32) -> EpisodeRow {
    EpisodeRow {
        phase: Phase::Main,
        episode,
        start: 0.1,
        steps: 70,
        duration_s: 1.4,
        end: End::Failed,
        total: 60.0,
        mean_reward: 0.9,
        share: Some(1.0),
        success: Some(0.2),
        receptive_fields: Some(3),
        tallied: Tallied::default(),
    }
}

impl Show {
    fn open(desk: &Desk) -> Self {
        let folder = desk.at("sockets");
        let place = Place::at([folder.clone()]);
        let (publisher, watcher) = snapshot::channel(Stage::Running(moment(0)));
        let hello = Hello::new("/logs/S07/001".to_owned(), sidecar(desk));
        let post = Some(Post::open(&place, hello, watcher).unwrap());
        Self { publisher, post, place, folder }
    }

    fn watcher(&self) -> Following {
        let (mut found, strange) = Found::all(&self.place);
        assert!(strange.is_empty(), "{strange:?}");
        assert_eq!(found.len(), 1);
        found.remove(0).follow()
    }

    fn socket(&self) -> PathBuf {
        self.post.as_ref().unwrap().path().to_owned()
    }
}

#[test]
fn only_this_user_may_open_the_socket_and_it_is_gone_afterwards() {
    let desk = Desk::new();
    let mut session = Show::open(&desk);
    let socket = session.socket();
    assert_eq!(fs::metadata(&socket).unwrap().permissions().mode() & 0o777, 0o600);
    let folder = fs::metadata(&session.folder).unwrap();
    assert_eq!(folder.permissions().mode() & 0o777, 0o700);
    assert_eq!(folder.uid(), fs::metadata(desk.at("")).unwrap().uid());
    session.post = None;
    assert!(!socket.exists());
    assert!(Found::all(&session.place).0.is_empty());
}

#[test]
fn two_watchers_see_every_rollout_and_the_latest_tick() {
    let desk = Desk::new();
    let mut session = Show::open(&desk);
    for episode in 1..=250 {
        session.publisher.rollout(rollout(episode));
    }
    let watchers = [session.watcher(), session.watcher()];
    session.publisher.publish(&seen(41));
    session.publisher.waits(Some("the pole".to_owned()));
    session.publisher.rollout(rollout(251));
    for following in &watchers {
        soon("the tick", || following.watcher.look().tick == Tick(41));
        soon("what it waits for", || following.watcher.waits().as_deref() == Some("the pole"));
        let mut known = Vec::new();
        soon("the rollouts", || {
            following.watcher.rollouts(&mut known);
            known.len() == 251
        });
        assert_eq!(known[250], rollout(251));
        assert!(!following.is_over());
    }
    // What a watcher asks reaches nobody.
    watchers[0].watcher.ask(snapshot::Command::Stop);
    assert_eq!(session.publisher.pending(), None);
    let mut last = seen(42);
    last.stage = Stage::Finished(Finish::Complete);
    session.publisher.publish(&last);
    session.post = None;
    for following in &watchers {
        soon("the end", || following.is_over());
        assert_eq!(following.watcher.look().stage, last.stage);
    }
}

#[test]
fn who_never_reads_holds_up_nobody() {
    let desk = Desk::new();
    let mut session = Show::open(&desk);
    let stuck: Vec<UnixStream> =
        (0..3).map(|_| UnixStream::connect(session.socket()).unwrap()).collect();
    for episode in 1..=5000 {
        session.publisher.rollout(rollout(episode));
    }
    let quick = session.watcher();
    // More than any buffer holds.
    let mut known = Vec::new();
    soon("all rollouts", || {
        quick.watcher.rollouts(&mut known);
        known.len() == 5000
    });
    session.publisher.publish(&seen(7));
    soon("the tick", || quick.watcher.look().tick == Tick(7));
    session.post = None;
    soon("the end", || quick.is_over());
    // What it was sent are whole lines, but for the last.
    let mut lines = BufReader::new(&stuck[0]).lines().map_while(Result::ok);
    assert!(matches!(Line::read(&lines.next().unwrap()), Ok(Line::Hello(_))));
    let lines: Vec<String> = lines.collect();
    let (_, whole) = lines.split_last().unwrap();
    assert!(whole.iter().all(|line| Line::read(line).is_ok()));
}

#[test]
fn who_does_not_answer_is_named_and_holds_up_nobody() {
    let desk = Desk::new();
    let session = Show::open(&desk);
    let me = std::process::id();
    // One that lets nobody in, one that says nothing, one that drips, one that is no text.
    let bind = |number: u32| {
        UnixListener::bind(session.folder.join(format!("{me}-{number}.sock"))).unwrap()
    };
    let [full, _mute, dripping, strange] = [1001, 1002, 1003, 1004].map(bind);
    full.set_nonblocking(true).unwrap();
    rustix::net::listen(&full, 0).unwrap();
    let _first = UnixStream::connect(full.local_addr().unwrap().as_pathname().unwrap()).unwrap();
    let drip = thread::spawn(move || {
        let (mut stream, _) = dripping.accept().unwrap();
        let mut clock = WallClock::start();
        while stream.write_all(b"x").is_ok() {
            assert!(clock.now() < Seconds(60.0), "it is still waited for");
            clock.wait_until(clock.now() + Seconds(0.05));
        }
    });
    let babble = thread::spawn(move || {
        let (mut stream, _) = strange.accept().unwrap();
        stream.write_all(b"\xff\xfe\n").unwrap();
    });
    let (found, strange) = Found::all(&session.place);
    drip.join().unwrap();
    babble.join().unwrap();
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].socket, session.socket());
    let pid = i32::try_from(me).unwrap();
    let silent = strange.iter().filter(|why| **why == Strange::Silent { pid }).count();
    let texts = strange.iter().filter(|why| matches!(why, Strange::Text(_))).count();
    assert_eq!((silent, texts), (3, 1), "{strange:?}");
    assert!(strange.iter().any(|why| why.to_string().contains(&format!("PID {pid} does not"))));
}

#[test]
fn bytes_that_are_no_text_end_nothing() {
    let desk = Desk::new();
    let session = Show::open(&desk);
    session.publisher.publish(&seen(9));
    let folder = desk.at("other");
    let place = Place::at([folder.clone()]);
    place.open().unwrap();
    let listener =
        UnixListener::bind(folder.join(format!("{}-1.sock", std::process::id()))).unwrap();
    let mut real = BufReader::new(UnixStream::connect(session.socket()).unwrap());
    let relay = thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut line = Vec::new();
        real.read_until(b'\n', &mut line).unwrap();
        stream.write_all(&line).unwrap();
        stream.write_all(b"\xff\n").unwrap();
        line.clear();
        real.read_until(b'\n', &mut line).unwrap();
        stream.write_all(&line).unwrap();
        stream
    });
    let following = Found::all(&place).0.remove(0).follow();
    soon("what follows", || following.news() == 2);
    assert_eq!(following.watcher.look().tick, Tick(9));
    assert!(!following.is_over());
    drop(relay.join().unwrap());
    soon("the end", || following.is_over());
}

/// The program, whose sockets are in the desk's own folder.
fn program(desk: &Desk, line: &str) -> Command {
    fs::create_dir_all(desk.at("run")).unwrap();
    let mut program = Command::new(env!("CARGO_BIN_EXE_coadapt"));
    program.args(line.split_whitespace()).current_dir(desk.at(""));
    program.env("XDG_RUNTIME_DIR", desk.at("run"));
    program.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    program
}

/// Long enough to be watched.
const LONG: &str = "run balance --headless --operator simulated:expert --seed 5 --rollouts 40 \
    --set session.introduction_rollouts=6 --set session.autonomous_rollouts=10";

struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The place of the sockets on `desk`.
fn place(desk: &Desk) -> Place {
    Place::at([desk.at("run/coadapt")])
}

fn steps(desk: &Desk, folder: &str) -> Vec<u8> {
    fs::read(desk.at(folder).join("steps.csv")).unwrap()
}

#[test]
fn a_session_is_the_same_whoever_looks_on() {
    let desk = Desk::new();
    let alone = program(&desk, &format!("{LONG} --logs alone")).output().unwrap();
    assert!(alone.status.success(), "{}", text(&alone.stderr));
    let session = program(&desk, LONG).spawn().unwrap();
    let mut session = Running(session);
    let place = place(&desk);
    let mut sockets = Vec::new();
    soon("a socket", || {
        sockets = place.sockets();
        !sockets.is_empty()
    });
    let _stuck: Vec<UnixStream> =
        (0..4).filter_map(|_| UnixStream::connect(&sockets[0]).ok()).collect();
    let following = Found::all(&place).0.remove(0).follow();
    soon("its end", || following.is_over());
    assert!(matches!(following.watcher.look().stage, Stage::Finished(Finish::Complete)));
    assert!(session.0.wait().unwrap().success());
    let folder = "anon/001-balance-simultaneous";
    let same = steps(&desk, &format!("alone/{folder}")) == steps(&desk, &format!("logs/{folder}"));
    assert!(same, "the rows differ");
}

#[test]
fn of_several_sessions_one_must_be_named_and_killed_ones_leave_nothing() {
    let desk = Desk::new();
    let mut sessions: Vec<Running> = ["S01", "S02"]
        .map(|subject| {
            let line = format!("{LONG} --subject {subject} --set session.main_rollouts=5000");
            Running(program(&desk, &line).spawn().unwrap())
        })
        .into();
    let place = place(&desk);
    soon("both", || Found::all(&place).0.len() == 2);
    let mut subjects: Vec<String> =
        Found::all(&place).0.iter().map(|found| found.hello.sidecar.subject.to_string()).collect();
    subjects.sort();
    assert_eq!(subjects, ["S01", "S02"]);
    for session in &mut sessions {
        session.0.kill().unwrap();
        session.0.wait().unwrap();
    }
    let sockets = || names(&desk.at("run/coadapt")).len();
    assert_eq!(sockets(), 2, "a killed program removes nothing");
    assert!(Found::all(&place).0.is_empty());
    assert_eq!(sockets(), 0);
}

#[test]
fn without_a_terminal_nothing_is_watched() {
    let desk = Desk::new();
    let output = program(&desk, "watch").output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    for (wanted, said) in [("no/such/folder", "no session is there"), ("a b", "subject")] {
        let output = program(&desk, "watch").arg(wanted).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let words = text(&output.stderr);
        assert!(words.contains(said), "{words}");
    }
    desk.succeed("run balance --headless --operator none --seed 1 --rollouts 1 --phases main");
    let over = "watch logs/anon/001-balance-simultaneous";
    let words = text(&program(&desk, over).output().unwrap().stderr);
    assert!(words.contains("coadapt replay"), "{words}");
    assert!(Path::new(&desk.at("run")).exists());
}
