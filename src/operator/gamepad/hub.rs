//! The pads at this computer: one thread hears them all, for as long as the program runs.

use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::feel::Feel;
use super::inbox::{Inbox, Outbox};
use super::pads::{About, Event, Id};
use crate::clock::WallClock;
use crate::signal::Seconds;

/// Why no pad can be heard.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoPads {
    /// This program was built without them.
    #[error("this coadapt was built without gamepads (feature `gamepad`)")]
    NotBuilt,
    /// The system offers no way to them.
    #[error("gamepads cannot be reached ({0}); coadapt devices tells what to do")]
    System(String),
}

/// Things to be felt that wait for the pads' thread.
#[cfg_attr(not(feature = "gamepad"), expect(dead_code, reason = "nothing can be felt"))]
const FEELS: usize = 16;

/// The pads' thread, as others see it; clones are the same.
#[derive(Clone, Debug)]
pub struct Hub {
    listeners: Arc<Mutex<Listeners>>,
    feels: SyncSender<(Id, Feel)>,
}

#[derive(Debug, Default)]
struct Listeners {
    /// The pads that are plugged in.
    present: Vec<About>,
    outboxes: Vec<Outbox>,
    /// When the thread looked at the pads last; `None` before it did.
    looked_at: Option<Seconds>,
    /// Nobody wants this thread any more: another with other mappings took its place.
    is_over: bool,
}

impl Hub {
    /// The hub of this process, whose events carry times of `clock`; started at the first
    /// call, and anew for other `sdl_mappings`.
    ///
    /// # Errors
    /// When the system offers no way to pads. A computer without any pad is no error.
    pub fn open(clock: WallClock, sdl_mappings: &[String]) -> Result<Self, NoPads> {
        static OPEN: Mutex<Option<(Vec<String>, Hub)>> = Mutex::new(None);
        let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
        match &*open {
            Some((mappings, hub)) if mappings == sdl_mappings => return Ok(hub.clone()),
            Some((_, other)) => other.listeners().is_over = true,
            None => {}
        }
        *open = None;
        let hub = start(clock, sdl_mappings)?;
        *open = Some((sdl_mappings.to_vec(), hub.clone()));
        Ok(hub)
    }

    /// From now on hears everything, beginning with the pads that are there.
    #[must_use]
    pub fn listen(&self, now: Seconds) -> Inbox {
        let inbox = Inbox::default();
        let mut listeners = self.listeners();
        for about in &listeners.present {
            inbox.outbox().put(&Event::Connected(about.clone()), now);
        }
        listeners.outboxes.push(inbox.outbox());
        inbox
    }

    /// How long ago the thread looked at the pads; for ever, where it never did.
    #[must_use]
    pub fn age(&self, now: Seconds) -> Seconds {
        self.listeners().looked_at.map_or(Seconds(f64::INFINITY), |at| now - at)
    }

    /// Lets the hand at `pad` feel something. A pad that cannot shake stays still.
    pub fn feel(&self, pad: Id, feel: Feel) {
        let _ = self.feels.try_send((pad, feel));
    }

    fn listeners(&self) -> MutexGuard<'_, Listeners> {
        self.listeners.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Listeners {
    /// Passes an event on to everyone who still listens.
    #[cfg_attr(not(feature = "gamepad"), expect(dead_code, reason = "there are no events"))]
    fn tell(&mut self, event: &Event, now: Seconds) {
        match event {
            Event::Connected(about) => {
                self.present.retain(|known| known.id != about.id);
                self.present.push(about.clone());
            }
            Event::Disconnected(id) => self.present.retain(|known| known.id != *id),
            Event::Axis { .. } | Event::Button { .. } => {}
        }
        self.outboxes.retain(|outbox| outbox.put(event, now));
    }
}

#[cfg(not(feature = "gamepad"))]
fn start(_clock: WallClock, _sdl_mappings: &[String]) -> Result<Hub, NoPads> {
    Err(NoPads::NotBuilt)
}

#[cfg(feature = "gamepad")]
use worker::start;

#[cfg(feature = "gamepad")]
mod worker {
    use std::fmt::Write as _;
    use std::sync::mpsc::{Receiver, sync_channel};
    use std::sync::{Arc, Mutex};
    use std::time::Duration;

    use gilrs::ff::{BaseEffect, BaseEffectType, Effect, EffectBuilder, Repeat, Replay, Ticks};
    use gilrs::{EventType, GamepadId, Gilrs, GilrsBuilder, MappingSource};

