//! What is kept of a session outlives kills, full disks and a second process.

#![expect(clippy::unwrap_used, reason = "helpers of tests may fail like tests")]

#[path = "record/samples.rs"]
mod samples;

use std::fs;
use std::path::Path;

use coadapt::random::{Place, Purpose, stream};
use coadapt::record::folder::{self, Unfinished};
use coadapt::record::{
    Error, EvaluationRow, EventRow, Folder, Manner, Recorder, Sidecar, Status, StepRow, assignment,
    reader,
};
use coadapt::record::{policy, read_policy, read_sidecar};
use coadapt::session::{Phase, Subject, Trial};
use coadapt::sharing::Mode;
use coadapt::signal::{End, State, Tallied};
use proptest::prelude::*;
use samples::*;

#[test]
fn a_session_leaves_the_files_with_the_promised_columns() {
    for manner in [Manner::Live, Manner::Virtual] {
        let logs = tempfile::tempdir().unwrap();
        let (mut recorder, trial) = start(logs.path(), manner);
        let path = recorder.path().to_owned();
        assert_eq!(path, logs.path().join("S07/001-balance-simultaneous"));
        rollouts(&mut recorder, 1..=1);
        recorder.step(StepRow {
            u_human: None,
            share: None,
            u: None,
            u_applied: None,
            reward: None,
            success: None,
            region: None,
            ..step(2, 0)
        });
        recorder.policy(Some(10), Box::new(a_policy(model(1.0))));
        recorder.policy(None, Box::new(a_policy(model(2.0))));
        recorder.event(EventRow {
            time: String::new(),
            phase: Some(Phase::Main),
            episode: None,
            step: None,
            event: "fault",
            cause: "a \"cause\",\nof two lines".to_owned(),
        });
        assert_eq!((recorder.lost(), recorder.fault()), (0, None));
        recorder.finish(complete(trial)).unwrap();

        let steps = read(&path, "steps.csv");
        let lines: Vec<&str> = steps.lines().collect();
        assert_eq!(
            lines[0],
            "phase,episode,step,t,x,x_dot,theta,theta_dot,u_human,u_machine,\
            share,u,u_applied,reward,success,region,lateness_us,raw"
        );
        assert_eq!(
            lines[1],
            "main,1,0,0.0,0.0,1e-300,-0.0,0.3333333333333333,10.0,,1.0,10.0,\
            1e22,0.30000000000000004,0.0,all,0,"
        );
        assert_eq!(lines[4], "main,2,0,0.0,0.0,1e-300,-0.0,0.3333333333333333,,,,,,,,,0,");
        assert!(steps.ends_with('\n') && !steps.contains('\r'));
        assert_eq!(
            read(&path, "episodes.csv"),
            "phase,episode,start,steps,duration_s,end,return,\
            mean_reward,share,success,receptive_fields,mean_speed,end_hits\n\
            main,1,0.05,3,0.06,failed,1.5,0.5,1.0,,7,0.30000000000000004,3.0\n"
        );
        assert_eq!(
            read(&path, "events.csv"),
            "time,phase,episode,step,event,cause\n,main,,,fault,\"a \"\"cause\"\", of two lines\"\n"
        );
        assert_eq!(read_sidecar(&path.join("session.json")).unwrap(), complete(trial));
        let kept = read_policy(&path.join("policy-010.json")).unwrap();
        assert_eq!(a_policy(model(1.0)), kept);
        assert!(path.join("policy.json").exists());
        let events = reader::read_events(&path.join("events.csv")).unwrap();
        assert_eq!(events[0].cause, "a \"cause\", of two lines");
    }
}

fn number() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits).prop_filter("a number", |n| n.is_finite())
}

fn bits(row: &[Option<f64>]) -> Vec<Option<u64>> {
    row.iter().map(|n| n.map(f64::to_bits)).collect()
}

