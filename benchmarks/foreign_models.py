"""Models of others: `python -m benchmarks.foreign_models FOLDER`.

Each model of `foreign_models.txt` that FOLDER has (in OWNER/NAME/PATH), or if it has none each
model below FOLDER, is converted into a figure, checked, simulated for 0.3 s, written in its own
format again and loaded by its own program (MuJoCo, Pinocchio, OpenSim), with the mass and the
freedoms of the figure. Each has a process of its own and a time limit. Tables say how many pass, by
format, and why the others do not. It needs the extra `verify`. Of one MODEL it prints the stages.
"""

import re
import resource
import signal
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stderr, redirect_stdout, suppress
from io import StringIO
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

from benchmarks.tables import show
from generator.child_processes import cores
from generator.figure_file.read import read_figure

LIST = Path(__file__).with_suffix(".txt")
STOP = 0.3
TIME_LIMIT = 120
"""Longest CPU time of a model [s]."""

WALL_LIMIT = 1200.0
"""Longest time of a model on a busy machine [s]."""

PROCESSES = get_context("forkserver")

STAGES = ("convert", "check", "simulate", "write", "load")
FORMATS: Mapping[str, str] = {"mujoco": "MJCF", "robot": "URDF", "OpenSimDocument": "OpenSim"}
SUFFIXES: Mapping[str, str] = {"MJCF": ".xml", "URDF": ".urdf", "OpenSim": ".osim"}


def main() -> None:
    """Measure the models of a folder, or one of them in this process."""
    match sys.argv[1:]:
        case [file] if Path(file).is_file() and (kind := format_of(Path(file))):
            for row in stages(Path(file), kind):
                print(*row, flush=True)
        case [folder] if Path(folder).is_dir():
            report(Path(folder))
        case _:
            sys.exit("usage: python -m benchmarks.foreign_models FOLDER|MODEL")


def report(folder: Path) -> None:
    """Measure all models of a folder and print the tables."""
    models = list(listed(folder)) or sorted(found(folder))
    PROCESSES.set_forkserver_preload(["generator.cli.app", "generator.simulation.run", "trimesh"])
    with ThreadPoolExecutor(max(2, cores())) as pool:
        results = list(pool.map(measure, (model for model, _ in models), (k for _, k in models)))
    rows: list[Mapping[str, object]] = []
    for kind in [*SUFFIXES, "all"]:
        own = [r for r, (_, k) in zip(results, models, strict=True) if kind in (k, "all")]
        row: dict[str, object] = {"format": kind, "models": len(own)}
        for stage in STAGES:
            row[stage] = sum(stage in times for times, _ in own)
        passed = sum(not reason for _, reason in own)
        rows.append({**row, "passed": f"{100.0 * passed / max(len(own), 1):.0f} %"})
    show(rows)
    print()
    for stage in STAGES:
        spent = sorted(times[stage] for times, _ in results if stage in times)
        if spent:
            print(f"{stage}: median {median(spent):.1f} s, longest {spent[-1]:.1f} s")
    print()
    kinds = Counter((k, reason) for (_, k), (_, reason) in zip(models, results, strict=True))
    ranked = sorted(kinds.items(), key=lambda each: (-each[1], each[0]))
    show(
        {"format": kind, "reason": reason, "models": count}
        for (kind, reason), count in ranked
        if reason
    )
    print()
    for (model, _), (_, reason) in zip(models, results, strict=True):
        if reason:
            print(f"{model.relative_to(folder)}: {reason}")


def listed(folder: Path) -> Iterator[tuple[Path, str]]:
    """Yield the models of the list that the folder has, each with its format."""
    repository = ""
    for line in LIST.read_text(encoding="utf-8").splitlines():
        if heading := re.fullmatch(r"([\w.-]+/[\w.-]+) [0-9a-f]{10}", line):
            repository = heading[1]
        elif line and not line.startswith("#") and (folder / repository / line).is_file():
            path = folder / repository / line
            yield path, format_of(path) or "URDF"  # a macro of one has no root element to tell


def found(folder: Path) -> Iterator[tuple[Path, str]]:
    """Yield the models below a folder, each with its format."""
    for path in folder.rglob("*"):
        if path.suffix.lower() in (".xml", ".mjcf", ".urdf", ".osim") and (kind := format_of(path)):
            yield path, kind


def format_of(path: Path) -> str | None:
    """Return the format of a model by its root element; None for another file."""
    head = re.search(r"<([A-Za-z]\w*)", path.read_text(encoding="utf-8", errors="replace"))
    return None if head is None else FORMATS.get(head[1])


