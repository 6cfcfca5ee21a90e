use super::*;
use proptest::prelude::*;

fn nowhere() -> &'static Path {
    Path::new("tests/data/no-such-folder")
}

fn text(body: &str) -> Text {
    let fixed = "profile: \"balance\", starts: [(name: \"grid\", count: 3)]";
    Text::new("x.ron", format!("({fixed}, {body})"))
}

const TWO_ARMS: &str = "arms: [(name: \"a\", mode: sequential), (name: \"b\", mode: simultaneous)]";

fn study(body: &str, changes: &Changes) -> Study {
    Study::of(&text(body), nowhere(), changes, &|| false).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(body: &str, sets: &[(&str, &str)]) -> String {
    let sets = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    let changes = Changes { sets, seeds: None };
    Study::of(&text(body), nowhere(), &changes, &|| false).unwrap_err().to_string()
}

#[test]
fn runs_are_paired_and_always_in_the_same_order() {
    let body = format!(
        "{TWO_ARMS}, operators: [\"simulated:naive\", \"none\"], seeds: (first: 7, count: 2), \
         references: [zero]"
    );
    let study = study(&body, &Changes::default());
    let told: Vec<String> = study.runs.iter().map(|run| study.labels(run).to_string()).collect();
    assert_eq!(
        told,
        [
            "run 1 (reference, profile, seed 7)",
            "run 2 (a, simulated:naive, profile, seed 7)",
            "run 3 (b, simulated:naive, profile, seed 7)",
            "run 4 (a, simulated:naive, profile, seed 8)",
            "run 5 (b, simulated:naive, profile, seed 8)",
            "run 6 (a, none, profile, seed 7)",
            "run 7 (b, none, profile, seed 7)",
            "run 8 (a, none, profile, seed 8)",
            "run 9 (b, none, profile, seed 8)",
        ]
    );
}

#[test]
fn an_arm_may_have_an_operator_and_changes_of_its_own() {
    let body = "arms: [(name: \"idle\", mode: sequential, operator: \"none\", sets: {\"plant.pole_mass_kg\": 0.2}), \
                (name: \"b\", mode: simultaneous)], operators: [\"simulated:naive\"], seeds: (count: 1), \
                sets: {\"plant.pole_mass_kg\": 0.3, \"session.phases\": [main]}";
    let study = study(body, &Changes::default());
    let masses: Vec<f64> = study
        .runs
        .iter()
        .map(|run| study.profile(run).unwrap().experiment.cart_pole().unwrap().pole_mass_kg)
        .collect();
    // The operators come one after the other, that of the first arm first.
    assert_eq!(masses, [0.2, 0.3]);
    assert_eq!(study.profile(&study.runs[0]).unwrap().session.phases, [Wanted::Main]);
}

#[test]
fn values_with_commas_between_are_settings() {
    let body = format!("{TWO_ARMS}, operators: [\"none\"], seeds: (count: 1)");
    let sets = vec![
        ("sharing.gate".to_owned(), "0.3, 0.5".to_owned()),
        ("session.phases".to_owned(), "[introduction, main]".to_owned()),
    ];
    let study = study(&body, &Changes { sets, seeds: Some(2) });
    let names: Vec<&str> = study.params.settings.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["sharing.gate=0.3", "sharing.gate=0.5"]);
    assert_eq!(study.runs.len(), 2 * 2 * 2);
    let gate = |run: &Run| study.profile(run).unwrap().sharing.gate;
    assert_eq!((gate(&study.runs[0]), gate(&study.runs[7])), (0.3, 0.5));
}

#[test]
fn all_that_is_wrong_is_told_at_once_and_where_it_stands() {
    let message = refused(
        "arms: [(name: \"a\", mode: sequential), (name: \"a\", mode: simultaneous)], \
         operators: [\"none\"], seeds: (count: 0), checkpoints: [10, 15], readouts: []",
        &[],
    );
    for words in ["two called `a`", "nothing to run", "[10, 15]", "`readouts` is []", "4 faults"] {
        assert!(message.contains(words), "{words}: {message}");
    }
    assert!(message.contains("x.ron:1:"), "{message}");
}

