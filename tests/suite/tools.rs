//! Tools that push, sweep, attract, grab and stir.

use crate::alike::assert_states;
use crate::backends::{ALL, Backend, CPUS, DEVICES, MOST, Tests};
use crate::worlds::{DX, block, busy, empty, larger, particles};
use pbmpm::{
    Action, CpuSolver, DVec3, Error, GpuOptions, MAX_TOOLS, Motion, Particle, ScriptedTool, Simulate, Tool, Wall, World,
};

pub fn add(tests: &mut Tests) {
    tests.each("tools", ALL, "each_action_is_what_it_says", each_action_is_what_it_says);
    tests.each("tools", MOST, "a_push_adds_up", a_push_adds_up);
    tests.each("tools", MOST, "scripts_begin_and_end", scripts_begin_and_end);
    tests.each("tools", CPUS, "wielded_as_scripted", wielded_as_scripted);
    tests.each("tools", DEVICES, "devices_and_their_twin_agree", devices_and_their_twin_agree);
    tests.each("tools", MOST, "bad_tools_are_refused", bad_tools_are_refused);
    tests.once("tools", "bad_scripts_are_refused", bad_scripts_are_refused);
    tests.once("tools", "scene_files_hold_tools", scene_files_hold_tools);
}

/// A weightless block of 8 by 6 by 6 cells that flies as a whole, one iteration.
fn flying(velocity: [f64; 3]) -> World {
    let mut world = empty([40.0, 24.0, 24.0], Wall::Open);
    world.gravity = DVec3::ZERO;
    world.settings.iterations = 1;
    world.spawns.push(block([12.0, 9.0, 9.0], [20.0, 15.0, 15.0], velocity));
    world
}

/// The mean of `field` over the 27 nodes around a particle, weighted as the grid does.
fn on_the_grid(at: DVec3, field: impl Fn(DVec3) -> DVec3) -> DVec3 {
    let cells = at / DX;
    let weight = |distance: f64| match distance.abs() {
        d if d < 0.5 => 0.75 - d * d,
        d => 0.5 * (1.5 - d) * (1.5 - d),
    };
    let first = (cells - 0.5).floor();
    let mut mean = DVec3::ZERO;
    for n in 0..27 {
        let node = first + DVec3::new(f64::from(n % 3), f64::from(n / 3 % 3), f64::from(n / 9));
        let w = (cells - node).to_array().map(weight);
        mean += field(node * DX) * (w[0] * w[1] * w[2]);
    }
    mean
}

