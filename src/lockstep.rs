//! CPU and GPU in lockstep: one step, pass by pass, from the same state, with the differences after each pass. For
//! tests, and for finding the first stage in which two devices diverge.

mod blocks;
mod compared;
mod implicit;
mod spoil;

pub use spoil::{Array, Spoil};

use crate::bins::NODES;
use crate::cpu::{CpuSolver, ParticleArrays};
use crate::error::{Error, Result};
use crate::gpu::layout::{Block, Chunk, Counters, GROUP, Place, SLOTS, StressSearch, TableEntry};
use crate::gpu::slots::Slot;
use crate::gpu::tuning::Tuning;
use crate::gpu::{GpuOptions, GpuSolver};
use crate::headless::{AdapterChoice, Headless};
use crate::math::real::Real;
use crate::plan::{Pass, Stage};
use crate::sensor;
use crate::simulate::Simulate;
use crate::stages;
use crate::stages::bin_wake::{DISTURBED, WOKEN};
use crate::stages::emit_gate;
use crate::stages::gap::NODES_PER_WORD;
use crate::stages::motion::momentum_scale;
use crate::world::World;
use bytemuck::Zeroable;
use compared::{Compared, floats, integers};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicU32, Ordering};

/// The difference after one pass.
#[derive(Debug, Clone)]
pub struct Difference {
    /// The pass that ran.
    pub stage: Stage,
    /// What was compared.
    pub what: &'static str,
    /// How many values were compared.
    pub compared: usize,
    /// How many of them differ in their bits.
    pub unequal: usize,
    /// Largest difference; of integers, in units.
    pub largest: f64,
    /// The same, with the nodes' displacements weighted by their mass where that is less than a cell's: at nodes with
    /// hardly any mass a sum that is off by a unit changes the displacement the more, but moves particles as little.
    pub weighed: f64,
    /// Whether integers were compared.
    pub integers: bool,
}

/// Steps `world` on the CPU for `steps`, gives the same state to both paths, and compares them pass by pass over the
/// next step.
///
/// # Errors
/// As [`Headless::new`].
pub fn compare_step(
    world: &World,
    steps: u32,
    choice: &AdapterChoice,
    tuning: Option<Tuning>,
) -> Result<Vec<Difference>> {
    let mut cpu = CpuSolver::<f32>::new(world)?;
    cpu.steps(steps)?;
    // Each stage is run by itself.
    let adapter = || crate::headless::choose_adapter(choice).map(|adapter| Tuning::of(&adapter.get_info()));
    let tuning = Tuning { fused: false, ..tuning.map_or_else(adapter, Ok)? };
    let options = GpuOptions { grid_blocks: Some(1 << 14), tuning: Some(tuning), ..GpuOptions::default() };
    let mut gpu = Headless::new(world, choice, &options)?;
    gpu.solver_mut().load(&cpu.timeline, &cpu.gpu_layout());
    if !cpu.state.deviator.is_empty() {
        let mut brought = vec![StressSearch::zeroed(); cpu.state.capacity as usize];
        for (at, &id) in cpu.state.id.iter().enumerate().take(cpu.state.deviator.len()) {
            brought[id as usize] = implicit::stress_search(&cpu, at);
        }
        gpu.solver_mut().write(Slot::Search, bytemuck::cast_slice(&brought));
    }

    if cpu.state.features.sleep {
        let mut places = vec![Place::zeroed(); cpu.state.capacity as usize];
        for (&id, &rest) in cpu.state.id.iter().zip(&cpu.state.rest) {
            places[id as usize].rest = rest;
        }
        gpu.solver_mut().write(Slot::Bin, bytemuck::cast_slice(&places));
    }

    let (input, needs) = cpu.next_step();
    cpu.load(&input);
    let inputs = gpu.solver_mut().write_inputs(&input)?;
    let mut found = Vec::new();
    for pass in crate::plan::passes(needs) {
        stages::run(pass, &mut cpu.state);
        gpu.run_pass(pass, &inputs)?;
        compare(pass, &cpu, &gpu, &mut found)?;
    }
    Ok(found)
}

