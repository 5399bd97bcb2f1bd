//! Lewin's scene files become the worlds that they describe.

use crate::backends::{Backend, Tests};
use crate::worlds::{after, assert_sound, report};
use pbmpm::scene::lewin::{Imported, Slab, from_json, is_lewin};
use pbmpm::{DVec3, Error, Model, Rate, Shape, Wall};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

pub fn add(tests: &mut Tests) {
    tests.once("lewin", "values_are_converted", values_are_converted);
    tests.once("lewin", "figures_become_bodies", figures_become_bodies);
    tests.once("lewin", "filled_cells_are_his", filled_cells_are_his);
    tests.once("lewin", "many_figures_on_the_largest_grid", many_figures_on_the_largest_grid);
    tests.once("lewin", "what_is_wrong_is_named", what_is_wrong_is_named);
    tests.once("lewin", "his_own_scenes_run", his_own_scenes_run);
}

/// 30 by 40 cells of 10 pixels, and parts of some more, which are no cells; y counts down from the last whole one.
fn scene(settings: &Value, shapes: &Value) -> String {
    let mut list = vec![json!({ "name": "simResDivisor", "type": "ENUM", "value": "10" })];
    list.extend(settings.as_array().into_iter().flatten().cloned());
    json!({ "version": 2, "resolution": [305, "407"], "settings": list, "shapes": shapes }).to_string()
}

fn shape(kind: u32, function: u32, at: [f64; 2], change: impl Fn(&mut Value)) -> Value {
    let mut shape = json!({
        "id": "it", "position": { "x": at[0], "y": at[1] }, "halfSize": { "x": 30, "y": 20 }, "radius": 25,
        "rotation": 0, "shape": kind, "function": function, "emitMaterial": 0, "emissionRate": 7,
    });
    change(&mut shape);
    shape
}