#[test]
fn faults_of_each_kind_say_what_is_right() {
    let with = |more: &str| format!("{TWO_ARMS}, seeds: (count: 1), {more}");
    for (body, sets, words) in [
        (with("operators: []"), &[][..], "nobody steers in the arm `a`"),
        (with("operators: [\"keyboard\"]"), &[], "needs a person or a file"),
        (with("operators: [\"nobody\"]"), &[], "is no operator"),
        (with("operators: [\"q_learning\"]"), &[], "learns the mountain car alone"),
        (with("operators: [\"none\"], readouts: [agent]"), &[], "no agent whose policy"),
        (with("operators: [\"none\"], references: [optimum]"), &[], "known of the mountain car"),
        (with("operators: [\"none\"], trajectories: [3]"), &[], "there is no start 3"),
        (with("operators: [\"none\"], colour: 3"), &[], "colour"),
        (with("operators: [\"none\"], sets: {\"plant.pole_mas_kg\": 1}"), &[], "pole_mass_kg"),
        (with("operators: [\"none\"]"), &[("sharing.gatee", "0.1,0.2")], "sharing.gate"),
        (with("operators: [\"none\"]"), &[("sharing.gate", "0.1,7")], "0 to 0.99"),
        (with("operators: [\"none\"], sets: {\"session.phases\": [introduction]}"), &[], "no main"),
        (
            with("operators: [\"none\"], trajectories: [1, 1]"),
            &[],
            "the start 1 stands there twice",
        ),
        (with("operators: [\"none\"], references: [zero, zero]"), &[], "zero stands there twice"),
        (
            with("operators: [\"simulated:naive\", \"simulated:naive:delayed-pd\"]"),
            &[],
            "are the same person",
        ),
        (with("operators: [\"none\"], sets: {\"mode\": sequential}"), &[], "`mode` is no change"),
    ] {
        let message = refused(&body, sets);
        assert!(message.contains(words), "{words}: {message}");
    }
}

/// A setting is called after its values: none may be replaced on the way to a run.
#[test]
fn a_sweep_whose_names_would_not_be_true_is_refused() {
    let plain = format!("{TWO_ARMS}, operators: [\"none\"], seeds: (count: 1)");
    let gate = "sharing.gate";
    for (sets, words) in [
        (&[(gate, "0.3,0.5"), (gate, "0.6")][..], "--set sharing.gate is given twice"),
        (&[("mode", "sequential,simultaneous")], "each arm of a study has its own mode"),
        (&[(gate, "0.3,0.3")], "--set sharing.gate has the value 0.3 twice"),
        (&[(gate, "0.3,0.30")], "`sharing.gate=0.3` and `sharing.gate=0.30` are the same"),
    ] {
        let message = refused(&plain, sets);
        assert!(message.contains(words), "{words}: {message}");
    }
    let own = "arms: [(name: \"a\", mode: sequential, sets: {\"sharing.gate\": 0.1})], \
               operators: [\"none\"], seeds: (count: 1)";
    let message = refused(own, &[(gate, "0.3,0.5")]);
    assert!(message.contains("the arm `a` of the study sets it too"), "{message}");
    let named = format!("{plain}, settings: [(name: \"low\", sets: {{\"sharing.gate\": 0.1}})]");
    let message = refused(&named, &[(gate, "0.3")]);
    assert!(message.contains("the setting `low` of the study sets it too"), "{message}");
    let both = format!("{own}, settings: [(name: \"low\", sets: {{\"sharing.gate\": 0.2}})]");
    let message = refused(&both, &[]);
    assert!(
        message.contains("the arm `a` and the setting `low` both set sharing.gate"),
        "{message}"
    );
    // What the study sets for all is there to be changed.
    let all = format!("{plain}, sets: {{\"sharing.gate\": 0.1}}");
    assert_eq!(study(&all, &swept(&[(gate, "0.3,0.5")])).params.settings.len(), 2);
}

fn swept(sets: &[(&str, &str)]) -> Changes {
    let sets = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    Changes { sets, seeds: None }
}

/// None of these has room in memory.
#[test]
fn what_is_too_much_is_refused_before_it_is_made() {
    let body = format!("{TWO_ARMS}, operators: [\"none\"], seeds: (count: 100000)");
    let five = "0.1,0.2,0.3,0.4,0.5,0.6";
    let message = refused(&body, &[("sharing.gate", five)]);
    assert!(message.contains("more than 1000000 runs"), "{message}");
    let many: Vec<String> = (0..1000).map(|value| format!("0.{value:03}")).collect();
    let many = many.join(",");
    let keys = ["sharing.gate", "teaching.rate", "plant.pole_mass_kg", "plant.cart_mass_kg"];
    let sets: Vec<(&str, &str)> = keys.iter().map(|key| (*key, &*many)).collect();
    let message = refused(&body, &sets);
    assert!(message.contains("more than 10000 settings"), "{message}");
    let message = refused(&body.replace("100000", "200000"), &[]);
    assert!(message.contains("`seeds.count` is 200000: that is too many"), "{message}");
}

