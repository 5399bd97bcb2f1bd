//! The order of a step. Both solvers walk this list; nothing else knows the order.

use crate::features::Features;
use crate::settings::Scheme;

/// A stage of a step. Each has a file of its name in `src/stages` and one in `shaders/stages`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Finds or makes the block of every particle and counts the block's particles.
    BinInsert,
    /// Makes the blocks that the tiles of occupied ones also reach; gives each occupied block its range and its chunks.
    BinLink,
    /// Writes the particles of each block into its range.
    BinScatter,
    /// Notes which blocks are awake.
    BinWake,
    /// Puts the particles of other blocks to sleep.
    BinSleep,
    /// Sorts the particles of each chunk by cell, and notes the blocks of its tile.
    BinSort,
    /// Notes for each block the colliders that can be touched from it.
    ColliderCull,
    /// Records how far from bodies the solids at each node are.
    Gap,
    /// Scales displacements and pressures when the step length has changed.
    Rescale,
    /// Sums the particles' volumes on the nodes.
    VolumeP2g,
    /// Gathers the volume fraction at each particle.
    VolumeG2p,
    /// Finds the largest motion that particles bring to nodes.
    Gauge,
    /// Restores the motion that transfers smooth away.
    Sharpen,
    /// Zeroes the nodes of the active blocks.
    GridClear,
    /// Corrects the displacement gradient of each particle towards its material's constraint.
    Constraint,
    /// Adds each particle's stress to its displacement gradient.
    Stress,
    /// Sums the particles' mass and momentum on the nodes.
    P2g,
    /// Turns sums into displacements, adds gravity, applies boundaries.
    GridUpdate,
    /// Prepares the solve for the stresses.
    Press,
    /// Turns sums into the displacements due to motion and stresses at the step's beginning; applies boundaries.
    Predict,
    /// Sums the push and the state of the liquids of each block.
    BlockP2g,
    /// Computes the couplings between the pressures of blocks.
    BlockJoin,
    /// Finds the pressures of blocks.
    BlockSolve,
    /// Adds the effect of these pressures to the motion of the nodes.
    BlockSpread,
    /// Advances the conjugate gradients by one step, and sums the effect of the next direction on the nodes.
    Seek,
    /// Turns these sums into a velocity field.
    Project,
    /// Finds the next step length.
    Line,
    /// Adds the stresses found to the motion, and applies boundaries.
    Settle,
    /// Gathers each particle's motion, constrains it and sums it on the nodes again, without storing it.
    G2p2g,
    /// Gathers displacement and gradient for each particle.
    G2p,
    /// Advances volume ratio and position, keeps particles out of bodies and inside the domain.
    Integrate,
    /// Deletes the particles that are in a drain.
    Drain,
    /// Checks for each particle that is to appear whether its place is free.
    EmitGate,
    /// Counts the free slots.
    EmitCount,
    /// Numbers the particles that may appear and the free slots.
    EmitScan,
    /// Puts each particle that appears into the free slot of the same number.
    EmitPlace,
    /// Sums the particles in each sensor.
    Sense,
    /// Clears the table of blocks.
    BinClear,
    /// Counts the step.
    StepEnd,
}

impl Stage {
    /// Every stage, in the order of a step.
    pub const ALL: [Stage; 39] = [
        Stage::BinInsert,
        Stage::BinLink,
        Stage::BinScatter,
        Stage::BinWake,
        Stage::BinSleep,
        Stage::BinSort,
        Stage::ColliderCull,
        Stage::Gap,
        Stage::Rescale,
        Stage::VolumeP2g,
        Stage::VolumeG2p,
        Stage::Gauge,
        Stage::Sharpen,
        Stage::GridClear,
        Stage::Constraint,
        Stage::Stress,
        Stage::P2g,
        Stage::GridUpdate,
        Stage::Press,
        Stage::Predict,
        Stage::BlockP2g,
        Stage::BlockJoin,
        Stage::BlockSolve,
        Stage::BlockSpread,
        Stage::Seek,
        Stage::Project,
        Stage::Line,
        Stage::Settle,
        Stage::G2p2g,
        Stage::G2p,
        Stage::Integrate,
        Stage::Drain,
        Stage::EmitGate,
        Stage::EmitCount,
        Stage::EmitScan,
        Stage::EmitPlace,
        Stage::Sense,
        Stage::BinClear,
        Stage::StepEnd,
    ];

