//! The buffers of the GPU path by name, and how stages refer to them.

/// A buffer of the GPU path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Slot {
    /// Constants of one step; uniform, in the ring.
    Constants,
    /// Constants of the materials; uniform.
    Materials,
    /// The colliders of one step, in the ring.
    Colliders,
    /// Header of each distance grid: all but its distances; uniform, in worlds with meshes.
    DistanceGrids,
    /// The distances of all grids in units of their spacing, one after the other through the rows of a texture, since
    /// stages with bodies have no storage buffer left.
    Distances,
    /// `vec4` per particle: position in cells, volume ratio.
    Position,
    /// `vec4` per particle: displacement in cells, volume fraction measured on the grid.
    Displacement,
    /// Three `vec4` per particle: columns of the displacement gradient; fourth lanes mass, material (with what
    /// `stages::faces` notes as a fraction), and in the implicit scheme the pressure, in the explicit one the evenness of
    /// the matter around it.
    Gradient,
    /// Three `vec4` per particle, in worlds with solids or with liquids that stick: columns of the deformation
    /// gradient. Fourth lanes: for sand its slack, two unused; for other solids beside clamps, and for viscous liquids
    /// where they stick, the correction of the strains that they underestimate. The columns of such liquids hold the
    /// rest of that correction (see `stages::correction`).
    Deformation,
    /// Per particle its table entry and its rank in the block; where matter may sleep, also how long it has been at
    /// rest.
    Bin,
    /// Particle indices, block by block.
    Order,
    /// Hash table from block keys to blocks, with their particles' number and whether all of them rest.
    Table,
    /// Per block its key, table entry, first particle, particle count, and which tiles that reach it sleep.
    Blocks,
    /// Per occupied block the table entries of the eight blocks of its tile.
    Links,
    /// Per chunk of at most 256 particles its block, its particles, the blocks of its tile and its cells that hold
    /// particles; where the liquids of a block share a pressure, also that.
    Chunks,
    /// Counts of this step and since the start.
    Counters,
    /// Arguments of the indirect dispatch over occupied blocks. It is apart from the others because the stage that is
    /// dispatched with it writes those.
    DispatchOccupied,
    /// Arguments of the other indirect dispatches.
    Dispatch,
    /// Per block a bit per collider in reach, and whether later words have any; behind all of them, where gaps are
    /// noted, per node the distance of its solids from bodies, and before which faces of boxes they lie.
    Cull,
    /// Four numbers per node: sums as integers, then displacement and mass as floats.
    Grid,
    /// What is deleted at the end of a step, then the sensors, in the ring.
    Regions,
    /// The particles that are to appear, a stretch for each step in flight.
    Candidates,
    /// Per candidate how many of its group of 64 may appear, up to and including it.
    Accepted,
    /// Per group of slots how many are free, later how many are free in all groups before it; behind these the same for
    /// candidates that may appear.
    Vacancies,
    /// Sums of each sensor, two words each, for this step and the one before.
    Sensed,
    /// The tools of one step; uniform, in the ring.
    Tools,
    /// Where nothing sleeps in one step, in worlds where matter may sleep; uniform, in the ring.
    Disturbances,
    /// Per particle the state of the implicit scheme's solve. This and the following slots exist only in that scheme,
    /// but for `Force`.
    Search,
    /// `vec4` per node: predicted displacement, during the solve the displacement along the direction of search; 0.
    Field,
    /// Per node the directions in which bodies hold it.
    Held,
    /// Four numbers per node: sums of what stresses add to the momentum; 0. In fused iterations of the published scheme
    /// the momentum itself.
    Force,
    /// Global state of the solve.
    Solve,
    /// Per occupied block and node of its tile three integers: what a unit of pressure of its liquids pushes there.
    /// This and the following slots exist only where the liquids of a block share a pressure.
    BlockTiles,
    /// Per occupied block the state of its liquids, summed, and the blocks of its tile.
    BlockSums,
    /// Per occupied block the pressure that its liquids share, with its solve.
    BlockPressures,
    /// Per block of nodes how the pressures of the blocks whose tiles reach it act on each other there: vectors of
    /// four, each of all blocks before the next.
    Couplings,
}

impl Slot {
    /// Every slot.
    pub const ALL: [Slot; 36] = [
        Slot::Constants,
        Slot::Materials,
        Slot::Colliders,
        Slot::DistanceGrids,
        Slot::Distances,
        Slot::Position,
        Slot::Displacement,
        Slot::Gradient,
        Slot::Deformation,
        Slot::Bin,
        Slot::Order,
        Slot::Table,
        Slot::Blocks,
        Slot::Links,
        Slot::Chunks,
        Slot::Counters,
        Slot::DispatchOccupied,
        Slot::Dispatch,
        Slot::Cull,
        Slot::Grid,
        Slot::Regions,
        Slot::Candidates,
        Slot::Accepted,
        Slot::Vacancies,
        Slot::Sensed,
        Slot::Tools,
        Slot::Disturbances,
        Slot::Search,
        Slot::Field,
        Slot::Held,
        Slot::Force,
        Slot::Solve,
        Slot::BlockTiles,
        Slot::BlockSums,
        Slot::BlockPressures,
        Slot::Couplings,
    ];

