//! Gradients of particles, and what their fourth lanes hold. Twin: `shaders/lib/gradient.wgsl`.

use crate::math::real::Real;

/// The displacement gradient of a particle by columns. The fourth lanes hold mass, material index (with what
/// [`faces`](crate::stages::faces) notes as a fraction), and in the implicit scheme the pressure, in the explicit one the
/// evenness of the matter around it. The functions below read and write these. Deformation gradients have the same type
/// and other fourth lanes.
pub type Gradient<R> = [[R; 4]; 3];

/// The deformation gradient of a particle that has not moved yet.
pub fn undeformed<R: Real>() -> Gradient<R> {
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]].map(|column| column.map(R::of))
}

/// The displacement gradient of a particle of this mass and material, before no face and without pressure.
pub fn with_mass<R: Real>([x, y, z]: [[R; 3]; 3], mass: R, material: R) -> Gradient<R> {
    let beside = |[a, b, c]: [R; 3], fourth| [a, b, c, fourth];
    [beside(x, mass), beside(y, material), beside(z, R::of(0.0))]
}

#[inline(always)]
pub fn mass_of<R: Real>(gradient: &Gradient<R>) -> R {
    gradient[0][3]
}

/// The index of the particle's material.
#[inline(always)]
pub fn material_of<R: Real>(gradient: &Gradient<R>) -> usize {
    stored_material(gradient).floor_index() as usize
}

/// What is noted beside that index: the faces that the particle lies before.
#[inline(always)]
pub fn beside_of<R: Real>(gradient: &Gradient<R>) -> R {
    let stored = stored_material(gradient);
    stored - R::of(f64::from(stored.floor_index()))
}

/// The same of four particles, of which `columns` holds the gradients.
#[inline(always)]
pub fn beside_of_lanes<R: Real>(columns: &[[R::V; 4]; 3]) -> R::V {
    let stored = columns[1][3];
    stored - R::truncated(stored).1
}

/// Notes faces beside the index of the material.
#[inline(always)]
pub fn note_beside<R: Real>(gradient: &mut Gradient<R>, beside: R) {
    gradient[1][3] = R::of(f64::from(stored_material(gradient).floor_index())) + beside;
}

/// The index of the material and what is noted beside it, as one number.
#[inline(always)]
pub fn stored_material<R: Real>(gradient: &Gradient<R>) -> R {
    gradient[1][3]
}

/// The pressure in the implicit scheme.
#[inline(always)]
pub fn pressure_of<R: Real>(gradient: &Gradient<R>) -> R {
    gradient[2][3]
}

#[inline(always)]
pub fn pressure_mut<R: Real>(gradient: &mut Gradient<R>) -> &mut R {
    &mut gradient[2][3]
}

/// The evenness of the matter around the particle in the explicit scheme.
#[inline(always)]
pub fn evenness_of<R: Real>(gradient: &Gradient<R>) -> R {
    gradient[2][3]
}

#[inline(always)]
pub fn evenness_mut<R: Real>(gradient: &mut Gradient<R>) -> &mut R {
    &mut gradient[2][3]
}
