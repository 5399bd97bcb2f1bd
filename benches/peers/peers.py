#!/usr/bin/env python3
"""Times Taichi and NVIDIA Warp MLS-MPM beside this engine.

Per pass: all engines step the same falling cubes in the same box with the same step. Per simulated second at equal
error: a column at rest, which the peers solve with the softest liquid and the longest step that lose no more of its
height than a preset of ours. Compilation and warm-up are not part of any time; engines take turns, and a time is the
median over rounds of medians over steps.
"""

import argparse
import contextlib
import importlib.metadata
import itertools
import math
import os
import platform
import statistics
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import ours
import record
from ours import Engine, Processor, lost
from record import Row
from scenes import COLUMN, COLUMN_HEIGHT, DENSITY, GRAVITY, LARGE, SMALL, Basin
from worker import PeerFailed, Worker

# The column at some value of what makes it stiffer; None where it does not stand.
Attempt = Callable[[float], dict | None]

PRESETS = ["draft", "realtime", "accurate"]
# Engines of a device: ours and the peers', with their threads.
CORES = os.cpu_count() or 1
ALL = sorted({1, CORES})
# Courant numbers of sound that a peer's step is tried with.
LADDER = [k / 10 for k in range(10, 2, -1)]


def say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def label(worker: Worker) -> str:
    package = {"taichi": ("Taichi", "taichi"), "warp": ("Warp", "warp-lang")}[worker.engine]
    return f"{package[0]} {importlib.metadata.version(package[1])}"


def processor_name() -> str:
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.machine()


