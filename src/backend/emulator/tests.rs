mod bench;
mod stm32;
mod wire_faults;

use super::super::wire::{
    Ack, Codec, Config, FirmwareConfig, Flags, Message, Order, Outcome, Refusal, StateFrame,
};
use super::faults::{Noise, Timed};
use super::rig::Sensor;
use super::*;

/// A host at an emulated device, on virtual time.
struct Lab {
    device: Emulator,
    host: Box<dyn Codec>,
    heard: Vec<Result<Message, Refusal>>,
    trace: Vec<Entry>,
}

impl Lab {
    fn with(params: &Params, faults: &Faults) -> Self {
        let device = Emulator::new(params, faults, 1);
        Self { device, host: params.format.codec(), heard: Vec::new(), trace: Vec::new() }
    }

    fn new(format: Format) -> Self {
        Self::with(&Params { format, ..Params::default() }, &Faults::default())
    }

    /// Writes `bytes` and lets `time` pass.
    fn write(&mut self, bytes: &[u8], time: f64) {
        let read = self.device.advance(self.device.now() + Seconds(time), bytes);
        self.host.take(&read);
        self.heard.extend(std::iter::from_fn(|| self.host.hear()));
        self.trace.extend(self.device.take_trace());
    }

    fn wait(&mut self, time: f64) {
        self.write(&[], time);
    }

    fn order(&mut self, order: Order, time: f64) {
        let mut bytes = Vec::new();
        self.host.encode(&order, &mut bytes).unwrap();
        self.write(&bytes, time);
    }

    fn states(&self) -> Vec<StateFrame> {
        let state = |heard: &Result<Message, Refusal>| match heard {
            Ok(Message::State(state)) => Some(*state),
            _ => None,
        };
        self.heard.iter().filter_map(state).collect()
    }

    fn last(&self) -> StateFrame {
        *self.states().last().unwrap()
    }

    fn acks(&self) -> Vec<Outcome> {
        let outcome = |heard: &Result<Message, Refusal>| match heard {
            Ok(Message::Ack(Ack { outcome, .. })) => Some(*outcome),
            _ => None,
        };
        self.heard.iter().filter_map(outcome).collect()
    }

    fn offences(&self) -> Vec<Offence> {
        self.device.offences().iter().map(|(_, offence)| *offence).collect()
    }

    fn commands(&self) -> Vec<i32> {
        let command = |entry: &Entry| match entry.event {
            Event::Motor { command, .. } => Some(command),
            _ => None,
        };
        self.trace.iter().filter_map(command).collect()
    }

    fn obeyed(&self) -> Vec<Request> {
        let order = |entry: &Entry| match entry.event {
            Event::Obeyed { order: Written::Sensorsini31(request) } => Some(request),
            _ => None,
        };
        self.trace.iter().filter_map(order).collect()
    }

    fn crashed(&self) -> bool {
        self.trace.iter().any(|entry| matches!(entry.event, Event::Crashed { .. }))
    }

    /// Writes requests while the board sends a state and cannot look at them.
    fn write_while_busy(&mut self, requests: &[Request]) {
        // Ticks come every 20 ms from 0 on, and a state takes 1.35 ms.
        let period = 0.02;
        let next = (self.device.now().0 / period).ceil() * period + 1e-4;
        self.wait(next - self.device.now().0);
        let mut bytes = Vec::new();
        for request in requests {
            request.encode(&mut bytes);
        }
        self.write(&bytes, 0.005);
    }
}

fn streaming() -> Lab {
    let mut lab = Lab::new(Format::Sensorsini31);
    lab.order(Order::Stream(true), 0.05);
    lab
}

fn firmware_config(period_ms: u16) -> Config {
    let firmware =
        FirmwareConfig { sync: true, angle_hanging: 1000.0, average: 1, correct_dynamics: false };
    Config { period_ms, firmware: Some(firmware) }
}
