"""Output of the numbers: printed, and as CSV files that the plates of `plots` draw."""

import csv
import os
import platform
from collections.abc import Iterable, Mapping, Sequence
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "plots" / "data"

_PACKAGES = ("exudyn-mover", "exudyn", "mujoco", "opensim", "pin", "drake", "numpy", "scipy")

Row = Mapping[str, object]


def made_with() -> dict[str, str]:
    """The day, the machine and the versions of what was measured with."""
    versions: dict[str, str] = {}
    for name in _PACKAGES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    machine = f"{_processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}"
    measured = {"measured": date.today().isoformat(), "machine": machine}
    return {**measured, "Python": platform.python_version(), **versions}


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor()


def write(name: str, command: str, rows: Sequence[Row]) -> None:
    """Write `plots/data/NAME.csv`: comments that say where it is from, then the rows."""
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / f"{name}.csv"
    with path.open("w", encoding="utf-8", newline="") as stream:
        for key, value in {"command": command, **made_with()}.items():
            stream.write(f"# {key}: {value}\n")
        table = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows({key: _cell(value) for key, value in row.items()} for row in rows)
    print(f"wrote {path}")


def show(rows: Iterable[Row]) -> None:
    """Print rows as a table in Markdown."""
    head: list[str] = []
    for row in rows:
        if not head:
            head = list(row)
            print("|", " | ".join(head), "|")
            print("|" + "---|" * len(head))
        print("|", " | ".join(_cell(value) for value in row.values()), "|", flush=True)


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