class Bench:
    """What takes part on one device."""

    def __init__(self, device: str, adapter: str, rounds: int, engine: Engine, settled: dict):
        self.device, self.rounds, self.engine = device, rounds, engine
        # What peers have settled on another device: a software adapter would take hours for it.
        self.settled = settled
        self.commit = ours.commit()
        self.rows: list[Row] = []
        if device == "cpu":
            self.name = processor_name()
            self.processors = [Processor("cpu", threads) for threads in ALL]
            wanted = [("taichi", "cpu", threads) for threads in ALL] + [("warp", "cpu", 1)]
        else:
            self.processors = [Processor("gpu", 0, adapter)]
            wanted = [("taichi", device, 0), ("warp", device, 0)]
            probe = engine.run(SMALL.scene.document(1.0, {"dt": 0.01}), self.processors[0], "--steps", "0")
            self.name = probe["adapter"]
        self.hard = device != "cpu" and "llvmpipe" not in self.name.lower() and "swiftshader" not in self.name.lower()
        self.workers: list[Worker] = []
        for engine_name, on, threads in wanted:
            try:
                self.workers.append(Worker(engine_name, on, threads))
            except RuntimeError as error:
                say(f"{engine_name} on {on}: not measured: {str(error).splitlines()[0]}")

    def close(self) -> None:
        for worker in self.workers:
            worker.close()

    def run(self, case: Callable[..., None], *arguments) -> None:
        """Measures a case, without the peers that fail in it."""
        while True:
            rows = len(self.rows)
            try:
                return case(*arguments)
            except PeerFailed as failure:
                failed = failure.worker
                say(f"{failed.engine} on {failed.device}: not measured from here on: {str(failure).splitlines()[0]}")
                del self.rows[rows:]
                self.workers.remove(failed)
                failed.close()

    def leads(self) -> dict[str, Worker]:
        """Of each peer the one that settles states for all of its kind: the one with most threads."""
        return {worker.engine: worker for worker in self.workers}

    def keep(self, lead: Worker, name: str, look: dict) -> dict:
        """Notes the lead's state for all of its kind, with what is known of it."""
        self.settled[lead.engine, name] = (look, lead.state())
        return look

    def hand_out(self, worker: Worker, name: str) -> None:
        worker.adopt(name, self.settled[worker.engine, name][1])

    def row(self, case: str, engine: str, setting: str, threads: int, particles: int, **numbers) -> Row:
        zero = dict.fromkeys(["passes", "ms_per_pass", "error", "kinetic", "ms_per_simulated_second"], math.nan)
        given = {"ratio_to_ours": math.nan, "wrong": "", "state": "", **zero, **numbers}
        row = Row(case, engine, setting, self.name, threads, particles, commit=self.commit, **given)
        self.rows.append(row)
        return row

    def basin(self, basin: Basin, schemes: list[str], steps: int) -> None:
        """Time per pass of falling cubes, of which all have the same step."""
        scene = basin.scene
        say(f"{scene.name} on {self.name}")
        hertz = 1 / basin.dt
        documents, heights, before = {}, {}, {}
        wrong = dict.fromkeys(schemes, "")
        for scheme in schemes:
            # The tolerance is never met: iterations end at their number, or at rounding.
            iterations = 4 if scheme == "implicit" else 1
            settings = {"dt": basin.dt, "scheme": scheme, "tolerance": 0, "iterations": iterations}
            documents[scheme] = scene.document(basin.bulk_modulus, settings)
            options = ["--steps", str(basin.before), "--every", str(basin.free)]
            report = self.engine.settle(scene.name + scheme, documents[scheme], CORES, *options)
            states = [sample["state"] for sample in report["series"]]
            start, low, end = (state["centre_of_mass_m"][1] for state in states)
            heights[scheme], before[scheme] = end, report["spent"]["iterations"]
            # Gravity acts in the middle of steps.
            fall = 0.5 * (basin.free * basin.dt) ** 2 * GRAVITY
            missing = lost(report) or report["particles"]["alive"] != scene.count
            mass = abs(states[-1]["mass_kg"] / (scene.mass * scene.count) - 1) > 1e-5
            wrong[scheme] = judge(start - low, fall, {"particles lost": missing, "mass": mass})
        for worker in self.workers:
            worker.open(scene)
            worker.start()
            worker.tune(basin.dt, basin.bulk_modulus)
        for engine, lead in self.leads().items():
            if not self.hard and (engine, scene.name) in self.settled:
                continue
            start = lead.look()["height"]
            lead.steps(basin.free)
            low = lead.look()
            lead.steps(basin.before - basin.free)
            look = lead.look()
            # Gravity is added before the move.
            fall = 0.5 * basin.dt**2 * basin.free * (basin.free + 1) * GRAVITY
            self.keep(lead, scene.name, look | {"wrong": judge(start - low["height"], fall, peer_faults(look))})
        for worker in self.workers:
            self.hand_out(worker, scene.name)

        times: dict[object, list[float]] = {}
        states: dict[object, dict] = {}
        for _ in range(self.rounds):
            for on in self.processors:
                for scheme in schemes:
                    report = self.engine.time(scene.name + scheme, documents[scheme], on, steps)
                    states[on, scheme] = report
                    times.setdefault((on, scheme), []).append(report["step_ms"]["median"])
            for worker in self.workers:
                worker.restore(scene.name)
                times.setdefault(worker, []).append(1e3 * statistics.median(worker.times(steps)))

        base = {on.threads: statistics.median(times[on, "explicit"]) for on in self.processors}
        for on in self.processors:
            for scheme in schemes:
                report = states[on, scheme]
                iterations = report["spent"]["iterations"] - before[scheme]
                per_step = 1 + iterations / (report["steps"] - basin.before) if scheme == "implicit" else 1
                ms = statistics.median(times[on, scheme]) / per_step
                self.row(
                    scene.name, f"pbmpm {scheme}", paced(per_step), on.threads, scene.count,
                    passes=hertz * per_step, ms_per_pass=ms, ms_per_simulated_second=ms * per_step * hertz,
                    ratio_to_ours=ms / base[on.threads], error=(heights[scheme] - heights["explicit"]) / scene.dx,
                    wrong=wrong[scheme] or ("particles lost" if lost(report) else ""), state=report["state_hash"],
                )  # fmt: skip
        for worker in self.workers:
            ms, look = statistics.median(times[worker]), self.settled[worker.engine, scene.name][0]
            # Those of one kind end at the same height.
            end = worker.look()
            same = look.setdefault("end", end["height"])
            faults = peer_faults(end) | {"not the same": abs(end["height"] - same) > 0.05 * scene.dx}
            self.row(
                scene.name, label(worker), paced(1), worker.threads, scene.count,
                passes=hertz, ms_per_pass=ms, ms_per_simulated_second=ms * hertz,
                ratio_to_ours=ms / base[worker.threads], error=(look["height"] - heights["explicit"]) / scene.dx,
                wrong=look["wrong"] or listed(faults),
            )  # fmt: skip

    def column(self, steps: int) -> None:
        """Time per simulated second of a column at rest, at the loss of height that our presets have."""
        say(f"column on {self.name}")
        own = {(preset, "implicit"): self.rest(preset, {"quality": preset}) for preset in PRESETS}
        losses = {preset: own[preset, "implicit"]["loss"] for preset in PRESETS}
        own |= self.paced(losses)
        for (preset, scheme), run in own.items():
            say(f"  {preset}, {scheme}: {own_setting(run)}, {run['loss']:.2%} of the height lost")

        for worker in self.workers:
            worker.open(COLUMN)
        for engine, lead in self.leads().items():
            if self.hard or not any((engine, preset) in self.settled for preset in PRESETS):
                self.match(lead, losses)
        matched = {key: look for key, (look, _) in self.settled.items()}
        for worker in self.workers:
            for preset in PRESETS:
                if (worker.engine, preset) in matched:
                    self.hand_out(worker, preset)
        ends = {}
        times: dict[object, list[float]] = {}
        states: dict[object, dict] = {}
        for _ in range(self.rounds):
            for preset in PRESETS:
                for on, (key, run) in itertools.product(self.processors, own.items()):
                    if key[0] == preset:
                        states[on, key] = report = self.engine.time(run["name"], run["document"], on, steps)
                        times.setdefault((on, key), []).append(report["step_ms"]["median"])
                for worker in self.workers:
                    if (point := matched.get((worker.engine, preset))) is not None:
                        worker.tune(point["dt"], point["bulk_modulus"])
                        worker.restore(preset)
                        times.setdefault((worker, preset), []).append(1e3 * statistics.median(worker.times(4 * steps)))
                        ends[worker, preset] = worker.look()

        for preset in PRESETS:
            base = {}
            for on, (key, run) in itertools.product(self.processors, own.items()):
                if key[0] != preset:
                    continue
                report, start = states[on, key], run["report"]
                taken, seconds = report["steps"] - start["steps"], report["sim_seconds"] - start["sim_seconds"]
                passes = (taken + report["spent"]["iterations"] - start["spent"]["iterations"]) / seconds
                ms = statistics.median(times[on, key]) * taken / seconds
                # The faster of ours.
                base[on.threads] = min(ms, base.get(on.threads, math.inf))
                self.row(
                    f"column-{preset}", f"pbmpm {key[1]}", own_setting(run), on.threads, COLUMN.count,
                    passes=passes, ms_per_pass=ms / passes, ratio_to_ours=1.0, error=run["loss"],
                    kinetic=run["kinetic"], ms_per_simulated_second=ms, wrong=run["wrong"],
                    state=report["state_hash"],
                )  # fmt: skip
            for worker in self.workers:
                point = matched.get((worker.engine, preset))
                if point is None:
                    self.row(f"column-{preset}", label(worker), "", worker.threads, COLUMN.count, wrong="not reached")
                    continue
                step_ms = statistics.median(times[worker, preset])
                ms, end = step_ms / point["dt"], ends[worker, preset]
                # Waves go on.
                sunk = abs(1 - 2 * end["height"] / COLUMN_HEIGHT - point["loss"]) > 0.005 + point["loss"]
                self.row(
                    f"column-{preset}", label(worker), setting(point), worker.threads, COLUMN.count,
                    passes=1 / point["dt"], ms_per_pass=step_ms, ratio_to_ours=ms / base[worker.threads],
                    error=point["loss"], kinetic=point["kinetic"], ms_per_simulated_second=ms,
                    wrong=listed(peer_faults(end) | {"height": sunk}),
                )  # fmt: skip

    def rest(self, name: str, settings: dict) -> dict:
        """Our column after two seconds: means over the second of them, of 20 looks."""
        document, name = COLUMN.document(2.2e9, settings), "column" + name
        hertz = 1 / self.engine.run(document, Processor("cpu", 1), "--steps", "0")["settings"]["dt_s"]
        options = ["--seconds", "2", "--every", str(max(1, round(hertz / 20)))]
        report = self.engine.settle(name, document, CORES, *options)
        late = [s["state"] for s in report["series"] if s["time_s"] > 1 + 0.5 / hertz]
        return {
            "name": name, "document": document, "report": report, "hertz": hertz,
            "loss": 1 - 2 * mean(s["centre_of_mass_m"][1] for s in late) / COLUMN_HEIGHT,
            "kinetic": mean(s["kinetic_j"] / (s["mass_kg"] * GRAVITY * COLUMN_HEIGHT) for s in late),
            "wrong": "particles lost" if lost(report) or report["particles"]["alive"] != COLUMN.count else "",
        }  # fmt: skip

    def paced(self, losses: dict[str, float]) -> dict:
        """Our explicit scheme with the longest steps for each loss; they are what softens its liquids."""

        def run(hertz: float) -> dict:
            return self.rest(f"explicit{hertz:g}", {"scheme": "explicit", "dt": 1 / hertz})

        points = sweep(run, 240, 1.5, losses)
        return {(preset, "explicit"): found for preset, found in reached(run, points, "hertz", 1.03, losses)}

    def match(self, lead: Worker, losses: dict[str, float]) -> None:
        """A peer's softest liquid for each loss, and its longest step."""
        say(f"  {label(lead)}: bulk modulus, step, loss of height")

        def stand(bulk_modulus: float) -> dict | None:
            return self.stand(lead, bulk_modulus)

        # Of the first its own weight takes 12 % of the height.
        points = sweep(stand, DENSITY * GRAVITY * COLUMN_HEIGHT / 0.24, 2.5, losses)
        for point in points:
            say(f"    {setting(point)}: {point['loss']:.2%}")
            self.row(
                "column-sweep", label(lead), setting(point), lead.threads, COLUMN.count,
                passes=1 / point["dt"], error=point["loss"], kinetic=point["kinetic"],
            )  # fmt: skip
        for preset, point in reached(stand, points, "bulk_modulus", 1.05, losses):
            # The lead is in that state now.
            self.keep(lead, preset, point)
            say(f"    {preset}: {setting(point)}: {point['loss']:.2%}")

    def stand(self, lead: Worker, bulk_modulus: float) -> dict | None:
        """The column at the largest Courant number with which it stands."""
        for number in LADDER:
            dt = number * COLUMN.dx / math.sqrt(bulk_modulus / DENSITY)
            look = lead.settle(dt, bulk_modulus)
            if look["stands"]:
                return {"courant": number, "dt": dt, "bulk_modulus": bulk_modulus, **look}
        return None


