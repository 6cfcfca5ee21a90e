//! A script that runs a study as an array of jobs on Slurm, one shard a job.

use std::fmt::Write as _;

use crate::profile::shell_word;

/// The processor time that a job should take, s.
const JOB_S: f64 = 600.0;
/// The most jobs in an array, which most installations allow.
const MOST_JOBS: u32 = 1000;
/// Memory is asked for in steps of so much, MiB.
const MEMORY_STEP: f64 = 64.0;
/// and at least so much.
const LEAST_MEMORY: f64 = 128.0;
/// And of what was measured so many times as much, since runs differ.
const RESERVE: f64 = 2.0;

/// What a run was measured to need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Need {
    /// Processor time, the mean, s,
    pub mean_s: f64,
    /// the most,
    pub most_s: f64,
    /// and memory, MiB.
    pub memory_mib: f64,
    /// Runs that were measured.
    pub measured: usize,
}

/// What an array asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Array {
    /// Jobs,
    pub jobs: u32,
    /// memory of each, MiB,
    pub memory_mib: u32,
    /// and the time after which it is ended, minutes.
    pub minutes: u32,
}

impl Array {
    /// An array for `runs` runs that each need `need`; `jobs` of them, if that is wanted.
    #[must_use]
    pub fn of(runs: u32, need: &Need, jobs: Option<u32>) -> Self {
        let whole = |number: f64| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "saturates"
            )]
            let whole = number.ceil() as u32;
            whole
        };
        let by_time = whole(f64::from(runs) * need.mean_s / JOB_S);
        let jobs = jobs.unwrap_or(by_time).clamp(1, runs.clamp(1, MOST_JOBS));
        let of_a_job = f64::from(runs.div_ceil(jobs));
        Self {
            jobs,
            memory_mib: whole((RESERVE * need.memory_mib).max(LEAST_MEMORY) / MEMORY_STEP)
                * whole(MEMORY_STEP),
            minutes: whole(RESERVE * of_a_job * need.most_s / 60.0) + 1,
        }
    }
}

/// What a script runs, and where.
#[derive(Clone, Copy, Debug)]
pub struct Job<'a> {
    /// The study's name.
    pub study: &'a str,
    /// The folder in which it was asked for: names and paths in it mean what they meant there.
    pub desk: &'a str,
    /// The path of coadapt.
    pub program: &'a str,
    /// The words after `coadapt study`, as a shell reads them.
    pub words: &'a str,
    /// The folder that shards are named after.
    pub folder: &'a str,
}

/// The script that runs `job` as `array`, which asks for what was measured.
#[must_use]
pub fn script(job: &Job<'_>, array: Array, need: &Need) -> String {
    let Array { jobs, memory_mib, minutes } = array;
    let Need { mean_s, most_s, memory_mib: used, measured } = need;
    let is_plain = |c: &char| c.is_alphanumeric() || "-_.".contains(*c);
    let name: String = job.study.chars().map(|c| if is_plain(&c) { c } else { '_' }).collect();
    let [desk, program, folder] = [job.desk, job.program, job.folder].map(shell_word);
    let words = job.words;
    // A comment ends with its line, whatever is quoted.
    let told = folder.replace(char::is_control, "?");
    let mut script = String::new();
    // Writing to a text cannot fail.
    let _ = write!(
        script,
        "#!/bin/sh
# The study {name} as an array of {jobs} jobs, one shard each:
#   sbatch slurm.sh
# and when all are over:
#   coadapt study merge {told}-*-of-{jobs} --out {told}
# A job that was cut goes on where it was when it is submitted again.
# Measured on {measured} run(s): {mean_s:.1} s of processor time on average, {most_s:.1} s at most, {used:.0} MiB.
#SBATCH --job-name=coadapt-{name}
#SBATCH --array=1-{jobs}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --mem={memory_mib}M
#SBATCH --time={minutes}
cd {desk} || exit 1
exec {program} study {words} \\
    --shard \"$SLURM_ARRAY_TASK_ID/{jobs}\" --jobs \"${{SLURM_CPUS_PER_TASK:-1}}\" \\
    --out {folder}-\"$SLURM_ARRAY_TASK_ID\"-of-{jobs}
"
    );
    script
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_asks_for_what_was_measured_and_a_reserve() {
        let need = Need { mean_s: 5.0, most_s: 8.0, memory_mib: 20.0, measured: 1 };
        assert_eq!(Array::of(240, &need, None), Array { jobs: 2, memory_mib: 128, minutes: 33 });
        assert_eq!(Array::of(3, &need, Some(99)).jobs, 3, "no job without a run");
        assert_eq!(Array::of(1_000_000, &need, None).jobs, MOST_JOBS);
        let array = Array::of(4, &need, Some(4));
        let job = Job {
            study: "it's\nmine",
            desk: "/home/o'neill/a b",
            program: "/bin/coadapt",
            words: "'it'\\''s.ron' --seeds 2",
            folder: "out/x y",
        };
        let script = script(&job, array, &need);
        for line in [
            "#SBATCH --array=1-4",
            "#SBATCH --cpus-per-task=1",
            "#SBATCH --mem=128M",
            "--shard \"$SLURM_ARRAY_TASK_ID/4\"",
            "coadapt study merge 'out/x y'-*-of-4 --out 'out/x y'",
            "cd '/home/o'\\''neill/a b' || exit 1\n",
            "exec /bin/coadapt study 'it'\\''s.ron' --seeds 2 ",
            "#SBATCH --job-name=coadapt-it_s_mine\n",
        ] {
            assert!(script.contains(line), "{line}: {script}");
        }
    }
}