/// In a step, every node's velocity changes as the action prescribes: along the whole way of a tool that moves seven
/// cells, and not beyond its radius.
fn each_action_is_what_it_says(backend: Backend) {
    let v = DVec3::new(0.3, -0.2, 0.1);
    let mut world = flying(v.to_array());
    world.settings.max_displacement = 16.0; // a node that follows immediately is that fast
    let dt = world.settings.dt;
    let radius = 2.5 * DX;
    let omega = DVec3::new(3.0, -20.0, 8.0);
    // A unit vector, except within a tenth of the radius.
    let towards = |r: DVec3| r / (r.length_squared() + 0.01).sqrt();
    for way in [DVec3::new(6.0, 2.0, -3.0) * DX, DVec3::ZERO] {
        let start = DVec3::new(13.0, 11.0, 13.5) * DX;
        let follows = |time: f64| 1.0 - (-dt / time).exp();
        type Field<'a> = Box<dyn Fn(DVec3) -> DVec3 + 'a>;
        let push = DVec3::new(4.0, -30.0, 2.0);
        let mut actions: Vec<(Action, Field<'_>)> = vec![
            (Action::Push { acceleration: push }, Box::new(move |_| push * dt)),
            (Action::Attract { acceleration: 25.0 }, Box::new(move |r| -towards(r / radius) * 25.0 * dt)),
            (Action::Attract { acceleration: -9.0 }, Box::new(move |r| towards(r / radius) * 9.0 * dt)),
            (Action::Grab { time: 0.02 }, Box::new(move |_| (way / dt - v) * follows(0.02))),
            (Action::Grab { time: 0.0 }, Box::new(move |_| way / dt - v)),
            (
                Action::Stir { angular_velocity: omega, time: 0.05 },
                Box::new(move |r| (way / dt + omega.cross(r) - v) * follows(0.05)),
            ),
        ];
        let sweep = if way == DVec3::ZERO { DVec3::ZERO } else { way.normalize() * 40.0 * dt };
        actions.push((Action::Sweep { acceleration: 40.0 }, Box::new(move |_| sweep)));
        for (action, change) in actions {
            let mut solver = backend.solver(&world);
            let before = solver.particles().unwrap();
            solver.set_tools(&[Tool { action, radius, position: start, velocity: way / dt }]).unwrap();
            solver.step().unwrap();
            let now = solver.particles().unwrap();
            let mut touched = 0;
            for (old, new) in before.iter().zip(&now) {
                let expected = on_the_grid(old.position, |x| {
                    let share = (x - start).dot(way) / way.length_squared().max(1e-30);
                    let r = x - start - way * share.clamp(0.0, 1.0);
                    let near = (1.0 - r.length_squared() / (radius * radius)).max(0.0);
                    v + change(r) * near * near
                });
                let size = v.length() + 10.0 * DX / dt;
                assert!(
                    new.velocity.distance(expected) < backend.pick(1e-12, 1e-5) * size,
                    "{action:?} {way}: {} instead of {expected}",
                    new.velocity
                );
                touched += usize::from(expected.distance(v) > 1e-9);
            }
            let idle = matches!(action, Action::Sweep { .. }) && way == DVec3::ZERO;
            let some = touched > 100 && touched < before.len() - 100;
            assert!(if idle { touched == 0 } else { some }, "{action:?} {way}: {touched} of {}", before.len());
        }
    }
}

fn everywhere(action: Action) -> ScriptedTool {
    ScriptedTool::new(action, 1e6, DVec3::splat(10.0 * DX))
}

/// The velocity that all particles have in common.
fn common(particles: &[Particle], tolerance: f64) -> DVec3 {
    let first = particles[0].velocity;
    let apart = particles.iter().map(|p| p.velocity.distance(first)).fold(0.0, larger);
    assert!(apart < tolerance, "the block flies as a whole but for {apart} m/s");
    first
}

/// A tool that extends far beyond the block accelerates it as a whole, by a·dt in each step, for any iterations; two
/// tools add up.
fn a_push_adds_up(backend: Backend) {
    let mut world = flying([0.0; 3]);
    world.settings.iterations = 3;
    let pushes = [DVec3::new(2.0, 0.0, -1.0), DVec3::new(0.5, 3.0, 0.0)];
    world.tools = pushes.map(|acceleration| everywhere(Action::Push { acceleration })).to_vec();
    let mut solver = backend.solver(&world);
    let before = particles(&mut *solver);
    solver.steps(20).unwrap();
    let now = particles(&mut *solver);
    let (a, dt) = (pushes[0] + pushes[1], world.settings.dt);
    let tolerance = backend.pick(1e-9, 2e-4) * a.length();
    let v = common(&now, tolerance * 20.0 * dt);
    assert!(v.distance(a * (20.0 * dt)) < tolerance * 20.0 * dt, "{v}");
    let moved = now[0].position - before[0].position;
    assert!(moved.distance(a * (dt * dt * 210.0)) < tolerance * dt * dt * 210.0 + 1e-6 * DX, "{moved}");
}