    /// The stem of the stage's files.
    pub fn name(self) -> &'static str {
        match self {
            Stage::BinInsert => "bin_insert",
            Stage::BinLink => "bin_link",
            Stage::BinScatter => "bin_scatter",
            Stage::BinWake => "bin_wake",
            Stage::BinSleep => "bin_sleep",
            Stage::BinSort => "bin_sort",
            Stage::ColliderCull => "collider_cull",
            Stage::Gap => "gap",
            Stage::Rescale => "rescale",
            Stage::VolumeP2g => "volume_p2g",
            Stage::VolumeG2p => "volume_g2p",
            Stage::Gauge => "gauge",
            Stage::Sharpen => "sharpen",
            Stage::GridClear => "grid_clear",
            Stage::Constraint => "constraint",
            Stage::Stress => "stress",
            Stage::P2g => "p2g",
            Stage::GridUpdate => "grid_update",
            Stage::Press => "press",
            Stage::Predict => "predict",
            Stage::Seek => "seek",
            Stage::Project => "project",
            Stage::Line => "line",
            Stage::BlockP2g => "block_p2g",
            Stage::BlockJoin => "block_join",
            Stage::BlockSolve => "block_solve",
            Stage::BlockSpread => "block_spread",
            Stage::Settle => "settle",
            Stage::G2p2g => "g2p2g",
            Stage::G2p => "g2p",
            Stage::Integrate => "integrate",
            Stage::Drain => "drain",
            Stage::EmitGate => "emit_gate",
            Stage::EmitCount => "emit_count",
            Stage::EmitScan => "emit_scan",
            Stage::EmitPlace => "emit_place",
            Stage::Sense => "sense",
            Stage::BinClear => "bin_clear",
            Stage::StepEnd => "step_end",
        }
    }

    pub(crate) fn index(self) -> usize {
        self as usize
    }
}

/// One entry of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pass {
    /// The stage that runs.
    pub stage: Stage,
    /// Whether it belongs to the first iteration of its step, in which gravity enters.
    pub first: bool,
    /// Whether it is the last of its step.
    pub last: bool,
}

/// The conditions that decide which passes a step needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Needs {
    /// Requirements of the world on all its steps.
    pub features: Features,
    pub iterations: u32,
    /// There are walls or bodies.
    pub colliders: bool,
    /// The step length differs from the step before.
    pub rescale: bool,
    /// Something is deleted at the end of the step.
    pub drains: bool,
    /// Something appears at the end of the step.
    pub emission: bool,
    /// There are sensors.
    pub sensors: bool,
    /// Constraints are applied, and motion is carried from one iteration to the next, by the passes that scatter it.
    pub fused: bool,
}

/// The passes of a step, in order.
pub(crate) fn passes(needs: Needs) -> impl Iterator<Item = Pass> {
    use Stage::*;
    let features = needs.features;
    let once = |stage| Pass { stage, first: true, last: false };
    let prepare = [
        (BinInsert, true),
        (BinLink, true),
        (BinScatter, true),
        (BinWake, features.sleep),
        (BinSleep, features.sleep),
        (BinSort, true),
        (ColliderCull, needs.colliders),
        (Gap, needs.colliders && features.gaps()),
        (Rescale, needs.rescale),
        (GridClear, features.volumes),
        (VolumeP2g, features.volumes),
        (VolumeG2p, features.volumes),
        (Gauge, features.sharpens),
        (GridClear, features.sharpens),
        (P2g, features.sharpens),
        (Sharpen, features.sharpens),
    ];
    let finish = [
        (Integrate, true),
        (Drain, needs.drains),
        (EmitGate, needs.emission),
        (EmitCount, needs.emission),
        (EmitScan, needs.emission),
        (EmitPlace, needs.emission),
        (Sense, needs.sensors),
        (BinClear, true),
        (StepEnd, true),
    ];
    let needed = move |(stage, needed): (Stage, bool)| needed.then(|| once(stage));
    let solve = |scheme| if features.scheme == scheme { needs.iterations } else { 0 };
    let solve = published(solve(Scheme::Published), needs.fused)
        .chain(implicit(solve(Scheme::Implicit), features.shares_pressure))
        .chain(explicit(features.scheme == Scheme::Explicit));
    prepare.into_iter().filter_map(needed).chain(solve).chain(finish.into_iter().filter_map(needed))
}

