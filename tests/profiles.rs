//! Profiles from the outside: what is shipped, what is wrong with bad ones, what edits keep.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test ends at its first surprise")]

use std::path::{Path, PathBuf};

use coadapt::backend::serial::scales;
use coadapt::plant::cart_pole;
use coadapt::profile::{
    Document, Experiment, Origin, Profile, ProfileError, WantedMode, list, show,
};
use proptest::prelude::*;

const BALANCE: &str = include_str!("../profiles/balance.ron");

fn nowhere() -> PathBuf {
    PathBuf::from("tests/data/no-such-folder")
}

fn balance() -> Document {
    Document::find("balance", &nowhere()).unwrap()
}

fn read(text: &str) -> Profile {
    Document::from_text("x.ron", text).read().unwrap_or_else(|report| panic!("{report}"))
}

fn message(document: &Document) -> String {
    document.read().unwrap_err().to_string()
}

/// Every `key: value` line of the shipped profile that is no section: key, value, comment.
fn key_lines(text: &str) -> Vec<(String, String, String)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut path: Vec<&str> = Vec::new();
    let mut keys = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let line = line.trim();
        if line.starts_with(')') {
            path.pop();
        } else if let Some((key, rest)) = line.split_once(": ").filter(|_| !line.starts_with("//"))
        {
            if rest == "(" {
                path.push(key);
                continue;
            }
            let words = |line: &&str| line.trim().strip_prefix("//").map(|c| c.trim().to_owned());
            let above: Vec<String> =
                lines[..index].iter().rev().map_while(words).collect::<Vec<_>>();
            let above = above.into_iter().rev().collect::<Vec<_>>().join(" ");
            // A comment goes on in the lines below, as far as they hold nothing else.
            let below = lines[index + 1..].iter().map_while(words).collect::<Vec<_>>().join(" ");
            let (value, comment) = match rest.split_once("//") {
                Some((value, comment)) => (value, format!("{} {below}", comment.trim())),
                None => (rest, above),
            };
            let value = value.trim().trim_end_matches(',');
            let key = path.iter().chain([&key]).copied().collect::<Vec<_>>().join(".");
            keys.push((key, value.to_owned(), comment));
        }
    }
    keys
}

/// The text of a task's plain profile.
fn plain(task: &str) -> String {
    std::fs::read_to_string(format!("profiles/{task}.ron")).unwrap()
}

#[test]
fn the_plain_profiles_are_their_tasks_defaults() {
    for task in Experiment::NAMES {
        assert_eq!(read(&plain(task)), read(&format!("(task: {task:?})")), "{task}");
    }
}

#[test]
fn scales_are_asked_for_by_the_inputs_names() {
    let mut document = Document::find("speed-up", &nowhere()).unwrap();
    document.set("rules.use_theta_dot", "true");
    let message = message(&document);
    assert!(message.contains("a list of 4, for x, x_dot, theta, theta_dot"), "{message}");
}

#[test]
fn an_unknown_region_of_teaching_is_refused_with_the_regions() {
    let text = "(task: \"swing-up\", teaching: (delay_regions: [\"top\"]))";
    let message = message(&Document::from_text("x.ron", text));
    assert!(message.contains("x.ron:1") && message.contains("teaching.delay_regions"), "{message}");
    assert!(message.contains("down_slow, down_fast, middle_slow"), "{message}");
}

#[test]
fn a_task_has_its_own_defaults_for_what_a_profile_leaves_out() {
    let short = read("(task: \"swing-up\", plant: (bounce: 0.1), sharing: (gate: 0.2))");
    let mut document = Document::find("swing-up", &nowhere()).unwrap();
    document.set("plant.bounce", "0.1");
    document.set("sharing.gate", "0.2");
    assert_eq!(short, document.read().unwrap());
}

#[test]
fn the_plain_profiles_hold_every_key_with_meaning_default_and_range() {
    for task in Experiment::NAMES {
        let keys = key_lines(&plain(task));
        let usual = key_lines(&read(&plain(task)).to_ron());
        assert!(usual.len() > 40);
        hold_every_key(task, &keys, &usual);
    }
}