    use super::super::feel::Feel;
    use super::super::map::{Axis, Button};
    use super::super::pads::{About, Event, Id};
    use super::{FEELS, Hub, Listeners, NoPads};
    use crate::clock::{Clock, WallClock};
    use crate::signal::Seconds;

    /// How long the thread sleeps where no pad wakes it.
    const PATIENCE: Duration = Duration::from_millis(20);
    /// A wait shorter than this that brought nothing was none: a pad vanished without a word.
    const NO_WAIT: Seconds = Seconds(0.002);

    /// Starts the thread.
    pub(super) fn start(clock: WallClock, sdl_mappings: &[String]) -> Result<Hub, NoPads> {
        // As it comes from the pad: what is no movement of the hand is for the shape to say.
        let gilrs = GilrsBuilder::new()
            .with_default_filters(false)
            .add_included_mappings(true)
            .add_env_mappings(true)
            .add_mappings(&sdl_mappings.join("\n"))
            .build()
            .map_err(|error| NoPads::System(error.to_string()))?;
        let (sender, feels) = sync_channel(FEELS);
        let listeners = Arc::new(Mutex::new(Listeners::default()));
        let hub = Hub { listeners, feels: sender };
        let told = hub.clone();
        std::thread::Builder::new()
            .name("coadapt-gamepad".to_owned())
            .spawn(move || Worker { gilrs, hub: told, clock, steady: None }.run(&feels))
            .map_err(|error| NoPads::System(error.to_string()))?;
        Ok(hub)
    }

    struct Worker {
        gilrs: Gilrs,
        hub: Hub,
        clock: WallClock,
        /// The steady shaking under way, and at which pad.
        steady: Option<(GamepadId, Effect)>,
    }

    impl Worker {
        fn run(mut self, feels: &Receiver<(Id, Feel)>) {
            // Pads that are there from the start have no event of their own.
            let there: Vec<_> = self.gilrs.gamepads().map(|(id, _)| id).collect();
            for id in there {
                let event = Event::Connected(self.about(id));
                self.hub.listeners().tell(&event, self.clock.now());
            }
            while !self.hub.listeners().is_over {
                let before = self.clock.now();
                self.hub.listeners().looked_at = Some(before);
                let next = self.gilrs.next_event_blocking(Some(PATIENCE));
                let now = self.clock.now();
                match next {
                    Some(event) => {
                        if let Some(event) = self.translate(event.id, event.event) {
                            self.hub.listeners().tell(&event, now);
                        }
                    }
                    None if now - before < NO_WAIT => {
                        self.clock.wait_until(now + Seconds(PATIENCE.as_secs_f64()));
                    }
                    None => {}
                }
                while let Ok((pad, feel)) = feels.try_recv() {
                    self.feel(pad, feel);
                }
            }
        }

        fn translate(&self, id: GamepadId, event: EventType) -> Option<Event> {
            let pad = number(id);
            let code = |code: gilrs::ev::Code| code.into_u32();
            Some(match event {
                EventType::Connected => Event::Connected(self.about(id)),
                EventType::Disconnected => Event::Disconnected(pad),
                EventType::AxisChanged(named, value, by) => Event::Axis {
                    pad,
                    axis: axis(named).unwrap_or(Axis::Code(code(by))),
                    value: f64::from(value),
                },
                EventType::ButtonPressed(named, by) => Event::Button {
                    pad,
                    button: button(named).unwrap_or(Button::Code(code(by))),
                    is_pressed: true,
                },
                EventType::ButtonReleased(named, by) => Event::Button {
                    pad,
                    button: button(named).unwrap_or(Button::Code(code(by))),
                    is_pressed: false,
                },
                _ => return None,
            })
        }

        fn about(&self, id: GamepadId) -> About {
            let pad = self.gilrs.gamepad(id);
            let mut guid = String::new();
            for byte in pad.uuid() {
                // Writing to a string cannot fail.
                let _ = write!(guid, "{byte:02x}");
            }
            let mapping = match pad.mapping_source() {
                MappingSource::SdlMappings => "SDL mapping",
                MappingSource::Driver => "the driver's mapping",
                MappingSource::None => "no mapping",
            };
            About { id: number(id), name: pad.name().to_owned(), guid, mapping: mapping.to_owned() }
        }