/// Sessions of before the column `raw` are read all the same.
#[test]
fn rows_without_deflections_are_read() {
    let logs = tempfile::tempdir().unwrap();
    let (mut recorder, trial) = start(logs.path(), Manner::Virtual);
    let path = recorder.path().join("steps.csv");
    recorder.step(StepRow { u_human: Some(3.0), raw: Some(0.25), ..step(1, 0) });
    recorder.finish(complete(trial)).unwrap();
    let read = |path: &Path| {
        let row = reader::Steps::open(path).unwrap().next().unwrap().unwrap();
        (row.u_human, row.raw)
    };
    assert_eq!(read(&path), (Some(3.0), Some(0.25)));
    let before = fs::read_to_string(&path).unwrap();
    let before = before.replace(",raw\n", "\n").replace(",0.25\n", "\n");
    fs::write(&path, before).unwrap();
    assert_eq!(read(&path), (Some(3.0), None));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn rows_and_policies_read_back_to_the_same_bits(
        state in prop::array::uniform4(number()),
        cells in prop::array::uniform8(prop::option::of(number())),
        t in number(),
        late in any::<u32>(),
        beta in prop::collection::vec(number(), 0..20),
    ) {
        let logs = tempfile::tempdir().unwrap();
        let (mut recorder, trial) = start(logs.path(), Manner::Virtual);
        let path = recorder.path().to_owned();
        let [u_human, u_machine, share, u, u_applied, reward, success, raw] = cells;
        recorder.step(StepRow { t, state: State::new(state), u_human, u_machine, share, u,
            u_applied, reward, success, raw, lateness_us: late, ..step(1, 0) });
        let policy = a_policy(Model::Memory { beta: beta.clone() });
        recorder.policy(None, Box::new(policy));
        recorder.finish(complete(trial)).unwrap();

        let rows: Vec<_> = reader::Steps::open(&path.join("steps.csv")).unwrap().collect();
        prop_assert_eq!(rows.len(), 1);
        let row = rows[0].as_ref().unwrap();
        prop_assert_eq!(bits(&cells), bits(&[row.u_human, row.u_machine, row.share, row.u,
            row.u_applied, row.reward, row.success, row.raw]));
        prop_assert_eq!(state.map(f64::to_bits).to_vec(),
            row.state.iter().map(|n| n.to_bits()).collect::<Vec<_>>());
        prop_assert_eq!((t.to_bits(), late), (row.t.to_bits(), row.lateness_us));
        let Model::Memory { beta: kept } =
            read_policy::<Model>(&path.join("policy.json")).unwrap().learner;
        let to_bits = |numbers: Vec<f64>| numbers.into_iter().map(f64::to_bits).collect::<Vec<_>>();
        prop_assert_eq!(to_bits(beta), to_bits(kept));
    }
}

#[test]
fn a_table_cut_at_any_byte_yields_all_its_whole_rows() {
    let logs = tempfile::tempdir().unwrap();
    let (mut recorder, trial) = start(logs.path(), Manner::Virtual);
    let path = recorder.path().to_owned();
    rollouts(&mut recorder, 1..=2);
    recorder.finish(complete(trial)).unwrap();
    let cut = logs.path().join("cut.csv");
    for name in ["steps.csv", "episodes.csv"] {
        let whole = fs::read(path.join(name)).unwrap();
        for length in 0..=whole.len() {
            fs::write(&cut, &whole[..length]).unwrap();
            let lines = String::from_utf8_lossy(&whole[..length]).matches('\n').count();
            let rows = if name == "steps.csv" {
                reader::Steps::open(&cut).unwrap().map(Result::unwrap).count()
            } else {
                reader::Episodes::open(&cut).unwrap().map(Result::unwrap).count()
            };
            assert_eq!(rows, lines.saturating_sub(1), "{name} cut at {length}");
        }
    }
}

#[test]
fn a_wrong_cell_is_told_with_file_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("episodes.csv");
    let header = "phase,episode,start,steps,duration_s,end,return,mean_reward,share,success,\
        receptive_fields\n";
    let good = "main,1,0.05,3,0.06,failed,1.5,0.5,1.0,,7\n";
    for (bad, expected) in [
        ("main,1,0.05,3,0.06,felled,1.5,0.5,1.0,,7\n", "column end: unknown variant `felled`"),
        ("main,1,0.05,x,0.06,failed,1.5,0.5,1.0,,7\n", "column steps: \"x\" is not a whole number"),
        ("main,1,,3,0.06,failed,1.5,0.5,1.0,,7\n", "column start: \"\" is not a number"),
        ("main,1,0.05\n", "column steps: the line ends before this column"),
    ] {
        fs::write(&path, format!("{header}{good}{bad}")).unwrap();
        let rows: Vec<_> = reader::Episodes::open(&path).unwrap().collect();
        let fault = rows[1].as_ref().unwrap_err().to_string();
        assert!(rows[0].is_ok() && fault.contains("episodes.csv, line 3, "), "{fault}");
        assert!(fault.contains(expected), "{fault}");
    }
    fs::write(&path, "name,value\na,1\n").unwrap();
    let fault = reader::Episodes::open(&path).err().unwrap().to_string();
    assert!(fault.contains("line 1, column name: the column phase is expected"), "{fault}");
}

