//! A run that is stopped, saved and resumed is the same as one that was not stopped.

use crate::alike::assert_positions;
use crate::backends::{Backend, CPUS, MOST, NATIVE, SOFTWARE, Tests};
use crate::guest::Host;
use crate::meshes::{mesh, slab};
use crate::worlds::{
    DX, body, busy, cuboid, empty, flowing, mixed_explicit, mixed_implicit, mixed_thick, one, particles, report, thick,
};
use pbmpm::lockstep::{Array, Spoil};
use pbmpm::{
    Action, CpuSolver, DVec3, Emitter, Error, Fate, GpuOptions, GpuSolver, Particle, Rate, Region, Scheme, Shape,
    Simulate, Snapshot, SnapshotFault, Tool, Wall, World,
};

pub fn add(tests: &mut Tests) {
    tests.each("snapshots", MOST, "gone_on_with_is_never_stopped", gone_on_with_is_never_stopped);
    tests.each("snapshots", MOST, "what_hosts_asked_for_is_kept", what_hosts_asked_for_is_kept);
    tests.each("snapshots", SOFTWARE, "each_path_takes_the_others", each_path_takes_the_others);
    tests.each("snapshots", CPUS, "stage_times_are_of_the_steps_since", stage_times_are_of_the_steps_since);
    tests.each("snapshots", MOST, "other_worlds_are_refused", other_worlds_are_refused);
    tests.each("snapshots", NATIVE, "a_guest_does_not_wait", a_guest_does_not_wait);
    tests.each("snapshots", NATIVE, "one_that_reports_have_overtaken", one_that_reports_have_overtaken);
    tests.once("snapshots", "quarantine_is_kept", quarantine_is_kept);
    tests.once("snapshots", "the_shortest_steps_are_taken_up", the_shortest_steps_are_taken_up);
    tests.once("snapshots", "the_longest_steps_are_taken_up", the_longest_steps_are_taken_up);
    tests.once("snapshots", "what_is_to_be_removed_is_known_once", what_is_to_be_removed_is_known_once);
    tests.once("snapshots", "files_that_are_not_whole", files_that_are_not_whole);
    tests.once("snapshots", "a_file_is_written_whole_or_not_at_all", a_file_is_written_whole_or_not_at_all);
    #[cfg(unix)]
    tests.once("snapshots", "links_and_pipes_stay", links_and_pipes_stay);
    tests.once("snapshots", "writers_of_one_file_do_not_meet", writers_of_one_file_do_not_meet);
}

/// A fountain over a drain, with a sensor and a body whose load is measured.
pub fn fountain() -> World {
    let mut world = empty([12.0, 12.0, 12.0], Wall::Slip);
    world.name = "fountain".to_owned();
    world.settings.iterations = 2;
    let jet =
        Emitter::new("water", Shape::Sphere { radius: DX }, DVec3::new(6.0, 8.0, 6.0) * DX, Rate::Particles(3000.0));
    world.emitters.push(Emitter { velocity: DVec3::new(0.3, -1.0, 0.0), ..jet });
    world.drains.push(Region::new(cuboid([6.0, 1.5, 6.0]), DVec3::new(6.0, 1.5, 6.0) * DX));
    world.sensors.push(Region::new(cuboid([6.0, 3.0, 6.0]), DVec3::new(6.0, 6.0, 6.0) * DX));
    world.colliders.push(body(cuboid([1.5, 0.5, 1.5]), [7.0, 6.0, 6.0]));
    world.colliders[0].measure = true;
    world.settings.capacity = Some(500);
    world
}

fn bits(particles: &[Particle]) -> Vec<Vec<u64>> {
    let lanes = |p: &Particle| {
        let first = p.position.to_array().into_iter().chain(p.velocity.to_array());
        let all = first.chain(p.velocity_gradient.to_cols_array()).chain([p.volume_ratio, p.mass, p.material.into()]);
        all.map(f64::to_bits).collect()
    };
    particles.iter().map(lanes).collect()
}

/// Everything that can be read from a solver: its counts and readings, and the particles' bits.
fn everything(solver: &mut dyn Simulate) -> (String, Vec<Vec<u64>>) {
    let mut counts = report(solver);
    // How often a grid must grow depends on its previous size.
    counts.faults.steps_deferred = 0;
    let told = (
        counts,
        solver.loads().unwrap(),
        solver.sensors().unwrap(),
        solver.poses().to_vec(),
        (solver.dt(), solver.time(), solver.gravity()),
    );
    (format!("{told:?}"), bits(&particles(solver)))
}