        /// A pad that cannot shake, or is gone, is no fault: the hand just feels nothing.
        fn feel(&mut self, pad: Id, feel: Feel) {
            let found = self.gilrs.gamepads().find(|(id, _)| number(*id) == pad);
            let Some((id, _)) = found.filter(|(_, pad)| pad.is_ff_supported()) else { return };
            match feel {
                Feel::Pulse { strength, lasting } => {
                    let play_for = Ticks::from_ms(millis(lasting));
                    let kind = BaseEffectType::Strong { magnitude: magnitude(strength) };
                    let scheduling = Replay { play_for, ..Replay::default() };
                    let effect = EffectBuilder::new()
                        .add_effect(BaseEffect { kind, scheduling, ..BaseEffect::default() })
                        .repeat(Repeat::For(play_for))
                        .gamepads(&[id])
                        .finish(&mut self.gilrs);
                    // It stops by itself; a handle that is dropped would stop it at once.
                    if let Ok(effect) = effect {
                        let _ = effect.play();
                        self.keep(effect, lasting);
                    }
                }
                Feel::Steady { strength } => self.shake(id, strength),
            }
        }

        /// Holds a pulse's handle for as long as it plays.
        fn keep(&self, effect: Effect, lasting: Seconds) {
            let (mut clock, end) = (self.clock, self.clock.now() + lasting);
            let wait = move || {
                clock.wait_until(end + Seconds(0.1));
                drop(effect);
            };
            let _ = std::thread::Builder::new().name("coadapt-pulse".to_owned()).spawn(wait);
        }

        fn shake(&mut self, id: GamepadId, strength: f64) {
            #[expect(clippy::cast_possible_truncation, reason = "a part of 1")]
            let gain = strength.clamp(0.0, 1.0) as f32;
            if let Some((at, effect)) = &self.steady
                && *at == id
            {
                let _ = effect.set_gain(gain);
                return;
            }
            let kind = BaseEffectType::Weak { magnitude: u16::MAX };
            let scheduling = Replay { play_for: Ticks::from_ms(1000), ..Replay::default() };
            let effect = EffectBuilder::new()
                .add_effect(BaseEffect { kind, scheduling, ..BaseEffect::default() })
                .repeat(Repeat::Infinitely)
                .gain(gain)
                .gamepads(&[id])
                .finish(&mut self.gilrs);
            if let Ok(effect) = effect {
                let _ = effect.play();
                self.steady = Some((id, effect));
            }
        }
    }

    fn number(id: GamepadId) -> Id {
        Id(u32::try_from(usize::from(id)).unwrap_or(u32::MAX))
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    fn magnitude(strength: f64) -> u16 {
        (strength.clamp(0.0, 1.0) * f64::from(u16::MAX)) as u16
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    fn millis(time: Seconds) -> u32 {
        (time.0 * 1000.0) as u32
    }

    fn axis(named: gilrs::Axis) -> Option<Axis> {
        Some(match named {
            gilrs::Axis::LeftStickX => Axis::LeftStickX,
            gilrs::Axis::LeftStickY => Axis::LeftStickY,
            gilrs::Axis::LeftZ => Axis::LeftZ,
            gilrs::Axis::RightStickX => Axis::RightStickX,
            gilrs::Axis::RightStickY => Axis::RightStickY,
            gilrs::Axis::RightZ => Axis::RightZ,
            gilrs::Axis::DPadX => Axis::DPadX,
            gilrs::Axis::DPadY => Axis::DPadY,
            gilrs::Axis::Unknown => return None,
        })
    }

    fn button(named: gilrs::Button) -> Option<Button> {
        Some(match named {
            gilrs::Button::South => Button::South,
            gilrs::Button::East => Button::East,
            gilrs::Button::North => Button::North,
            gilrs::Button::West => Button::West,
            gilrs::Button::C => Button::C,
            gilrs::Button::Z => Button::Z,
            gilrs::Button::LeftTrigger => Button::LeftTrigger,
            gilrs::Button::LeftTrigger2 => Button::LeftTrigger2,
            gilrs::Button::RightTrigger => Button::RightTrigger,
            gilrs::Button::RightTrigger2 => Button::RightTrigger2,
            gilrs::Button::Select => Button::Select,
            gilrs::Button::Start => Button::Start,
            gilrs::Button::Mode => Button::Mode,
            gilrs::Button::LeftThumb => Button::LeftThumb,
            gilrs::Button::RightThumb => Button::RightThumb,
            gilrs::Button::DPadUp => Button::DPadUp,
            gilrs::Button::DPadDown => Button::DPadDown,
            gilrs::Button::DPadLeft => Button::DPadLeft,
            gilrs::Button::DPadRight => Button::DPadRight,
            gilrs::Button::Unknown => return None,
        })
    }
}