#[test]
fn a_killed_session_resumes_to_the_same_bytes_wherever_it_was_cut() {
    let logs = tempfile::tempdir().unwrap();
    let (mut unbroken, trial) = start(logs.path(), Manner::Virtual);
    let whole = unbroken.path().to_owned();
    rollouts(&mut unbroken, 1..=3);
    unbroken.policy(None, Box::new(a_policy(model(3.0))));
    unbroken.finish(complete(trial)).unwrap();

    let (mut recorder, _) = start(logs.path(), Manner::Live);
    let path = recorder.path().to_owned();
    rollouts(&mut recorder, 1..=2);
    recorder.step(step(3, 0));
    drop(recorder);
    let steps = fs::read(path.join("steps.csv")).unwrap();
    let kept = steps.iter().enumerate().filter(|(_, b)| **b == b'\n').nth(6).unwrap().0 + 1;

    for length in kept..=steps.len() {
        let killed = logs.path().join(format!("K/{length:03}-balance-simultaneous"));
        copy(&path, &killed);
        fs::write(killed.join("steps.csv"), &steps[..length]).unwrap();
        fs::write(killed.join("events.csv"), "time,phase,episode,step,event,cause\n,ma").unwrap();
        fs::write(killed.join("checkpoint.json.new"), "{\"schema\":1,\"prog").unwrap();
        let resumed = Folder::open(&killed).unwrap().resume::<Model>(Manner::Virtual, "").unwrap();
        assert_eq!(resumed.checkpoint.moment.rollout, 3);
        assert_eq!(resumed.checkpoint.learner, checkpoint(3).learner);
        assert_eq!(resumed.episodes, [episode(1), episode(2)]);
        assert_eq!(resumed.dropped_steps > 0, length > kept);
        let mut recorder = resumed.recorder;
        rollouts(&mut recorder, 3..=3);
        recorder.policy(None, Box::new(a_policy(model(3.0))));
        recorder.finish(Sidecar { status: Status::Complete, ..resumed.sidecar }).unwrap();
        for name in ["steps.csv", "episodes.csv", "checkpoint.json", "policy.json"] {
            assert_eq!(read(&whole, name), read(&killed, name), "{name} cut at {length}");
        }
        let events = reader::read_events(&killed.join("events.csv")).unwrap();
        assert_eq!((events.len(), events[0].event.as_str()), (1, "resumed"));
        assert!(events[0].cause.contains("step rows"), "{}", events[0].cause);
        let session = read_sidecar(&killed.join("session.json")).unwrap();
        assert_eq!((session.status, session.resumed.len()), (Status::Complete, 1));
    }
}

