//! The stages of a step. Each file holds a stage's bindings and its CPU twin; the shader of the same name in
//! `shaders/stages` does the same on the GPU. The order is in [`crate::plan`].

pub(crate) mod believed;
pub(crate) mod bin_clear;
pub(crate) mod bin_insert;
pub(crate) mod bin_link;
pub(crate) mod bin_scatter;
pub(crate) mod bin_sleep;
pub(crate) mod bin_sort;
pub(crate) mod bin_wake;
pub(crate) mod block_join;
pub(crate) mod block_p2g;
pub(crate) mod block_solve;
pub(crate) mod block_spread;
pub(crate) mod collider_cull;
pub(crate) mod compliance;
pub(crate) mod constraint;
pub(crate) mod contact;
pub(crate) mod corner;
pub(crate) mod correction;
pub(crate) mod drag;
pub(crate) mod drain;
pub(crate) mod emit_count;
pub(crate) mod emit_gate;
pub(crate) mod emit_place;
pub(crate) mod emit_scan;
pub(crate) mod even;
pub(crate) mod faces;
pub(crate) mod footing;
pub(crate) mod g2p;
pub(crate) mod g2p2g;
pub(crate) mod gap;
pub(crate) mod gauge;
pub(crate) mod grid_clear;
pub(crate) mod grid_update;
pub(crate) mod integrate;
pub(crate) mod joint;
pub(crate) mod line;
pub(crate) mod load;
pub(crate) mod matter;
pub(crate) mod motion;
pub(crate) mod p2g;
pub(crate) mod predict;
pub(crate) mod press;
pub(crate) mod project;
pub(crate) mod rescale;
pub(crate) mod room;
pub(crate) mod seam;
pub(crate) mod seek;
pub(crate) mod sense;
pub(crate) mod settle;
pub(crate) mod sharpen;
pub(crate) mod sides;
pub(crate) mod solid;
pub(crate) mod sound;
pub(crate) mod step_end;
pub(crate) mod stress;
pub(crate) mod swept;
pub(crate) mod tool;
pub(crate) mod viscosity;
pub(crate) mod volume_g2p;
pub(crate) mod volume_p2g;
pub(crate) mod walls;

use crate::cpu::state::CpuState;
use crate::gpu::slots::{Bind, Over};
use crate::math::real::Real;
use crate::plan::{Pass, Stage};

/// What the GPU path needs to know of a stage.
pub(crate) struct Kernel {
    /// Bindings in the order of their numbers in the shader.
    pub binds: &'static [Bind],
    /// What one invocation or workgroup works on.
    pub over: Over,
    /// The shader's text before imports.
    pub source: &'static str,
}

/// The GPU side of a stage.
pub(crate) fn kernel(stage: Stage) -> &'static Kernel {
    match stage {
        Stage::BinInsert => &bin_insert::KERNEL,
        Stage::BinLink => &bin_link::KERNEL,
        Stage::BinScatter => &bin_scatter::KERNEL,
        Stage::BinWake => &bin_wake::KERNEL,
        Stage::BinSleep => &bin_sleep::KERNEL,
        Stage::BinSort => &bin_sort::KERNEL,
        Stage::ColliderCull => &collider_cull::KERNEL,
        Stage::Gap => &gap::KERNEL,
        Stage::Rescale => &rescale::KERNEL,
        Stage::VolumeP2g => &volume_p2g::KERNEL,
        Stage::VolumeG2p => &volume_g2p::KERNEL,
        Stage::Gauge => &gauge::KERNEL,
        Stage::Sharpen => &sharpen::KERNEL,
        Stage::GridClear => &grid_clear::KERNEL,
        Stage::Constraint => &constraint::KERNEL,
        Stage::Stress => &stress::KERNEL,
        Stage::P2g => &p2g::KERNEL,
        Stage::GridUpdate => &grid_update::KERNEL,
        Stage::Press => &press::KERNEL,
        Stage::Predict => &predict::KERNEL,
        Stage::Seek => &seek::KERNEL,
        Stage::Project => &project::KERNEL,
        Stage::Line => &line::KERNEL,
        Stage::BlockP2g => &block_p2g::KERNEL,
        Stage::BlockJoin => &block_join::KERNEL,
        Stage::BlockSolve => &block_solve::KERNEL,
        Stage::BlockSpread => &block_spread::KERNEL,
        Stage::Settle => &settle::KERNEL,
        Stage::G2p => &g2p::KERNEL,
        Stage::G2p2g => &g2p2g::KERNEL,
        Stage::Integrate => &integrate::KERNEL,
        Stage::Drain => &drain::KERNEL,
        Stage::EmitGate => &emit_gate::KERNEL,
        Stage::EmitCount => &emit_count::KERNEL,
        Stage::EmitScan => &emit_scan::KERNEL,
        Stage::EmitPlace => &emit_place::KERNEL,
        Stage::Sense => &sense::KERNEL,
        Stage::BinClear => &bin_clear::KERNEL,
        Stage::StepEnd => &step_end::KERNEL,
    }
}

/// Runs the CPU side of a pass.
pub(crate) fn run<R: Real>(pass: Pass, s: &mut CpuState<R>) {
    match pass.stage {
        Stage::BinInsert => bin_insert::run(s),
        Stage::BinLink => bin_link::run(s),
        Stage::BinScatter => bin_scatter::run(s),
        Stage::BinWake => bin_wake::run(s),
        Stage::BinSleep => bin_sleep::run(s),
        Stage::BinSort => bin_sort::run(s),
        Stage::ColliderCull => collider_cull::run(s),
        Stage::Gap => gap::run(s),
        Stage::Rescale => rescale::run(s),
        Stage::VolumeP2g => volume_p2g::run(s),
        Stage::VolumeG2p => volume_g2p::run(s),
        Stage::Gauge => gauge::run(s),
        Stage::Sharpen => sharpen::run(s),
        Stage::GridClear => grid_clear::run(s),
        Stage::Constraint => constraint::run(s),
        Stage::Stress => stress::run(s),
        Stage::P2g => p2g::run(s),
        Stage::GridUpdate => grid_update::run(s, pass.first),
        Stage::Press => press::run(s),
        Stage::Predict => predict::run(s),
        Stage::Seek => seek::run(s, pass.first, pass.last),
        Stage::Project => project::run(s),
        Stage::Line => line::run(s, pass.first),
        Stage::BlockP2g => block_p2g::run(s),
        Stage::BlockJoin => block_join::run(s),
        Stage::BlockSolve => block_solve::run(s),
        Stage::BlockSpread => block_spread::run(s),
        Stage::Settle => settle::run(s),
        Stage::G2p2g => debug_assert!(false, "the plan of this path has its parts"),
        Stage::G2p => g2p::run(s),
        Stage::Integrate => integrate::run(s),
        Stage::Drain => drain::run(s),
        Stage::EmitGate => emit_gate::run(s),
        Stage::EmitCount => emit_count::run(s),
        Stage::EmitScan => emit_scan::run(s),
        Stage::EmitPlace => emit_place::run(s),
        Stage::Sense => sense::run(s),
        Stage::BinClear => bin_clear::run(s),
        Stage::StepEnd => step_end::run(s),
    }
}
