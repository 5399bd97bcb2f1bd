//! The benefit of skipping: two worlds, or two ways to drive one, are stepped alternately in one run.

use crate::report::record::Row;
use crate::run::{Place, Times, median, state_after};
use crate::suite::file::Failure;
use crate::worlds;
use pbmpm::{Material, Result, Simulate, World};
use std::time::{Duration, Instant};

/// How a side takes its steps.
type Drive = fn(&mut dyn Simulate, u32) -> Result<()>;

struct Side {
    world: World,
    drive: Drive,
    stages: bool,
}

/// Two sides, of which the other has something that should cost nothing, or omits something that should change nothing.
struct Line {
    name: &'static str,
    plain: Side,
    other: Side,
    /// Steps before the measurement.
    start: u32,
    /// On devices only.
    device: bool,
    /// The largest number of pairs of batches.
    pairs: usize,
}

fn as_it_is(solver: &mut dyn Simulate, steps: u32) -> Result<()> {
    solver.steps(steps)
}

fn with_reports(solver: &mut dyn Simulate, steps: u32) -> Result<()> {
    (0..steps).try_for_each(|_| {
        solver.step()?;
        solver.report().map(drop)
    })
}

fn one_by_one(solver: &mut dyn Simulate, steps: u32) -> Result<()> {
    (0..steps).try_for_each(|_| solver.step())
}

fn side(world: World) -> Side {
    Side { world, drive: as_it_is, stages: false }
}

/// There is no line for bins that matter has left: nothing skips them yet.
fn lines() -> Vec<Line> {
    let line = |name, plain, other, start| Line { name, plain, other, start, device: false, pairs: 300 };
    let basin = |name, other| line(name, side(worlds::calm()), other, worlds::CALM);
    let implicit = |name, falls, start| {
        let [plain, other] = [0.0, 0.01].map(|tolerance| side(worlds::implicit(falls, tolerance)));
        line(name, plain, other, start)
    };
    let pool = |name, stirred, start| {
        let [plain, other] = [false, true].map(|sleep| side(worlds::pool(stirred, sleep)));
        line(name, plain, other, start)
    };
    let driven = |drive, stages| Side { world: worlds::calm(), drive, stages };
    let timed =
        Line { plain: driven(one_by_one, false), device: true, ..basin("stages timed", driven(one_by_one, true)) };
    vec![
        basin("domain 1,000 times larger", side(worlds::vast())),
        basin("a liquid of which there is nothing", side(worlds::with_material(Material::liquid("nothing")))),
        basin("a solid of which there is nothing", side(worlds::with_material(Material::elastic("nothing")))),
        basin("elastic matter that a host may add", side(worlds::with_addable(Material::elastic("nothing")))),
        basin("an emitter that has ended", side(worlds::with_ended_emitter())),
        basin("a drain and a sensor that nothing reaches", side(worlds::with_regions())),
        basin("256 boxes that touch nothing", side(worlds::with_boxes())),
        implicit("iterations ended by tolerance, at rest", false, 300),
        // It falls for 250 steps.
        Line { pairs: 25, ..implicit("iterations ended by tolerance, in free flight", true, 20) },
        pool("a pool of 100,000 particles that may sleep", false, worlds::STIRRED),
        pool("the same, stirred in one corner", true, worlds::STIRRED + 100),
        basin("a report for each step", driven(with_reports, false)),
        basin("loads on all bodies", side(worlds::with_loads())),
        timed,
    ]
}

/// Steps of a side at a time: as many as a device gets in one submission.
const BATCH: u32 = 8;
/// Pairs of batches after which the states are compared, which is also the least number that is measured.
const COMPARED: usize = 10;

/// Measures the lines of one device, each for the given time; calls `say` with both rows of each.
pub fn measure(
    place: &Place,
    budget: Duration,
    say: &mut dyn FnMut(&[Row; 2]) -> std::result::Result<(), Failure>,
) -> std::result::Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for line in lines().into_iter().filter(|line| !line.device || !place.is_cpu()) {
        match pair(place, &line, budget) {
            Ok(pair) => {
                say(&pair)?;
                rows.extend(pair);
            }
            Err(error) => eprintln!("{} on {}: not measured: {error}", line.name, place.name),
        }
    }
    Ok(rows)
}

fn pair(place: &Place, line: &Line, budget: Duration) -> std::result::Result<[Row; 2], Failure> {
    let sides = [&line.plain, &line.other];
    let begin = |side: &Side| place.resumed(&side.world, &state_after(&side.world, line.start)?, side.stages);
    let mut solvers = [begin(sides[0])?, begin(sides[1])?];
    let mut times = [Times::default(), Times::default()];
    let mut rows = [Row::default(), Row::default()];
    let spent = |solver: &mut dyn Simulate| solver.report().map(|r| (r.step, r.spent.iterations));
    let before = [spent(&mut *solvers[0])?, spent(&mut *solvers[1])?];
    let start = Instant::now();
    while times[0].len() < COMPARED || (times[0].len() < line.pairs && start.elapsed() < budget) {
        let pairs = times[0].len();
        // Neither side is always the second.
        for i in if pairs % 2 == 0 { [0, 1] } else { [1, 0] } {
            times[i].add(BATCH, || (sides[i].drive)(&mut *solvers[i], BATCH))?;
        }
        if pairs + 1 == COMPARED {
            for i in 0..2 {
                rows[i] = place.row("skipping", line.name, &sides[i].world, &mut *solvers[i])?;
                rows[i].side = ["plain", "other"][i].to_owned();
            }
        }
    }
    let ratio =
        |of: fn(&Times) -> &[f64]| median(of(&times[1]).iter().zip(of(&times[0])).map(|(a, b)| a / b).collect());
    rows[1].ratio = Some(ratio(|times| &times.wall));
    rows[1].processor_ratio = place.on_processor.then(|| ratio(|times| &times.processor));
    for (i, times) in times.into_iter().enumerate() {
        let (step, iterations) = spent(&mut *solvers[i])?;
        rows[i].iterations = (iterations - before[i].1) as f64 / (step - before[i].0) as f64;
        times.fill(&mut rows[i], place.on_processor);
        rows[i].steps *= BATCH as usize;
    }
    Ok(rows)
}
