//! Tabular Q-learning of the mountain car: the agent that takes the person's place in
//! chapter IV of the thesis.
//!
//! Position and velocity are cut into cells, 100 × 100 of them (4.2.1), and a table holds the
//! value of each of the throttles −1, 0, 1 in each cell. The agent is told what came of every
//! control step and moves one value by it (eq. 33, Watkins and Dayan 1992):
//!
//! ```text
//! Q(s, a) ← Q(s, a) + β·(r + γ·max over a' of Q(s', a') − Q(s, a))       (33)
//! π(s) = the a with the largest Q(s, a)                                   (34)
//! β(episode) = 10 / (episode + 100)^0.51, at most 1                       (4.3)
//! ```
//!
//! It follows π but for one step in ten, which is drawn from the three throttles (ε-greedy).
//! Of equal values the lowest throttle's counts. Q begins at 0, more than nearly every return
//! (steps cost 1 each): what was never tried looks best, and this optimism explores. The flag
//! has no value after it; an episode that is given up or cut goes on in thought, so that its
//! last step counts the value of the state it led to.
//!
//! With [`Params::lambda`] it is Watkins' Q(λ): each step moves the values of those before it
//! as well, each γλ times as much as the one after it, back to the last step off π. A value
//! that is visited again counts as fresh (replacing traces). The traces end with the rollout.
//!
//! In a session the agent is an [operator](Operator) like any other: its throttle is `u_human`.
//! Where the robot shares control the plant receives something else, and [`Updates`] says whose
//! value is moved then. Its episodes are the rollouts it steered, in introduction and main
//! together. Chance comes from a stream for each rollout, so that a session that is taken up
//! again needs the table alone ([`Operator::learned`]).

mod params;
mod table;
mod traces;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

pub use params::{Params, Shows, Updates};
pub use table::{Cell, Throttle};

use super::{Feedback, Operator, Practice, View};
use crate::plant::mountain_car;
use crate::random::{Place, Purpose, stream};
use crate::signal::{End, Intent, State};
use table::Table;
use traces::Traces;

/// What Q-learning knows, and how it learns; its user says what happened.
#[derive(Clone, Debug)]
pub struct Agent {
    table: Table,
    traces: Option<Traces>,
    params: Params,
    /// The learning rate of this episode.
    beta: f64,
}

impl Agent {
    /// An agent that knows nothing yet, for a mountain car with the parameters `plant`.
    #[must_use]
    pub fn new(params: &Params, plant: &mountain_car::Params) -> Self {
        Self {
            table: Table::new(params, plant),
            traces: params.lambda.map(|lambda| Traces::new(params.gamma * lambda, params.values())),
            params: params.clone(),
            beta: params.beta(0),
        }
    }

    /// An episode begins, after that many.
    pub fn begin(&mut self, episodes: u32) {
        self.beta = self.params.beta(episodes);
        if let Some(traces) = &mut self.traces {
            traces.clear();
        }
    }

    /// The cell that `state` lies in.
    #[inline]
    #[must_use]
    pub fn cell(&self, state: &State) -> Cell {
        self.table.cell(state)
    }

    /// The throttle with the largest value in `cell`, the lowest of equals (eq. 34).
    #[inline]
    #[must_use]
    pub fn best(&self, cell: Cell) -> Throttle {
        self.table.best(cell)
    }

    /// The best throttle, or now and then any (ε-greedy).
    #[inline]
    pub fn choose(&self, cell: Cell, chance: &mut ChaCha8Rng) -> Throttle {
        if chance.random::<f64>() < self.params.epsilon {
            Throttle::ALL[chance.random_range(0..Throttle::ALL.len())]
        } else {
            self.best(cell)
        }
    }

    /// The value of `throttle` in `cell`: the return that is expected of it.
    #[inline]
    #[must_use]
    pub fn value(&self, cell: Cell, throttle: Throttle) -> f64 {
        self.table.value(cell, throttle)
    }

    /// The values of all cells: those of one position stand together, by velocity.
    #[must_use]
    pub fn values(&self) -> &[[f64; 3]] {
        self.table.values()
    }

