//! The words of the command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, value_parser};

use crate::profile::Order;
use crate::session::BadSubject;
use crate::session::plan::MOST_ROLLOUTS;
use crate::study::batch::Shard;

const EXAMPLES: &str = "\
Examples:
  coadapt                                       set up a session on the screen
  coadapt run balance --subject S07             one session, you at the keyboard
  coadapt run balance --headless --operator simulated:average --seed 1 --json
  coadapt run --headless --resume logs/S07/001-balance-simultaneous
  coadapt fit data.csv --inputs a,b --outputs u a learner on a table, offline
  coadapt study balance                         many simulated sessions, compared
  coadapt profile show balance                  every key, its value and its origin
  coadapt devices                               pads, ports, terminal; maps a gamepad

Results go to standard output, messages to standard error.
Exit codes: 0 done, 1 failed, 2 wrong usage or input, 130 interrupted, 143 terminated.";

/// The terminal laboratory for simultaneous human-robot learning.
///
/// Without a command it opens the set-up screen; Enter plays at once.
#[derive(Debug, Parser)]
#[command(version, after_help = EXAMPLES)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// One session: introduction, main, autonomous.
    Run(Box<Run>),
    /// Let recorded policies act alone over many starts, and nobody on the same ones.
    Evaluate(Evaluate),
    /// A learner on a table or a recorded session, offline.
    Fit(Fit),
    /// Many sessions, compared: arms × operators × seeds × settings, on all cores.
    Study(Study),
    /// A plant open loop: a table of actions in, a table of states out.
    Simulate(Simulate),
    /// This computer's gamepad for a session at another: lines on standard output.
    PadRelay(PadRelay),
    /// A plant's device without hardware, on a pseudo-terminal, in real time.
    Emulate(Emulate),
    /// Stops a real plant's motor when the program that started this is gone.
    #[command(hide = true)]
    Guard(Guard),
    /// Look at profiles.
    #[command(subcommand)]
    Profile(Profile),
    /// Gamepads, serial ports and the terminal: what is there, live, and what mends problems.
    Devices(Devices),
}

/// The words of `run`.
#[derive(Args, Debug)]
pub struct Run {
    /// A name in `profiles/` or built in, or a path.
    #[arg(required_unless_present = "resume")]
    pub profile: Option<String>,
    /// Who: 1 to 64 letters, digits, '-' and '_' [default: anon].
    #[arg(long, value_name = "ID")]
    pub subject: Option<String>,
    /// The trial's number [default: the next free one].
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub trial: Option<u32>,
    /// simultaneous, sequential or assigned.
    #[arg(long, value_name = "MODE")]
    pub mode: Option<String>,
    /// rfwr or lwpr.
    #[arg(long, value_name = "LEARNER")]
    pub learner: Option<String>,
    /// `keyboard`, `gamepad[:relay=-|:relay=unix:PATH|:script=FILE]`, `mouse`,
    /// `script:FILE|SESSION`, `simulated:naive|average|expert[:TYPE]`, `q_learning` (mountain car)
    /// or `none`.
    #[arg(long, value_name = "OPERATOR", default_value = "keyboard")]
    pub operator: String,
    /// simulated, or serial:PORT for a real plant: a path, a name in /dev/serial/by-id, or
    /// `usb:VID:PID[:SERIAL]`.
    #[arg(long, value_name = "BACKEND", default_value = "simulated")]
    pub backend: String,
    /// Some of introduction,main,autonomous.
    #[arg(long, value_name = "A,B")]
    pub phases: Option<String>,
    /// Rollouts of the main phase.
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub rollouts: Option<String>,
    /// Controlled time of the main phase, s.
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    pub duration: Option<String>,
    /// What the robot does in a session without a main phase: a file, or `last`.
    #[arg(long, value_name = "FILE|last")]
    pub policy: Option<String>,
    /// Go on with a session that was cut.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["profile", "subject", "trial", "mode",
        "learner", "operator", "backend", "phases", "rollouts", "duration", "policy", "seed", "set",
        "logs"])]
    pub resume: Option<PathBuf>,
    /// The seed of everything left to chance [default: drawn and stored].
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Change a value of the profile, such as `plant.pole_length_m=0.6`.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// The folder of all sessions.
    #[arg(long, value_name = "DIR", default_value = "logs")]
    pub logs: PathBuf,
    /// No screen, as fast as the machine goes.
    #[arg(long)]
    pub headless: bool,
    /// Arm a real plant without a screen. Its motor moves: stay beside it, with a hand on its power
    /// switch.
    #[arg(long, requires = "headless")]
    pub arm: bool,
    /// Print one JSON object instead of sentences.
    #[arg(long, requires = "headless")]
    pub json: bool,
}

