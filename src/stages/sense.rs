//! Sums the particles in each sensor.

use super::Kernel;
use super::contact::distance_normal_after;
use super::load::whole;
use crate::cpu::gradient::mass_of;
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::{Lanes, Real};
use crate::sensor::MASS_SCALE;
use std::sync::atomic::Ordering;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Regions),
        read(Slot::Position),
        read(Slot::Displacement),
        read(Slot::Gradient),
        write(Slot::Sensed),
        write(Slot::Counters),
        read(Slot::DistanceGrids).with_meshes(),
        read(Slot::Distances).with_meshes(),
    ],
    over: Over::Particles,
    source: include_str!("../../shaders/stages/sense.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (sensors, sensed, constants) = (&s.sensors, &s.sensed, &s.constants);
    let (displacement, gradient) = (&s.displacement, &s.gradient);
    sensed.iter().flatten().for_each(|sum| sum.store(0, Ordering::Relaxed));
    let zero = R::of(0.0);
    par::each_chunk(&mut s.position, 4, |chunk, position| {
        let last = position.len() - 1;
        let [x, y, z, _] = R::V::transposed([0, 1, 2, 3].map(|n: usize| R::V::from4(position[n.min(last)])));
        for (sensor, sums) in sensors.iter().zip(sensed) {
            let inside = distance_normal_after::<R>(sensor, [x, y, z]).0.below(R::V::all(zero));
            for (n, inside) in inside.lanes().into_iter().enumerate().take(position.len()) {
                if !inside || position[n][3] <= zero {
                    continue;
                }
                let (u, mass) = (displacement[4 * chunk + n], mass_of(&gradient[4 * chunk + n]));
                let weight = mass * constants.load_scale;
                let found = [
                    1,
                    whole(mass * R::of(MASS_SCALE)),
                    whole(u[0] * weight),
                    whole(u[1] * weight),
                    whole(u[2] * weight),
                ];
                for (sum, found) in sums.iter().zip(found) {
                    sum.fetch_add(found, Ordering::Relaxed);
                }
            }
        }
    });
}