/// The profiles of real plants.
const HARDWARE: [&str; 4] =
    ["cobs-cart-pole", "physical-balance", "physical-cart-pole", "physical-cart-pole-short"];

/// The keys below `backend` of a profile's lines.
fn of_backend(text: &str) -> Vec<(String, String, String)> {
    let mut keys = key_lines(text);
    keys.retain(|(key, _, _)| key.starts_with("backend."));
    keys
}

#[test]
fn the_hardware_profiles_hold_every_key_of_the_real_plant() {
    let usual = of_backend(&read("(task: \"swing-up\", backend: ())").to_ron());
    assert!(usual.len() > 40);
    for name in HARDWARE {
        hold_every_key(name, &of_backend(&plain(name)), &usual);
    }
}

/// Whether `comment` names this default: a number in any spelling, and an option as in text.
fn tells_default(comment: &str, default: &str) -> bool {
    let number = |word: &str| word.parse::<f64>().ok();
    let told = comment.split_once("default ").and_then(|(_, told)| told.split(';').next());
    comment.contains(&format!("default {default}"))
        || comment.contains(&format!("default Some({default})"))
        || told.and_then(number).is_some_and(|told| Some(told) == number(default))
}

/// Checks that `keys`, a part of the profile `name`, are all of the `usual` ones, each with the
/// usual value as its default and the range that is checked.
fn hold_every_key(
    name: &str,
    keys: &[(String, String, String)],
    usual: &[(String, String, String)],
) {
    for (key, default, _) in usual {
        let known = keys.iter().find(|(known, _, _)| known == key);
        let (_, _, comment) = known.unwrap_or_else(|| panic!("{name}: {key} is missing"));
        assert!(comment.contains("default"), "{name}: {key}: {comment:?}");
        let told = default.len() >= 60 || tells_default(comment, default);
        assert!(told, "{name}: {key}: {comment:?} but {default}");
    }
    for (key, _, comment) in keys {
        // The range in the comment is the one that is checked.
        for beyond in ["1e300", "4294967295", "2000000000", "65535"] {
            let mut document = Document::find(name, &nowhere()).unwrap();
            document.set(key, beyond);
            let Err(report) = document.read() else { continue };
            for fault in report.faults() {
                let allowed = fault.expected.strip_prefix("allowed: ");
                let range = allowed.filter(|words| words.starts_with(|c: char| c.is_ascii_digit()));
                if let Some(range) = range {
                    assert!(comment.contains(range), "{name}: {key}: {comment:?} but {range}");
                }
            }
        }
    }
}

/// A modern profile holds what differs, each key with the default that it differs from.
#[test]
fn the_modern_profiles_say_what_differs_from_the_plain_ones() {
    for task in Experiment::NAMES {
        let text = plain(&format!("{task}-modern"));
        assert_eq!(read(&text).preset, "modern");
        assert!(text.contains("Never pool sessions"), "{task}");
        says_what_differs(&text);
    }
}

/// So does one of a real plant, but for the section `backend`.
#[test]
fn the_hardware_profiles_say_what_differs_from_the_plain_ones() {
    for name in HARDWARE {
        says_what_differs(&plain(name));
    }
}

fn says_what_differs(text: &str) {
    let profile = read(text);
    let task = profile.experiment.name();
    let usual = read(&plain(task));
    assert_eq!(usual.preset, "thesis");
    let usual = key_lines(&usual.to_ron());
    let mut keys = key_lines(text);
    keys.retain(|(key, _, _)| key != "task" && !key.starts_with("backend."));
    assert!(keys.len() > 2, "{task}");
    for (key, value, comment) in &keys {
        let (_, default, _) = usual.iter().find(|(known, _, _)| known == key).unwrap();
        assert_ne!(value, default, "{task}: {key}");
        let told = comment.contains(&format!("default {default}"));
        assert!(told, "{task}: {key}: {comment:?} but {default}");
    }
}

