"""Rows of what was measured: a CSV file, and tables for people."""

import csv
import math
from dataclasses import asdict, dataclass, fields
from pathlib import Path


@dataclass
class Row:
    case: str
    engine: str
    setting: str
    device: str
    # 0: the device's.
    threads: int
    particles: int
    # Per simulated second.
    passes: float
    ms_per_pass: float
    # Of a peer's time to ours on the same device and threads: per pass in the basins, per simulated second in columns.
    ratio_to_ours: float
    # Columns: share of the height that is lost. Basins: height of the centre less that of ours (explicit), in cells.
    error: float
    # Columns: mean kinetic energy over m g H in the second from which the error is, which would be 0.
    kinetic: float
    ms_per_simulated_second: float
    # Empty, or what is wrong.
    wrong: str
    state: str
    commit: str


def write(path: Path, rows: list[Row]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Row)], lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({k: f"{v:.4g}" if isinstance(v, float) else v for k, v in asdict(row).items()})


def read(path: Path) -> list[Row]:
    kinds = {field.name: field.type for field in fields(Row)}
    with path.open(newline="") as file:
        return [Row(**{name: kinds[name](value) for name, value in row.items()}) for row in csv.DictReader(file)]


def known(value: float, form: str) -> str:
    return "" if math.isnan(value) else format(value, form)


def tables(rows: list[Row]) -> str:
    """A table per case."""
    parts = []
    for case in dict.fromkeys(row.case for row in rows):
        column = case.startswith("column")
        head = ["engine", "setting", "threads", "ms per pass", "ratio to ours", "error"]
        head += ["kinetic", "passes per s", "ms per s"] if column else []
        lines = [head, ["---"] * len(head)]
        of_case = [row for row in rows if row.case == case]
        for row in of_case:
            own = row.engine.startswith("pbmpm")
            line = [row.engine, row.setting, str(row.threads or ""), known(row.ms_per_pass, ".3g")]
            line += ["" if own else known(row.ratio_to_ours, ".2f"), known(row.error, ".4f" if column else "+.2f")]
            if column:
                line += [known(row.kinetic, ".1e"), known(row.passes, ".0f"), known(row.ms_per_simulated_second, ".0f")]
            line[1] += f" **wrong: {row.wrong}**" if row.wrong else ""
            lines.append(line)
        text = "\n".join("| " + " | ".join(line) + " |" for line in lines)
        parts.append(f"`{case}`, {of_case[0].particles:,} particles, {of_case[0].device}:\n\n{text}\n")
    return "\n".join(parts)