def mean(values) -> float:
    return statistics.fmean(values)


def paced(per_step: float) -> str:
    return "1 pass per step" if per_step == 1 else f"{per_step:.3g} passes per step"


def setting(point: dict) -> str:
    return f"{point['bulk_modulus'] / 1e3:.0f} kPa, {1 / point['dt']:.0f} Hz, Courant {point['courant']:.1f}"


def own_setting(run: dict) -> str:
    settings = run["report"]["settings"]
    # The explicit scheme has none.
    iterations = "" if "scheme" in run["document"]["settings"] else f", {settings['iterations']} iterations"
    return f"{1 / settings['dt_s']:.0f} Hz{iterations}"


def sweep(attempt: Attempt, value: float, factor: float, losses: dict[str, float]) -> list[dict]:
    """What is found at values that grow by a factor, until as little is lost as is asked for."""
    points = []
    while len(points) < 8 and not (points and points[-1]["loss"] < min(losses.values())):
        point = attempt(value)
        if point is None:
            break
        points.append(point)
        value *= factor
    return points


def reached(
    attempt: Attempt, points: list[dict], key: str, factor: float, losses: dict[str, float]
) -> Iterator[tuple[str, dict]]:
    """For each loss what is found at the least value that loses no more: guessed from a sweep, then tried. Told at once."""
    for preset, loss in losses.items():
        guess = where(points, key, loss)
        for _ in range(8):
            point = None if guess is None else attempt(guess)
            if point is None:
                break
            if point["loss"] <= loss:
                yield preset, point
                break
            guess *= factor


