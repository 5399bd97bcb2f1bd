"""MLS-MPM in NVIDIA Warp."""

import warp as wp

from peer import PAD, Peer
from scenes import GRAVITY, TENSION_LIMIT

wp.config.quiet = True
wp.set_module_options({"enable_backward": False, "fast_math": True})

PAD_CELLS = wp.constant(PAD)
FREE_FALL = wp.constant(GRAVITY)
TENSION = wp.constant(TENSION_LIMIT)


@wp.func
def weights(r: wp.vec3):
    """A row for each of the three nodes, a column for each axis."""
    a = wp.vec3(1.5) - r
    b = r - wp.vec3(1.0)
    c = r - wp.vec3(0.5)
    return wp.matrix_from_rows(0.5 * wp.cw_mul(a, a), wp.vec3(0.75) - wp.cw_mul(b, b), 0.5 * wp.cw_mul(c, c))


@wp.func
def stencil(x: wp.vec3, inverse: float):
    """The first of a particle's nodes, the way from it in cells, and the weights."""
    at = x * inverse + wp.vec3(float(PAD_CELLS))
    bx, by, bz = int(at[0] - 0.5), int(at[1] - 0.5), int(at[2] - 0.5)
    r = at - wp.vec3(float(bx), float(by), float(bz))
    return bx, by, bz, r, weights(r)


@wp.kernel
def p2g(
    x: wp.array(dtype=wp.vec3),
    v: wp.array(dtype=wp.vec3),
    C: wp.array(dtype=wp.mat33),
    J: wp.array(dtype=float),
    grid: wp.array3d(dtype=wp.vec4),
    dx: float,
    mass: float,
    volume: float,
    dt: float,
    bulk_modulus: float,
):
    p = wp.tid()
    inverse = 1.0 / dx
    bx, by, bz, r, w = stencil(x[p], inverse)
    pressure = wp.where(J[p] <= TENSION, bulk_modulus * (1.0 - J[p]), 0.0)
    push = 4.0 * inverse * inverse * dt * volume * pressure
    affine = mass * C[p] + push * wp.identity(3, dtype=float)
    momentum = mass * v[p]
    for i in range(3):
        for j in range(3):
            for k in range(3):
                weight = w[i, 0] * w[j, 1] * w[k, 2]
                given = momentum + affine @ ((wp.vec3(float(i), float(j), float(k)) - r) * dx)
                wp.atomic_add(grid, bx + i, by + j, bz + k, weight * wp.vec4(given[0], given[1], given[2], mass))


@wp.func
def walled(v: float, node: int, cells: int):
    u = v
    if node <= PAD_CELLS:
        u = wp.max(u, 0.0)
    if node >= PAD_CELLS + cells:
        u = wp.min(u, 0.0)
    return u


@wp.kernel
def grid_update(grid: wp.array3d(dtype=wp.vec4), cells: wp.vec3i, dt: float):
    i, j, k = wp.tid()
    sums = grid[i, j, k]
    mass = sums[3]
    if mass > 0.0:
        grid[i, j, k] = wp.vec4(
            walled(sums[0] / mass, i, cells[0]),
            walled(sums[1] / mass - FREE_FALL * dt, j, cells[1]),
            walled(sums[2] / mass, k, cells[2]),
            mass,
        )


@wp.kernel
def g2p(
    x: wp.array(dtype=wp.vec3),
    v: wp.array(dtype=wp.vec3),
    C: wp.array(dtype=wp.mat33),
    J: wp.array(dtype=float),
    grid: wp.array3d(dtype=wp.vec4),
    dx: float,
    size: wp.vec3,
    dt: float,
):
    p = wp.tid()
    inverse = 1.0 / dx
    bx, by, bz, r, w = stencil(x[p], inverse)
    velocity = wp.vec3(0.0)
    B = wp.mat33(0.0)
    for i in range(3):
        for j in range(3):
            for k in range(3):
                weight = w[i, 0] * w[j, 1] * w[k, 2]
                node = grid[bx + i, by + j, bz + k]
                u = weight * wp.vec3(node[0], node[1], node[2])
                velocity += u
                B += wp.outer(u, wp.vec3(float(i), float(j), float(k)) - r)
    gradient = 4.0 * inverse * B
    v[p] = velocity
    C[p] = gradient
    J[p] = J[p] * (1.0 + dt * wp.trace(gradient))
    x[p] = wp.min(wp.max(x[p] + dt * velocity, wp.vec3(0.0)), size)


class WarpPeer(Peer):
    def __init__(self, device: str, threads: int):
        super().__init__()
        wp.init()
        if device not in ("cpu", "cuda"):
            raise RuntimeError(f"Warp has no {device}")
        if device == "cuda" and not wp.is_cuda_available():
            raise RuntimeError("Warp has no CUDA here")
        if device == "cpu" and threads != 1:
            raise RuntimeError("Warp runs on one thread of a CPU")
        self.device = device
        self.batch = 1 if device == "cpu" else 8
        self.graph = None

    def allocate(self):
        n = self.scene.count
        with wp.ScopedDevice(self.device):
            self.x = wp.zeros(n, dtype=wp.vec3)
            self.v = wp.zeros(n, dtype=wp.vec3)
            self.C = wp.zeros(n, dtype=wp.mat33)
            self.J = wp.zeros(n, dtype=float)
            self.grid = wp.zeros(tuple(c + 1 + 2 * PAD for c in self.scene.cells), dtype=wp.vec4)

    def tune(self, dt, bulk_modulus):
        super().tune(dt, bulk_modulus)
        self.graph = None

    def load(self, state):
        for name, values in state.items():
            getattr(self, name).assign(values)

    def state(self):
        return {name: getattr(self, name).numpy().copy() for name in ("x", "v", "C", "J")}

    def record(self):
        scene, n = self.scene, self.scene.count
        particles = [self.x, self.v, self.C, self.J, self.grid, scene.dx]
        self.grid.zero_()
        wp.launch(p2g, n, [*particles, scene.mass, scene.spacing**3, self.dt, self.bulk_modulus])
        wp.launch(grid_update, self.grid.shape, [self.grid, wp.vec3i(*scene.cells), self.dt])
        wp.launch(g2p, n, [*particles, wp.vec3(*scene.size.tolist()), self.dt])

    def steps(self, count):
        with wp.ScopedDevice(self.device):
            if self.device == "cuda" and self.graph is None:
                # One launch per step in place of four; kernels are compiled first, which a capture does not bear.
                wp.load_module(device=self.device)
                with wp.ScopedCapture() as capture:
                    self.record()
                self.graph = capture.graph
            for _ in range(count):
                if self.graph is None:
                    self.record()
                else:
                    wp.capture_launch(self.graph)
            wp.synchronize_device()

    def grid_mass(self):
        return float(self.grid.numpy()[..., 3].sum(dtype="f8"))