/// Converted to a file's bytes and back.
fn kept(solver: &mut dyn Simulate, world: &World) -> Snapshot {
    let snapshot = solver.save().unwrap();
    let bytes = snapshot.to_bytes().unwrap();
    let read = Snapshot::from_bytes(&bytes, world).unwrap();
    assert_eq!(read, snapshot);
    let (inside, all) = (snapshot.particles().unwrap(), particles(solver));
    let (used, unused) = all.split_at(inside.len());
    assert_eq!(bits(&inside), bits(used));
    assert!(unused.iter().all(|p| p.fate == Fate::Vacant));
    snapshot
}

/// Times of the stages do not include steps before the snapshot that a solver has resumed.
fn stage_times_are_of_the_steps_since(backend: Backend) {
    let mut world = empty([8.0, 8.0, 8.0], Wall::Slip);
    world.spawns.push(one(DVec3::splat(4.0) * DX));
    let mut solver = backend.solver(&world);
    solver.steps(20_000).unwrap();
    let snapshot = solver.save().unwrap();
    let mut other = backend.solver(&world);
    other.restore(&snapshot).unwrap();
    let start = std::time::Instant::now();
    other.steps(20).unwrap();
    let taken = start.elapsed().as_secs_f64() / 20.0;
    let stages: f64 = other.stage_times().iter().map(|stage| stage.seconds).sum();
    // Averaged over all steps they would be a thousandth. The time outside the stages depends on the machine.
    assert!(stages <= taken && stages > 0.01 * taken, "{stages} of {taken} s");
}

/// In every scheme, with emitters, drains, sensors, loads and tools, into a new solver and into one that has run on
/// differently.
fn gone_on_with_is_never_stopped(backend: Backend) {
    for world in [busy(), flowing(), thick(), mixed_explicit(), mixed_thick(), fountain()] {
        let mut whole = backend.solver(&world);
        whole.steps(9).unwrap();
        let snapshot = kept(&mut *whole, &world);
        assert_eq!((snapshot.step(), snapshot.time()), (9, whole.time()));
        let then = everything(&mut *whole);
        whole.steps(9).unwrap();
        let end = everything(&mut *whole);
        assert_ne!(then, end);

        let mut fresh = backend.solver(&world);
        fresh.restore(&snapshot).unwrap();
        assert_eq!(everything(&mut *fresh), then, "{}", world.name);
        fresh.steps(9).unwrap();
        assert_eq!(everything(&mut *fresh), end, "{}", world.name);

        // Back in time, as a game does.
        fresh.set_gravity(DVec3::X).unwrap();
        fresh.steps(3).unwrap();
        fresh.restore(&snapshot).unwrap();
        fresh.steps(9).unwrap();
        assert_eq!(everything(&mut *fresh), end, "{}", world.name);
    }
}

/// Requests that are not carried out yet, and lasting changes.
fn what_hosts_asked_for_is_kept(backend: Backend) {
    let world = fountain();
    let mut whole = backend.solver(&world);
    whole.steps(12).unwrap();
    whole.set_dt(1.0 / 200.0).unwrap();
    whole.steps(2).unwrap();
    whole.set_gravity(DVec3::new(1.0, -5.0, 0.5)).unwrap();
    whole.set_emission(0, Rate::Particles(1000.0)).unwrap();
    let pose = pbmpm::Pose { position: DVec3::new(6.0, 5.0, 6.0) * DX, ..whole.poses()[0] };
    whole.set_collider(0, Some(pose), DVec3::X * 0.1, DVec3::Y).unwrap();
    whole.add(&one(DVec3::splat(0.19))).unwrap();
    whole.remove(&Region::new(Shape::Sphere { radius: 2.0 * DX }, DVec3::new(6.0, 7.0, 6.0) * DX)).unwrap();
    let action = Action::Push { acceleration: DVec3::new(0.0, 30.0, 3.0) };
    whole.set_tools(&[Tool { action, radius: 0.1, position: DVec3::splat(0.12), velocity: DVec3::X * 0.2 }]).unwrap();
    let snapshot = kept(&mut *whole, &world);
    whole.steps(10).unwrap();
    let end = everything(&mut *whole);
    assert!(report(&mut *whole).drained > 0);
    let mut other = backend.solver(&world);
    other.restore(&snapshot).unwrap();
    other.steps(10).unwrap();
    assert_eq!(everything(&mut *other), end);
}