/// The words of `evaluate`.
#[derive(Args, Debug)]
pub struct Evaluate {
    /// A policy file, or the folder of a session: its final policy, and those of its tenths.
    pub policy: PathBuf,
    /// The profile whose plant and rules apply [default: the session's, or the task's].
    #[arg(long, value_name = "PROFILE")]
    pub profile: Option<String>,
    /// The number of starts [default: the profile's].
    #[arg(long, value_name = "N", allow_hyphen_values = true,
        value_parser = value_parser!(u32).range(1..=i64::from(MOST_ROLLOUTS)))]
    pub starts: Option<u32>,
    /// Starts drawn at random in place of the profile's.
    #[arg(long)]
    pub random: bool,
    /// The seed of the plant's noise, and of random starts.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Change a value of the profile, such as `plant.pole_length_m=0.6`.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Print one JSON object instead of sentences.
    #[arg(long)]
    pub json: bool,
}

const FIT_EXAMPLES: &str = "\
Examples:
  coadapt fit data.csv --inputs x1,x2 --outputs y --settings lwpr.ron --json
  coadapt fit data.csv --inputs x1,x2 --outputs y --query grid.csv --predictions out.csv
  coadapt fit logs/S07/001-balance-sequential --learner lwpr --out policy.json
  zcat data.csv.gz | coadapt fit - --inputs x1,x2 --outputs y

The settings are RON, or JSON in a file that ends in .json; profiles/learners/ has commented
examples of every key. What they leave out is the session's, or else the published value.
NaN and infinite samples are refused and counted.

nmse one step: each sample predicted just before it is learned; nmse final: the final learner on
the same samples; both are mean squared errors over the output's variance, and of several
outputs the mean. samples/s is that of the learning pass, reading and predicting included.";

/// The words of `fit`.
#[derive(Args, Debug)]
#[command(after_help = FIT_EXAMPLES)]
pub struct Fit {
    /// A CSV table whose first line names its columns, `-` for standard input, or the folder
    /// of a recorded session.
    pub data: PathBuf,
    /// rfwr or lwpr [default: the settings', the session's, or rfwr].
    #[arg(long, value_name = "LEARNER")]
    pub learner: Option<String>,
    /// The learner's settings, RON or JSON by the file's ending.
    #[arg(long, value_name = "FILE")]
    pub settings: Option<PathBuf>,
    /// The columns to learn from [default: a session's features].
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    pub inputs: Option<Vec<String>>,
    /// The columns to be learned [default: a session's `u_human`].
    #[arg(long, value_name = "U", value_delimiter = ',')]
    pub outputs: Option<Vec<String>>,
    /// A table with the inputs' columns, to be answered by the final learner.
    #[arg(long, value_name = "FILE", requires = "predictions")]
    pub query: Option<PathBuf>,
    /// Where the answers go, as a CSV table.
    #[arg(long, value_name = "FILE", requires = "query")]
    pub predictions: Option<PathBuf>,
    /// Where the final learner goes, as a policy.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Print one JSON object instead of sentences.
    #[arg(long)]
    pub json: bool,
}

const STUDY_EXAMPLES: &str = "\
Examples:
  coadapt study balance                         two modes, six types of people, 20 seeds
  coadapt study mountain-car --seeds 3 --out /tmp/car
  coadapt study balance --set learner.init_d=3,25,60        each value is a setting of its own
  coadapt study balance --shard 1/8             the first of eight shares of the runs
  coadapt study balance --slurm                 writes slurm.sh, an array of such shares
  coadapt study merge logs/studies/balance-*-of-8

A study is a RON file: profiles/studies/NAME.ron, built in, or a path; docs/STUDIES.md tells how to
write one. Finished runs are kept at once: the same command goes on where it was cut. Results do not
depend on the number of jobs. The folder gets results.csv (a row for every number), summary.json
(means, medians, 95 % intervals, differences seed by seed), table.txt (what is printed) and figures/
(the data of figures).";

/// The words of `study`.
#[derive(Args, Debug)]
#[command(after_help = STUDY_EXAMPLES, args_conflicts_with_subcommands = true)]
pub struct Study {
    /// What else can be done.
    #[command(subcommand)]
    pub command: Option<StudyCommand>,
    /// The study to be carried out.
    #[command(flatten)]
    pub words: StudyWords,
}

/// What can be done beside carrying out a study.
#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// Join the folders of shards, and say what is missing.
    Merge(Merge),
    /// The studies in `profiles/studies/` and those that are built in.
    List(StudyList),
}