def measure(model: Path, kind: str) -> tuple[dict[str, float], str]:
    """Return the CPU time of each stage that a model passed [s], and why it failed, or ""."""
    receiver, sender = PROCESSES.Pipe(duplex=False)
    process = PROCESSES.Process(target=send_stages, args=(sender, model, kind))
    process.start()
    sender.close()
    times: dict[str, float] = {}
    failed = ""
    start = perf_counter()
    with suppress(EOFError):
        while receiver.poll(max(0.0, start + WALL_LIMIT - perf_counter())):
            stage, times[stage], reason = receiver.recv()
            failed = f"{stage}: {reason}" if reason else ""
            if failed:
                del times[stage]
    process.kill()
    process.join()
    if not failed and len(times) < len(STAGES):
        late = process.exitcode in (-signal.SIGKILL, -signal.SIGXCPU)
        ending = f"more than {TIME_LIMIT} s" if late else f"it ended with {process.exitcode}"
        failed = f"{STAGES[len(times)]}: {ending}"
    print(f"{'passed' if not failed else 'failed'} {model}", file=sys.stderr, flush=True)
    return times, failed


def send_stages(sender: Connection, model: Path, kind: str) -> None:
    """Send the stages of a model, in a process of its own that may take `TIME_LIMIT`."""
    resource.setrlimit(resource.RLIMIT_CPU, (TIME_LIMIT, TIME_LIMIT + 5))
    for row in stages(model, kind):
        sender.send(row)


def stages(model: Path, kind: str) -> Iterator[tuple[str, float, str]]:
    """Yield each stage of a model with its CPU time [s] and, of one that fails, the reason."""
    with TemporaryDirectory() as name:
        figure, written = Path(name) / "figure.fig", Path(name) / f"written{SUFFIXES[kind]}"
        commands: Mapping[str, Callable[[], str]] = {
            "convert": lambda: mover("convert", str(model), str(figure)),
            "check": lambda: mover("check", str(figure)),
            "simulate": lambda: mover("simulate", str(figure), "--stop", str(STOP)),
            "write": lambda: mover("convert", str(figure), str(written)),
            "load": lambda: loading_fault(figure, written, kind),
        }
        for stage, run in commands.items():
            start = process_time()
            reason = run()
            if reason and stage == "convert" and not is_loaded(model, kind):
                reason = f"its own program refuses it as well ({reason})"
            yield stage, process_time() - start, reason
            if reason:
                return


def mover(*arguments: str) -> str:
    """Run a command of this program; return its first error without names, "" if it succeeds."""
    from generator.cli.app import main as run

    said, before = StringIO(), sys.argv
    try:
        sys.argv = ["mover", *arguments]
        with redirect_stdout(StringIO()), redirect_stderr(said):
            run()
    except SystemExit as ending:
        if not ending.code:
            return ""
    except Exception as failure:
        return f"{type(failure).__name__}: {failure}"
    finally:
        sys.argv = before
    lines = [line for line in said.getvalue().splitlines() if "error: " in line]
    message = (lines or said.getvalue().strip().splitlines() or ["no message"])[0]
    message = message.rpartition("error: ")[2]
    return re.sub(r"`[^`]*`", "`...`", re.sub(r"\[[-\d.e+ ]+\]", "[...]", message))


def loading_fault(figure: Path, written: Path, kind: str) -> str:
    """Return what is wrong with the model as its own program loads it; "" for nothing."""
    of = read_figure(figure)
    try:
        mass, freedoms = LOADERS[kind](written)
    except Exception as failure:
        return f"{type(failure).__name__}: {' '.join(str(failure).split())[:100]}"
    if abs(mass - of.total_mass) > 1e-6 * of.total_mass:
        return f"a mass of {mass:.6g} kg instead of {of.total_mass:.6g} kg"
    expected = sum(len(joint.chain) for joint in of.joints.values())
    return "" if freedoms == expected else f"{freedoms} freedoms instead of {expected}"


def is_loaded(model: Path, kind: str) -> bool:
    """Return whether the model's own program loads it."""
    try:
        LOADERS[kind](model)
    except Exception:
        return False
    return True


def load_in_mujoco(path: Path) -> tuple[float, int]:
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    return float(model.body_subtreemass[0]), int(model.nv)


def load_in_pinocchio(path: Path) -> tuple[float, int]:
    import pinocchio

    model = pinocchio.buildModelFromUrdf(str(path))
    return float(sum(inertia.mass for inertia in model.inertias)), int(model.nv)


def load_in_opensim(path: Path) -> tuple[float, int]:
    import opensim

    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(path))
    state = model.initSystem()
    return float(model.getTotalMass(state)), int(model.getNumCoordinates())


LOADERS: Mapping[str, Callable[[Path], tuple[float, int]]] = {
    "MJCF": load_in_mujoco,
    "URDF": load_in_pinocchio,
    "OpenSim": load_in_opensim,
}
"""Loaders of models in their own programs: total mass [kg] and number of freedoms."""


if __name__ == "__main__":
    main()