/// From the first step that begins at the start to the last that begins before the end, at the positions of the motion.
fn scripts_begin_and_end(backend: Backend) {
    let mut world = flying([0.0; 3]);
    let dt = world.settings.dt;
    let push = Action::Push { acceleration: DVec3::X * 6.0 };
    world.tools = vec![ScriptedTool { start: 2.0 * dt, end: Some(5.0 * dt), ..everywhere(push) }];
    let mut solver = backend.solver(&world);
    for step in 1..8 {
        solver.step().unwrap();
        let v = common(&particles(&mut *solver), 1e-4);
        let expected = 6.0 * dt * f64::from((step - 2).clamp(0, 3));
        assert!(v.distance(DVec3::X * expected) < 1e-4, "{v} after {step} steps, {expected} expected");
    }
    // A tool on a path acts where it passes, and nothing happens before it arrives.
    let path = Motion::Keyframes {
        times: vec![0.0, 4.0 * dt],
        positions: vec![DVec3::X * -16.0 * DX, DVec3::X * 4.0 * DX],
        rotations: Vec::new(),
        repeat: false,
    };
    let mut tool = ScriptedTool::new(push, 3.0 * DX, DVec3::new(12.0, 12.0, 12.0) * DX);
    tool.motion = Some(path);
    assert!(tool.position_at(2.0 * dt).distance(DVec3::new(6.0, 12.0, 12.0) * DX) < 1e-12);
    world.tools = vec![tool];
    let mut solver = backend.solver(&world);
    for step in 1..5 {
        solver.step().unwrap();
        // It acts up to 3 cells from its centre, at 5 cells per step; nodes reach a cell and a half, the block begins
        // at 12.
        let fastest = particles(&mut *solver).iter().map(|p| p.velocity.length()).fold(0.0, larger);
        assert_eq!(fastest > 1e-6, -4.0 + 5.0 * f64::from(step) + 3.0 + 1.5 > 12.25, "{fastest} after {step} steps");
    }
}

fn steady(tool: &Tool) -> ScriptedTool {
    let motion = Motion::Steady { linear_velocity: tool.velocity, angular_velocity: DVec3::ZERO };
    ScriptedTool { motion: Some(motion), ..ScriptedTool::new(tool.action, tool.radius, tool.position) }
}

fn tools() -> Vec<Tool> {
    let tool = |action, at: [f64; 3], velocity: [f64; 3]| Tool {
        action,
        radius: 4.0 * DX,
        position: DVec3::from_array(at) * DX,
        velocity: DVec3::from_array(velocity),
    };
    vec![
        tool(Action::Push { acceleration: DVec3::new(0.0, 30.0, 5.0) }, [5.0, 6.0, 5.0], [0.3, 0.0, 0.0]),
        tool(Action::Sweep { acceleration: 60.0 }, [10.0, 8.0, 8.0], [-1.5, 0.5, 0.0]),
        tool(Action::Attract { acceleration: 40.0 }, [6.0, 8.0, 4.0], [0.0; 3]),
        tool(Action::Grab { time: 0.03 }, [9.0, 9.0, 9.0], [0.0, 1.0, -0.4]),
        tool(Action::Stir { angular_velocity: DVec3::Y * 12.0, time: 0.05 }, [5.0, 9.0, 5.0], [0.0; 3]),
        tool(
            Action::Stir { angular_velocity: DVec3::new(3.0, -4.0, 8.0), time: 0.01 },
            [6.0, 8.0, 7.0],
            [0.7, -0.4, 0.5],
        ),
    ]
}