    /// Learns that `throttle` in `cell` brought `reward` and led to the cell `next`, or to the
    /// end of everything (eq. 33). What is no number is not learned.
    #[inline]
    pub fn learn(&mut self, cell: Cell, throttle: Throttle, reward: f64, next: Option<Cell>) {
        let to_come = next.map_or(0.0, |next| self.params.gamma * self.table.most(next));
        let error = reward + to_come - self.table.value(cell, throttle);
        if !error.is_finite() {
            return;
        }
        let change = self.beta * error;
        match &mut self.traces {
            None => self.table.add(cell, throttle, change),
            Some(traces) => {
                let is_on_policy = self.table.is_best(cell, throttle);
                traces.visit(Table::place(cell, throttle), is_on_policy);
                for (place, part) in traces.iter() {
                    self.table.add_at(place, change * part);
                }
            }
        }
    }
}

/// The agent as the operator of a session.
#[derive(Clone, Debug)]
pub struct QLearner {
    agent: Agent,
    seed: u64,
    chance: ChaCha8Rng,
    throttle_limit: f64,
    /// What it wants in which cell, until it is told what came of it: a countdown asks often,
    /// and chance must not depend on that.
    decided: Option<(Cell, Throttle)>,
    /// The state that it was told of last, and its cell: it is mostly the one that comes next.
    reached: Option<(State, Cell)>,
}

impl QLearner {
    /// An agent that knows nothing yet, for a mountain car with the parameters `plant`. `seed`
    /// decides what it tries.
    #[must_use]
    pub fn new(params: &Params, seed: u64, plant: &mountain_car::Params) -> Self {
        Self {
            agent: Agent::new(params, plant),
            seed,
            chance: stream(seed, Purpose::Exploration, Place::default()),
            throttle_limit: plant.throttle_limit,
            decided: None,
            reached: None,
        }
    }

    /// The cell of `state`.
    fn cell(&self, state: &State) -> Cell {
        match &self.reached {
            Some((reached, cell)) if reached == state => *cell,
            _ => self.agent.cell(state),
        }
    }

    /// What it knows.
    #[must_use]
    pub const fn agent(&self) -> &Agent {
        &self.agent
    }

    /// The throttle whose value a tick moves.
    fn learned_throttle(&self, own: Throttle, feedback: &Feedback<'_>) -> Throttle {
        match self.agent.params.updates {
            Updates::Own => own,
            Updates::Executed => Throttle::nearest(feedback.applied.0 / self.throttle_limit),
        }
    }
}

impl Operator for QLearner {
    fn begin(&mut self, place: Place, practice: Practice) {
        self.agent.begin(practice.rollouts);
        self.chance = stream(self.seed, Purpose::Exploration, place);
        self.decided = None;
    }

    fn intent(&mut self, view: View<'_>) -> Intent {
        let cell = self.cell(view.state);
        let throttle = match self.decided {
            Some((decided_in, throttle)) if decided_in == cell => throttle,
            _ => self.agent.choose(cell, &mut self.chance),
        };
        self.decided = Some((cell, throttle));
        Intent::fresh(throttle.part() * self.throttle_limit)
    }

    fn shown(&self, wanted: Intent) -> Intent {
        match (self.agent.params.shows, self.decided) {
            (Shows::Best, Some((cell, _))) => {
                Intent::fresh(self.agent.best(cell).part() * self.throttle_limit)
            }
            _ => wanted,
        }
    }

    fn told(&mut self, feedback: &Feedback<'_>) {
        let Some((cell, own)) = self.decided.take() else { return };
        if feedback.is_frozen || !feedback.next.is_finite() {
            return;
        }
        let throttle = self.learned_throttle(own, feedback);
        let is_over = feedback.end == Some(End::Goal);
        let next = (!is_over).then(|| self.agent.cell(feedback.next));
        self.reached = next.map(|cell| (*feedback.next, cell));
        self.agent.learn(cell, throttle, feedback.reward, next);
    }

    /// The values that are no longer the initial one, each after its place in the table.
    fn learned(&self) -> Vec<f64> {
        self.agent.table.changed()
    }

    fn recall(&mut self, learned: &[f64]) -> bool {
        self.decided = None;
        self.agent.table.recall(learned)
    }
}

#[cfg(test)]
#[path = "q_learning/tests.rs"]
mod tests;