/// Saved on the CPU and resumed on a device, and the other way round: the same, up to the sign of zeros.
fn each_path_takes_the_others(backend: Backend) {
    for world in [busy(), flowing(), thick(), mixed_implicit(), fountain()] {
        let mut cpu = Backend::Cpu.solver(&world);
        cpu.steps(10).unwrap();
        let from_cpu = kept(&mut *cpu, &world);
        cpu.steps(10).unwrap();
        let end = particles(&mut *cpu);

        let mut gpu = backend.solver(&world);
        gpu.restore(&from_cpu).unwrap();
        gpu.steps(5).unwrap();
        let from_gpu = kept(&mut *gpu, &world);
        gpu.steps(5).unwrap();
        assert!(particles(&mut *gpu) == end, "{}", world.name);

        let mut back = Backend::Cpu.solver(&world);
        back.restore(&from_gpu).unwrap();
        back.steps(5).unwrap();
        assert!(particles(&mut *back) == end, "{}", world.name);
        let counts = |solver: &mut dyn Simulate| {
            let r = report(solver);
            (r.step, r.alive, r.emitted, r.drained, r.withheld, r.active_blocks, r.max_speed.to_bits())
        };
        assert_eq!(counts(&mut *back), counts(&mut *cpu), "{}", world.name);
    }
}

pub fn fault(result: Result<(), Error>) -> SnapshotFault {
    match result {
        Err(Error::Snapshot { fault, .. }) => fault,
        other => panic!("{other:?}"),
    }
}

/// Refused with the name of the difference, and without changes.
fn other_worlds_are_refused(backend: Backend) {
    let world = busy();
    let mut solver = backend.solver(&world);
    solver.steps(3).unwrap();
    let snapshot = solver.save().unwrap();
    let bytes = snapshot.to_bytes().unwrap();
    type Change = fn(&mut World);
    let changes: [(&str, Change); 5] = [
        ("settings.iterations", |w| w.settings.iterations = 3),
        ("materials[1].rest_density", |w| w.materials[1].rest_density = 801.0),
        ("domain.max[2]", |w| w.domain.max.z += DX),
        ("colliders", |w| w.colliders.truncate(1)),
        ("spawns[0].jitter", |w| w.spawns[0].jitter = 0.1),
    ];
    for (field, change) in changes {
        let mut other = world.clone();
        change(&mut other);
        let refused = fault(Snapshot::from_bytes(&bytes, &other).map(drop));
        assert_eq!(refused.to_string(), format!("is of another world: the two differ in {field}"));
        assert_eq!(refused, SnapshotFault::World { field: field.to_owned() });
        let mut there = backend.solver(&other);
        let before = everything(&mut *there);
        let refused = fault(there.restore(&snapshot));
        let part = field.split(['.', '[']).next().unwrap_or_default();
        assert_eq!(refused, SnapshotFault::World { field: part.to_owned() });
        assert_eq!(everything(&mut *there), before);
    }
    // Values that only concern display do not make another world.
    let shown = World { name: "another name".to_owned(), camera: None, ..world.clone() };
    assert!(Snapshot::from_bytes(&bytes, &shown).is_ok());
    assert!(backend.solver(&shown).restore(&snapshot).is_ok());

    let (mut other, found, needed) = match backend {
        Backend::Cpu64 => (Backend::Cpu.solver(&world), 64, 32),
        _ => (Backend::Cpu64.solver(&world), 32, 64),
    };
    assert_eq!(fault(other.restore(&snapshot)), SnapshotFault::Precision { found, needed });
}

