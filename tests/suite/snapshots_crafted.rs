//! Complete files of snapshots that no solver wrote.

use crate::backends::Tests;
use crate::snapshots::{fault, fountain};
use crate::worlds::{DX, cuboid, mixed_explicit, one};
use pbmpm::lockstep::{Array, Spoil};
use pbmpm::{Action, CpuSolver, DVec3, Error, Region, Simulate, Snapshot, SnapshotFault, Tool};
use serde_json::{Value, json};

pub fn add(tests: &mut Tests) {
    tests.once("snapshots_crafted", "what_no_host_asked_for_is_refused", what_no_host_asked_for_is_refused);
    tests.once("snapshots_crafted", "any_number_is_refused_or_borne", any_number_is_refused_or_borne);
    tests.once("snapshots_crafted", "no_number_is_taken_for_a_strain", no_number_is_taken_for_a_strain);
}

/// The header of a snapshot's bytes, and what follows.
fn header(bytes: &[u8]) -> (&str, &[u8]) {
    let length = u64::from_le_bytes(std::array::from_fn(|i| bytes[12 + i])) as usize;
    let (header, rest) = bytes[28..].split_at(length);
    (std::str::from_utf8(header).unwrap(), rest)
}

/// The same snapshot with another header, and the checksum that belongs to it.
fn with_header(bytes: &[u8], other: &str) -> Vec<u8> {
    let rest = header(bytes).1;
    let mut out = bytes[..12].to_vec();
    out.extend_from_slice(&(other.len() as u64).to_le_bytes());
    out.extend_from_slice(&bytes[20..28]);
    out.extend_from_slice(other.as_bytes());
    out.extend_from_slice(&rest[..rest.len() - 4]);
    out.extend_from_slice(&crc32fast::hash(&out).to_le_bytes());
    out
}

/// Replaces the value of a snapshot's field, at its first occurrence.
fn crafted(bytes: &[u8], field: &str, value: &str) -> Vec<u8> {
    let header = header(bytes).0;
    let at = header.find(&format!("\"{field}\":")).expect("the field") + field.len() + 3;
    let end = at + header[at..].find([',', '}']).expect("its end");
    with_header(bytes, &[&header[..at], value, &header[end..]].concat())
}

/// The numbers below a value.
fn numbers(value: &mut Value) -> Vec<&mut Value> {
    match value {
        Value::Number(_) => vec![value],
        Value::Array(all) => all.iter_mut().flat_map(numbers).collect(),
        Value::Object(all) => all.values_mut().flat_map(numbers).collect(),
        _ => Vec::new(),
    }
}

/// Whatever number of a complete file is replaced, by whatever: it is refused, or the solver takes a step.
fn any_number_is_refused_or_borne() {
    let world = fountain();
    let mut solver = CpuSolver::<f32>::new(&world).unwrap();
    solver.steps(10).unwrap();
    solver.add(&one(DVec3::splat(3.0) * DX)).unwrap();
    solver.remove(&Region::new(cuboid([1.0; 3]), DVec3::splat(9.0) * DX)).unwrap();
    let pose = solver.poses()[0];
    solver.set_collider(0, Some(pose), DVec3::X, DVec3::Y).unwrap();
    let action = Action::Sweep { acceleration: 1.0 };
    solver.set_tools(&[Tool { action, radius: 0.1, position: DVec3::splat(0.1), velocity: DVec3::X }]).unwrap();
    let bytes = solver.save().unwrap().to_bytes().unwrap();
    let mut stated: Value = serde_json::from_str(header(&bytes).0).unwrap();
    // As of a device that has a step to take again.
    stated["clock"]["due"] = json!([stated["clock"]["asked"]]);
    let (mut refused, mut borne) = (0, 0);
    for part in ["clock", "counts", "loads", "sensed", "width", "stored", "words", "lanes"] {
        for n in 0..numbers(&mut stated[part].clone()).len() {
            for value in [json!(0), json!(7), json!(-1), json!(1e-300), json!(1e300), json!(i64::MIN), json!(u64::MAX)]
            {
                let mut other = stated.clone();
                *numbers(&mut other[part])[n] = value;
                let crafted = Snapshot::from_bytes(&with_header(&bytes, &other.to_string()), &world);
                match crafted.and_then(|snapshot| solver.restore(&snapshot)) {
                    Ok(()) => borne += 1,
                    Err(_) => refused += 1,
                }
                solver.step().unwrap();
            }
        }
    }
    assert!(refused > 100 && borne > 100, "{refused} refused, {borne} borne");
}

/// Complete files with numbers that would make a solver run endlessly, or out of memory.
fn what_no_host_asked_for_is_refused() {
    let world = fountain();
    let mut solver = CpuSolver::<f32>::new(&world).unwrap();
    solver.steps(10).unwrap();
    let bytes = solver.save().unwrap().to_bytes().unwrap();
    let mut restored = |bytes: &[u8]| solver.restore(&Snapshot::from_bytes(bytes, &world)?);
    assert_eq!(restored(&crafted(&bytes, "owed", "0.5")), Ok(()));
    for (field, value, named) in [
        ("owed", "1e18", "progress.owed"),
        ("heaviest", "1e300", "heaviest"),
        ("occupied", "4000000000", "more blocks"),
        ("active", "4000000000", "more blocks"),
        ("time", "-1", "clock.time"),
    ] {
        let error = restored(&crafted(&bytes, field, value)).expect_err(field);
        assert!(error.to_string().contains(named), "{field}: {error}");
    }
    // A pose is [position, rotation]; this is its first number.
    let error = restored(&crafted(&bytes, "poses", "[{\"position\":[1e999")).expect_err("poses");
    assert!(matches!(error, Error::Snapshot { .. }), "{error}");
}

/// Steps do not check deformation gradients for NaN and infinity, so these may not be restored.
fn no_number_is_taken_for_a_strain() {
    let world = mixed_explicit();
    for (lane, value) in [(0, f32::NAN), (7, f32::INFINITY), (10, f32::NEG_INFINITY)] {
        let mut solver = CpuSolver::<f32>::new(&world).unwrap();
        solver.step().unwrap();
        let sound = solver.save().unwrap();
        solver.spoil(5, Array::Deformation, lane, value);
        let spoilt = solver.save().unwrap();
        assert!(matches!(fault(solver.restore(&spoilt)), SnapshotFault::Content(_)), "lane {lane}");
        assert_eq!(solver.restore(&sound), Ok(()));
        // In a particle that takes no part it does not matter.
        solver.spoil(5, Array::Deformation, lane, value);
        solver.spoil(5, Array::Position, 3, -1.0);
        let out = solver.save().unwrap();
        assert_eq!(solver.restore(&out), Ok(()));
    }
}
