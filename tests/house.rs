//! The rules of the house: what imports what, and what is named where.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking, helpers too")]

use std::collections::HashMap;
use std::fs;
use std::path::Path;

/// A file of `src`.
struct Source {
    /// Its path within `src` without the ending, such as `plant/cart_pole`.
    name: String,
    text: String,
}

impl Source {
    fn room(&self) -> &str {
        self.name.split('/').next().unwrap()
    }

    /// The lines without comments.
    fn code(&self) -> String {
        let line = |line: &str| line.split("//").next().unwrap_or("").to_owned() + "\n";
        self.text.lines().map(line).collect()
    }

    /// The number of lines above the unit tests.
    fn length(&self) -> usize {
        self.text.lines().take_while(|line| *line != "mod tests {").count()
    }

    /// Whether this file is one of `places` or lies below one.
    fn is_in(&self, places: &[&str]) -> bool {
        let below = |place: &&str| {
            self.name
                .strip_prefix(*place)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        places.iter().any(below)
    }

    /// The paths that this file takes from the crate's root, such as `signal::State`.
    fn imports(&self) -> Vec<String> {
        let code = self.code();
        let root = if self.name == "main" { "coadapt::" } else { "crate::" };
        let mut imports: Vec<String> = code
            .match_indices(root)
            .flat_map(|(at, _)| paths(&code[at + root.len()..]).0)
            .collect();
        // In a room's own file, `super` is the root as well.
        if !self.name.contains('/') {
            imports.extend(code.match_indices("super::").flat_map(|(at, _)| {
                let above_tests = code.find("mod tests {").is_none_or(|tests| at < tests);
                if above_tests { paths(&code[at + "super::".len()..]).0 } else { Vec::new() }
            }));
        }
        imports
    }
}

/// The paths that a use tree, or the path at the start of `text`, stands for, and the text
/// after it: `a::{b, c::d as e}` is `a::b` and `a::c::d`.
fn paths(text: &str) -> (Vec<String>, &str) {
    if let Some(group) = text.strip_prefix('{') {
        let mut found = Vec::new();
        let mut rest = group.trim_start();
        while !rest.starts_with('}') {
            let (inner, after) = paths(rest);
            found.extend(inner);
            rest = &after[after.find([',', '}']).unwrap()..];
            rest = rest.trim_start_matches(',').trim_start();
        }
        return (found, &rest[1..]);
    }
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let end = text.find(|c| !is_part(c)).unwrap_or(text.len());
    let (name, rest) = text.split_at(end);
    match rest.strip_prefix("::") {
        Some(rest) => {
            let (inner, rest) = paths(rest);
            (inner.iter().map(|path| format!("{name}::{path}")).collect(), rest)
        }
        None => (vec![name.to_owned()], rest),
    }
}

fn sources() -> Vec<Source> {
    fn gather(folder: &Path, root: &Path, found: &mut Vec<Source>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                gather(&path, root, found);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let name = path.strip_prefix(root).unwrap().with_extension("");
                let name = name.to_str().unwrap().replace(std::path::MAIN_SEPARATOR, "/");
                found.push(Source { name, text: fs::read_to_string(&path).unwrap() });
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    gather(&root, &root, &mut found);
    assert!(found.len() > 50, "{} files", found.len());
    found
}

/// What each room may import, by the table in `lib.rs`: paths that an import begins with.
struct House {
    rooms: Vec<String>,
    allowed: HashMap<String, Vec<String>>,
}

impl House {
    fn of(lib: &str) -> Self {
        let (mut rooms, mut allowed, mut all) = (Vec::new(), HashMap::new(), Vec::new());
        let rows = lib.lines().filter_map(|line| line.strip_prefix("//! | "));
        for row in rows.skip_while(|row| !row.starts_with("---")).skip(1) {
            let cells: Vec<&str> = row.split('|').map(str::trim).collect();
            let &[room, _, imports, ""] = &cells[..] else { panic!("{row}") };
            let named: Vec<String> = quoted(imports);
            if room == "every room below" {
                all = named;
                continue;
            }
            let room = quoted(room).remove(0);
            for import in &named {
                let of = import.split("::").next().unwrap().to_owned();
                assert!(rooms.contains(&of), "{room} imports {of}, which is no room above it");
            }
            let named = if imports == "every room above" { rooms.clone() } else { named };
            allowed.insert(room.clone(), [named, all.clone()].concat());
            rooms.push(room);
        }
        Self { rooms, allowed }
    }

    /// The imports of `source` that its room's row does not list.
    fn breaches(&self, source: &Source) -> Vec<String> {
        let room = source.room();
        let allowed = self.allowed.get(room).unwrap_or_else(|| panic!("no row for {room}"));
        let is_free = |import: &String| {
            let first = import.split("::").next().unwrap();
            let within = |path: &str| format!("{import}::").starts_with(&format!("{path}::"));
            // What is no room is a part of the own one, or a macro.
            first == room
                || !self.rooms.iter().any(|known| known == first)
                || allowed.iter().any(|path| within(path))
        };
        let breach = |import| format!("{} imports {import}", source.name);
        source.imports().into_iter().filter(|import| !is_free(import)).map(breach).collect()
    }
}

/// The words in `backticks`.
fn quoted(text: &str) -> Vec<String> {
    text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

fn house() -> House {
    let sources = sources();
    House::of(&sources.iter().find(|source| source.name == "lib").unwrap().text)
}

#[test]
fn rooms_import_only_what_the_table_lists() {
    let house = house();
    let breaches: Vec<String> = sources()
        .iter()
        .filter(|source| source.name != "lib")
        .flat_map(|source| house.breaches(source))
        .collect();
    assert!(breaches.is_empty(), "not in the table of src/lib.rs:\n{}", breaches.join("\n"));
}

#[test]
fn breaches_are_found_in_every_form() {
    let house = house();
    let breaches = |name: &str, text: &str| {
        let (name, text) = (name.to_owned(), text.to_owned());
        house.breaches(&Source { name, text }).len()
    };
    assert_eq!(breaches("plant/pole", "use crate::task::Task;"), 1);
    assert_eq!(breaches("plant/pole", "let x = crate::task::new();"), 1);
    assert_eq!(breaches("plant", "use super::task::Task;"), 1);
    assert_eq!(breaches("plant", "use crate::{signal::{State, Action}, task, learner as l};"), 2);
    assert_eq!(
        breaches("plant", "use crate::{\n    task::{\n        A,\n    },\n    clock,\n};"),
        2
    );
    assert_eq!(breaches("tui/scene", "use crate::control::{snapshot::Snapshot, cycle};"), 1);
    assert_eq!(breaches("main", "coadapt::cli::parse(); coadapt::study::all();"), 1);
    assert_eq!(breaches("plant", "use crate::signal::State; // not crate::task"), 0);
    assert_eq!(breaches("run", "use crate::{cli, control::cycle, signal::*};"), 0);
}

#[test]
fn files_are_short_and_none_is_called_mod() {
    for source in sources() {
        let (name, length) = (&source.name, source.length());
        assert!(length <= 500, "{name} has {length} lines without its tests; split it");
        assert!(!name.ends_with("/mod"), "{name}: a room's file stands beside its folder");
    }
}

/// Words that only some places may use.
const RESERVED: [(&str, &[&str]); 8] = [
    ("ratatui::", &["tui"]),
    ("crossterm::", &["tui", "operator/terminal"]),
    ("gilrs::", &["operator/gamepad"]),
    ("indicatif::", &["run/fit/progress", "run/progress", "run/study/progress"]),
    ("kuva::", &["report/draw"]),
    ("serialport::", &["backend/serial", "backend/emulator"]),
    ("Instant::now", &["clock"]),
    ("SystemTime::now", &["clock"]),
];

#[test]
fn screens_devices_and_clocks_are_named_only_where_they_belong() {
    for source in sources() {
        let code = source.code();
        for (word, places) in RESERVED {
            let used = code.contains(word) && !source.is_in(places);
            assert!(!used, "{} names {word}, which belongs to {}", source.name, places.join(", "));
        }
    }
}
