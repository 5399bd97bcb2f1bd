"""MLS-MPM in Taichi."""

import taichi as ti

from peer import PAD, Peer
from scenes import GRAVITY, TENSION_LIMIT

Vec4 = ti.types.vector(4, ti.f32)


@ti.data_oriented
class Fields:
    def __init__(self, scene):
        self.count = scene.count
        self.dx = scene.dx
        self.mass = scene.mass
        self.volume = scene.spacing**3
        self.cells = scene.cells
        self.x = ti.Vector.field(3, ti.f32, scene.count)
        self.v = ti.Vector.field(3, ti.f32, scene.count)
        self.C = ti.Matrix.field(3, 3, ti.f32, scene.count)
        self.J = ti.field(ti.f32, scene.count)
        # Momentum and mass.
        self.grid = ti.Vector.field(4, ti.f32, tuple(n + 1 + 2 * PAD for n in scene.cells))

    @ti.func
    def weights(self, r):
        return [0.5 * (1.5 - r) ** 2, 0.75 - (r - 1.0) ** 2, 0.5 * (r - 0.5) ** 2]

    @ti.kernel
    def step(self, dt: ti.f32, bulk_modulus: ti.f32):
        inverse = ti.static(1.0 / self.dx)
        for node in ti.grouped(self.grid):
            self.grid[node] = Vec4(0.0)

        for p in self.x:
            at = self.x[p] * inverse + PAD
            base = ti.cast(at - 0.5, ti.i32)
            r = at - base
            w = self.weights(r)
            pressure = 0.0
            if self.J[p] <= TENSION_LIMIT:
                pressure = bulk_modulus * (1.0 - self.J[p])
            push = 4.0 * inverse * inverse * dt * self.volume * pressure
            affine = self.mass * self.C[p] + push * ti.Matrix.identity(ti.f32, 3)
            momentum = self.mass * self.v[p]
            for i, j, k in ti.static(ti.ndrange(3, 3, 3)):
                offset = ti.Vector([i, j, k])
                weight = w[i][0] * w[j][1] * w[k][2]
                given = momentum + affine @ ((offset - r) * self.dx)
                self.grid[base + offset] += weight * Vec4(given[0], given[1], given[2], self.mass)

        for node in ti.grouped(self.grid):
            sums = self.grid[node]
            if sums[3] > 0.0:
                v = ti.Vector([sums[0], sums[1], sums[2]]) / sums[3]
                v[1] -= GRAVITY * dt
                for axis in ti.static(range(3)):
                    if node[axis] <= PAD:
                        v[axis] = ti.max(v[axis], 0.0)
                    if node[axis] >= PAD + self.cells[axis]:
                        v[axis] = ti.min(v[axis], 0.0)
                self.grid[node] = Vec4(v[0], v[1], v[2], sums[3])

        for p in self.x:
            at = self.x[p] * inverse + PAD
            base = ti.cast(at - 0.5, ti.i32)
            r = at - base
            w = self.weights(r)
            v = ti.Vector.zero(ti.f32, 3)
            C = ti.Matrix.zero(ti.f32, 3, 3)
            for i, j, k in ti.static(ti.ndrange(3, 3, 3)):
                offset = ti.Vector([i, j, k])
                weight = w[i][0] * w[j][1] * w[k][2]
                node = self.grid[base + offset]
                u = weight * ti.Vector([node[0], node[1], node[2]])
                v += u
                C += 4.0 * inverse * u.outer_product(offset - r)
            self.v[p] = v
            self.C[p] = C
            self.J[p] *= 1.0 + dt * C.trace()
            x = self.x[p] + dt * v
            for axis in ti.static(range(3)):
                x[axis] = ti.min(ti.max(x[axis], 0.0), self.cells[axis] * self.dx)
            self.x[p] = x


class TaichiPeer(Peer):
    def __init__(self, device: str, threads: int):
        super().__init__()
        arch = {"cpu": ti.cpu, "vulkan": ti.vulkan, "cuda": ti.cuda}[device]
        options = {"cpu_max_num_threads": threads} if device == "cpu" else {}
        ti.init(arch=arch, default_fp=ti.f32, **options)
        got = ti.lang.impl.current_cfg().arch
        # Taichi goes on with another device where it does not find the one asked for.
        if device != "cpu" and got != arch:
            raise RuntimeError(f"Taichi has no {device} here")
        self.batch = 1 if device == "cpu" else 8

    def allocate(self):
        self.fields = Fields(self.scene)

    def load(self, state):
        for name, values in state.items():
            getattr(self.fields, name).from_numpy(values)

    def state(self):
        return {name: getattr(self.fields, name).to_numpy() for name in ("x", "v", "C", "J")}

    def steps(self, count):
        for _ in range(count):
            self.fields.step(self.dt, self.bulk_modulus)
        ti.sync()

    def grid_mass(self):
        return float(self.fields.grid.to_numpy()[..., 3].sum(dtype="f8"))
