//! Panics: the plant stops first, and words wait until the screen is gone.

use std::panic;
use std::sync::{Mutex, PoisonError};

use super::tell;
#[cfg(unix)]
use crate::backend::guard::last_resort;
use crate::tui::terminal::is_taken;

/// What is to be said once the terminal is given back.
static LAST_WORDS: Mutex<Option<String>> = Mutex::new(None);

/// From now on a panic in any thread stops a real plant before anything else is done.
pub(super) fn stop_the_plant_first() {
    let previous = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        #[cfg(unix)]
        last_resort::stop();
        if is_taken() {
            let name = std::thread::current().name().unwrap_or("unnamed").to_owned();
            tell_later(&format!("the thread {name} panicked: {info}"));
        } else {
            previous(info);
        }
    }));
}

/// Keeps words until the terminal was given back.
pub(super) fn tell_later(words: &str) {
    let mut last = LAST_WORDS.lock().unwrap_or_else(PoisonError::into_inner);
    *last = Some(last.take().map_or_else(|| words.to_owned(), |first| format!("{first}\n{words}")));
}

/// Tells what was kept, now that the terminal was given back.
pub(super) fn tell_last_words() {
    let kept = LAST_WORDS.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some(words) = kept {
        tell(&words);
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::io::{Read, pipe};

    use super::*;

    #[test]
    fn a_panic_in_any_thread_stops_the_plant() {
        let (mut heard, port) = pipe().unwrap();
        last_resort::arm(port.into(), b"stop");
        stop_the_plant_first();
        let died = std::thread::spawn(|| panic!("a thread that has nothing to do with it")).join();
        drop(panic::take_hook());
        assert!(died.is_err());
        assert!(last_resort::was_pulled());
        last_resort::disarm();
        let mut bytes = String::new();
        heard.read_to_string(&mut bytes).unwrap();
        assert!(bytes.starts_with("stop"), "{bytes:?}");
    }
}