/// A real cart-pole and the model of it that stands in for its board are the same robot.
#[test]
fn the_hardware_profiles_plant_is_their_emulated_one() {
    for name in HARDWARE {
        let profile = read(&plain(name));
        let (Experiment::SwingUp { plant, .. } | Experiment::Balance { plant, .. }) =
            profile.experiment
        else {
            panic!("{name} is no cart-pole")
        };
        let real = profile.backend.unwrap();
        let rig = &real.emulated;
        // The board's model has the drag and the largest force at its motor.
        let board = cart_pole::Params {
            cart_drag_n_s_per_m: rig.motor.viscous_n_s_per_m,
            force_limit_n: rig.motor.force_n,
            substeps: plant.substeps,
            ..rig.plant.clone()
        };
        assert_eq!(board, plant, "{name}");
        // What is read and sent is scaled as the board's model does it.
        let scales = scales::Params {
            angle: scales::Angle {
                counts_per_turn: rig.angle.counts_per_turn,
                hanging: rig.angle.hanging,
                invert: rig.angle.sign < 0,
                upright_deg: 0.0,
            },
            position: scales::Position { m_per_count: rig.m_per_count, invert: false },
            motor: scales::Motor {
                full_scale: rig.motor.full_scale.unsigned_abs(),
                gain: rig.motor.gain,
                friction_forward: rig.motor.friction_forward,
                friction_backward: rig.motor.friction_backward,
                ..scales::Motor::default()
            },
            ..scales::Params::default()
        };
        assert_eq!(scales, real.scales, "{name}");
    }
}

#[test]
fn bad_profiles_are_told_all_their_faults() {
    let mut bad: Vec<PathBuf> = std::fs::read_dir("tests/data/profiles/bad")
        .unwrap()
        .map(|file| file.unwrap().path())
        .filter(|path| path.extension().is_some_and(|end| end == "ron"))
        .collect();
    bad.sort();
    assert!(bad.len() >= 10);
    for path in bad {
        let document = Document::find(path.to_str().unwrap(), &nowhere()).unwrap();
        let name = path.file_stem().unwrap().to_str().unwrap();
        insta::with_settings!({snapshot_path => "data/profiles/bad", prepend_module_to_snapshot => false}, {
            insta::assert_snapshot!(name, message(&document));
        });
    }
}

#[test]
fn good_profiles_are_read() {
    for file in std::fs::read_dir("tests/data/profiles/good").unwrap() {
        let path = file.unwrap().path();
        let document = Document::find(path.to_str().unwrap(), &nowhere()).unwrap();
        let profile = document.read().unwrap_or_else(|report| panic!("{report}"));
        assert_eq!(read(&profile.to_ron()), profile);
    }
}

#[test]
fn a_set_takes_the_place_of_a_value_and_keeps_the_comments() {
    let mut document = balance();
    document.set("plant.pole_length_m", "0.9");
    document.set("plant.pole_length_m", "0.6");
    document.set("mode", "assigned");
    document.set("preset", "short-pole");
    document.set("session.main_duration_s", "90.0");
    let profile = document.read().unwrap();
    assert_eq!(profile.mode, WantedMode::Assigned);
    assert_eq!(profile.preset, "short-pole");
    assert_eq!(profile.session.main_duration_s, Some(90.0));
    assert_eq!(document.changed().len(), 4);
    let text = document.text();
    assert_eq!(read(&text), profile);
    assert_eq!(text.lines().count(), BALANCE.lines().count());
    assert!(text.contains("pole_length_m: 0.6,"));
    assert!(text.contains("// whole pole, m;"));
}

#[test]
fn a_set_of_a_key_that_the_text_lacks_is_added() {
    let mut document = Document::from_text("x.ron", "(\n    task: \"balance\" // why\n)\n");
    document.set("session.instructions.autonomous", "Let \"go\"");
    document.set("session.break_s", "1.0");
    assert_eq!(read(&document.text()), document.read().unwrap());
    assert_eq!(document.read().unwrap().session.instructions.autonomous, "Let \"go\"");
    assert!(document.text().contains("task: \"balance\", // why\n"));
}

