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
    Study::of(&text(body), nowhere(), changes).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(body: &str, sets: &[(&str, &str)]) -> String {
    let sets = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    let changes = Changes { sets, seeds: None };
    Study::of(&text(body), nowhere(), &changes).unwrap_err().to_string()
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
        .map(|run| study.profile(run).experiment.cart_pole().unwrap().pole_mass_kg)
        .collect();
    // The operators come one after the other, that of the first arm first.
    assert_eq!(masses, [0.2, 0.3]);
    assert_eq!(study.profile(&study.runs[0]).session.phases, [Wanted::Main]);
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
    let gate = |run: &Run| study.profile(run).sharing.gate;
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
    ] {
        let message = refused(&body, sets);
        assert!(message.contains(words), "{words}: {message}");
    }
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
    for name in library::names() {
        let study = Study::find(name, nowhere(), &Changes::default());
        let study = study.unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(study.runs.len() > 30, "{name}");
    }
    let message = Study::find("balanse", nowhere(), &Changes::default()).unwrap_err().to_string();
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