#[test]
fn a_damaged_session_is_refused_and_left_untouched() {
    type Damage<'a> = &'a dyn Fn(&str) -> String;
    let logs = tempfile::tempdir().unwrap();
    let (mut recorder, _) = start(logs.path(), Manner::Live);
    let path = recorder.path().to_owned();
    rollouts(&mut recorder, 1..=2);
    recorder.step(step(3, 0));
    drop(recorder);
    let newer = |text: &str| text.replacen("\"schema\":1", "\"schema\":2", 1);
    let cut = |text: &str| text[..text.len() / 2].to_owned();
    let cases: [(&str, Damage<'_>, &str); 6] = [
        ("checkpoint.json", &newer, "written by a newer coadapt"),
        ("checkpoint.json", &cut, "is cut off"),
        ("checkpoint.json", &|_| "not JSON".to_owned(), "not a valid JSON file"),
        ("session.json", &cut, "is cut off"),
        ("steps.csv", &cut, "whole rows, which are not here"),
        ("episodes.csv", &|t| t.replace("failed", "felled"), "unknown variant"),
    ];
    for (name, damage, expected) in cases {
        let damaged = logs.path().join("damaged");
        let _ = fs::remove_dir_all(&damaged);
        copy(&path, &damaged);
        fs::write(damaged.join(name), damage(&read(&damaged, name))).unwrap();
        let before: Vec<String> =
            ["steps.csv", "episodes.csv", "events.csv"].map(|n| read(&damaged, n)).to_vec();
        let fault = Folder::open(&damaged).unwrap().resume::<Model>(Manner::Live, "").unwrap_err();
        assert!(fault.to_string().contains(expected), "{name}: {fault}");
        assert!(fault.to_string().contains(name), "{name}: {fault}");
        let after = ["steps.csv", "episodes.csv", "events.csv"].map(|n| read(&damaged, n));
        assert_eq!(before, after);
    }
}

#[test]
fn a_session_being_recorded_is_neither_offered_nor_resumed_by_another() {
    let logs = tempfile::tempdir().unwrap();
    let (mut recorder, trial) = start(logs.path(), Manner::Live);
    let path = recorder.path().to_owned();
    rollouts(&mut recorder, 1..=1);
    let fault = Folder::open(&path).unwrap_err();
    assert!(matches!(&fault, Error::Busy { .. }), "{fault}");
    assert_eq!(folder::unfinished(logs.path()), []);
    drop(recorder);

    fs::create_dir_all(logs.path().join("S07/002-rubbish-x")).unwrap();
    fs::create_dir_all(logs.path().join("S07/lost+found")).unwrap();
    fs::write(logs.path().join("README.md"), "logs").unwrap();
    let expected = Unfinished {
        path: path.clone(),
        subject: subject(),
        trial,
        task: "balance".to_owned(),
        preset: "balance".to_owned(),
        mode: "simultaneous",
        phase: Phase::Main,
        episode: 2,
        of: Some(3),
    };
    assert_eq!(folder::unfinished(logs.path()), [expected]);

    let resumed = Folder::open(&path).unwrap().resume::<Model>(Manner::Virtual, "").unwrap();
    resumed.recorder.finish(complete(trial)).unwrap();
    assert_eq!(folder::unfinished(logs.path()), []);
    let fault = Folder::open(&path).unwrap().resume::<Model>(Manner::Virtual, "").unwrap_err();
    assert!(fault.to_string().contains("complete"), "{fault}");
}

#[test]
fn trials_count_by_subject_whatever_the_task_and_are_never_taken_twice() {
    let logs = tempfile::tempdir().unwrap();
    let create = |wanted: Option<u32>, task: &str| {
        Folder::create(logs.path(), &subject(), wanted.map(Trial), task, "sequential").unwrap()
    };
    assert_eq!(create(None, "balance").trial, Trial(1));
    assert_eq!(create(Some(7), "swing-up").trial, Trial(7));
    let moved = create(Some(1), "swing-up");
    assert_eq!(moved.trial, Trial(2));
    assert_eq!(moved.notice.unwrap(), "trial 001 of subject S07 is taken: this is trial 002");
    assert_eq!(create(None, "balance").trial, Trial(8));
    let kept = folder::trials(logs.path(), &subject()).unwrap();
    assert_eq!(kept.iter().map(|k| k.trial.0).collect::<Vec<_>>(), [1, 2, 7, 8]);

    let numbers: Vec<u32> = std::thread::scope(|scope| {
        let many = |task| move || (0..20).map(|_| create(None, task).trial.0).collect::<Vec<_>>();
        let threads = ["balance", "swing-up", "speed-up"].map(|task| scope.spawn(many(task)));
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
    });
    let mut sorted = numbers.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, (9..69).collect::<Vec<_>>());
}