fn compare(pass: Pass, cpu: &CpuSolver<f32>, gpu: &Headless, found: &mut Vec<Difference>) -> Result<()> {
    let mut note = |what, found_here: Compared| {
        let Compared { compared, unequal, largest, weighed, integers } = found_here;
        found.push(Difference { stage: pass.stage, what, compared, unequal, largest, weighed, integers });
    };
    match pass.stage {
        Stage::BinInsert => {
            let counters = counters(gpu)?;
            let blocks: Vec<Block> = gpu.read(Slot::Blocks)?;
            let table: Vec<TableEntry> = gpu.read(Slot::Table)?;
            let here = cpu.state.blocks.iter().map(|b| (b.key, b.count));
            let there = blocks[..counters.occupied as usize].iter().map(|b| (b.key, table[b.entry as usize].count));
            note("particles in each block", integers(here, there));
        }
        Stage::BinLink => {
            let there = active(gpu)?;
            note(
                "active blocks",
                integers(cpu.state.blocks.iter().map(|b| (b.key, 0)), there.iter().map(|b| (b.key, 0))),
            );
            let mut sums = BTreeMap::new();
            for c in chunks(cpu, gpu)? {
                *sums.entry(c.key).or_insert(0) += c.count;
            }
            let occupied = &cpu.state.blocks[..cpu.state.occupied];
            note(
                "particles in each block's chunks",
                integers(occupied.iter().map(|b| (b.key, b.count)), sums.into_iter()),
            );
        }
        Stage::BinScatter => {
            let order: Vec<u32> = gpu.read(Slot::Order)?;
            let blocks = active(gpu)?;
            let mut there = Vec::new();
            for b in &blocks {
                there.extend(order[b.start as usize..(b.start + b.count) as usize].iter().map(|&p| (p, b.key)));
            }
            let s = &cpu.state;
            let mut here = Vec::new();
            for b in &s.blocks[..s.occupied] {
                here.extend(s.id[b.start as usize..(b.start + b.count) as usize].iter().map(|&id| (id, b.key)));
            }
            note("block of each particle", integers(here.into_iter(), there.into_iter()));
        }
        Stage::BinWake => {
            let s = &cpu.state;
            let here =
                s.blocks[..s.occupied].iter().zip(&s.awake).map(|(b, awake)| (b.key, awake.load(Ordering::Relaxed)));
            let table: Vec<TableEntry> = gpu.read(Slot::Table)?;
            let woken = |b: &Block| table[b.entry as usize].unrest & (WOKEN | DISTURBED);
            let there = active(gpu)?;
            let there = there[..s.occupied].iter().map(|b| (b.key, woken(b)));
            note("blocks that are awake", integers(here, there));
        }
        Stage::BinSleep => {
            let s = &cpu.state;
            let there: BTreeMap<_, _> = chunks(cpu, gpu)?.iter().map(|c| (c.key, c.sleep)).collect();
            let here = s.blocks[..s.occupied].iter().map(|b| (b.key, b.sleep));
            note("blocks that sleep", integers(here, there.into_iter()));
            let there = active(gpu)?.into_iter().map(|b| (b.key, b.tiles));
            note("tiles at each block", integers(s.blocks.iter().map(|b| (b.key, b.tiles)), there));
            let places: Vec<Place> = gpu.read(Slot::Bin)?;
            let here = s.id.iter().zip(&s.position).zip(&s.rest).filter(|((_, x), _)| x[3] > 0.0);
            let here: Vec<_> = here.map(|((id, _), rest)| (*id, *rest)).collect();
            let there: Vec<_> = here.iter().map(|(id, _)| (*id, places[*id as usize].rest)).collect();
            note("rest of each particle", integers(here.into_iter(), there.into_iter()));
            note("gradients", gradients(cpu, gpu)?);
        }
        Stage::BinSort => {
            let order: Vec<u32> = gpu.read(Slot::Order)?;
            let mut sorted = order[..counters(gpu)?.ordered as usize].to_vec();
            sorted.sort_unstable();
            let mut taking_part: Vec<u32> = cpu.state.id[..sorted.len()].to_vec();
            taking_part.sort_unstable();
            note("particles in order", integers(taking_part.into_iter().enumerate(), sorted.into_iter().enumerate()));
        }
        Stage::ColliderCull => {
            let words = cpu.state.cull_words;
            let masks: Vec<u32> = gpu.read(Slot::Cull)?;
            let blocks = active(gpu)?;
            let pairs = |key: u32, block: usize, masks: &[u32]| -> Vec<((u32, usize), u32)> {
                (0..words).map(|w| ((key, w), masks[block * words + w])).collect()
            };
            let here = cpu.state.blocks.iter().enumerate().flat_map(|(i, b)| pairs(b.key, i, &cpu.state.cull));
            let there = blocks.iter().enumerate().flat_map(|(i, b)| pairs(b.key, i, &masks));
            note("colliders in reach of each block", integers(here, there));
        }
        Stage::Gap => {
            let there: Vec<u32> = gpu.read(Slot::Cull)?;
            let blocks = gpu.solver().buffer(Slot::Grid).size() as usize / (NODES * size_of::<[u32; 4]>());
            let (gaps, faces) = there[blocks * cpu.state.cull_words..].split_at(blocks * NODES);
            let pairs =
                |key: u32, words: Vec<u32>| words.into_iter().enumerate().map(move |(n, word)| ((key, n), word));
            let loaded = |words: &[AtomicU32]| words.iter().map(|word| word.load(Ordering::Relaxed)).collect();
            let here = || cpu.state.blocks.iter().zip(&cpu.state.gaps);
            let there = active(gpu)?;
            let on = |words: &[u32], count: usize| {
                let of = |(b, words): (&Block, &[u32])| pairs(b.key, words.to_vec());
                there.iter().zip(words.chunks(count)).flat_map(of).collect::<Vec<_>>().into_iter()
            };
            let gaps = on(gaps, NODES);
            note("gaps at the nodes", integers(here().flat_map(|(b, n)| pairs(b.key, loaded(&n.gaps))), gaps));
            if !faces.is_empty() {
                let faces = on(faces, NODES / NODES_PER_WORD);
                note(
                    "faces before the nodes",
                    integers(here().flat_map(|(b, n)| pairs(b.key, loaded(&n.faces))), faces),
                );
            }
        }
        // Not in the plan that is compared, which is not fused.
        Stage::G2p2g => {}
        Stage::P2g => {
            // In units of the world's own momentum scale, which correspond to the tolerances of floats.
            let units = momentum_scale(cpu.state.largest_motion, &cpu.state.constants);
            let coarser = f64::from(cpu.state.constants.momentum_scale / units).min(1.0);
            let sums = |masses: bool| {
                let of = move |at: &((u32, usize), i32)| (at.0.1 % 4 == 3) == masses;
                let there = nodes::<i32>(gpu, Slot::Grid)?.into_iter().filter(of);
                Ok::<_, Error>(integers(by_block(cpu, &cpu.state.grid).filter(of), there))
            };
            let momenta = sums(false)?;
            let largest = momenta.largest * coarser;
            note("momenta on the nodes", Compared { largest, weighed: largest, ..momenta });
            note("masses on the nodes", sums(true)?);
        }
        Stage::Gauge => {
            note("gradients", gradients(cpu, gpu)?);
            note("largest motion", largest_motion(cpu, gpu)?);
        }
        Stage::GridClear | Stage::VolumeP2g => {
            let here = by_block(cpu, &cpu.state.grid);
            note("sums on the nodes", integers(here, nodes::<i32>(gpu, Slot::Grid)?.into_iter()));
        }
        Stage::GridUpdate | Stage::Settle => note("displacement of the nodes", displacement(cpu, gpu)?),
        Stage::Press => {
            note("searches", implicit::searches(cpu, gpu)?);
            note("gradients", gradients(cpu, gpu)?);
            note("largest motion", largest_motion(cpu, gpu)?);
        }
        Stage::Predict => {
            note("displacement of the nodes", displacement(cpu, gpu)?);
            note("velocity field", field(cpu, gpu)?);
            note("held nodes", implicit::held(cpu, gpu)?);
        }
        Stage::Project => note("velocity field", field(cpu, gpu)?),
        Stage::Line => note("the solve", implicit::solve(cpu, gpu)?),
        Stage::BlockP2g => note("pushes of blocks", blocks::tiles(cpu, gpu, &active(gpu)?)?),
        Stage::BlockJoin => note("couplings of blocks", blocks::couplings(cpu, gpu, &active(gpu)?)?),
        Stage::BlockSolve => note("pressures of blocks", blocks::pressures(cpu, gpu, &active(gpu)?)?),
        Stage::BlockSpread => note("velocity field", field(cpu, gpu)?),
        Stage::Seek => {
            note("searches", implicit::searches(cpu, gpu)?);
            note("gradients", gradients(cpu, gpu)?);
            let here = by_block(cpu, &cpu.state.force);
            note("sums of the pressures", integers(here, nodes::<i32>(gpu, Slot::Force)?.into_iter()));
        }
        Stage::EmitGate => {
            let accepted: Vec<u32> = gpu.read(Slot::Accepted)?;
            let here = cpu.state.accepted.iter().copied().enumerate();
            note(
                "particles that may appear",
                integers(here, accepted.into_iter().take(cpu.state.accepted.len()).enumerate()),
            );
        }
        Stage::EmitCount => {
            let vacancies: Vec<u32> = gpu.read(Slot::Vacancies)?;
            let vacancies = vacancies.into_iter().take(slot_groups(cpu));
            let never_used = cpu.state.capacity as usize - cpu.state.id.len();
            let here = (cpu.state.vacant.len() + never_used) as u32;
            note("free slots", integers([(0, here)].into_iter(), [(0, vacancies.sum())].into_iter()));
        }
        Stage::EmitScan => {
            let numbers: Vec<u32> = gpu.read(Slot::Vacancies)?;
            let groups = emit_gate::of_groups(&cpu.state.accepted);
            let here = groups.scan(0, |before, own| Some(std::mem::replace(before, *before + own)));
            let there =
                numbers.into_iter().skip(slot_groups(cpu)).take(cpu.state.accepted.len().div_ceil(GROUP as usize));
            note("numbers of the groups", integers(here.enumerate(), there.enumerate()));
        }
        Stage::Rescale
        | Stage::Constraint
        | Stage::Stress
        | Stage::Sharpen
        | Stage::G2p
        | Stage::VolumeG2p
        | Stage::Integrate
        | Stage::Drain
        | Stage::EmitPlace => {
            let ParticleArrays { position, displacement, gradient, deformation } = cpu.gpu_layout();
            let lanes = |v: Vec<[f32; 4]>| v.into_iter().flatten().enumerate();
            note("positions", floats(lanes(position), lanes(gpu.read(Slot::Position)?)));
            note("displacements", floats(lanes(displacement), lanes(gpu.read(Slot::Displacement)?)));
            let flat = |v: Vec<[[f32; 4]; 3]>| v.into_iter().flatten().flatten().enumerate();
            note("gradients", floats(flat(gradient), flat(gpu.read(Slot::Gradient)?)));
            if !deformation.is_empty() {
                note("deformations", floats(flat(deformation), flat(gpu.read(Slot::Deformation)?)));
            }
            if pass.stage == Stage::Stress {
                note("largest motion", largest_motion(cpu, gpu)?);
            }
            if pass.stage == Stage::Integrate {
                let there = f32::from_bits(counters(gpu)?.largest_square);
                note(
                    "largest displacement",
                    floats([(0, cpu.state.largest_square)].into_iter(), [(0, there)].into_iter()),
                );
            }
        }
        Stage::Sense => {
            let steps = counters(gpu)?.steps as usize;
            let sensed: Vec<[i64; sensor::SUMS]> = gpu.read(Slot::Sensed)?;
            let count = cpu.state.sensed.len();
            let there = sensed[steps % 2 * count..][..count].iter().flatten().copied().enumerate();
            let here = cpu.state.sensed.iter().flatten().map(|sum| sum.load(Ordering::Relaxed)).enumerate();
            note("sums of the sensors", integers(here, there));
        }
        Stage::BinClear => {
            let table: Vec<TableEntry> = gpu.read(Slot::Table)?;
            let left = table.iter().filter(|e| e.key != 0 || e.count != 0);
            let (compared, unequal) = (table.len(), left.count());
            note("entries left in the table", Compared { compared, unequal, integers: true, ..Compared::default() });
        }
        Stage::StepEnd => {
            let c = counters(gpu)?;
            let here = [cpu.state.occupied as u32, cpu.state.blocks.len() as u32, 0, 0, 0, 0, 0];
            let there = [c.last_occupied, c.last_active, c.occupied, c.halo, c.ordered, c.chunks, c.largest_square];
            note("counters", integers(here.into_iter().enumerate(), there.into_iter().enumerate()));
        }
    }
    Ok(())
}