def where(points: list[dict], key: str, loss: float) -> float | None:
    """Where the line through the logarithms of a sweep meets a loss; where it begins or does not reach, its end."""
    if not points or points[-1]["loss"] > loss:
        return None
    for softer, stiffer in itertools.pairwise(points):
        if softer["loss"] > loss >= stiffer["loss"] > 0:
            share = math.log(softer["loss"] / loss) / math.log(softer["loss"] / stiffer["loss"])
            return softer[key] * (stiffer[key] / softer[key]) ** share
    return points[0][key] if points[0]["loss"] <= loss else points[-1][key]


def judge(fall: float, expected: float, faults: dict[str, object]) -> str:
    """What is wrong, if anything."""
    return listed({"free fall": abs(fall / expected - 1) > 1e-3, **faults})


def listed(faults: dict[str, object]) -> str:
    return ", ".join(fault for fault, is_so in faults.items() if is_so)


def peer_faults(look: dict) -> dict[str, object]:
    return {
        "not finite": not look["sound"],
        "particles outside": look["outside"],
        "mass": not look["mass_error"] < 1e-4,
    }


def slug(name: str) -> str:
    words = name.lower().split("(")[0].replace("/", " ").split()
    return "-".join(words[:2])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    devices = "what runs the engines, for cuda ours on Vulkan; may be repeated [default: all there are]"
    parser.add_argument("--device", action="append", choices=["cpu", "vulkan", "cuda"], help=devices)
    parser.add_argument("--adapter", default="", help="part of the name of the graphics adapter of ours")
    parser.add_argument("--case", action="append", choices=["basin", "basin-large", "column"], help="[default: all]")
    parser.add_argument("--rounds", type=int, default=5, help="[default: 5]")
    parser.add_argument("--out", type=Path, default=ours.ROOT / "benches/record", help="folder of the CSV files")
    parser.add_argument("--table", type=Path, nargs="+", help="print the tables of such files, and run nothing")
    arguments = parser.parse_args()
    if arguments.table:
        print("\n".join(record.tables(record.read(path)) for path in arguments.table))
        return 0
    cases = arguments.case or ["basin", "basin-large", "column"]
    wrong = False
    with tempfile.TemporaryDirectory() as folder:
        engine, settled = Engine(Path(folder)), {}
        for device in arguments.device or ["cpu", "vulkan", "cuda"]:
            try:
                bench = Bench(device, arguments.adapter, arguments.rounds, engine, settled)
            except RuntimeError as error:
                say(f"{device}: not measured: {error}")
                continue
            with contextlib.closing(bench):
                if not bench.workers:
                    continue
                # Hardware is through with a few steps before it has reached its clock.
                steps = 512 if bench.hard else 16
                name = "cpu" if device == "cpu" else f"{device}-{slug(bench.name)}"
                for case in cases:
                    if case == "basin":
                        bench.run(bench.basin, SMALL, ["explicit", "published", "implicit"], steps)
                    elif case == "basin-large":
                        bench.run(bench.basin, LARGE, ["explicit"], steps if bench.hard else 8)
                    else:
                        bench.run(bench.column, steps)
                    # After each case, so that an interrupted run leaves what it has found.
                    record.write(arguments.out / f"peers-{name}.csv", bench.rows)
                print(record.tables(bench.rows), flush=True)
                wrong |= any(row.wrong not in ("", "not reached") for row in bench.rows)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