#[test]
fn a_real_plants_keys_are_set_and_refused_like_all_others() {
    let mut document = Document::find("physical-cart-pole", &nowhere()).unwrap();
    document.set("backend.safety.soft_limit_m", "0.15");
    document.set("backend.emulated.motor.delay_s", "0.004");
    let plant = document.read().unwrap().backend.unwrap();
    assert_eq!((plant.safety.soft_limit_m, plant.emulated.motor.delay_s), (0.15, 0.004));
    document.set("backend.safety.soft_limit", "0.15");
    let told = message(&document);
    assert!(told.contains("did you mean `backend.safety.soft_limit_m`"), "{told}");
    let mut document = Document::find("swing-up", &nowhere()).unwrap();
    document.set("backend.safety.soft_limit_m", "0.15");
    assert!(message(&document).contains("unknown key"));
}

#[test]
fn bad_sets_are_reported_together_with_the_files_faults() {
    let mut document = Document::from_text("x.ron", "(task: \"balance\", tick_ms: 0.0)");
    document.set("plant.pole_lenght_m", "0.6");
    document.set("plant.substeps", "many");
    document.set("plant.bounce", "7.0");
    document.set("rules", "()");
    document.set("sharing.gate", "0.1), mode: (sequential");
    insta::assert_snapshot!(message(&document));
}

#[test]
fn origins_are_shown_and_the_shown_text_is_the_same_profile() {
    let path = "tests/data/profiles/good/short.ron";
    let mut document = Document::find(path, &nowhere()).unwrap();
    document.set("plant.pole_length_m", "0.6");
    assert_eq!(document.origin("plant.pole_length_m"), Origin::Set);
    assert_eq!(document.origin("rules.cap_s"), Origin::File { line: 7 });
    assert_eq!(document.origin("tick_ms"), Origin::Default);
    for with_origin in [false, true] {
        assert_eq!(read(&show(&document, with_origin).unwrap()), document.read().unwrap());
    }
    let shown = show(&document, true).unwrap();
    for (key, origin) in
        [("pole_length_m", "// --set"), ("cap_s", "// short.ron:7"), ("tick_ms", "// default")]
    {
        let line = shown.lines().find(|line| line.contains(key)).unwrap();
        assert!(line.ends_with(origin), "{line}");
    }
    assert!(key_lines(&shown).iter().all(|(_, _, comment)| !comment.is_empty()));
}

#[test]
fn names_and_paths_are_found_or_the_message_helps() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("mine.ron"), "// Mine\n(task: \"balance\")").unwrap();
    std::fs::write(at("binary.ron"), [b'(', 0xff]).unwrap();
    std::fs::write(at("huge.ron"), vec![b' '; (1 << 20) + 1]).unwrap();
    let find = |name: &str| Document::find(name, folder.path());
    assert_eq!(find("mine").unwrap().name(), "mine");
    assert_eq!(find(at("mine.ron").to_str().unwrap()).unwrap().name(), "mine");
    let error = |name: &str| find(name).unwrap_err().to_string();
    assert!(error("balanse").contains("did you mean `balance`?"));
    assert!(
        error("zzz")
            .contains("the known ones are balance, balance-modern, binary, cobs-cart-pole, huge")
    );
    assert!(error("").contains("the known ones"));
    assert!(error("./none.ron").contains("./none.ron cannot be read: No such file"));
    assert!(matches!(find("huge"), Err(ProfileError::TooLarge { .. })));
    assert!(matches!(find("binary"), Err(ProfileError::NotText { at: 1, .. })));
    assert!(matches!(find(folder.path().to_str().unwrap()), Err(ProfileError::Folder { .. })));
    #[cfg(unix)]
    assert!(matches!(find("/dev/zero"), Err(ProfileError::TooLarge { .. })));

    let listed = list(folder.path());
    let titles: Vec<_> = listed.iter().map(|l| (l.name.as_str(), l.title.as_str())).collect();
    assert!(titles.contains(&("mine", "Mine")));
    assert!(listed.iter().any(|l| l.name == "balance" && l.path.is_none()));
}