/// The words of `study list`.
#[derive(Args, Debug)]
pub struct StudyList {
    /// Print one JSON object instead of lines.
    #[arg(long)]
    pub json: bool,
}

/// Which study, and how it is carried out.
#[derive(Args, Debug)]
pub struct StudyWords {
    /// A name in `profiles/studies/` or built in, or a path.
    #[arg(required = true)]
    pub study: Option<String>,
    /// Threads [default: one for each core].
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=4096))]
    pub jobs: Option<u32>,
    /// Only share K of N of the runs.
    #[arg(long, value_name = "K/N", conflicts_with = "slurm")]
    pub shard: Option<Shard>,
    /// So many seeds in place of the study's.
    #[arg(long, value_name = "N")]
    pub seeds: Option<u32>,
    /// Change a value of the profile in all runs; of several values with commas between, each is
    /// a setting of its own.
    #[arg(long, value_name = "KEY=VALUE,…", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// The folder for results [default: logs/studies/NAME].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Keep the step rows of every session, in DIR/steps.
    #[arg(long)]
    pub keep_steps: bool,
    /// Write the script of a Slurm array of JOBS shares [default: 10 minutes each], and run nothing
    /// but what tells how much a run needs.
    #[arg(
        long,
        value_name = "JOBS",
        num_args = 0..=1,
        value_parser = value_parser!(u32).range(1..=1000)
    )]
    pub slurm: Option<Option<u32>>,
    /// Print one JSON object instead of tables.
    #[arg(long)]
    pub json: bool,
}

/// The words of `study merge`.
#[derive(Args, Debug)]
pub struct Merge {
    /// The folders of shards.
    #[arg(required = true, value_name = "DIR")]
    pub folders: Vec<PathBuf>,
    /// The folder for the whole [default: logs/studies/NAME].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object instead of tables.
    #[arg(long)]
    pub json: bool,
}

/// The words of `simulate`.
#[derive(Args, Debug)]
pub struct Simulate {
    /// A name in `profiles/` or built in, or a path.
    pub profile: String,
    /// The state to start from, such as 0,0,0.05,0.
    #[arg(long, value_name = "X,…", allow_hyphen_values = true)]
    pub start: String,
    /// A CSV table with the column `u`, a row a control step; `-` for standard input.
    #[arg(long, value_name = "FILE")]
    pub actions: PathBuf,
    /// The seed of the plant's noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Change a value of the profile, such as `plant.pole_length_m=0.6`.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
}

const RELAY_EXAMPLES: &str = "\
The pad is at this computer, the session at LAB-PC:
  LAB-PC:  coadapt run balance --operator gamepad:relay=unix:$HOME/pad
  here:    coadapt pad-relay | ssh LAB-PC 'coadapt pad-relay --forward unix:$HOME/pad'
The session is here, the pad at LAPTOP:
  ssh LAPTOP coadapt pad-relay | coadapt run balance --operator gamepad:relay=-";

/// The words of `pad-relay`.
#[derive(Args, Debug)]
#[command(after_help = RELAY_EXAMPLES)]
pub struct PadRelay {
    /// The profile whose `operator.gamepad.sdl_mappings` are used.
    #[arg(default_value = "balance")]
    pub profile: String,
    /// Change a value of the profile.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Pass a relay's lines on from standard input to the session at this socket.
    #[arg(long, value_name = "unix:PATH")]
    pub forward: Option<String>,
    /// Relay a table of events in place of a pad: columns t,event,pad,what,value.
    #[arg(long, value_name = "FILE", conflicts_with = "forward")]
    pub events: Option<PathBuf>,
}

const EMULATE_EXAMPLES: &str = "\
Examples:
  coadapt emulate physical-cart-pole --port-link /tmp/cp0
  coadapt emulate cobs-cart-pole --faults faults.ron --seed 7 --json > trace.jsonl

The first line on standard output is the port; with --json every line is an object with at_s and
what: written (by the host), obeyed, delivered (to the host), motor, homing_began, fault, forbidden …
On standard input, a line each: steady or an empty line (a hand brings the pole to hang at rest),
raise (a hand holds it upright for 3 s), push N (a hand moves the cart by N cm while the motor is
off), unplug S (the cable is pulled for S seconds), help.
docs/SERIAL-PROTOCOL.md has the faults and what a host must never do. Ctrl-C ends.";

