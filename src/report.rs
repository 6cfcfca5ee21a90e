//! What came out: measures of rollouts, and the report of any set of sessions and studies.
//!
//! ```text
//! folders ─ gather ─▶ sessions, studies, what was left out
//!                          │ session, pair, portrait, group, studies: what the thesis shows
//!                          ▼
//!           figure: plain data with units, a sentence and a preset
//!             │ draw: SVG   │ html: one page   │ text: tables and sparklines   (and the screen)
//! ```
//!
//! Rollouts of a subject are never taken for subjects: every number of a group is first the
//! subject's own mean. Presets are never pooled, nor are sessions whose profiles differ.

pub mod achieved;
pub mod compose;
pub mod draw;
pub mod figure;
pub mod gather;
pub mod group;
pub mod html;
pub mod metrics;
pub mod pair;
pub mod portrait;
pub mod series;
pub mod session;
pub mod spread;
pub mod statistics;
pub mod studies;
pub mod text;
mod words;
