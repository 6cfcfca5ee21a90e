//! coadapt: the terminal laboratory for simultaneous human–robot learning.
//!
//! A person steers a plant; a robot learns from that and takes over more of the controls
//! the better it goes: `u = w·u_h + (1 − w)·u_m`. One control cycle runs it all, at the
//! screen, without one, and in studies:
//!
//! ```text
//! backend ── state ─▶ operator ── u_h ─┐
//!    ▲          └───▶ learner ─── u_m ─┴▶ sharing ── u ─▶ backend (the plant or its model)
//!    │                   ▲                  ▲ w
//!    │                   └─── teaching ◀────┴── task: reward, success, end
//!    └─ session: rollouts, phases ── control: the cycle ──▶ record (files), snapshot (screen)
//! ```
//!
//! Newcomers read [`signal`] for what flows, [`sharing`] for the idea, [`learner`] for what
//! learns, and [`control`] for how a tick goes.
//!
//! # Rooms
//!
//! Each module here is a room: `room.rs`, with its parts in `room/`. A room imports from
//! those above it that its row names, and a test reads this table.
//!
//! | room | what lives there | may import |
//! | --- | --- | --- |
//! | `check` | ranges of parameters | |
//! | `random` | seeded streams of chance | |
//! | `signal` | state, features, action, time | |
//! | every room below | | `check`, `random`, `signal` |
//! | `host` | the computer: who is logged in, what may be opened | |
//! | `clock` | wall and virtual time; nobody else reads a clock | |
//! | `plant` | equations of motion | |
//! | `learner` | what the robot knows | |
//! | `sharing` | mixing, success, share, regions | |
//! | `teaching` | what the learner is given | |
//! | `session` | subjects, phases, rollouts, and their order | |
//! | `operator` | who steers: hands, scripts, simulated people, an agent | `plant`, `clock`, `host` |
//! | `task` | what a plant is used for | `plant`, `sharing` |
//! | `backend` | the plant, real or simulated, within its limits | `plant`, `clock`, `host` |
//! | `record` | the files of a session | `learner`, `session`, `clock`, `sharing` |
//! | `profile` | an experiment's parameters, from a file | `plant`, `learner`, `sharing`, `teaching`, `session`, `operator`, `task`, `backend`, `record` |
//! | `control` | the control cycle, and what others see of it | `clock`, `plant`, `learner`, `sharing`, `teaching`, `session`, `operator`, `task`, `backend`, `record` |
//! | `report` | measures, figures, tables, statistics: a page of sessions and studies | `record`, `task`, `learner`, `session`, `sharing` |
//! | `study` | many runs without a screen | `clock`, `plant`, `learner`, `sharing`, `teaching`, `session`, `operator`, `task`, `backend`, `record`, `profile`, `control`, `report` |
//! | `tui` | screens that draw plain data | `control::snapshot`, `control::recording`, `report`, `record`, `profile`, `session`, `task`, `operator`, `backend`, `sharing`, `learner`, `clock`, `host` |
//! | `cli` | the words of the command line | `learner`, `sharing`, `session`, `operator`, `backend`, `record`, `profile`, `study` |
//! | `run` | where everything is put together | every room above |
//! | `main` | the doorbell | `cli`, `run` |

pub mod backend;
pub mod check;
pub mod cli;
pub mod clock;
pub mod control;
pub mod host;
pub mod learner;
pub mod operator;
pub mod plant;
pub mod profile;
pub mod random;
pub mod record;
pub mod report;
pub mod run;
pub mod session;
pub mod sharing;
pub mod signal;
pub mod study;
pub mod task;
pub mod teaching;
pub mod tui;
