"""The scenes that every engine is timed on: boxes of slip walls with blocks of liquid, nothing else."""

from dataclasses import dataclass, field

import numpy as np

GRAVITY = 9.81  # m/s²
DENSITY = 1000.0  # kg/m³
# Volume ratio beyond which a liquid has come apart and bears no stress; the default of the engine.
TENSION_LIMIT = 1.1
# Random offset of the particles at the start, share of their spacing: lattices hide errors and scattered reads.
JITTER = 0.2


@dataclass(frozen=True)
class Block:
    """A lattice of so many particles along x, y and z from a corner on, m."""

    corner: tuple[float, float, float]
    counts: tuple[int, int, int]


@dataclass(frozen=True)
class Scene:
    """A box from the origin, and what is in it."""

    name: str
    cells: tuple[int, int, int]
    dx: float  # m
    spacing: float  # of the particles, m
    blocks: tuple[Block, ...] = field(default=())

    @property
    def size(self) -> np.ndarray:
        return np.array(self.cells) * self.dx

    @property
    def count(self) -> int:
        return sum(int(np.prod(block.counts)) for block in self.blocks)

    @property
    def mass(self) -> float:
        """Of one particle, kg."""
        return DENSITY * self.spacing**3

    def positions(self) -> np.ndarray:
        """At the start, m."""
        random = np.random.default_rng(1)
        parts = []
        for block in self.blocks:
            lattice = np.stack(np.meshgrid(*(np.arange(n) for n in block.counts), indexing="ij"), -1).reshape(-1, 3)
            offset = random.uniform(-JITTER, JITTER, lattice.shape)
            parts.append(np.array(block.corner) + (lattice + 0.5 + offset) * self.spacing)
        return np.concatenate(parts).astype(np.float32)

    def document(self, bulk_modulus: float, settings: dict) -> dict:
        """As a scene file of the engine."""
        spawns = []
        for seed, block in enumerate(self.blocks):
            half = 0.5 * self.spacing * np.array(block.counts)
            spawns.append({
                "material": "water",
                # A hair larger, so that rounding takes no layer away.
                "shape": {"box": {"half_size": (half * (1 + 1e-6)).tolist()}},
                "position": (np.array(block.corner) + half).tolist(),
                "fill": {"spacing": self.spacing},
                "jitter": JITTER,
                "seed": seed,
            })
        return {
            "name": self.name,
            "domain": {"min": [0, 0, 0], "max": self.size.tolist(), "cell_size": self.dx},
            "gravity": [0, -GRAVITY, 0],
            "materials": [{"name": "water", "rest_density": DENSITY, "bulk_modulus": bulk_modulus}],
            "spawns": spawns,
            "settings": settings,
        }


@dataclass(frozen=True)
class Basin:
    """Two cubes fall into a basin: time per pass."""

    scene: Scene
    dt: float  # s
    bulk_modulus: float  # Pa
    free: int  # steps in which nothing is near the floor yet
    before: int  # steps until times are taken; the cubes are spreading by then


def _basin(name: str, corners: list[tuple[float, float, float]], per_side: int, spacing: float) -> Basin:
    blocks = tuple(Block(corner, (per_side,) * 3) for corner in corners)
    scene = Scene(name, (50, 54, 51), 1.0, spacing, blocks)
    # Sound goes a quarter of a cell per step, which every engine bears; the fall ends after 0.9 s.
    return Basin(scene, 1 / 120, 9e5, 80, 144)


# The box, the count and the density (5 per cell) of the thesis' basin.
SMALL = _basin("basin", [(3.0, 4.0, 3.0), (32.0, 4.0, 33.0)], 25, 7 / 12)
# Eight times as many, 8 per cell.
LARGE = _basin("basin-large", [(0.0, 4.0, 0.0), (25.0, 4.0, 26.0)], 50, 0.5)

# As case a3-32 of the example `validate`.
COLUMN_CELLS = 32
COLUMN = Scene("column", (16, 48, 4), 0.02, 0.01, (Block((0.0, 0.0, 0.0), (32, 64, 8)),))
COLUMN_HEIGHT = COLUMN_CELLS * COLUMN.dx
