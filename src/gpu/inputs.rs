//! Writes a step's inputs, and makes room and pipelines for what hosts may first ask for while the world runs.

use super::contents::upload_distances;
use super::layout::{self, StepConstants};
use super::pipelines::Inputs;
use super::requirements;
use super::ring;
use super::shader::Variant;
use super::slots::Slot;
use super::{GpuSolver, Sizes};
use crate::collider::Shapes;
use crate::cpu::constants::{CandidateConstants, ColliderConstants, Constants, ToolConstants};
use crate::error::Result;
use crate::timeline::{ColliderInput, StepInput};

/// Initial room for candidates: an emitter adds few per step.
pub const CANDIDATES: u32 = 1024;

impl GpuSolver {
    /// Writes a step's inputs to where its passes will find them.
    pub(crate) fn write_inputs(&mut self, input: &StepInput) -> Result<Inputs> {
        let candidates = self.make_room(input)?;
        let slot = (self.flight.recorded() % u64::from(self.options.steps_in_flight)) as u32;
        let offset = |of| slot * self.buffers.stride(of);
        let offsets = [Slot::Constants, Slot::Colliders, Slot::Regions, Slot::Tools, Slot::Disturbances].map(offset);
        let drains = input.drains.len() as u32;
        let constants = StepConstants::new(&Constants::new(input), &self.sizes, drains, candidates.clone());
        self.write_at(Slot::Constants, offsets[0], bytemuck::bytes_of(&constants));
        let bodies = |bodies: &[ColliderInput]| -> Vec<layout::Collider> {
            bodies.iter().map(|c| (&ColliderConstants::new(c, |x| x as f32)).into()).collect()
        };
        if self.sizes.colliders > 0 {
            self.write_at(Slot::Colliders, offsets[1], bytemuck::cast_slice(&bodies(&input.colliders)));
        }
        let mut regions = bodies(&input.drains);
        regions.extend(bodies(&input.sensors));
        if !regions.is_empty() {
            self.write_at(Slot::Regions, offsets[2], bytemuck::cast_slice(&regions));
        }
        if !input.tools.is_empty() {
            let tools: Vec<layout::Tool> = input.tools.iter().map(|t| (&ToolConstants::new(t)).into()).collect();
            self.write_at(Slot::Tools, offsets[3], bytemuck::cast_slice(&tools));
        }
        if let Some(sleep) = &input.sleep {
            let disturbances = layout::Disturbance::all(&sleep.disturbed);
            self.write_at(Slot::Disturbances, offsets[4], bytemuck::cast_slice(&disturbances));
        }
        if !candidates.is_empty() {
            let particles: Vec<layout::Candidate> =
                input.candidates.iter().map(|c| CandidateConstants::new(c).into()).collect();
            let first = u64::from(candidates.start) * size_of::<layout::Candidate>() as u64;
            self.write_at(Slot::Candidates, first, bytemuck::cast_slice(&particles));
        }
        Ok(Inputs { offsets, candidates })
    }

    fn write_at(&self, slot: Slot, offset: impl Into<u64>, bytes: &[u8]) {
        self.queue.write_buffer(self.buffers.get(slot), offset.into(), bytes);
    }

    /// Makes room for the drains, tools and candidates of a step, and compiles pipelines where they are the first;
    /// returns the candidates' places. Steps in flight keep the buffers that they were recorded with.
    fn make_room(&mut self, input: &StepInput) -> Result<std::ops::Range<u32>> {
        let before = self.pipelines.variant();
        let (drains, count) = (input.drains.len() as u32, input.candidates.len() as u32);
        let mut sizes = self.sizes;
        let mut variant = before;
        if drains > 0 || input.release {
            sizes = sizes.with_grids(&self.timeline.grids);
            let shapes = Shapes::of_kinds(input.drains.iter().map(|d| d.kind), sizes.grids);
            variant.drains = Some(before.drains.unwrap_or_default().and(shapes));
            // What is bound may not be empty.
            sizes.regions = sizes.regions.max(drains + sizes.sensors).max(1);
        }
        variant.tools |= !input.tools.is_empty();
        sizes.tools = variant.tools;
        let mut first = 0;
        if count > 0 {
            let found = ring::place(sizes.candidates, self.flight.candidates(), count);
            first = found.unwrap_or(0);
            variant.emission = true;
            if found.is_none() {
                let ample = count.max(CANDIDATES / 2).max(sizes.candidates).saturating_mul(2);
                // A different size makes a new buffer, so that steps in flight keep the present one.
                let limits = self.device.limits();
                let fits = |candidates: &u32| {
                    *candidates != self.sizes.candidates
                        && requirements::check(&limits, &Sizes { candidates: *candidates, ..sizes }).is_ok()
                };
                let found = [ample, count + 1, count].into_iter().find(fits);
                // None: the present buffer is as large as the device allows, and steps in flight have yet to read it.
                let larger = |candidates| requirements::check(&limits, &Sizes { candidates, ..sizes });
                sizes.candidates = found.map_or_else(|| larger(count + 1).map(|()| count + 1), Ok)?;
            }
        }
        if sizes != self.sizes || variant != before {
            self.extend(sizes, variant)?;
        }
        Ok(first..first + count)
    }

    fn extend(&mut self, sizes: Sizes, variant: Variant) -> Result<()> {
        requirements::check(&self.device.limits(), &sizes)?;
        if sizes.candidates != self.sizes.candidates {
            // Those in flight lie in the buffer that is replaced.
            self.flight.forget_candidates();
        }
        let more_grids = sizes.grids != self.sizes.grids;
        self.sizes = sizes;
        self.buffers.resize(&self.device, &sizes);
        if more_grids {
            upload_distances(&self.queue, &self.buffers, &self.timeline.grids);
        }
        self.pipelines.extend(&self.device, variant);
        self.pipelines.bind(&self.device, &self.buffers, &sizes);
        Ok(())
    }
}