fn counters(gpu: &Headless) -> Result<Counters> {
    Ok(gpu.read::<Counters>(Slot::Counters)?[0])
}

fn active(gpu: &Headless) -> Result<Vec<Block>> {
    let c = counters(gpu)?;
    let mut blocks: Vec<Block> = gpu.read(Slot::Blocks)?;
    blocks.truncate((c.occupied + c.halo) as usize);
    Ok(blocks)
}

/// Chunks in use, with zeros for fields that this world's chunks do not have.
fn chunks(cpu: &CpuSolver<f32>, gpu: &Headless) -> Result<Vec<Chunk>> {
    let bytes: Vec<u8> = gpu.read(Slot::Chunks)?;
    let there = bytes.chunks_exact(Chunk::stride(cpu.state.features.shares_pressure)).map(|there| {
        let mut chunk = Chunk::zeroed();
        bytemuck::bytes_of_mut(&mut chunk)[..there.len()].copy_from_slice(there);
        chunk
    });
    Ok(there.take(counters(gpu)?.chunks as usize).collect())
}

/// The displacements that have replaced the nodes' sums, beside the mass.
fn displacement(cpu: &CpuSolver<f32>, gpu: &Headless) -> Result<Compared> {
    let here = || by_block(cpu, &cpu.state.grid).map(|(at, stored)| (at, f32::loaded(stored)));
    let masses: BTreeMap<_, _> = here().filter(|((_, lane), _)| lane % 4 == 3).collect();
    let there = nodes::<f32>(gpu, Slot::Grid)?;
    let weighed = |((key, lane), x): ((u32, usize), f32)| {
        let mass = masses.get(&(key, lane | 3)).map_or(1.0, |mass| mass.clamp(0.0, 1.0));
        ((key, lane), if lane % 4 == 3 { x } else { x * mass })
    };
    let Compared { largest, .. } = floats(here().map(weighed), there.iter().copied().map(weighed));
    Ok(Compared { weighed: largest, ..floats(here(), there.into_iter()) })
}