/// A host's tool moves on at its velocity until it is put away, like a scripted one in steady motion.
fn wielded_as_scripted(backend: Backend) {
    let mut world = busy();
    let mut wielded = backend.solver(&world);
    wielded.steps(3).unwrap();
    wielded.set_tools(&tools()).unwrap();
    wielded.steps(12).unwrap();
    wielded.set_tools(&[]).unwrap();
    wielded.steps(5).unwrap();
    let (start, dt) = (3.0 * world.settings.dt, world.settings.dt);
    world.tools = tools().iter().map(steady).collect();
    for (tool, wielded) in world.tools.iter_mut().zip(tools()) {
        tool.position -= wielded.velocity * start;
        (tool.start, tool.end) = (start, Some(start + 12.0 * dt));
    }
    let mut scripted = backend.solver(&world);
    scripted.steps(20).unwrap();
    let mut without = backend.solver(&busy());
    without.steps(20).unwrap();
    let [a, b, c] = [&mut wielded, &mut scripted, &mut without].map(|s| particles(&mut **s));
    let apart = |a: &[Particle], b: &[Particle]| {
        a.iter().zip(b).map(|(a, b)| a.position.distance(b.position) / DX).fold(0.0, larger)
    };
    // Positions that are summed step by step differ by rounding from those that are not.
    assert!(apart(&a, &b) < backend.pick(1e-6, 1e-2), "{}", apart(&a, &b));
    assert!(apart(&a, &c) > 0.5, "{}", apart(&a, &c));
}

/// With the tools of the world and of a host, set while it runs, on a grid that must grow.
fn devices_and_their_twin_agree(backend: Backend) {
    let mut world = busy();
    let all = tools();
    for scripted in [true, false] {
        world.tools = if scripted { all[..2].iter().map(steady).collect() } else { Vec::new() };
        let options = GpuOptions { grid_blocks: Some(8), ..GpuOptions::default() };
        let mut cpu: Box<dyn Simulate> = Box::new(CpuSolver::<f32>::new(&world).unwrap());
        let mut device = backend.try_solver(&world, &options).unwrap();
        let [here, there] = [&mut cpu, &mut device].map(|solver| {
            solver.steps(2).unwrap();
            for (k, tool) in all.iter().enumerate() {
                solver.set_tools(&all[..k + 1]).unwrap();
                solver.steps(2).unwrap();
                solver.set_tools(&[*tool]).unwrap();
                solver.step().unwrap();
            }
            solver.particles().unwrap()
        });
        assert_states(backend, &here, &there, if scripted { "scripted and wielded" } else { "wielded" });
    }
}

fn refused(result: Result<(), Error>, field: &str) {
    match result {
        Err(Error::Invalid { field: found, .. }) => assert_eq!(found, field),
        other => panic!("{field}: {other:?}"),
    }
}

const NAN: f64 = f64::NAN;

/// Invalid values of actions, with the field that the error names.
fn bad_actions() -> Vec<(Action, &'static str)> {
    vec![
        (Action::Push { acceleration: DVec3::splat(1.1e6) }, "action.push.acceleration"),
        (Action::Push { acceleration: DVec3::splat(NAN) }, "action.push.acceleration"),
        (Action::Sweep { acceleration: f64::INFINITY }, "action.sweep.acceleration"),
        (Action::Attract { acceleration: -1.1e6 }, "action.attract.acceleration"),
        (Action::Grab { time: -0.1 }, "action.grab.time"),
        (Action::Grab { time: 1.1e3 }, "action.grab.time"),
        (Action::Stir { angular_velocity: DVec3::Y * 1.1e4, time: 0.1 }, "action.stir.angular_velocity"),
        (Action::Stir { angular_velocity: DVec3::Y, time: NAN }, "action.stir.time"),
    ]
}

/// They change nothing either.
fn bad_tools_are_refused(backend: Backend) {
    let mut solver = backend.solver(&flying([0.1, 0.0, 0.0]));
    let good = Tool { velocity: DVec3::ZERO, ..tools()[0] };
    for (action, field) in bad_actions() {
        refused(solver.set_tools(&[good, Tool { action, ..good }]), &format!("tools[1].{field}"));
    }
    for radius in [0.0, -1.0, 1.1e6, NAN] {
        refused(solver.set_tools(&[Tool { radius, ..good }]), "tools[0].radius");
    }
    refused(solver.set_tools(&[Tool { position: DVec3::X * 1.1e6, ..good }]), "tools[0].position");
    refused(solver.set_tools(&[Tool { velocity: DVec3::splat(NAN), ..good }]), "tools[0].velocity");
    refused(solver.set_tools(&vec![good; MAX_TOOLS + 1]), "tools");
    solver.steps(3).unwrap();
    let v = common(&particles(&mut *solver), 1e-4);
    assert!(v.distance(DVec3::X * 0.1) < 1e-4, "{v}");
    solver.set_tools(&[good; MAX_TOOLS]).unwrap();
    solver.step().unwrap();
}

