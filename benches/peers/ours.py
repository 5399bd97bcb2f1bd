"""This engine, by its example `headless`.

States are settled once on the CPU path and kept as snapshots, from which times are taken on all paths.
"""

import json
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Steps of which the example times the stages one by one at the end of a GPU run; it leaves them out of its step times.
MEASURED = 32


@dataclass(frozen=True)
class Processor:
    """What takes the steps."""

    device: str  # "cpu" or "gpu"
    threads: int  # 0: the device's
    adapter: str = ""


def build() -> Path:
    """Builds the example and says where it is."""
    command = ["cargo", "build", "--release", "--example", "headless", "--message-format=json-render-diagnostics"]
    lines = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    found = [json.loads(line).get("executable") for line in lines if '"executable":"' in line]
    return Path(found[-1])


def commit() -> str:
    """The last that changed the engine."""

    def git(*command: str) -> str:
        run = subprocess.run(["git", *command, "--", "src", "shaders"], cwd=ROOT, stdout=subprocess.PIPE, text=True)
        return run.stdout.strip()

    name = git("log", "-1", "--format=%h", "--abbrev=12") or "unknown"
    return name + ("-dirty" if git("status", "--porcelain") else "")


class Engine:
    """Runs scenes; files go into `folder`."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.program = build()

    def run(self, document: dict, on: Processor, *options: str) -> dict:
        """The report of a run."""
        scene = self.folder / "scene.json"
        scene.write_text(json.dumps(document))
        command = [str(self.program), str(scene), "--backend", on.device, "--frames", "0", "--quiet"]
        command += ["--out", str(self.folder), *options]
        if on.adapter:
            command += ["--adapter", on.adapter]
        environment = dict(os.environ)
        if on.threads:
            environment["RAYON_NUM_THREADS"] = str(on.threads)
        run = subprocess.run(command, env=environment, stderr=subprocess.PIPE, text=True)
        if run.returncode != 0:
            raise RuntimeError(run.stderr.strip())
        return json.loads((self.folder / "report.json").read_text())

    def settle(self, name: str, document: dict, threads: int, *options: str) -> dict:
        """Steps on the CPU path and keeps the state under a name."""
        return self.run(document, Processor("cpu", threads), *options, "--save", str(self._snapshot(name)))

    def time(self, name: str, document: dict, on: Processor, steps: int) -> dict:
        """Goes on from a state that was kept.

        `step_ms` of the report leaves out the last `MEASURED` steps on a GPU; a CPU takes as many steps, so that both
        end in the same state.
        """
        total = steps + min(MEASURED, steps)
        restore = ["--restore", str(self._snapshot(name))]
        return self.run(document, on, "--steps", str(total), "--every", "1000000", *restore)

    def _snapshot(self, name: str) -> Path:
        return self.folder / f"{name}.snapshot"


def lost(report: dict) -> int:
    """Particles and sums that are not what they should be."""
    return sum(report["faults"][fault] for fault in ("saturated_nodes", "escaped", "quarantined", "refused"))
