"""What the two peers have in common: the interface to their kernels, times, and a look at whether they are right.

Both solve the same equations with the same discretisation (MLS-MPM, Hu et al. 2018): quadratic B-splines, affine
transfers, a liquid of pressure K (1 - J), explicit steps, a dense grid in single precision, particles in the order of
their making. The kernels are plain: what somebody writes who knows the method and the framework, not what an expert of
the device would.
"""

import time
from abc import ABC, abstractmethod

import numpy as np

from scenes import COLUMN_HEIGHT, GRAVITY, Scene

# Cells of the grid beyond each wall, room for the kernels of particles at it.
PAD = 2


class Peer(ABC):
    """Particles of one scene on one device."""

    # Steps that are sent off before they are waited for, as the example `headless` does.
    batch = 1

    def __init__(self) -> None:
        self.scene: Scene | None = None
        self.dt = 0.0
        self.bulk_modulus = 0.0
        self.kept: dict[str, dict[str, np.ndarray]] = {}

    def open(self, scene: Scene) -> None:
        """Makes room for a scene, and compiles."""
        self.scene = scene
        self.allocate()
        self.tune(1e-6, 1.0)
        self.start()
        self.steps(2)

    def start(self) -> None:
        """The scene as it begins."""
        n = self.scene.count
        self.load({
            "x": self.scene.positions(),
            "v": np.zeros((n, 3), np.float32),
            "C": np.zeros((n, 3, 3), np.float32),
            "J": np.ones(n, np.float32),
        })

    def tune(self, dt: float, bulk_modulus: float) -> None:
        self.dt, self.bulk_modulus = dt, bulk_modulus

    def adopt(self, name: str, state: dict[str, np.ndarray]) -> None:
        """Notes a state, also that of another device, for `restore`."""
        self.kept[name] = state

    def restore(self, name: str) -> None:
        self.load(self.kept[name])

    def times(self, count: int) -> list[float]:
        """Seconds per step of each batch in `count` steps."""
        found = []
        for _ in range(count // self.batch):
            start = time.perf_counter()
            self.steps(self.batch)
            found.append((time.perf_counter() - start) / self.batch)
        return found

    def look(self) -> dict[str, float]:
        """Numbers about the state, and whether anything was lost."""
        state = self.state()
        x, v = state["x"].astype(np.float64), state["v"].astype(np.float64)
        mass = self.scene.mass * self.scene.count
        sound = bool(np.isfinite(x).all() and np.isfinite(v).all() and np.isfinite(state["J"]).all())
        return {
            "sound": sound,
            "outside": int(((x < 0) | (x > self.scene.size * (1 + 1e-6))).any(1).sum()),
            # A step's grid holds all that the particles do.
            "mass_error": abs(self.grid_mass() / mass - 1) if sound else float("nan"),
            "height": float(x[:, 1].mean()),
            "kinetic": 0.5 * self.scene.mass * float((v * v).sum()),
            "weight": mass * GRAVITY,
        }

    def settle(self, dt: float, bulk_modulus: float) -> dict[str, float]:
        """The column over two seconds: means over each of them."""
        self.tune(dt, bulk_modulus)
        self.start()
        steps, looks = round(2.0 / dt), []
        for k in range(40):
            self.steps((k + 1) * steps // 40 - k * steps // 40)
            looks.append(self.look())
            if not looks[-1]["sound"] or looks[-1]["outside"]:
                return {"stands": False}

        def mean(name: str, part: list[dict]) -> float:
            return float(np.mean([look[name] for look in part]))

        kinetic = [mean("kinetic", part) for part in (looks[:20], looks[20:])]
        loss = 1 - 2 * mean("height", looks[20:]) / COLUMN_HEIGHT
        return {
            # Waves die down rather than grow, and something is left.
            "stands": kinetic[1] < kinetic[0] and loss < 0.5 and looks[-1]["mass_error"] < 1e-4,
            "loss": loss,
            "kinetic": kinetic[1] / (looks[-1]["weight"] * COLUMN_HEIGHT),
        }

    @abstractmethod
    def allocate(self) -> None: ...

    @abstractmethod
    def load(self, state: dict[str, np.ndarray]) -> None: ...

    @abstractmethod
    def state(self) -> dict[str, np.ndarray]: ...

    @abstractmethod
    def steps(self, count: int) -> None:
        """Takes steps and waits for them."""

    @abstractmethod
    def grid_mass(self) -> float:
        """What the last step has summed up on the grid, kg."""