/// The words of `emulate`.
#[derive(Args, Debug)]
#[command(after_help = EMULATE_EXAMPLES)]
pub struct Emulate {
    /// A profile with a device: physical-cart-pole, cobs-cart-pole, or a path.
    pub profile: String,
    /// Change a value of the profile, such as `backend.emulated.motor.delay_s=0.005`.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Make a link to the port here, which stays when the port gets another name.
    #[arg(long, value_name = "PATH")]
    pub port_link: Option<PathBuf>,
    /// What goes wrong on purpose.
    #[arg(long, value_name = "FILE.ron")]
    pub faults: Option<PathBuf>,
    /// The seed of the wire's and the plant's noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Print the trace, one JSON object a line.
    #[arg(long)]
    pub json: bool,
}

/// The words of `guard`, which only coadapt itself says: beats come on standard input, and
/// standard output is the port.
#[derive(Args, Debug)]
pub struct Guard {
    /// The bytes that stop the motor, in hexadecimal digits.
    #[arg(long, value_name = "HEX", value_parser = bytes)]
    pub stop: Box<[u8]>,
    /// The bytes that say so once more.
    #[arg(long, value_name = "HEX", value_parser = bytes)]
    pub again: Box<[u8]>,
    /// How long an armed program may be silent, s.
    #[arg(long, value_name = "SECONDS", value_parser = patience)]
    pub patience_s: f64,
}

/// The words of `profile`.
#[derive(Debug, Subcommand)]
pub enum Profile {
    /// The profiles that can be run by name.
    List,
    /// Every key with its value and where the value comes from.
    Show(Looked),
    /// Tell all that is wrong with a profile.
    Check(Looked),
}

/// Which profile to look at.
#[derive(Args, Debug)]
pub struct Looked {
    /// A name in `profiles/` or built in, or a path.
    pub profile: String,
    /// Change a value of the profile, such as `plant.pole_length_m=0.6`.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
}

const DEVICES_HELP: &str = "\
On a terminal it is a screen: pages of gamepad, keyboard, mouse, serial ports and terminal, live,
with the profile's response curves; m learns a gamepad's map by moving it, s saves it to a profile.
Elsewhere, or with --json, what is there is printed. Problems are findings: the exit code is 0.";

/// The words of `devices`.
#[derive(Args, Debug)]
#[command(after_help = DEVICES_HELP)]
pub struct Devices {
    /// The profile whose maps and curves apply: a name in `profiles/` or built in, or a path.
    #[arg(default_value = "balance")]
    pub profile: String,
    /// Change a value of the profile, such as `operator.gamepad.shape.exponent=2`.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Print one JSON object instead of sentences, and show no screen.
    #[arg(long)]
    pub json: bool,
}

fn bytes(text: &str) -> Result<Box<[u8]>, String> {
    let pairs = text.as_bytes().chunks(2).map(|pair| match pair {
        [_, _] if pair.iter().all(u8::is_ascii_hexdigit) => std::str::from_utf8(pair).ok(),
        _ => None,
    });
    let bytes: Option<Box<[u8]>> = pairs.map(|pair| u8::from_str_radix(pair?, 16).ok()).collect();
    bytes.filter(|bytes| !bytes.is_empty()).ok_or_else(|| "give bytes, such as aa0508".to_owned())
}

fn patience(text: &str) -> Result<f64, String> {
    let given = text.parse().ok().filter(|given| (0.01..=10.0).contains(given));
    given.ok_or_else(|| "give 0.01 to 10".to_owned())
}

fn key_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("give KEY=VALUE, such as plant.pole_length_m=0.6".to_owned()),
    }
}

impl Run {
    /// The session that these words ask for.
    ///
    /// # Errors
    /// When the subject cannot name a folder.
    pub fn order(&self) -> Result<Order, BadSubject> {
        let mut order = Order {
            profile: self.profile.clone().unwrap_or_default(),
            subject: self.subject.as_deref().map(str::parse).transpose()?.unwrap_or_default(),
            trial: self.trial,
            operator: self.operator.clone(),
            policy: self.policy.clone(),
            seed: self.seed,
            backend: self.backend.clone(),
            logs: self.logs.clone(),
            sets: Vec::new(),
        };
        for (key, value) in &self.set {
            order.change(key, value);
        }
        let lasts = self.duration.as_deref().and_then(|d| d.parse::<f64>().ok());
        if lasts.is_some_and(f64::is_finite) && self.rollouts.is_none() {
            order.change("session.main_rollouts", "None");
        }
        let phases = self.phases.as_ref().map(|phases| format!("[{phases}]"));
        for (key, value) in [
            ("mode", self.mode.as_ref()),
            ("learner.kind", self.learner.as_ref()),
            ("session.phases", phases.as_ref()),
            ("session.main_rollouts", self.rollouts.as_ref()),
            ("session.main_duration_s", self.duration.as_ref()),
        ] {
            if let Some(value) = value {
                order.change(key, value);
            }
        }
        Ok(order)
    }
}