/// The velocity field is not maintained in blocks that only sleeping matter reaches.
fn field(cpu: &CpuSolver<f32>, gpu: &Headless) -> Result<Compared> {
    let idle: BTreeSet<u32> = cpu.state.blocks.iter().filter(|b| b.is_idle()).map(|b| b.key).collect();
    let kept = |at: &((u32, usize), f32)| !idle.contains(&at.0.0);
    let there = nodes::<f32>(gpu, Slot::Field)?.into_iter().filter(kept);
    Ok(floats(by_block(cpu, &cpu.state.field).filter(kept), there))
}

fn largest_motion(cpu: &CpuSolver<f32>, gpu: &Headless) -> Result<Compared> {
    let there = f32::from_bits(counters(gpu)?.largest_motion);
    Ok(floats(cpu.state.largest_motion.into_iter().enumerate(), [(0, there)].into_iter()))
}

fn gradients(cpu: &CpuSolver<f32>, gpu: &Headless) -> Result<Compared> {
    let lanes = |v: Vec<[[f32; 4]; 3]>| v.into_iter().flatten().flatten().enumerate();
    Ok(floats(lanes(cpu.gpu_layout().gradient), lanes(gpu.read(Slot::Gradient)?)))
}

/// Every channel of every active node on the device, by block key, node and channel.
fn nodes<T: bytemuck::Pod>(gpu: &Headless, slot: Slot) -> Result<Vec<((u32, usize), T)>> {
    let nodes: Vec<[[T; 4]; NODES]> = gpu.read(slot)?;
    let blocks = active(gpu)?;
    Ok(blocks.iter().zip(&nodes).flat_map(|(b, nodes)| by_node(b.key, nodes)).collect())
}