    /// The variable's name in the shaders.
    pub fn name(self) -> &'static str {
        match self {
            Slot::Constants => "constants",
            Slot::Materials => "materials",
            Slot::Colliders => "colliders",
            Slot::DistanceGrids => "distance_grids",
            Slot::Distances => "distances",
            Slot::Position => "position",
            Slot::Displacement => "displacement",
            Slot::Gradient => "gradient",
            Slot::Deformation => "deformation",
            Slot::Bin => "bin",
            Slot::Order => "order",
            Slot::Table => "table",
            Slot::Blocks => "blocks",
            Slot::Links => "links",
            Slot::Chunks => "chunks",
            Slot::Counters => "counters",
            Slot::DispatchOccupied => "dispatch_occupied",
            Slot::Dispatch => "dispatch",
            Slot::Cull => "cull",
            Slot::Grid => "grid",
            Slot::Regions => "regions",
            Slot::Candidates => "candidates",
            Slot::Accepted => "accepted",
            Slot::Vacancies => "vacancies",
            Slot::Tools => "tools",
            Slot::Disturbances => "disturbances",
            Slot::Sensed => "sensed",
            Slot::Search => "search",
            Slot::Field => "field",
            Slot::Held => "held",
            Slot::Force => "force",
            Slot::Solve => "solve",
            Slot::BlockTiles => "block_tiles",
            Slot::BlockSums => "block_sums",
            Slot::BlockPressures => "block_pressures",
            Slot::Couplings => "couplings",
        }
    }
}

/// How a stage uses a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bind {
    /// Which.
    pub slot: Slot,
    /// Whether it is written.
    pub write: bool,
    /// In which worlds.
    pub only: Only,
}

/// In which worlds a stage uses a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Only {
    /// In all.
    Always,
    /// Where there are walls or bodies.
    WithColliders,
    /// Where there are solids.
    WithSolids,
    /// Where the solve has to tell materials apart.
    WithMaterials,
    /// Where there are solids, or liquids whose viscosity is solved for.
    WithKinds,
    /// Where the solve is for stresses, not for pressures alone.
    WithTensors,
    /// Where particles have a deformation gradient, or what liquids that stick keep in its place.
    WithDeformation,
    /// Where viscous liquids stick to bodies.
    WithSticking,
    /// Where bodies are meshes or heightfields.
    WithMeshes,
    /// Where there are tools.
    WithTools,
    /// In the implicit scheme.
    WithImplicit,
    /// Where matter may sleep.
    WithSleep,
    /// Where iterations of the published scheme are fused.
    WithFused,
    /// Where several are.
    WithRepeats,
}

impl Bind {
    /// Only where there are walls or bodies.
    pub const fn with_colliders(self) -> Bind {
        Bind { only: Only::WithColliders, ..self }
    }

    /// Only where bodies are meshes or heightfields.
    pub const fn with_meshes(self) -> Bind {
        Bind { only: Only::WithMeshes, ..self }
    }

    /// Only where viscous liquids stick to bodies.
    pub const fn with_sticking(self) -> Bind {
        Bind { only: Only::WithSticking, ..self }
    }

    /// Only where there are tools.
    pub const fn with_tools(self) -> Bind {
        Bind { only: Only::WithTools, ..self }
    }

    /// Only in the implicit scheme.
    pub const fn with_implicit(self) -> Bind {
        Bind { only: Only::WithImplicit, ..self }
    }

    /// Only where matter may sleep.
    pub const fn with_sleep(self) -> Bind {
        Bind { only: Only::WithSleep, ..self }
    }

    /// Only where iterations of the published scheme are fused.
    pub const fn with_fused(self) -> Bind {
        Bind { only: Only::WithFused, ..self }
    }

    /// Only where several of these are fused.
    pub const fn with_repeats(self) -> Bind {
        Bind { only: Only::WithRepeats, ..self }
    }

    /// Only where the solve has to tell materials apart.
    pub const fn with_materials(self) -> Bind {
        Bind { only: Only::WithMaterials, ..self }
    }

    /// Only where there are solids.
    pub const fn with_solids(self) -> Bind {
        Bind { only: Only::WithSolids, ..self }
    }

    /// Only where there are solids, or liquids whose viscosity is solved for.
    pub const fn with_kinds(self) -> Bind {
        Bind { only: Only::WithKinds, ..self }
    }

    /// Only where the solve is for stresses.
    pub const fn with_tensors(self) -> Bind {
        Bind { only: Only::WithTensors, ..self }
    }

    /// Only where particles have a deformation gradient, or what liquids that stick keep in its place.
    pub const fn with_deformation(self) -> Bind {
        Bind { only: Only::WithDeformation, ..self }
    }
}

/// A binding that is only read.
pub const fn read(slot: Slot) -> Bind {
    Bind { slot, write: false, only: Only::Always }
}

/// A binding that is read and written.
pub const fn write(slot: Slot) -> Bind {
    Bind { slot, write: true, only: Only::Always }
}

/// What a stage is dispatched over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// One invocation per particle slot, or for as many as [`Tuning::share`](super::tuning::Tuning::share) says.
    Particles,
    /// Per occupied block as many invocations as link it ([`Tuning::linkers`](super::tuning::Tuning::linkers)).
    Occupied,
    /// One invocation per active block.
    Blocks,
    /// One workgroup per active block.
    Nodes,
    /// One workgroup per chunk of particles.
    Chunks,
    /// The same as over nodes while a solve goes on, then none.
    SolveNodes,
    /// The same as over chunks while a solve goes on, and in its last pass.
    SolveChunks,
    /// One invocation per candidate of the step.
    Candidates,
    /// One workgroup of 64 per group of slots.
    SlotGroups,
    /// One workgroup.
    One,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Buffers are found by it.
    #[test]
    fn slots_know_their_index() {
        for (index, slot) in Slot::ALL.into_iter().enumerate() {
            assert_eq!(slot as usize, index, "{}", slot.name());
        }
    }
}
