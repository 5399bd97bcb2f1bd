//! How far two sets of values are apart.

use std::collections::BTreeMap;

/// What is told by a [`Difference`](super::Difference).
#[derive(Default)]
pub struct Compared {
    pub compared: usize,
    pub unequal: usize,
    pub largest: f64,
    pub weighed: f64,
    pub integers: bool,
}

/// Values under equal keys; a key that only one side has is unequal.
fn differences<K: Ord, T: Copy>(
    here: impl Iterator<Item = (K, T)>,
    there: impl Iterator<Item = (K, T)>,
    difference: impl Fn(T, T) -> (bool, f64),
) -> Compared {
    let here: BTreeMap<K, T> = here.collect();
    let (mut met, mut unequal, mut largest) = (0, 0, 0.0f64);
    for (key, b) in there {
        match here.get(&key) {
            None => unequal += 1,
            Some(&a) => {
                met += 1;
                let (equal, size) = difference(a, b);
                unequal += usize::from(!equal);
                largest = largest.max(size);
            }
        }
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

pub fn floats<K: Ord>(here: impl Iterator<Item = (K, f32)>, there: impl Iterator<Item = (K, f32)>) -> Compared {
    differences(here, there, |a, b| (a.to_bits() == b.to_bits() || a == b, f64::from((a - b).abs())))
}
