//! Ranges of a buffer for steps in flight, handed out one after the other and given back in the same order.

use std::ops::Range;

/// Where `count` items find room in a buffer of `room` when the ranges `taken`, oldest first, are in use; `None` if
/// nowhere.
pub fn place(room: u32, taken: impl Iterator<Item = Range<u32>>, count: u32) -> Option<u32> {
    let mut taken = taken.filter(|range| !range.is_empty());
    let Some(oldest) = taken.next() else {
        return (count <= room).then_some(0);
    };
    let end = taken.last().map_or(oldest.end, |newest| newest.end);
    if end > oldest.start {
        if count <= room - end {
            return Some(end);
        }
        return (count <= oldest.start).then_some(0);
    }
    (count <= oldest.start - end).then_some(end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;

    /// Whatever comes and goes, ranges lie inside the buffer and do not overlap.
    #[test]
    fn stretches_never_overlap() {
        let mut taken: VecDeque<Range<u32>> = VecDeque::new();
        let (mut placed, mut refused) = (0, 0);
        for k in 0u32..10_000 {
            let count = k.wrapping_mul(2_654_435_761) >> 27;
            match place(100, taken.iter().cloned(), count) {
                Some(first) => {
                    let new = first..first + count;
                    assert!(new.end <= 100);
                    let apart =
                        |t: &Range<u32>| t.is_empty() || new.is_empty() || t.end <= new.start || new.end <= t.start;
                    assert!(taken.iter().all(apart), "{new:?} among {taken:?}");
                    taken.push_back(new);
                    placed += 1;
                }
                None => {
                    refused += 1;
                    assert!(taken.iter().any(|t| !t.is_empty()));
                    taken.pop_front();
                }
            }
            if k % 7 == 0 {
                taken.pop_front();
            }
        }
        assert!(placed > 5000 && refused > 500, "{placed} {refused}");
        assert_eq!(place(5, std::iter::empty(), 6), None);
    }
}
