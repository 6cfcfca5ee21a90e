//! Threads that serve a plant go before all others of the computer, where the system permits it.

use thread_priority::{
    RealtimeThreadSchedulePolicy, ScheduleParams, ThreadPriority, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

/// Above whatever else runs in real time by default, and below the system's own threads.
const PRIORITY: i32 = 20;

/// From now on this thread, and what it starts, goes before all others: a computer that is busy
/// with other things keeps it waiting no longer. Returns whether the system permits it.
pub fn go_first() -> bool {
    let first_come = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let priority = ThreadPriority::from_posix(ScheduleParams { sched_priority: PRIORITY });
    set_thread_priority_and_policy(thread_native_id(), priority, first_come).is_ok()
}

#[cfg(test)]
mod tests {
    use thread_priority::thread_schedule_policy;

    use super::*;

    #[test]
    fn it_says_what_the_system_did() {
        // A thread of its own: the test's others are in no hurry.
        let told = std::thread::spawn(|| (go_first(), thread_schedule_policy().unwrap())).join();
        let (is_first, policy) = told.unwrap();
        let first_come = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        assert_eq!(is_first, policy == first_come);
    }
}