#[test]
fn planning_ends_when_it_is_asked_to() {
    let body = format!("{TWO_ARMS}, operators: [\"none\"], seeds: (count: 1)");
    let study = Study::of(&text(&body), nowhere(), &Changes::default(), &|| true);
    assert!(matches!(study, Err(StudyError::Interrupted)));
}

#[test]
fn references_have_the_seeds_of_starts_that_are_drawn() {
    let body = format!(
        "{TWO_ARMS}, operators: [\"none\"], seeds: (first: 4, count: 3), references: [zero]"
    );
    let references = |text: &Text| -> Vec<u64> {
        let study = Study::of(text, nowhere(), &Changes::default(), &|| false).unwrap();
        assert_eq!(count(&study.params), Some(study.runs.len()));
        let is_one = |run: &&Run| run.what == What::References;
        study.runs.iter().filter(is_one).map(|run| run.seed).collect()
    };
    assert_eq!(references(&text(&body)), [4]);
    let fixed = "profile: \"balance\", starts: [(name: \"drawn\", count: 3, random: true)]";
    assert_eq!(references(&Text::new("x.ron", format!("({fixed}, {body})"))), [4, 5, 6]);
}

#[test]
fn arms_with_an_operator_of_their_own_are_compared_with_all_of_the_other_side() {
    let body = "arms: [(name: \"a\", mode: sequential, operator: \"none\"), \
                (name: \"b\", mode: simultaneous), (name: \"c\", mode: sequential)], \
                operators: [\"simulated:naive\", \"simulated:expert\"], seeds: (count: 1)";
    let study = study(body, &Changes::default());
    assert_eq!(study.opposite("b", "a", "simulated:naive"), ["none"]);
    assert_eq!(study.opposite("a", "b", "none"), ["simulated:naive", "simulated:expert"]);
    assert_eq!(study.opposite("b", "c", "simulated:expert"), ["simulated:expert"]);
    assert!(study.runs.windows(2).all(|two| study.are_together(&two[0], &two[1])));
}

#[test]
fn the_identity_is_that_of_the_results() {
    let body = format!("{TWO_ARMS}, operators: [\"none\"], seeds: (count: 2)");
    let one = |sets: &[(&str, &str)], seeds| {
        let sets = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        study(&body, &Changes { sets, seeds }).identity().to_owned()
    };
    assert_eq!(one(&[], None), one(&[], Some(2)));
    assert_ne!(one(&[], None), one(&[], Some(3)));
    assert_ne!(one(&[], None), one(&[("sharing.gate", "0.3")], None));
}

#[test]
fn the_studies_that_are_built_in_are_right() {
    for name in library::names(nowhere()) {
        let study = Study::find(&name, nowhere(), &Changes::default(), &|| false);
        let study = study.unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(study.runs.len() > 30, "{name}");
    }
    let none = Study::find("balanse", nowhere(), &Changes::default(), &|| false);
    let message = none.unwrap_err().to_string();
    assert!(message.contains("no study `balanse`: did you mean `balance`?"), "{message}");
}

proptest! {
    #[test]
    fn shards_share_out_all_runs_each_once(of in 1..50_u32, runs in 1..200_u32) {
        let shards: Vec<Shard> = (1..=of).map(|number| Shard { number, of }).collect();
        for run in 1..=runs {
            prop_assert_eq!(shards.iter().filter(|shard| shard.holds(run)).count(), 1);
        }
        for shard in shards {
            let held = (1..=runs).filter(|run| shard.holds(*run)).count();
            let share = (runs / of) as usize;
            prop_assert!(held == share || held == share + 1);
            prop_assert_eq!(shard.to_string().parse::<Shard>(), Ok(shard));
        }
    }

    #[test]
    fn what_is_no_shard_is_refused(number in 0..9_u32, of in 0..9_u32) {
        let is_one = (1..=of).contains(&number);
        prop_assert_eq!(format!("{number}/{of}").parse::<Shard>().is_ok(), is_one);
    }
}
