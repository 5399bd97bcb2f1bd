//! What a world requires of its steps, decided once. Features that are absent are not planned, compiled, bound or
//! stored.

use crate::collider::Collider;
use crate::material::Model;
use crate::settings::Scheme;
use crate::shape::Shape;
use crate::units::Units;
use crate::world::World;
use glam::DVec3;

/// The features of a world: its scheme, the models of the materials that take part, and what these need.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Features {
    /// How a step is solved.
    pub scheme: Scheme,
    /// The published scheme takes more than one iteration.
    pub repeats: bool,
    /// There is a liquid.
    pub liquid: bool,
    /// There is an elastic material.
    pub elastic: bool,
    /// There is sand.
    pub sand: bool,
    /// There is a viscoplastic material.
    pub viscoplastic: bool,
    /// There is a liquid whose viscosity the implicit scheme solves for (see [`World::viscous_dt`]).
    pub thick: bool,
    /// There is a liquid that sticks to something and is so viscous that the strains it underestimates there are
    /// corrected.
    pub sticks: bool,
    /// Strains that particles underestimate are corrected: of liquids that stick, or of solids beside clamps.
    pub corrects: bool,
    /// There is a liquid, and a closed side of the domain or a face of a body, before which liquids see less of a strain
    /// than there is. It is made up for unless their viscosity is solved for.
    pub walls: bool,
    /// These may also lie before faces of bodies that go through nodes.
    pub faces: bool,
    /// The implicit scheme's solve begins with the stress of the step before as its first direction of search.
    pub resumes: bool,
    /// Volume is summed on the grid beside mass, which does not tell how full a node is, or of what: materials differ
    /// in density, or liquids lie beside solids.
    pub volumes: bool,
    /// Motion that transfers smooth away is restored.
    pub sharpens: bool,
    /// The liquids of a block share a pressure.
    pub shares_pressure: bool,
    /// Matter may sleep.
    pub sleep: bool,
    /// Matter is repeated along an axis.
    pub periodic: bool,
}

impl Features {
    /// Those of a world.
    pub fn of(world: &World) -> Self {
        let settings = &world.settings;
        let any = |test: fn(Model) -> bool| world.has(|m| test(m.model));
        let features = Features {
            scheme: settings.scheme,
            repeats: settings.scheme == Scheme::Published && settings.iterations > 1,
            liquid: any(|m| m == Model::Liquid),
            elastic: any(|m| matches!(m, Model::Elastic { .. })),
            sand: any(|m| matches!(m, Model::Sand { .. })),
            viscoplastic: any(|m| matches!(m, Model::Viscoplastic { .. })),
            thick: world.is_thick(),
            sticks: world.sticks(),
            corrects: false,
            walls: false,
            faces: false,
            resumes: world.resumes(),
            volumes: false,
            sharpens: settings.sharpens(),
            shares_pressure: world.shares_pressure(),
            sleep: settings.sleep.is_some(),
            periodic: world.domain.period_cells() != DVec3::ZERO,
        };
        // The published scheme's solids have no stress to correct.
        let clamps = world.colliders.iter().any(Collider::clamps);
        let clamped = clamps && settings.scheme != Scheme::Published && features.touches();
        let densest = Units::new(world).density;
        let closed = world.domain.walls.sides().iter().any(|(_, _, wall, _)| wall.boundary().is_some());
        // The published scheme's liquids have no pressure of their own to match.
        let corrects_walls = features.liquid && settings.scheme != Scheme::Published;
        let flat = |shape: &Shape| matches!(shape, Shape::Box { .. } | Shape::HalfSpace);
        let faces = corrects_walls && world.colliders.iter().any(|c| flat(&c.shape));
        let walls = corrects_walls && (closed || faces);
        let volumes = features.mixes() || world.has(|m| m.rest_density != densest);
        Features { corrects: features.sticks || clamped, walls, faces, volumes, ..features }
    }

    /// Whether any is a solid.
    pub fn solids(self) -> bool {
        self.elastic || self.yielding()
    }

    /// Whether the implicit scheme's solve has to tell materials apart: solids from liquids, or liquids that share
    /// pressures by their densities.
    pub fn tells_materials(self) -> bool {
        self.solids() || (self.shares_pressure && self.volumes)
    }

    /// Whether particles differ in how they resist changes of volume: there are solids, or liquids whose viscosity is
    /// solved for.
    pub fn kinds(self) -> bool {
        self.solids() || self.thick
    }

    /// Whether any yields.
    pub fn yielding(self) -> bool {
        self.sand || self.viscoplastic
    }

    /// Whether particles have a deformation gradient, or what liquids that stick keep in its place.
    pub fn deforms(self) -> bool {
        self.solids() || self.sticks
    }

    /// Whether any material contacts bodies when its surface does, not as soon as it shares a node with them: all
    /// solids but sand.
    pub fn touches(self) -> bool {
        self.elastic || self.viscoplastic
    }

    /// Whether nodes must store how far from bodies their matter is, or that it is not the liquid that sticks to them.
    pub fn gaps(self) -> bool {
        self.touches() || (self.sand && self.sticks)
    }

    /// Whether liquids may lie beside solids other than sand.
    pub fn mixes(self) -> bool {
        self.liquid && self.touches()
    }

    /// Whether iterations can be fused: those of liquids in the published scheme.
    pub fn fuses(self) -> bool {
        self.scheme == Scheme::Published && !self.solids() && !self.sleep
    }

    /// Whether the scheme is the implicit one.
    pub fn implicit(self) -> bool {
        self.scheme == Scheme::Implicit
    }

    /// Whether the implicit scheme solves for stresses, not for pressures alone.
    pub fn tensors(self) -> bool {
        self.implicit() && (self.solids() || self.thick)
    }

    /// Whether the largest stiffness of liquids depends on how evenly matter lies.
    pub fn firm(self) -> bool {
        self.liquid && self.scheme == Scheme::Explicit
    }
}
