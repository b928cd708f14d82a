"""Damaged inputs for every reader: no traceback, no warning of numpy, little memory and time.

    python -m benchmarks.damaged_inputs [COUNT]

Files of every format, whole ones and the broken ones of `tests/faults`, are cut, lose, repeat or
exchange parts, get other bytes or inserted tokens, and go to what reads them. An answer is a result
or an error of this program (`MoverError`); anything else is a fault. The table is printed for COUNT
inputs [default: 10000], a process for each reader, so that the largest memory is the reader's.
"""

import json
import random
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np

from benchmarks.child import peak
from generator import Figure, Plan, read_figure, simulate
from generator.cli.answer import CommandResult, ExitCode
from generator.cli.check import check
from generator.cli.com import com
from generator.cli.mass import mass
from generator.diagnostics import MoverError
from generator.figure_file.write import write_figure
from generator.input_files.drives import DRIVES_FILE
from generator.input_files.links import LINK_ENTRIES
from generator.input_files.loads import LOADS_FILE
from generator.input_files.pose import POSE_FILE
from generator.model_files.formats import MODEL_FORMATS, read_model
from generator.motion_files import (
    COORDINATES_FILE,
    motion_from_action,
    motion_from_coordinates,
    read_action,
    read_npz,
)
from generator.springs_file.read import load_springs
from plots.fit import fit

MAX_MEMORY = 1_000_000_000
"""Largest memory of a reader [bytes]."""

_TESTS = Path(__file__).parents[1] / "tests"
_FAULTS, _MODELS = _TESTS / "faults", _TESTS / "generator" / "model_files" / "models"

LINKS = """figure = "prototype"
[[link]]
joints = ["right_elbow", "right_knee"]
control = "left_elbow"
[[link]]
joints = ["left_hip_joint"]
control = "waist"
dof = 3
control_dof = 2
factor = -0.5
offset_deg = 90
"""

LOADS = """site,kind,time [s],x [N or N m],y [N or N m],z [N or N m]
left_upper_leg.distal,localforce,0,0,10,0
left_upper_leg.distal,localforce,0.5,0,20,0
left_upper_leg.distal,localmoment,0,1,2,3
"""

DRIVES = """time [s],left_elbow [deg],left_knee [deg]
0,0,10
0.1,5,20
0.2,7,25
"""

MOMENTS = """angle [deg],moment [N m]
-40,4.1
-20,1.2
0,0.1
20,-1.3
40,-4.4
60,-11
"""

POSE = """joint left_elbow {
    displacement = 30deg;
}
joint left_hip_joint {
    displacement = (10deg, 20deg, 30deg);
}
"""

GLTF_SUFFIX, MESH_SUFFIXES = ".gltf", (".stl", ".ply", ".obj", ".glb")


@cache
def prototype() -> Figure:
    """The figure of the files."""
    return read_figure("prototype")


def _read_model(path: Path) -> None:
    imported = read_model(path if path.suffix else path.parent)
    try:
        write_figure(imported.figure)
    except ValueError as failure:
        raise MoverError(str(failure)) from None


def _read_figure(path: Path) -> CommandResult:
    com(str(path))
    return check(str(path))


def _read_action(path: Path) -> None:
    motion_from_action(read_action(path), prototype())


def _read_coordinates(path: Path) -> None:
    motion_from_coordinates(COORDINATES_FILE.parse_file(path).require_value(), prototype())


READERS: Mapping[str, Callable[[Path], object]] = {
    "figure": _read_figure,
    "pose": lambda path: POSE_FILE.parse_file(path, prototype()).require_value(),
    "psurf": lambda path: mass(str(path), "1000 kg/m3"),
    "mesh": lambda path: mass(str(path), "1000 kg/m3", None if path.suffix[1] == "g" else "mm"),
    "loads": lambda path: LOADS_FILE.parse_file(path, prototype()).require_value(),
    "drives": lambda path: DRIVES_FILE.parse_file(path, prototype()).require_value(),
    "moments": lambda path: fit(path),
    "springs": lambda path: check(str(path)),
    "optional": lambda path: load_springs(prototype(), choice=path).require_value(),
    "links": lambda path: LINK_ENTRIES.parse_file(path).require_value(),
    "action": _read_action,
    "coordinates": _read_coordinates,
    "npz": read_npz,
    "model": _read_model,
    "dyspam": _read_model,
}
"""Reader of each kind of file; raising a MoverError is a right answer."""