#[test]
fn saving_never_replaces_a_file_unasked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new.ron");
    let mut document = balance();
    document.set("rules.cap_s", "5.0");
    document.save(&path, false).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), document.text());
    document.set("rules.cap_s", "6.0");
    assert!(matches!(document.save(&path, false), Err(ProfileError::Exists { .. })));
    assert!(std::fs::read_to_string(&path).unwrap().contains("cap_s: 5.0"));
    document.save(&path, true).unwrap();
    assert!(std::fs::read_to_string(&path).unwrap().contains("cap_s: 6.0"));
    let nowhere = path.join("new.ron");
    assert!(matches!(document.save(&nowhere, true), Err(ProfileError::Unwritable { .. })));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let first = folder.path().join("profiles/first.ron");
    document.save(&first, false).unwrap();
    assert!(first.is_file(), "the folder of profiles is made with its first file");
}

#[test]
fn a_profile_cut_anywhere_is_one_fault_of_its_text() {
    let whole = BALANCE.trim_end().len();
    for cut in (0..whole).filter(|&cut| BALANCE.is_char_boundary(cut)) {
        let report = Document::from_text("cut.ron", &BALANCE[..cut]).read().unwrap_err();
        assert_eq!(report.faults().len(), 1, "{report}");
        assert!(report.faults()[0].message.contains("cannot be read beyond"), "{report}");
        if cut % 50 == 0 {
            assert!(report.to_string().contains("cut.ron:"));
        }
    }
}

#[test]
fn ten_thousand_faults_are_counted_and_the_first_ones_shown() {
    use std::fmt::Write as _;
    let mut text = "(task: \"balance\",\n".to_owned();
    for index in 0..10_000 {
        writeln!(text, "plant_{index}: 1,").unwrap();
    }
    let message = message(&Document::from_text("many.ron", text + ")"));
    assert!(message.ends_with("10000 faults in many.ron; nothing was started"), "{message}");
    assert!(message.lines().count() < 500);
}

fn damaged() -> impl Strategy<Value = String> {
    let damage = prop::sample::select(vec![
        "(",
        ")",
        ",",
        ":",
        "\"",
        "'",
        "/*",
        "//",
        "[",
        "]",
        "NaN",
        "-1",
        "\u{e9}",
        "\n",
        "r#\"",
        "a: 1",
        "None",
        "\0",
        "\u{200f}",
        "Some(",
        "{",
        "task: \"balance\",",
        "\t",
        "\u{1f916}",
        "\r",
    ]);
    let places = prop::collection::vec((any::<prop::sample::Index>(), 0..30_usize, damage), 1..4);
    places.prop_map(|places| {
        let mut letters: Vec<char> = BALANCE.chars().collect();
        for (index, length, new) in places {
            let from = index.index(letters.len());
            let to = (from + length).min(letters.len());
            letters.splice(from..to, new.chars());
        }
        letters.into_iter().collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_text_is_too_strange(text in prop_oneof![any::<String>(), damaged()], value in ".{0,20}") {
        let mut document = Document::from_text("strange.ron", text);
        document.set("plant.bounce", &value);
        match document.read() {
            Ok(profile) => prop_assert_eq!(read(&document.text()), profile),
            Err(report) => prop_assert!(
                report.to_string().ends_with("in strange.ron; nothing was started")
            ),
        }
    }
}

#[test]
fn the_folder_of_shipped_profiles_is_the_built_in_one() {
    let built_in: Vec<_> = list(&nowhere()).into_iter().map(|listed| listed.name).collect();
    let shipped: Vec<_> = list(Path::new("profiles")).into_iter().map(|l| l.name).collect();
    assert_eq!(built_in, shipped);
}