/// A host that records a snapshot between steps receives it by polling; a host whose steps were not taken is told so.
fn a_guest_does_not_wait(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let world = busy();
    let mut solver = GpuSolver::new(&host.device, &host.queue, &world, &GpuOptions::default()).unwrap();
    let mut encoder = host.encoder();
    (0..5).for_each(|_| assert!(solver.encode_step(&mut encoder).unwrap()));
    solver.encode_snapshot(&mut encoder).unwrap();
    (0..5).for_each(|_| assert!(solver.encode_step(&mut encoder).unwrap()));
    assert_eq!(solver.poll_snapshot(), Ok(None), "nothing was submitted");
    host.submit(encoder);
    let snapshot = solver.poll_snapshot().unwrap().expect("it was waited for");
    assert_eq!(solver.poll_snapshot(), Ok(None));
    assert_eq!(snapshot.step(), 5);
    let mut cpu = CpuSolver::<f32>::new(&world).unwrap();
    cpu.restore(&snapshot).unwrap();
    cpu.steps(5).unwrap();
    let position = host.read(solver.particle_buffers().position, host.encoder());
    assert_positions(backend, &position, &cpu.gpu_layout().position);

    // Back to step 5, while reports of later steps are in flight.
    let mut encoder = host.encoder();
    solver.encode_step(&mut encoder).unwrap();
    solver.encode_report(&mut encoder);
    host.queue.submit([encoder.finish()]);
    solver.restore(&snapshot).unwrap();
    assert_eq!(solver.step(), 5);
    let mut encoder = host.encoder();
    (0..5).for_each(|_| assert!(solver.encode_step(&mut encoder).unwrap()));
    solver.encode_report(&mut encoder);
    let position = host.read(solver.particle_buffers().position, encoder);
    assert_positions(backend, &position, &cpu.gpu_layout().position);
    assert_eq!(solver.poll_report().unwrap().map(|r| r.step), Some(10));

    let options = GpuOptions { grid_blocks: Some(8), ..GpuOptions::default() };
    let mut small = GpuSolver::new(&host.device, &host.queue, &world, &options).unwrap();
    let mut encoder = host.encoder();
    small.encode_step(&mut encoder).unwrap();
    small.encode_snapshot(&mut encoder).unwrap();
    host.submit(encoder);
    assert_eq!(fault(small.poll_snapshot().map(drop)), SnapshotFault::Deferred);
    // A restored state that does not fit at first is resumed like any other.
    small.restore(&snapshot).unwrap();
    while small.step() < 10 || small.poll_report().unwrap().is_none_or(|r| r.step < 10) {
        let mut encoder = host.encoder();
        if small.step() < 10 {
            small.encode_step(&mut encoder).unwrap();
        }
        small.encode_report(&mut encoder);
        host.submit(encoder);
    }
    let position = host.read(small.particle_buffers().position, host.encoder());
    assert_positions(backend, &position, &cpu.gpu_layout().position);
}

/// A snapshot has the counts of its own step, even if reports of later ones arrived first.
fn one_that_reports_have_overtaken(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let world = fountain();
    let mut solver = GpuSolver::new(&host.device, &host.queue, &world, &GpuOptions::default()).unwrap();
    let mut encoder = host.encoder();
    (0..10).for_each(|_| assert!(solver.encode_step(&mut encoder).unwrap()));
    solver.encode_snapshot(&mut encoder).unwrap();
    (0..10).for_each(|_| assert!(solver.encode_step(&mut encoder).unwrap()));
    solver.encode_report(&mut encoder);
    host.submit(encoder);
    let later = solver.poll_report().unwrap().expect("it was waited for");
    let snapshot = solver.poll_snapshot().unwrap().expect("it was waited for");
    let mut there = CpuSolver::<f32>::new(&world).unwrap();
    there.restore(&snapshot).unwrap();
    let mut whole = CpuSolver::<f32>::new(&world).unwrap();
    whole.steps(10).unwrap();
    let [found, expected] = [&mut there, &mut whole].map(|solver| report(solver));
    assert_eq!((later.step, found.step), (20, 10));
    assert!(later.emitted > expected.emitted);
    assert_eq!((found.emitted, found.alive), (expected.emitted, expected.alive));
    assert_eq!((found.drained, found.spent), (expected.drained, expected.spent));
}

/// A frame half as long again as the shortest step is divided into two shorter steps.
fn the_shortest_steps_are_taken_up() {
    let mut world = fountain();
    world.settings.dt = 1e-5;
    let mut solver = CpuSolver::<f32>::new(&world).unwrap();
    assert_eq!(solver.plan_frame(1.5e-5), Ok(2));
    solver.steps(2).unwrap();
    let snapshot = solver.save().unwrap();
    assert_eq!(solver.restore(&snapshot), Ok(()));
}