#[test]
fn an_unwritable_place_and_a_full_disk_are_told_clearly() {
    let logs = tempfile::tempdir().unwrap();
    let file = logs.path().join("file");
    fs::write(&file, "").unwrap();
    for place in [file.clone(), file.join("below")] {
        let fault = Folder::create(&place, &subject(), None, "balance", "sequential").unwrap_err();
        let text = fault.to_string();
        assert!(text.contains("cannot make the folder") && text.contains("--logs DIR"), "{text}");
        assert!(text.contains(place.to_str().unwrap()), "{text}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_ends_the_table_and_is_told_while_the_session_runs() {
    let logs = tempfile::tempdir().unwrap();
    let full = |name: &str| {
        let made = Folder::create(logs.path(), &subject(), None, "balance", "sequential").unwrap();
        let path = made.folder.path().join(name);
        let _ = fs::remove_file(&path);
        std::os::unix::fs::symlink("/dev/full", &path).unwrap();
        made
    };
    let made = full("steps.csv");
    let start = Recorder::<Model>::start(made.folder, &COLUMNS, Manner::Live, &sidecar(made.trial));
    let fault = start.unwrap_err().to_string();
    assert!(fault.contains("steps.csv") && fault.contains("free some space"), "{fault}");

    // The disk fills up later: here, when the first checkpoint is written.
    let made = full("checkpoint.json.new");
    let mut recorder =
        Recorder::<Model>::start(made.folder, &COLUMNS, Manner::Live, &sidecar(made.trial))
            .unwrap();
    let path = recorder.path().to_owned();
    rollouts(&mut recorder, 1..=2);
    let told = recorder.finish(complete(made.trial)).unwrap_err().to_string();
    assert!(told.contains("checkpoint.json") && told.contains("free some space"), "{told}");
    assert_eq!(reader::Steps::open(&path.join("steps.csv")).unwrap().count(), 6);
}

#[test]
fn a_policy_that_cannot_be_trusted_is_refused_with_its_own_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("policy.json");
    let refusal = |text: &str| {
        fs::write(&path, text).unwrap();
        read_policy::<Model>(&path).unwrap_err().to_string()
    };
    policy::write_policy(&path, &a_policy(model(0.5))).unwrap();
    let good = fs::read_to_string(&path).unwrap();
    for (text, expected) in [
        (good[..good.len() / 2].to_owned(), "this policy is cut off"),
        (String::new(), "this policy is cut off"),
        ("u,x\n1,2\n".to_owned(), "not a valid JSON file"),
        ("{\"name\":\"other\"}".to_owned(), "not a policy of coadapt's"),
        (good.replace("\"kind\": \"policy\"", "\"kind\": \"checkpoint\""), "this is a checkpoint"),
        (good.replace("\"schema\": 1", "\"schema\": 9"), "written by a newer coadapt"),
        (good.replace("0.5", "null"), "holds a wrong value"),
        (good.replace("0.5", "NaN"), "not a valid JSON file"),
        (good.replace("0.5", "1e999"), "number out of range"),
    ] {
        let fault = refusal(&text);
        assert!(fault.contains(expected) && fault.contains("policy.json"), "{fault}");
    }
    fs::remove_file(&path).unwrap();
    let missing = read_policy::<Model>(&path).unwrap_err().to_string();
    assert!(missing.contains("cannot read") && missing.contains("No such file"), "{missing}");

    policy::write_policy(&path, &a_policy(model(0.5))).unwrap();
    let fault = policy::write_policy(&path, &a_policy(model(f64::NAN))).unwrap_err().to_string();
    assert!(fault.contains("learner.beta: the number is NaN"), "{fault}");
    assert_eq!(fs::read_to_string(&path).unwrap(), good);
}

#[test]
fn an_evaluation_reads_back_and_a_repeated_one_replaces_it() {
    let logs = tempfile::tempdir().unwrap();
    let (mut recorder, trial) = start(logs.path(), Manner::Virtual);
    let path = recorder.path().join("evaluation.csv");
    let row = EvaluationRow {
        policy: "policy-010".to_owned(),
        episode: 1,
        start: -0.1,
        steps: 1000,
        duration_s: 20.0,
        end: End::Cap,
        total: 987.0,
        mean_reward: 0.987,
        tallied: Tallied::new([0.25, 3.0]),
    };
    recorder.evaluation(vec![row.clone()]);
    recorder.evaluation(vec![row.clone(), row.clone()]);
    recorder.finish(complete(trial)).unwrap();
    assert_eq!(reader::read_evaluation(&path).unwrap(), [row.clone(), row]);
}

#[test]
fn assigned_modes_are_balanced_over_subjects_who_keep_theirs() {
    let logs = tempfile::tempdir().unwrap();
    let taught = |subject: &str, mode: Mode, assigned: bool| {
        let subject: Subject = subject.parse().unwrap();
        let made = Folder::create(logs.path(), &subject, None, "balance", mode.word()).unwrap();
        let sidecar = Sidecar { subject, mode, assigned, ..sidecar(made.trial) };
        Recorder::<Model>::start(made.folder, &COLUMNS, Manner::Virtual, &sidecar)
            .unwrap()
            .finish(sidecar)
            .unwrap();
    };
    let chance = || stream(4, Purpose::Assignment, Place::default());
    let draws: Vec<Mode> = {
        let mut chance = chance();
        (0..50).map(|_| assignment::assign(&[], &mut chance)).collect()
    };
    assert!(draws.contains(&Mode::Sequential) && draws.contains(&Mode::Simultaneous));

    taught("a", Mode::Sequential, true);
    taught("a", Mode::Simultaneous, false);
    taught("b", Mode::Sequential, false);
    let modes = assignment::modes_so_far(logs.path(), "balance", "balance");
    assert_eq!(modes, [Mode::Sequential, Mode::Sequential]);
    assert_eq!(assignment::assign(&modes, &mut chance()), Mode::Simultaneous);
    assert_eq!(assignment::modes_so_far(logs.path(), "swing-up", "balance"), []);
    assert_eq!(assignment::modes_so_far(logs.path(), "balance", "modern"), [], "never pooled");
    let mode_of =
        |s: &str| assignment::mode_of(logs.path(), &s.parse().unwrap(), "balance", "balance");
    assert_eq!((mode_of("a"), mode_of("b"), mode_of("c")), (Some(Mode::Sequential), None, None));
}
