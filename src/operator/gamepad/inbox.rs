//! What one listener has not heard yet. It never loses where a stick is or that a button was
//! pressed, however long nobody listens.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use super::pads::{Event, least};
use crate::signal::Seconds;

/// An event and when it was heard.
pub type Heard = (Event, Seconds);

/// Buttons pressed and pads plugged in while nobody listened: no hand makes more.
const MOST: usize = 4096;

/// The listener's end; clones are the same.
#[derive(Clone, Debug, Default)]
pub struct Inbox(Arc<(Mutex<VecDeque<Heard>>, Condvar)>);

/// The teller's end; it does not keep the listener alive.
#[derive(Clone, Debug)]
pub struct Outbox(Weak<(Mutex<VecDeque<Heard>>, Condvar)>);

impl Inbox {
    /// The other end.
    #[must_use]
    pub fn outbox(&self) -> Outbox {
        Outbox(Arc::downgrade(&self.0))
    }

    /// The next event that is there already.
    #[must_use]
    pub fn next(&self) -> Option<Heard> {
        lock(&self.0.0).pop_front()
    }

    /// The next event, for which it waits as long as `patience`.
    #[must_use]
    pub fn wait(&self, patience: Duration) -> Option<Heard> {
        let (waiting, bell) = &*self.0;
        let is_empty = |waiting: &mut VecDeque<Heard>| waiting.is_empty();
        let (mut waiting, _) = bell
            .wait_timeout_while(lock(waiting), patience, is_empty)
            .unwrap_or_else(PoisonError::into_inner);
        waiting.pop_front()
    }
}

impl Outbox {
    /// Puts `event` into the inbox. False once nobody listens any more.
    pub fn put(&self, event: &Event, now: Seconds) -> bool {
        let Some(inbox) = self.0.upgrade() else { return false };
        let mut waiting = lock(&inbox.0);
        if !follow(&mut waiting, event, now) {
            waiting.push_back((event.clone(), now));
            if waiting.len() > MOST {
                let oldest = least(waiting.iter().map(|(event, _)| event));
                waiting.remove(oldest);
            }
        }
        inbox.1.notify_one();
        true
    }
}

/// Lets an axis that waits already, with nothing else after it, go on to where it is now.
fn follow(waiting: &mut VecDeque<Heard>, event: &Event, now: Seconds) -> bool {
    let Event::Axis { pad, axis, value } = event else { return false };
    for (earlier, at) in waiting.iter_mut().rev() {
        match earlier {
            Event::Axis { pad: of, axis: known, value: old } => {
                if *of == *pad && *known == *axis {
                    (*old, *at) = (*value, now);
                    return true;
                }
            }
            _ => return false,
        }
    }
    false
}

fn lock(waiting: &Mutex<VecDeque<Heard>>) -> MutexGuard<'_, VecDeque<Heard>> {
    waiting.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::super::Params;
    use super::super::map::{Axis, Button};
    use super::super::pads::{About, Id, Pads};
    use super::*;
    use crate::operator::{News, Request, Switch};

    #[test]
    fn nobody_listens_for_long_and_neither_the_centre_nor_the_stop_is_lost() {
        let inbox = Inbox::default();
        let outbox = inbox.outbox();
        let now = Seconds(0.0);
        let (name, mapping) = ("Pad".to_owned(), String::new());
        let about = About { id: Id(0), name, guid: String::new(), mapping };
        outbox.put(&Event::Connected(about), now);
        let axis = |value| Event::Axis { pad: Id(0), axis: Axis::LeftStickX, value };
        let button = |is_pressed| Event::Button { pad: Id(0), button: Button::East, is_pressed };
        outbox.put(&axis(0.0), now);
        for k in 0..100_000_u32 {
            outbox.put(&axis(f64::from(k % 100) / 100.0), now);
            let y = Event::Axis { pad: Id(0), axis: Axis::LeftStickY, value: 0.5 };
            outbox.put(&y, now);
        }
        for event in [button(true), button(false), axis(0.0)] {
            outbox.put(&event, now);
        }
        let mut pads = Pads::new(&Params::default());
        let mut count = 0;
        while let Some((event, at)) = inbox.next() {
            pads.take(event, at);
            count += 1;
        }
        assert!(count < 10, "{count}");
        assert_eq!(pads.deflection(), Some(0.0));
        let asked = std::iter::from_fn(|| pads.next_news());
        assert!(asked.into_iter().any(|news| news == News::Asks(Request::Stop)));
        for _ in 0..3 * MOST {
            outbox.put(&button(true), now);
        }
        assert_eq!(std::iter::from_fn(|| inbox.next()).count(), MOST);
        drop(inbox);
        assert!(!outbox.put(&axis(0.0), now));
    }

    /// A press that was heard has its release still to come, whatever else fills the inbox.
    #[test]
    fn a_hand_that_let_go_is_never_lost_in_a_flood() {
        let inbox = Inbox::default();
        let outbox = inbox.outbox();
        let now = Seconds(0.0);
        let about = |id| {
            let (name, mapping) = ("Pad".to_owned(), String::new());
            Event::Connected(About { id: Id(id), name, guid: String::new(), mapping })
        };
        let button = |button, is_pressed| Event::Button { pad: Id(0), button, is_pressed };
        let mut pads = Pads::new(&Params::default());
        pads.take(about(0), now);
        pads.take(button(Button::LeftTrigger, true), now);
        assert_eq!(pads.switch(), Switch::Held);
        outbox.put(&button(Button::LeftTrigger, false), now);
        for id in 1..=u32::try_from(2 * MOST).unwrap() {
            outbox.put(&about(id), now);
            outbox.put(&button(Button::South, true), now);
        }
        while let Some((event, at)) = inbox.next() {
            pads.take(event, at);
        }
        assert_eq!(pads.switch(), Switch::Free);
    }

    #[test]
    fn one_who_waits_hears_what_comes_and_no_longer() {
        let inbox = Inbox::default();
        assert_eq!(inbox.wait(Duration::ZERO), None);
        let outbox = inbox.outbox();
        let told = std::thread::spawn(move || {
            outbox.put(&Event::Disconnected(Id(1)), Seconds(1.0));
        });
        let heard = inbox.wait(Duration::from_mins(1));
        assert_eq!(heard, Some((Event::Disconnected(Id(1)), Seconds(1.0))));
        told.join().unwrap();
    }
}