fn bad_scripts_are_refused() {
    let good = everywhere(Action::Grab { time: 0.1 });
    let with = |tool: ScriptedTool| World { tools: vec![good.clone(), tool], ..flying([0.0; 3]) }.validate();
    for (action, field) in bad_actions() {
        refused(with(ScriptedTool { action, ..good.clone() }), &format!("tools[1].{field}"));
    }
    refused(with(ScriptedTool { radius: NAN, ..good.clone() }), "tools[1].radius");
    refused(with(ScriptedTool { position: DVec3::X * NAN, ..good.clone() }), "tools[1].position");
    refused(with(ScriptedTool { start: NAN, ..good.clone() }), "tools[1].start");
    refused(with(ScriptedTool { start: 1.0, end: Some(0.5), ..good.clone() }), "tools[1].end");
    let motion =
        Some(Motion::Oscillate { amplitude: DVec3::X, frequency: -1.0, phase: 0.0, angular_amplitude: DVec3::ZERO });
    refused(with(ScriptedTool { motion, ..good.clone() }), "tools[1].motion.oscillate.frequency");
    let mut world = flying([0.0; 3]);
    let of = |start: f64| ScriptedTool { start, end: Some(start + 1.0), ..good.clone() };
    world.tools = (0..64).map(|i| of(f64::from(i / 16))).collect();
    assert_eq!(world.validate(), Ok(()));
    world.tools.push(of(1.5));
    refused(world.validate(), "tools[32].start");
}

/// As in the documentation, and as written.
fn scene_files_hold_tools() {
    let text = r#"{
        "domain": { "min": [0, 0, 0], "max": [1, 1, 1], "cell_size": 0.05 },
        "materials": [{ "name": "water" }],
        "tools": [
            { "action": { "push": { "acceleration": [0, 20, 0] } }, "radius": 0.2, "position": [0.5, 0.5, 0.5] },
            { "action": { "sweep": { "acceleration": 5 } }, "radius": 0.2, "position": [0.5, 0.5, 0.5], "start": 1,
              "end": 2.5, "motion": { "oscillate": { "amplitude": [0.2, 0, 0], "frequency": 2 } } },
            { "action": { "attract": { "acceleration": -3 } }, "radius": 0.2, "position": [0.5, 0.5, 0.5] },
            { "action": { "grab": { "time": 0.1 } }, "radius": 0.2, "position": [0.5, 0.5, 0.5] },
            { "action": { "stir": { "angular_velocity": [0, 9, 0], "time": 0.1 } }, "radius": 0.2, "position": [0, 0, 0] }
        ]
    }"#;
    let world = pbmpm::scene::from_json(text).unwrap();
    let at = DVec3::splat(0.5);
    let push = Action::Push { acceleration: DVec3::Y * 20.0 };
    assert_eq!(world.tools[0], ScriptedTool::new(push, 0.2, at));
    assert_eq!((world.tools[1].start, world.tools[1].end), (1.0, Some(2.5)));
    assert!(world.tools[1].position_at(1.125).distance(at + DVec3::X * 0.2) < 1e-9);
    assert_eq!(world.tools[2].action, Action::Attract { acceleration: -3.0 });
    assert_eq!(world.tools[3].action, Action::Grab { time: 0.1 });
    assert_eq!(world.tools[4].action, Action::Stir { angular_velocity: DVec3::Y * 9.0, time: 0.1 });
    assert_eq!(pbmpm::scene::from_json(&pbmpm::scene::to_json(&world)), Ok(world));
}
