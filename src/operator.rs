//! Who steers: hands on a device, a script, a simulated operator, an agent that learns, or nobody.

pub mod badge;
mod choice;
pub mod gamepad;
pub mod mouse;
pub mod playback;
pub mod q_learning;
pub mod script;
pub mod shaping;
pub mod simulated;
pub mod terminal;

pub use badge::Badge;
pub use choice::{Choice, Device, Params, UnknownOperator, Via, socket_path};

use crate::random::Place;
use crate::signal::{Action, End, Intent, Seconds, State};

/// What an operator sees at a tick.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The plant's state now. Operators with slow eyes keep their own past.
    pub state: &'a State,
    /// The time since the session's control began; it runs on through countdowns.
    pub now: Seconds,
    /// The time within the rollout; negative during the countdown before it.
    pub rollout_time: Seconds,
}

/// What came of a tick, told to the operator after it.
#[derive(Clone, Copy, Debug)]
pub struct Feedback<'a> {
    /// The state in which the action was applied.
    pub state: &'a State,
    /// The action that the plant received.
    pub applied: Action,
    /// The reward of `state`.
    pub reward: f64,
    /// The state afterwards.
    pub next: &'a State,
    /// The rollout's end, if it ended here.
    pub end: Option<End>,
    /// The person's share in the applied action.
    pub share: f64,
    /// Whether the plant ran into the end of its track.
    pub bumped: bool,
    /// Whether the state's region is handed over for good, and nothing is learned there.
    pub is_frozen: bool,
}

/// What a device asks for beside its deflection, with its buttons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Go on from an instruction, a break, a pause or a stop.
    Begin,
    /// Pause, or go on.
    Pause,
    /// Throw the rollout away and repeat it.
    Discard,
    /// Emergency stop.
    Stop,
}

/// What happened to a device, in words for `events.csv` and the screen.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// Its button asks for something.
    Asks(Request),
    /// It is gone: unplugged, or its relay has ended.
    Gone(String),
    /// It is there again.
    Back(String),
    /// Something else that whoever reads the data wants to know.
    Remark(String),
}

/// The dead-man switch of an operator: real hardware moves only while a hand is on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Switch {
    /// It has none, or none that can be trusted.
    None,
    /// A hand is on it now.
    Held,
    /// It is let go, or not heard of: its device is gone, silent or out of focus.
    Free,
}

impl Switch {
    /// A switch that can be trusted, and whether it `is_held`.
    #[must_use]
    pub const fn of(is_held: bool) -> Self {
        if is_held { Self::Held } else { Self::Free }
    }
}

/// What an operator has steered before a rollout, in introduction and main together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Practice {
    /// Rollouts, without the discarded ones.
    pub rollouts: u32,
    /// The time in them.
    pub time: Seconds,
}

/// Someone or something that wants an action at each tick.
pub trait Operator: Send {
    /// A rollout is about to begin, after that much practice.
    fn begin(&mut self, place: Place, practice: Practice);

    /// From now on the device's deflection counts `sensitivity` times; nonsense is ignored.
    fn tune(&mut self, _sensitivity: f64) {}

    /// What happened to the device since it was asked last, oldest first; asked at the start
    /// of every tick, whatever the session is doing. Never blocks.
    fn news(&mut self, _now: Seconds) -> Option<News> {
        None
    }

    /// Whether the device is gone, or back but not at its centre yet: nobody can steer.
    fn is_gone(&self) -> bool {
        false
    }

    /// Whether there will never be news again, so that a session that nobody attends would
    /// wait for ever.
    fn is_over(&self) -> bool {
        false
    }

    /// Whether a hand is on the dead-man switch at `now`, the session's time; asked at every
    /// tick of a session with real hardware. Never blocks.
    fn switch(&mut self, _now: Seconds) -> Switch {
        Switch::None
    }

    /// What the person does to keep the switch held, in ASCII, such as "hold L1"; `None` where
    /// there is no switch.
    fn switch_name(&self) -> Option<String> {
        None
    }

    /// The latest wish; never blocks. Called in the countdown too, where it has no effect.
    fn intent(&mut self, view: View<'_>) -> Intent;

    /// What the robot is given to learn from the tick at which this was `wanted`, before what came
    /// of it is known: that, unless the operator tries things.
    fn shown(&self, wanted: Intent) -> Intent {
        wanted
    }

    /// What eyes and hand remember at a rollout's end, as numbers of the operator's own.
    /// Empty for one that lives in the present.
    fn memory(&mut self) -> Vec<f64> {
        Vec::new()
    }

    /// The rollout that just began goes on without a pause from one that ended with this
    /// [`memory`](Self::memory).
    fn go_on(&mut self, _memory: &[f64]) {}

    /// What it has learned by steering, as numbers of its own, between rollouts; a session that
    /// is taken up again needs it. Empty for one that does not learn, or learns elsewhere, as
    /// people do.
    fn learned(&self) -> Vec<f64> {
        Vec::new()
    }

    /// It knows what it had [`learned`](Self::learned) then, and nothing since; false, and
    /// nothing changes, where these are no numbers of its own.
    fn recall(&mut self, learned: &[f64]) -> bool {
        learned.is_empty()
    }

    /// What came of the tick.
    fn told(&mut self, _feedback: &Feedback<'_>) {}
}

/// Nobody: an idle hand, the value 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct Nobody;

impl Operator for Nobody {
    fn begin(&mut self, _place: Place, _practice: Practice) {}

    fn intent(&mut self, _view: View<'_>) -> Intent {
        Intent::fresh(0.0)
    }
}
