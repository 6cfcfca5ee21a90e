//! A session as another terminal of the same user sees it: read-only, through a Unix socket.
//!
//! ```text
//! control ─ snapshot ─▶ board ◀─ looks, 30 times a second ─ Post ─ lines ─▶ socket ─▶ Following
//! ```
//!
//! The control thread does nothing for it: a [`Post`] looks at the board as the screen does, from a
//! thread of its own, and writes without ever waiting. Whoever reads too slowly misses pictures.
//! Nothing is read from the socket, so that nobody can move a session through it.

#[cfg(unix)]
mod follow;
pub mod line;
#[cfg(unix)]
mod place;
#[cfg(unix)]
mod post;

#[cfg(unix)]
pub use follow::{Following, Found};
#[cfg(unix)]
pub use place::Place;
#[cfg(unix)]
pub use post::Post;

use std::io;
use std::path::PathBuf;

/// Why a session cannot be watched.
#[derive(Debug, thiserror::Error)]
pub enum WatchError {
    /// No folder of this user's own can be had.
    #[error(
        "no folder for the socket: {0}; set XDG_RUNTIME_DIR to a folder that only you may enter"
    )]
    NoFolder(String),
    /// The system refused.
    #[error("cannot {action} {path}: {cause}")]
    Io {
        /// What was tried.
        action: &'static str,
        /// On what.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// What is to be said of the session has no text.
    #[error("the session's facts have no JSON: {0}")]
    NoText(#[from] serde_json::Error),
}
