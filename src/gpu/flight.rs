//! Steps that are recorded and not known to be finished, and whether the matter on the device agrees with the clock.

use crate::timeline::Moment;
use crate::timeline::asked::Beginning;
use std::collections::VecDeque;
use std::ops::Range;

/// A step that was recorded and is not yet known to be finished.
#[derive(Debug)]
struct Recorded {
    /// Steps recorded before it.
    number: u64,
    beginning: Beginning,
    /// Where its candidates lie.
    candidates: Range<u32>,
}

/// What the host knows of the steps that it has recorded.
#[derive(Debug, Default)]
pub struct Flight {
    steps: VecDeque<Recorded>,
    /// Steps that the device had executed, taken or not, before the first recorded one.
    start: u64,
    /// Steps recorded so far, taken or not.
    recorded: u64,
    /// Steps known to be finished.
    finished: u64,
    /// The largest known difference between the matter and the clock, in steps.
    lost: u64,
    /// The device takes no step for lack of room in the grid.
    full: bool,
}

impl Flight {
    /// Nothing in flight, on a device that has executed `start` steps, taken or not.
    pub fn after(start: u64) -> Self {
        Flight { start, ..Flight::default() }
    }

    pub fn recorded(&self) -> u64 {
        self.recorded
    }

    /// Steps that are recorded and not known to be finished.
    pub fn unfinished(&self) -> u64 {
        self.recorded - self.finished
    }

    pub fn is_full(&self) -> bool {
        self.full
    }

    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Notes a recorded step.
    pub fn record(&mut self, mut beginning: Beginning, candidates: Range<u32>) {
        if let Some(last) = self.steps.back() {
            beginning.share(&last.beginning);
        }
        self.steps.push_back(Recorded { number: self.recorded, beginning, candidates });
        self.recorded += 1;
    }

    /// The moment before the step that would be taken as number `step`.
    pub fn before(&self, step: u64) -> Option<&Moment> {
        self.from(step).next().map(|beginning| &beginning.moment)
    }

    /// The largest known difference between the matter and the clock, in steps, given that after `recorded` recorded
    /// steps the device had executed `executed`, taken or not.
    pub fn missed(&self, recorded: u64, executed: u64) -> u64 {
        (self.start + recorded).abs_diff(executed).max(self.lost)
    }

    /// Takes in a copy of the counters: after `recorded` recorded steps the device had executed `executed`, and was out
    /// of room if `full`. Returns whether this copy is the first to report that the device is out of room, and no step
    /// is missed.
    pub fn learn(&mut self, recorded: u64, executed: u64, full: bool) -> bool {
        self.lost = self.missed(recorded, executed);
        self.finished = self.finished.max(recorded);
        let was_full = std::mem::replace(&mut self.full, full);
        if !full {
            while self.steps.front().is_some_and(|s| s.number < self.finished) {
                self.steps.pop_front();
            }
        }
        full && !was_full && self.lost == 0
    }

    /// The steps from number `step` on.
    pub fn from(&self, step: u64) -> impl Iterator<Item = &Beginning> {
        self.steps.iter().map(|s| &s.beginning).skip_while(move |beginning| beginning.moment.step != step)
    }

    /// Notes that there is room again and nothing in flight.
    pub fn has_room(&mut self) {
        self.steps.clear();
        self.full = false;
    }

    /// Ranges of candidates that the device may still read.
    pub fn candidates(&self) -> impl Iterator<Item = Range<u32>> {
        self.steps.iter().map(|s| s.candidates.clone())
    }

    /// Forgets these ranges: the steps in flight keep the buffer that is being replaced.
    pub fn forget_candidates(&mut self) {
        self.steps.iter_mut().for_each(|s| s.candidates = 0..0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timeline::Timeline;
    use crate::world::World;
    use glam::DVec3;

    /// Records so many steps of a world's clock.
    fn record(flight: &mut Flight, clock: &mut Timeline, steps: u32) {
        for _ in 0..steps {
            flight.record(clock.beginning(), 0..0);
            let input = clock.input();
            clock.advance(&input);
        }
    }

    fn clock() -> Timeline {
        Timeline::new(&World::new(DVec3::ZERO, DVec3::ONE, 0.1), &[]).unwrap()
    }

    #[test]
    fn what_is_finished_is_let_go() {
        let (mut flight, mut clock) = (Flight::default(), clock());
        record(&mut flight, &mut clock, 5);
        assert!(!flight.learn(3, 3, false));
        assert_eq!((flight.unfinished(), flight.lost(), flight.steps.len()), (2, 0, 2));
        assert_eq!([2, 3].map(|step| flight.before(step).map(|m| m.step)), [None, Some(3)]);
        // An older copy changes nothing.
        assert!(!flight.learn(3, 3, false));
        assert!(!flight.learn(5, 5, false));
        assert_eq!((flight.unfinished(), flight.lost(), flight.steps.len()), (0, 0, 0));
    }

    #[test]
    fn steps_are_missed_for_good() {
        for (taken, lost) in [(1, 2), (3, 0), (4, 1)] {
            for full in [false, true] {
                let (mut flight, mut clock) = (Flight::after(7), clock());
                record(&mut flight, &mut clock, 5);
                flight.learn(3, 7 + taken, full);
                assert_eq!(flight.lost(), lost, "{taken} taken of 3");
                flight.learn(5, 7 + 5, full);
                assert_eq!(flight.lost(), lost);
            }
        }
    }

    /// Steps from the first that found no room have to be taken again; later copies that report the same change
    /// nothing.
    #[test]
    fn steps_without_room_are_not_lost() {
        let (mut flight, mut clock) = (Flight::default(), clock());
        record(&mut flight, &mut clock, 6);
        assert!(flight.learn(4, 2 + 2, true));
        let again: Vec<_> = flight.from(2).map(|beginning| beginning.moment.step).collect();
        assert_eq!((again, flight.lost(), flight.is_full()), (vec![2, 3, 4, 5], 0, true));
        assert!(!flight.learn(6, 2 + 4, true));
        assert_eq!((flight.unfinished(), flight.lost()), (0, 0));
        flight.has_room();
        assert_eq!((flight.is_full(), flight.from(2).count(), flight.recorded()), (false, 0, 6));
    }
}
