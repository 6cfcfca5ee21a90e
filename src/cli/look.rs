//! The words of the commands that look at sessions: afterwards, or while they run.

use std::path::PathBuf;

use clap::Args;

const REPLAY_HELP: &str = "\
Examples:
  coadapt replay logs/S07/001-balance-simultaneous
  coadapt replay logs/S07/001-balance-simultaneous --verify --json

On the screen: space pauses, . and , step, + and - set the speed (0.1 to 100 times), arrows,
Home and End go through time, n and p through rollouts, N and P through phases, a number and
Enter to that rollout; y, r and m show your, the robot's and the motor's (net) action as curves.

--verify does the session once more, from its profile, its seed and what its person did, and
compares every number of its rows bit by bit; the first difference is named, and so is a row that a
complete session lacks or has too many. u_human is taken as recorded: where it changed, u differs.
It works on sessions that were cut or resumed, with discarded rollouts; not on those of a real plant.
Exit codes: 0 the same, 1 it differs, 2 it cannot be compared.";

/// The words of `replay`.
#[derive(Args, Debug)]
#[command(after_help = REPLAY_HELP)]
pub struct Replay {
    /// The folder of a session.
    pub session: PathBuf,
    /// Do it once more, and compare every number.
    #[arg(long)]
    pub verify: bool,
    /// Print one JSON object instead of sentences.
    #[arg(long, requires = "verify")]
    pub json: bool,
}

const WATCH_HELP: &str = "\
Examples:
  coadapt watch            the session that runs, or the first one to begin
  coadapt watch S07        the one of subject S07
  coadapt watch logs/S07/001-balance-simultaneous

The session's own terminal may show the scene alone (key v); this one shows everything. It only
looks on: nothing typed here reaches the session, and no number of watchers delays it. It may be
started before the session, and waits for the next one after it. Only programs of the same user
on the same computer can watch; over the network: ssh -t LAB-PC coadapt watch";

/// The words of `watch`.
#[derive(Args, Debug)]
#[command(after_help = WATCH_HELP)]
pub struct Watch {
    /// The folder of a session that runs, or a subject; needed only where several run.
    #[arg(value_name = "SESSION|SUBJECT")]
    pub session: Option<String>,
}
