//! Differences between two sets of values.

use std::collections::BTreeMap;

/// The numbers of a [`Difference`](super::Difference).
#[derive(Default)]
pub struct Compared {
    pub compared: usize,
    pub unequal: usize,
    pub largest: f64,
    pub weighed: f64,
    pub integers: bool,
}

/// Values under equal keys; a key that only one side has is unequal, and infinitely far apart.
fn differences<K: Ord, T: Copy>(
    here: impl Iterator<Item = (K, T)>,
    there: impl Iterator<Item = (K, T)>,
    difference: impl Fn(T, T) -> (bool, f64),
) -> Compared {
    let here: BTreeMap<K, T> = here.collect();
    let (mut met, mut unequal, mut largest) = (0, 0, 0.0f64);
    for (key, b) in there {
        match here.get(&key) {
            None => (unequal, largest) = (unequal + 1, f64::INFINITY),
            Some(&a) => {
                met += 1;
                let (equal, size) = difference(a, b);
                unequal += usize::from(!equal);
                largest = largest.max(size);
            }
        }
    }
    if met < here.len() {
        largest = f64::INFINITY;
    }
    let (compared, unequal) = (here.len(), unequal + here.len() - met);
    Compared { compared, unequal, largest, weighed: largest, integers: false }
}

pub fn integers<K: Ord, T: Copy + PartialEq + Into<i64>>(
    here: impl Iterator<Item = (K, T)>,
    there: impl Iterator<Item = (K, T)>,
) -> Compared {
    let found = differences(here, there, |a, b| (a == b, (a.into() - b.into()).abs() as f64));
    Compared { integers: true, ..found }
}

/// If a value is a number on one side only, they are infinitely far apart.
pub fn floats<K: Ord>(here: impl Iterator<Item = (K, f32)>, there: impl Iterator<Item = (K, f32)>) -> Compared {
    differences(here, there, |a, b| {
        let equal = a.to_bits() == b.to_bits() || a == b;
        let apart = f64::from((a - b).abs());
        (
            equal,
            if equal {
                0.0
            } else if apart.is_nan() {
                f64::INFINITY
            } else {
                apart
            },
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(here: &[(u32, f32)], there: &[(u32, f32)]) -> (usize, f64) {
        let found = floats(here.iter().copied(), there.iter().copied());
        (found.unequal, found.largest)
    }

    #[test]
    fn what_is_missing_or_no_number_is_infinitely_far_apart() {
        let (one, nan) = ([(0, 1.0), (1, f32::INFINITY)], f32::NAN);
        assert_eq!(of(&one, &one), (0, 0.0));
        assert_eq!(of(&one, &[(0, 1.5), (1, f32::INFINITY)]), (1, 0.5));
        assert_eq!(of(&[(0, nan)], &[(0, nan)]), (0, 0.0));
        for (here, there) in [
            (&[(0, 1.0)][..], &[(0, nan)][..]),
            (&[(0, nan)], &[(0, 1.0)]),
            (&one[..1], &one[..]),
            (&one[..], &one[..1]),
        ] {
            assert_eq!(of(here, there), (1, f64::INFINITY));
        }
    }
}