def make_seeds(folder: Path) -> dict[str, list[Path]]:
    """Write whole files of every kind; return them, and the broken ones of `tests/faults`."""
    texts = {"links": ("a.toml", LINKS), "loads": ("a.csv", LOADS), "pose": ("a.pose", POSE)}
    texts |= {"drives": ("a.csv", DRIVES), "moments": ("a.csv", MOMENTS)}
    seeds: dict[str, list[Path]] = {kind: [] for kind in READERS}
    for kind, (name, text) in texts.items():
        (folder / kind).mkdir()
        seeds[kind].append(folder / kind / name)
        seeds[kind][-1].write_text(text, encoding="utf-8")
    shipped = Path(str(files("figures")))
    for kind, pattern in (("figure", "*.fig"), ("psurf", "*.pss"), ("springs", "*.springs.toml")):
        seeds[kind] += sorted(shipped.glob(pattern))
    seeds["optional"].append(shipped / "prototype.optional")
    springs = load_springs(prototype(), shipped, "prototype").value
    assert springs is not None
    for name, suffix in (("mjcf", ".xml"), ("urdf", ".urdf"), ("osim", ".osim")):
        seeds["model"].append(folder / f"model{suffix}")
        MODEL_FORMATS[name].format_files(prototype(), springs, seeds["model"][-1]).write()
    seeds["model"] += sorted(path for path in _MODELS.iterdir() if path.stem != "defaults")
    MODEL_FORMATS["dyspam"].format_files(prototype(), springs, folder / "dyspam").write()
    seeds["dyspam"] += sorted((folder / "dyspam").iterdir())
    recording = simulate(prototype(), Plan(stop=0.04, step=0.002))
    for suffix, kind in (
        (".npz", "npz"),
        (".action", "action"),
        (".mot", "coordinates"),
        (".sto", "coordinates"),
    ):
        seeds[kind].append(folder / f"run{suffix}")
        recording.write(seeds[kind][-1])
    import trimesh

    for suffix in (*MESH_SUFFIXES, GLTF_SUFFIX):
        path = folder / f"box{suffix}"
        if suffix == GLTF_SUFFIX:
            exported = trimesh.creation.box((1, 2, 3)).export(file_type="gltf", embed_buffers=True)
            path.write_bytes(exported["model.gltf"])
        else:
            trimesh.creation.box((1, 2, 3)).export(path)
        seeds["mesh"].append(path)
    for kind, paths in seeds.items():
        broken = (path for path in sorted(_FAULTS.glob(f"{kind}/*")) if path.suffix != ".expected")
        paths += [path for path in broken if path.suffix or kind != "model"]
    return seeds


TOKENS = (
    b"0", b"-1", b"1e308", b"-1e308", b"1e-320", b"1e155", b"nan", b"inf", b"99999999999999999999",
    b"2000000000", b"4294967295", b"{", b"}", b"(", b")", b"[", b"]", b"<", b">", b"/", b"\"", b"'",
    b",", b";", b"=", b"\n", b"\r", b"\t", b" ", b"\x00", b"\xff", b"\xef\xbb\xbf", b"\xe2\x84\xa2",
    b"#", b"//", b"/*", b"deg", b"kg", b"N m", b"joint", b"connect", b"<body>", b"<!--", b"&amp;",
)  # fmt: skip
"""Texts that are inserted."""


def damage(data: bytes, chance: random.Random) -> bytes:
    """Return the data with one to four damages."""
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        start = chance.randrange(len(data) + 1)
        end = min(len(data), start + chance.choice((1, 2, 4, 8, 64, 1000)))
        match chance.randrange(7):
            case 0:
                data = data[:start]
            case 1:
                data = data[:start] + data[end:]
            case 2:
                data = data[:start] + data[start:end] * chance.choice((2, 3, 50)) + data[end:]
            case 3:
                other = chance.randrange(len(data) + 1)
                data = data[:other] + data[start:end] + data[other:]
            case 4:
                flipped = bytes(byte ^ (1 << chance.randrange(8)) for byte in data[start:end][:4])
                data = data[:start] + flipped + data[start + len(flipped) :]
            case 5:
                data = data[:start] + chance.choice(TOKENS) + data[start:]
            case _:
                data = _exchange_number(data, start, chance)
    return data


def damage_member(data: bytes, chance: random.Random) -> bytes:
    """Return a zip archive with one damaged member: its checksum does not show the damage."""
    made = BytesIO()
    with ZipFile(BytesIO(data)) as before, ZipFile(made, "w", ZIP_DEFLATED) as after:
        damaged = chance.choice(before.namelist())
        for name in before.namelist():
            content = before.read(name)
            after.writestr(name, damage(content, chance) if name == damaged else content)
    return made.getvalue()


def _exchange_number(data: bytes, start: int, chance: random.Random) -> bytes:
    """Replace the first number after a place; in binary files, the four bytes there."""
    first = next((k for k in range(start, len(data)) if data[k : k + 1].isdigit()), None)
    if first is None or first - start > 200:
        return data[:start] + chance.randbytes(4) + data[start + 4 :]
    last = first
    while data[last : last + 1] in b"0123456789.eE" and last < len(data):
        last += 1
    return data[:first] + chance.choice(TOKENS[:11]) + data[last:]