/// Without gravity steps may be longer, here and where they are resumed.
fn the_longest_steps_are_taken_up() {
    let mut world = fountain();
    world.settings.scheme = Scheme::Implicit;
    world.settings.iterations = 4;
    let [mut solver, mut other] = [(); 2].map(|()| CpuSolver::<f32>::new(&world).unwrap());
    assert!(solver.set_dt(0.1).is_err(), "too long to fall in");
    solver.set_gravity(DVec3::ZERO).unwrap();
    solver.set_dt(0.1).unwrap();
    let snapshot = solver.save().unwrap();
    assert_eq!(other.restore(&snapshot), Ok(()));
    assert_eq!((other.dt(), other.gravity()), (0.1, DVec3::ZERO));
}

/// A mesh of the world's own is restored as such, however often, and does not count as one more of the limited number
/// of meshes.
fn what_is_to_be_removed_is_known_once() {
    let mut world = busy();
    let shape = mesh(slab([1.0; 3]), 0.5);
    world.colliders.push(body(shape.clone(), [9.0, 9.0, 9.0]));
    let mut solver = CpuSolver::<f32>::new(&world).unwrap();
    solver.remove(&Region::new(shape, DVec3::splat(5.0) * DX)).unwrap();
    let bytes = solver.save().unwrap().to_bytes().unwrap();
    for _ in 0..300 {
        assert_eq!(solver.restore(&Snapshot::from_bytes(&bytes, &world).unwrap()), Ok(()));
    }
    solver.step().unwrap();
}

/// A NaN is restored as a NaN, in whichever lane it is, before the particle is quarantined and after.
fn quarantine_is_kept() {
    let world = busy();
    // The last two are those of the mass and of the material.
    for (array, lane) in [(Array::Displacement, 1), (Array::Position, 3), (Array::Gradient, 3), (Array::Gradient, 7)] {
        for value in [f32::NAN, f32::INFINITY] {
            for before in [0, 3] {
                let mut solver = CpuSolver::<f32>::new(&world).unwrap();
                solver.spoil(5, array, lane, value);
                solver.steps(before).unwrap();
                let snapshot = Snapshot::from_bytes(&solver.save().unwrap().to_bytes().unwrap(), &world).unwrap();
                assert_eq!(snapshot.particles().map(|all| all.len()), Ok(particles(&mut solver).len()));
                let mut other = CpuSolver::<f32>::new(&world).unwrap();
                other.restore(&snapshot).unwrap();
                [&mut solver, &mut other].into_iter().for_each(|solver| solver.step().unwrap());
                assert_eq!(everything(&mut other), everything(&mut solver), "{value} in lane {lane} of {array:?}");
                assert_eq!(particles(&mut other)[5].fate, Fate::Quarantined, "{value} in lane {lane} of {array:?}");
            }
        }
    }
}

/// Files that are cut or altered anywhere, and files that never were snapshots.
fn files_that_are_not_whole() {
    let world = fountain();
    let mut solver = CpuSolver::<f32>::new(&world).unwrap();
    solver.steps(10).unwrap();
    let bytes = solver.save().unwrap().to_bytes().unwrap();
    let read = |bytes: &[u8]| fault(Snapshot::from_bytes(bytes, &world).map(drop));
    assert!(Snapshot::from_bytes(&bytes, &world).is_ok());
    for length in (0..bytes.len()).step_by(97).chain([1, 7, 8, 27, 28, 31, bytes.len() - 1]) {
        let found = length as u64;
        assert!(matches!(read(&bytes[..length]), SnapshotFault::Length { found: f, .. } if f == found), "{length}");
    }
    let longer = [&bytes[..], &[0]].concat();
    assert_eq!(read(&longer), SnapshotFault::Length { found: longer.len() as u64, expected: bytes.len() as u64 });
    for at in (0..bytes.len()).step_by(89).chain([9, 13]) {
        let mut altered = bytes.clone();
        altered[at] ^= 1 << (at % 8);
        let refused = read(&altered);
        let right = match at {
            0..8 => refused == SnapshotFault::NotASnapshot,
            8..12 => matches!(refused, SnapshotFault::Version { found, known } if found != known),
            12..28 => matches!(refused, SnapshotFault::Length { .. }),
            _ => matches!(refused, SnapshotFault::Altered { .. }),
        };
        assert!(right, "byte {at}: {refused:?}");
    }
    assert_eq!(read(b"{\"domain\":{}}"), SnapshotFault::NotASnapshot);
}