fn read(settings: &Value, shapes: &Value) -> Imported {
    from_json(&scene(settings, shapes), &Slab::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn values_are_converted() {
    let bare = read(&json!([]), &json!([]));
    // The defaults of his program: 2.5 heights per s², 240 Hz, five passes of which four solve.
    let world = &bare.world;
    assert!((world.gravity - DVec3::new(0.0, -9.81, 0.0)).length() < 1e-12);
    let cell = 9.81 / (2.5 * 40.0);
    assert!((world.domain.cell_size - cell).abs() < 1e-15);
    assert!((world.domain.min - DVec3::new(4.5, 4.5, 0.0) * cell).length() < 1e-12);
    assert!((world.domain.max - DVec3::new(25.5, 35.5, 6.0) * cell).length() < 1e-12);
    assert_eq!((world.settings.dt, world.settings.iterations), (1.0 / 240.0, 4));
    let kept = (-world.settings.dt / world.settings.volume_correction_time).exp();
    assert!((kept - 0.9f64.powi(4)).abs() < 1e-12, "four times a tenth");
    assert_eq!((world.domain.walls.x_min, world.domain.walls.z_min), (Wall::Friction(0.5), Wall::Slip));
    assert_eq!(world.materials.iter().map(|m| m.relaxation).collect::<Vec<_>>(), [1.5; 4]);
    assert_eq!(world.materials[1].model, Model::Elastic { shape_weight: 1.0 });
    assert_eq!(world.materials[2].model, Model::Sand { friction_angle: 30.0 });
    assert!(
        matches!(world.materials[3].model, Model::Viscoplastic { yield_strain } if (yield_strain - 0.1).abs() < 1e-12)
    );
    assert!(bare.notes.is_empty(), "{:?}", bare.notes);

    let settings = json!([
        { "name": "simRate", "value": "60" }, { "name": "iterationCount", "value": 2 },
        { "name": "gravityStrength", "value": 0 }, { "name": "liquidRelaxation", "value": "2.5" },
        { "name": "borderFriction", "value": 1 }, { "name": "useGridVolumeForLiquid", "value": "false" },
        { "name": "unheardOf", "value": 3 },
    ]);
    let other = read(&settings, &json!([]));
    assert_eq!((other.world.settings.dt, other.world.settings.iterations), (1.0 / 60.0, 1));
    assert_eq!((other.world.gravity, other.world.domain.cell_size), (DVec3::ZERO * -1.0, 0.02));
    assert_eq!((other.world.domain.walls.y_max, other.world.settings.volume_correction_time), (Wall::Stick, 1e3));
    assert_eq!(other.world.materials[0].relaxation, 1.9);
    assert_eq!(other.notes.len(), 2, "{:?}", other.notes);
}

fn figures_become_bodies() {
    let text = scene(
        &json!([]),
        &json!([
            shape(0, 1, [100.0, 300.0], |s| s["rotation"] = json!("30")),
            shape(1, 2, [200.0, 100.0], |_| ()),
            shape(1, 0, [155.0, 205.0], |s| s["emitMaterial"] = json!(3)),
        ]),
    );
    let world = from_json(&text, &Slab { cell_size: Some(0.01), depth: 4 }).unwrap_or_else(|e| panic!("{e}")).world;
    assert!((world.gravity.y + 2.5 * 40.0 * 0.01).abs() < 1e-12, "his gravity in cells of this size");
    let (ramp, outlet, jet) = (&world.colliders[0], &world.drains[0], &world.emitters[0]);
    assert!(ramp.position.distance(DVec3::new(0.10, 0.10, 0.02)) < 1e-12, "y points down on his screen");
    assert_eq!(ramp.shape, Shape::Box { half_size: DVec3::new(0.03, 0.02, 0.03) });
    assert!((ramp.rotation * DVec3::X).distance(DVec3::new(0.75f64.sqrt(), -0.5, 0.0)) < 1e-12, "clockwise");
    assert!((outlet.rotation * DVec3::Y).distance(DVec3::Z) < 1e-12, "a circle's cylinder lies along z");
    assert!(matches!(outlet.shape, Shape::Cylinder { radius, .. } if (radius - 0.025).abs() < 1e-12));
    // 16 corners within 2.5 of (15.5, 19.5): 4, 8 and 4 at distances of √0.5, √2.5 and √4.5. 4 cells deep, with 8
    // places each; 240/7 in whole steps.
    let Rate::Particles(rate) = jet.rate else { panic!("{:?}", jet.rate) };
    assert!((rate - 16.0 * 4.0 * 8.0 * 240.0 / 34.0).abs() < 1e-9, "{rate}");
    assert_eq!((jet.material.as_str(), jet.fill_limit), ("visco", 1e6));

    let fast = shape(1, 0, [155.0, 205.0], |s| s["emissionRate"] = json!(1e6));
    for count in 1..3 {
        let shapes: Vec<_> = std::iter::repeat_n(&fast, count).collect();
        let flood = read(&json!([{ "name": "simRate", "value": 1e5 }]), &json!(shapes));
        assert!(flood.notes.len() == 1 && flood.notes[0].contains("1e7"), "{:?}", flood.notes);
        for emitter in flood.world.emitters {
            let Rate::Particles(rate) = emitter.rate else { panic!("{:?}", emitter.rate) };
            assert!((rate * count as f64 / 1e7 - 1.0).abs() < 1e-9, "{rate}");
        }
    }
}

/// Whole cells whose lower corner is inside, and none on the border.
fn filled_cells_are_his() {
    let world = read(
        &json!([]),
        &json!([
            shape(0, 3, [153.0, 205.0], |_| ()),
            shape(1, 3, [155.0, 105.0], |s| s["emitMaterial"] = json!(1)),
            shape(0, 3, [0.0, 400.0], |s| s["halfSize"] = json!({ "x": 70, "y": 80 })),
        ]),
    )
    .world;
    let cell = world.domain.cell_size;
    let mut cells = std::collections::BTreeMap::new();
    let seeds = Backend::Cpu.solver(&world).particles().unwrap_or_else(|e| panic!("{e}"));
    for p in &seeds {
        // Jitter may move a particle into the next cell: rows of half a cell tell to which cell it belongs.
        let at = (p.position / cell * 2.0).floor() * 0.5;
        *cells.entry((p.material, at.x.floor() as i64, at.y.floor() as i64)).or_insert(0) += 1;
    }
    assert_eq!(seeds.len() % 48, 0, "whole cells of 6 deep");
    // The box: corners 13 to 18 by 18 to 21 (17.5 … 21.5). The circle: again 16. The shape that extends beyond the
    // border: 5 to 7 by 5 to 8.
    let of = |material| cells.iter().filter(move |((m, ..), _)| *m == material);
    let count = |material| of(material).map(|(_, n)| n).sum::<i32>() / 48;
    assert_eq!((count(1), count(0)), (16, 6 * 4 + 3 * 4));
    let box_and_corner =
        |x, y| (13..19).contains(&x) && (18..22).contains(&y) || (5..8).contains(&x) && (5..9).contains(&y);
    assert!(of(0).all(|((_, x, y), _)| box_and_corner(*x, *y)), "{cells:?}");
    // Its centre is at (15.5, 29.5), and it is as wide as it is high.
    assert!(of(1).all(|((_, x, y), _)| (13..19).contains(x) && (27..33).contains(y)), "{cells:?}");
    let lowest = seeds.iter().map(|p| p.position.min_element().min(p.position.y)).fold(f64::INFINITY, f64::min);
    assert!(lowest > 0.0);
}

/// The time to read a file depends on the size of the figures, not on the whole grid for each.
fn many_figures_on_the_largest_grid() {
    let place = |i: u32| [f64::from(100 + i % 64 * 600), f64::from(100 + i / 64 * 600)];
    let figures: Vec<_> = (0..4096).map(|i| shape(i % 2, u32::from(i >= 256) * 3, place(i), |_| ())).collect();
    let mut document: Value = serde_json::from_str(&scene(&json!([]), &json!(figures))).unwrap();
    document["resolution"] = json!([40_890, 40_890]);
    let begun = Instant::now();
    let world = from_json(&document.to_string(), &Slab::default()).unwrap_or_else(|e| panic!("{e}")).world;
    assert!(begun.elapsed() < Duration::from_secs(30), "{:?}", begun.elapsed());
    assert!(world.emitters.len() == 256 && world.spawns.len() > 3840, "{}", world.spawns.len());

    // Too many that each cover all of it.
    for figure in document["shapes"].as_array_mut().unwrap() {
        (figure["halfSize"], figure["radius"]) = (json!({ "x": 16_000, "y": 16_000 }), json!(16_000));
    }
    let begun = Instant::now();
    let error = from_json(&document.to_string(), &Slab::default()).unwrap_err();
    assert!(begun.elapsed() < Duration::from_secs(30), "{:?}", begun.elapsed());
    assert!(matches!(&error, Error::Invalid { field, .. } if field == "shapes"), "{error}");
}

fn what_is_wrong_is_named() {
    let good: Value = serde_json::from_str(&scene(&json!([]), &json!([shape(0, 1, [100.0, 300.0], |_| ())]))).unwrap();
    assert!(is_lewin(&good));
    type Change = fn(&mut Value);
    let broken: [(&str, Change); 12] = [
        ("version", |d| d["version"] = json!(1)),
        ("resolution[0]", |d| d["resolution"][0] = json!("wide")),
        ("resolution", |d| d["resolution"] = json!([100, 400])),
        ("resolution", |d| d["resolution"] = json!([65_536, 400])),
        ("settings[0].value", |d| d["settings"][0]["value"] = json!("coarse")),
        ("shapes[0].shape", |d| d["shapes"][0]["shape"] = json!(2)),
        ("shapes[0].function", |d| d["shapes"][0]["function"] = json!(0.5)),
        ("shapes[0].emitMaterial", |d| d["shapes"][0]["emitMaterial"] = json!(4)),
        ("shapes[0].halfSize", |d| d["shapes"][0]["halfSize"]["y"] = json!(0)),
        ("shapes[0].radius", |d| d["shapes"][0]["radius"] = json!(-1)),
        ("shapes[0].position.x", |d| d["shapes"][0]["position"]["x"] = json!("NaN")),
        ("shapes", |d| d["shapes"] = json!(7)),
    ];
    for (place, change) in broken {
        let mut document = good.clone();
        change(&mut document);
        let error = from_json(&document.to_string(), &Slab::default()).err();
        let at = match &error {
            Some(Error::Invalid { field, .. }) => field,
            Some(Error::Scene { path, .. }) => path,
            other => panic!("{place}: {other:?}"),
        };
        assert_eq!(at, place, "{error:?}");
    }
    let error = from_json(&good.to_string(), &Slab { depth: 0, ..Slab::default() });
    assert!(matches!(error, Err(Error::Invalid { field, .. }) if field == "slab.depth"));
    assert!(from_json("{", &Slab::default()).is_err());
}

fn his_own_scenes_run() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/lewin");
    let mut seen = 0;
    for entry in std::fs::read_dir(folder).expect("the folder exists") {
        let text = std::fs::read_to_string(entry.expect("a readable folder").path()).expect("a text");
        let imported = from_json(&text, &Slab::default()).unwrap_or_else(|e| panic!("{e}"));
        let mut solver = Backend::Cpu.solver(&imported.world);
        assert_sound(&after(&mut *solver, 30));
        let report = report(&mut *solver);
        assert!(report.alive > 1000 && report.emitted > 0, "{report:?}");
        seen += 1;
    }
    assert!(seen > 0);
}
