//! What gilrs sees: the gamepads that are there, then every event for ten seconds.
//!
//! ```sh
//! cargo run --release --example pads
//! ```

use std::error::Error;
use std::io::{self, Write};
use std::time::Duration;

use coadapt::clock::{Clock, WallClock};
use gilrs::{Gilrs, GilrsBuilder};

fn main() -> Result<(), Box<dyn Error>> {
    let mut out = io::stdout().lock();
    // As it comes from the pad: what is not a movement of the hand is for us to say.
    let built = GilrsBuilder::new()
        .with_default_filters(false)
        .add_included_mappings(true)
        .add_env_mappings(true)
        .build();
    let mut gilrs: Gilrs = match built {
        Ok(gilrs) => gilrs,
        Err(error) => return Err(error.to_string().into()),
    };
    writeln!(out, "{} gamepads", gilrs.gamepads().count())?;
    for (id, pad) in gilrs.gamepads() {
        let [source, power] = [&pad.mapping_source() as &dyn std::fmt::Debug, &pad.power_info()];
        writeln!(out, "{id}: {} ({}), {source:?}, {power:?}", pad.name(), pad.os_name())?;
    }
    let clock = WallClock::start();
    while clock.now().0 < 10.0 {
        if let Some(event) = gilrs.next_event_blocking(Some(Duration::from_millis(100))) {
            writeln!(out, "{}: {:?}", event.id, event.event)?;
        }
    }
    Ok(())
}