fn a_file_is_written_whole_or_not_at_all() {
    let folder = std::env::temp_dir().join(format!("pbmpm-snapshots-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("run.snapshot");
    let world = busy();
    let mut solver = CpuSolver::<f32>::new(&world).unwrap();
    // One that has left the places where a host may put it.
    let action = Action::Sweep { acceleration: 1.0 };
    solver
        .set_tools(&[Tool { action, radius: 0.1, position: DVec3::X * 999_999.0, velocity: DVec3::X * 1e6 }])
        .unwrap();
    for steps in [2, 4] {
        solver.steps(2).unwrap();
        solver.save().unwrap().write(&file).unwrap();
        let snapshot = Snapshot::read(&file, &world).unwrap();
        assert_eq!(snapshot.step(), steps);
        CpuSolver::<f32>::new(&world).unwrap().restore(&snapshot).unwrap();
    }
    let names: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["run.snapshot"], "nothing else is left");
    // A folder cannot be replaced by a file: it stays, and nothing is left beside it.
    let error = solver.save().unwrap().write(&folder).unwrap_err();
    assert!(matches!(&error, Error::Io { path, .. } if *path == folder.display().to_string()), "{error}");
    let error = solver.save().unwrap().write(folder.join("none/run.snapshot")).unwrap_err();
    assert!(matches!(error, Error::Io { .. }), "{error}");
    assert_eq!(Snapshot::read(&file, &world).unwrap().step(), 4);
    let error = Snapshot::read(folder.join("nothing"), &world).unwrap_err();
    assert!(matches!(error, Error::Io { .. }), "{error}");
    std::fs::write(&file, b"something else").unwrap();
    let error = Snapshot::read(&file, &world).unwrap_err();
    let named = matches!(&error, Error::Snapshot { path, fault: SnapshotFault::NotASnapshot } if path.ends_with("run.snapshot"));
    assert!(named, "{error}");
    if cfg!(target_os = "linux") {
        let error = Snapshot::read("/dev/zero", &world).unwrap_err();
        assert!(matches!(error, Error::Snapshot { fault: SnapshotFault::NotASnapshot, .. }), "{error}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A link and what it leads to remain, and so does a pipe, whose reader gets the snapshot.
#[cfg(unix)]
fn links_and_pipes_stay() {
    use std::os::unix::fs::FileTypeExt;
    let folder = std::env::temp_dir().join(format!("pbmpm-links-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let [file, link, pipe] = ["run.snapshot", "link", "pipe"].map(|name| folder.join(name));
    let world = busy();
    let snapshot = CpuSolver::<f32>::new(&world).unwrap().save().unwrap();
    std::fs::write(&file, b"an older one").unwrap();
    std::os::unix::fs::symlink(&file, &link).unwrap();
    snapshot.write(&link).unwrap();
    assert!(link.symlink_metadata().unwrap().is_symlink());
    assert!(Snapshot::read(&file, &world).unwrap() == snapshot);
    // One that leads to nothing yet.
    let [later, to_come] = ["later", "to-come.snapshot"].map(|name| folder.join(name));
    std::os::unix::fs::symlink("to-come.snapshot", &later).unwrap();
    snapshot.write(&later).unwrap();
    assert!(later.symlink_metadata().unwrap().is_symlink());
    assert!(Snapshot::read(&to_come, &world).unwrap() == snapshot);
    if std::process::Command::new("mkfifo").arg(&pipe).status().is_ok_and(|status| status.success()) {
        let (world, from) = (world.clone(), pipe.clone());
        let reader = std::thread::spawn(move || Snapshot::read(from, &world).unwrap());
        snapshot.write(&pipe).unwrap();
        assert!(pipe.symlink_metadata().unwrap().file_type().is_fifo());
        assert!(reader.join().unwrap() == snapshot);
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Each writes through a temporary file of its own: all succeed, and one result remains.
fn writers_of_one_file_do_not_meet() {
    let folder = std::env::temp_dir().join(format!("pbmpm-writers-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("run.snapshot");
    let world = busy();
    let snapshot = CpuSolver::<f32>::new(&world).unwrap().save().unwrap();
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| (0..25).for_each(|_| snapshot.write(&file).unwrap()));
        }
    });
    assert!(Snapshot::read(&file, &world).unwrap() == snapshot);
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "nothing else is left");
    std::fs::remove_dir_all(&folder).unwrap();
}
