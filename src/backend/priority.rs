//! Threads that serve a plant go before all others of the computer, where the system permits it.

use thread_priority::{
    NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ScheduleParams, ThreadPriority,
    ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
};

/// How urgent a thread is. Both are above whatever else runs in real time by default, and below the
/// system's own threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Urgency {
    /// It decides on the next action.
    Decision = 10,
    /// It keeps the motor safe, decision or not.
    Motor = 20,
}

/// From now on this thread, and what it starts, goes before all others that are less urgent: a
/// computer that is busy with other things keeps it waiting no longer. Returns whether the system
/// permits it.
pub fn go_first(urgency: Urgency) -> bool {
    let first_come = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let priority = ThreadPriority::from_posix(ScheduleParams { sched_priority: urgency as i32 });
    set_thread_priority_and_policy(thread_native_id(), priority, first_come).is_ok()
}

/// From now on this thread waits like all others again: what it has to do may take long.
pub fn go_with_all() {
    let fair = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Other);
    let priority = ThreadPriority::from_posix(ScheduleParams { sched_priority: 0 });
    // Whoever never went first needs no leave to do this.
    let _ = set_thread_priority_and_policy(thread_native_id(), priority, fair);
}

#[cfg(test)]
mod tests {
    use thread_priority::thread_schedule_policy;

    use super::*;

    #[test]
    fn it_says_what_the_system_did() {
        // A thread of its own: the test's others are in no hurry.
        let told = std::thread::spawn(|| {
            let before = thread_schedule_policy().unwrap();
            let (is_first, then) = (go_first(Urgency::Motor), thread_schedule_policy().unwrap());
            go_with_all();
            (is_first, before, then, thread_schedule_policy().unwrap())
        });
        let (is_first, before, then, after) = told.join().unwrap();
        let first_come = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        assert_eq!(is_first, then == first_come);
        assert_eq!(before, after);
    }
}
