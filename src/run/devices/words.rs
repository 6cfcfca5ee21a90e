//! What is plugged in, in sentences.

use crate::backend::serial::ports::Port;
use crate::tui::devices::{Gamepad, Survey};

/// The survey for people, with every line that mends a problem on a line of its own.
pub(super) fn sentences(survey: &Survey) -> Vec<String> {
    let mut lines = vec!["gamepads".to_owned()];
    lines.extend(survey.gamepads.iter().flat_map(gamepad));
    let is_heard = |name: &str| survey.gamepads.iter().any(|pad| pad.name == name);
    for node in survey.gamepad_nodes.iter().filter(|node| !is_heard(&node.name)) {
        let rights = node.rights.words();
        lines.push(format!("  {}, not heard: {}, rights {rights}", node.name, node.path));
    }
    if lines.len() == 1 {
        lines.push("  none".to_owned());
    }
    lines.push("serial ports".to_owned());
    lines.extend(survey.serial_ports.iter().map(port));
    if survey.serial_ports.is_empty() {
        lines.push("  none".to_owned());
    }
    lines.push("terminal".to_owned());
    let terminal = &survey.terminal;
    let term = terminal.abilities.term.as_deref().unwrap_or("not set");
    let size = terminal.abilities.size.map_or_else(String::new, |(w, h)| format!(", {w}×{h}"));
    let utf8 = if terminal.utf8 { ", UTF-8" } else { "" };
    lines.push(format!("  TERM {term}{size}{utf8}"));
    if terminal.asked {
        lines.extend(terminal.abilities.sentences().iter().map(|words| format!("  {words}")));
    } else {
        lines.push("  not asked, for standard input is none".to_owned());
    }
    lines.push(match survey.problems.len() {
        0 => "nothing is in the way".to_owned(),
        _ => "what is in the way, and what mends it".to_owned(),
    });
    for problem in &survey.problems {
        lines.push(format!("  {}: {}", problem.about.word(), problem.what));
        lines.extend(problem.mend.lines().map(|line| format!("      {line}")));
    }
    lines
}

fn gamepad(pad: &Gamepad) -> Vec<String> {
    let steers = if pad.steers { ", steers" } else { "" };
    let node = pad.node.as_deref().unwrap_or("its device is not known");
    let rights = pad.rights.map_or("", |rights| rights.words());
    vec![
        format!("  {}{steers}: {}, {node} {rights}", pad.name, pad.mapping),
        format!("      GUID {}, steering axis {}", pad.guid, pad.steering.axis),
    ]
}

fn port(port: &Port) -> String {
    let usb = port.usb.as_ref().map_or_else(String::new, |usb| {
        let serial = usb.serial.as_ref().map_or(String::new(), |serial| format!(" {serial}"));
        format!(", USB {:04x}:{:04x}{serial}", usb.vendor, usb.product)
    });
    let by_id =
        port.by_id.as_ref().map_or_else(String::new, |name| format!(", /dev/serial/by-id/{name}"));
    format!("  {}{usb}{by_id}, rights {}", port.path, port.rights.words())
}