/// Number of slot groups in which a device counts free slots.
fn slot_groups(cpu: &CpuSolver<f32>) -> usize {
    cpu.state.capacity.div_ceil(GROUP * SLOTS) as usize
}

/// Every channel of every active node on the CPU, by block key, node and channel.
fn by_block<'a, T: Copy>(
    cpu: &'a CpuSolver<f32>,
    nodes: &'a [[[T; 4]; NODES]],
) -> impl Iterator<Item = ((u32, usize), T)> + 'a {
    cpu.state.blocks.iter().zip(nodes).flat_map(|(b, nodes)| by_node(b.key, nodes))
}

fn by_node<T: Copy>(key: u32, nodes: &[[T; 4]; NODES]) -> impl Iterator<Item = ((u32, usize), T)> {
    nodes.iter().flatten().copied().enumerate().map(move |(i, x)| ((key, i), x)).collect::<Vec<_>>().into_iter()
}

impl GpuSolver {
    /// Takes over another solver's particles and clock.
    fn load(&mut self, timeline: &crate::timeline::Timeline, particles: &ParticleArrays) {
        self.set_timeline(timeline.clone());
        self.write(Slot::Position, bytemuck::cast_slice(&particles.position));
        self.write(Slot::Displacement, bytemuck::cast_slice(&particles.displacement));
        self.write(Slot::Gradient, bytemuck::cast_slice(&particles.gradient));
        if !particles.deformation.is_empty() {
            self.write(Slot::Deformation, bytemuck::cast_slice(&particles.deformation));
        }
    }
}