@dataclass(frozen=True)
class Row:
    """Answers of a reader.

    Attributes:
        reader: name in `READERS`.
        inputs: number of damaged files.
        refused: of them, those with an error of this program.
        faults: other exceptions and warnings, with the seed file, a sentence each.
        memory: largest resident memory of the process [bytes].
        slowest: longest processor time of one file [s].
    """

    reader: str
    inputs: int
    refused: int
    faults: tuple[str, ...]
    memory: float
    slowest: float


def read_damaged(
    reader: str, seeds: Iterable[Path], folder: Path, count: int, seed: int = 1
) -> Row:
    """Give damaged files to a reader."""
    seeds, chance = list(seeds), random.Random(f"{reader} {seed}")
    whole = [path for path in seeds if not path.is_relative_to(_FAULTS)]
    refused, faults, slowest = 0, list[str](), 0.0
    place = folder / f"damaged_{reader}"
    place.mkdir()
    if reader == "figure":
        for psurf in whole[0].parent.glob("*.pss"):
            (place / psurf.name).write_bytes(psurf.read_bytes())
    if reader == "model":
        (place / "defaults.xml").write_bytes((_MODELS / "defaults.xml").read_bytes())
    for k in range(count):
        source = chance.choice(whole if k % 2 else seeds)
        target = place / f"damaged{''.join(source.suffixes[-2:])}"
        if reader == "dyspam":
            target = target.with_name(source.name)
            for other in source.parent.iterdir():
                target.with_name(other.name).write_bytes(other.read_bytes())
        data = source.read_bytes()
        inside = reader == "npz" and chance.random() < 0.7
        data = damage_member(data, chance) if inside else damage(data, chance)
        target.write_bytes(data)
        begin = time.process_time()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                warnings.simplefilter("ignore", RuntimeWarning)  # as the command does
                answer = READERS[reader](target)
            refused += isinstance(answer, CommandResult) and answer.code != ExitCode.SUCCESS
        except MoverError:
            refused += 1
        except Exception as failure:
            faults.append(f"{source.name}, input {k}: {type(failure).__name__}: {failure}")
            target.with_name(f"fault{k}-{source.name}").write_bytes(data)
        slowest = max(slowest, time.process_time() - begin)
    return Row(reader, count, refused, tuple(faults), peak() * 1e6, slowest)


def _read_in_process(reader: str, folder: Path, count: int) -> Row:
    line = [sys.executable, "-m", "benchmarks.damaged_inputs", reader, str(folder), str(count)]
    done = subprocess.run(line, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        return Row(reader, count, 0, (f"its process ended with {done.returncode}",), 0, 0.0)
    values = json.loads(done.stdout.splitlines()[-1])
    return Row(**{**values, "faults": tuple(values["faults"])})


def _seeds_of(reader: str, folder: Path) -> list[Path]:
    names = (folder / f"{reader}.seeds").read_text(encoding="utf-8")
    return [Path(name) for name in names.splitlines()]


def main() -> None:
    """Print the table; fail on a fault or on too much memory."""
    if len(sys.argv) > 2:
        reader, folder, count = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
        # Reserved memory that is not used counts as well: a reader should not ask for it.
        resource.setrlimit(resource.RLIMIT_AS, (6_000_000_000, 6_000_000_000))
        print(json.dumps(asdict(read_damaged(reader, _seeds_of(reader, folder), folder, count))))
        return
    total = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    count = -(-total // len(READERS))
    with tempfile.TemporaryDirectory() as name:
        folder, rows = Path(name), list[Row]()
        for reader, paths in make_seeds(folder).items():
            (folder / f"{reader}.seeds").write_text("\n".join(map(str, paths)), encoding="utf-8")
        print("| reader | inputs | refused | tracebacks | largest memory [MB] | slowest [s] |")
        print("|---|---|---|---|---|---|")
        for reader in READERS:
            rows.append(row := _read_in_process(reader, folder, count))
            print(
                f"| {reader} | {row.inputs} | {row.refused} | {len(row.faults)} "
                f"| {row.memory / 1e6:.0f} | {row.slowest:.2f} |",
                flush=True,
            )
            for fault in row.faults[:20]:
                print(f"  {fault}"[:300], file=sys.stderr)
    numbers = np.array([[row.inputs, len(row.faults), row.memory] for row in rows])
    print(f"{numbers[:, 0].sum():.0f} inputs, {numbers[:, 1].sum():.0f} tracebacks")
    sys.exit(bool(numbers[:, 1].any() or numbers[:, 2].max() > MAX_MEMORY))


if __name__ == "__main__":
    main()