/// The published scheme: each iteration scatters and gathers the motion. Fused, an iteration gathers what the one before
/// has left on the nodes, and only the last stores it.
fn published(iterations: u32, fused: bool) -> impl Iterator<Item = Pass> {
    use Stage::*;
    let iteration = [GridClear, Constraint, G2p2g, P2g, GridUpdate, G2p];
    (0..iterations).flat_map(move |i| {
        let needed = move |stage: &Stage| match stage {
            Constraint => !fused,
            GridClear | P2g => !fused || i == 0,
            G2p2g => fused && i > 0,
            G2p => !fused || i + 1 == iterations,
            _ => true,
        };
        iteration.into_iter().filter(needed).map(move |stage| Pass { stage, first: i == 0, last: false })
    })
}

/// The implicit scheme: momentum is scattered once, then iterations find the stresses at the step's end. Empty for no
/// iterations.
fn implicit(iterations: u32, blocks: bool) -> impl Iterator<Item = Pass> {
    use Stage::*;
    let once = move |stage| (iterations > 0).then_some(Pass { stage, first: true, last: false });
    let begin = [GridClear, Press, P2g, Predict, Line].into_iter();
    let shared = [BlockP2g, BlockJoin, BlockSolve, BlockSpread].into_iter().filter(move |_| blocks);
    let seek = (1..=iterations).flat_map(move |i| {
        let last = i == iterations;
        [(Project, false), (Line, false), (Seek, last)].map(|(stage, last)| Pass { stage, first: false, last })
    });
    begin.chain(shared).chain([Seek]).filter_map(once).chain(seek).chain([Settle, G2p].into_iter().filter_map(once))
}

/// The explicit scheme: momentum is scattered once, together with the stress at the step's beginning.
fn explicit(chosen: bool) -> impl Iterator<Item = Pass> {
    use Stage::*;
    let once = move |stage| chosen.then_some(Pass { stage, first: true, last: false });
    [GridClear, Stress, P2g, GridUpdate, G2p].into_iter().filter_map(once)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_bins_then_iterations_then_integration() {
        let needs = Needs {
            features: Features { scheme: Scheme::Published, ..Features::default() },
            iterations: 2,
            colliders: false,
            rescale: false,
            drains: false,
            emission: false,
            sensors: false,
            fused: false,
        };
        let names: Vec<_> = passes(needs).map(|p| (p.stage.name(), p.first)).collect();
        let iteration = ["grid_clear", "constraint", "p2g", "grid_update", "g2p"];
        let mut expected: Vec<_> = ["bin_insert", "bin_link", "bin_scatter", "bin_sort"].map(|n| (n, true)).to_vec();
        expected.extend(iteration.map(|n| (n, true)));
        expected.extend(iteration.map(|n| (n, false)));
        expected.extend(["integrate", "bin_clear", "step_end"].map(|n| (n, true)));
        assert_eq!(names, expected);

        let fused = |iterations| passes(Needs { fused: true, iterations, ..needs }).map(|p| p.stage.name());
        let names: Vec<_> = fused(2).skip(4).take(6).collect();
        assert_eq!(names, ["grid_clear", "p2g", "grid_update", "g2p2g", "grid_update", "g2p"]);
        assert_eq!([0, 1, 4].map(|iterations| fused(iterations).count()), [7, 11, 17]);

        let explicitly = Features { scheme: Scheme::Explicit, ..Features::default() };
        let explicit = passes(Needs { features: explicitly, ..needs });
        let names: Vec<_> = explicit.map(|p| p.stage.name()).collect();
        let middle = ["grid_clear", "stress", "p2g", "grid_update", "g2p"];
        assert_eq!(names[4..9], middle);
        assert_eq!(names.len(), 12);

        // Pressures of blocks are found before those of particles.
        let shared = passes(Needs { features: Features { shares_pressure: true, ..Features::default() }, ..needs });
        let names: Vec<_> = shared.map(|p| p.stage.name()).collect();
        assert_eq!(names[7..14], ["predict", "line", "block_p2g", "block_join", "block_solve", "block_spread", "seek"]);

        // One more transfer to the grid and back, before the scheme's own.
        let sharpened = passes(Needs { features: Features { sharpens: true, ..explicitly }, ..needs });
        let names: Vec<_> = sharpened.map(|p| p.stage.name()).collect();
        assert_eq!(names[4..8], ["gauge", "grid_clear", "p2g", "sharpen"]);
        assert_eq!(names[8..13], middle);
    }

    #[test]
    fn stages_know_their_index() {
        for (i, stage) in Stage::ALL.into_iter().enumerate() {
            assert_eq!(stage.index(), i);
        }
    }
}
