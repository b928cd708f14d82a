"""Tables of `docs/` that are made of what was measured: `python -m benchmarks pages`.

A table stands between `<!-- measured: NAME -->` and `<!-- end -->`; its rows come from
`plots/data/*.csv`. Nothing is measured here.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import floor, isnan, log10
from pathlib import Path

import numpy as np

from benchmarks import startup
from plots.fall_facts import Direction, Falls
from plots.fall_verdicts import Comparison, FallTables, read_fall_tables
from plots.literature import Measurements, read_measurements
from plots.plate import Outcome
from plots.plates.falls_of_people import CAUSES, read_falls
from plots.plates.floor_falls import (
    CARRIED,
    COLLAPSE,
    PEAK_FORCE,
    PEAK_HIP_FORCE,
    SMOOTHED_FORCE,
    SMOOTHED_HIP_FORCE,
    contacts,
    select_fall,
)
from plots.plates.work_precision import cheapest_wall_time

FOLDER = Path(__file__).parents[1] / "docs"

PAGES = (
    "contact-validation.md",
    "falls-of-people.md",
    "model-formats.md",
    "speed.md",
    "verification.md",
    "view.md",
)

_TABLE = re.compile(r"(?<=<!-- measured: )([\w-]+)( -->\n\n).*?(?=<!-- end -->)", re.DOTALL)

Line = Sequence[object]


def main() -> None:
    """Write the tables into the pages."""
    for name in PAGES:
        path = FOLDER / name
        path.write_text(fill(path.read_text(encoding="utf-8")), encoding="utf-8")
        print(f"wrote {path}")


def fill(page: str) -> str:
    """Return a page with its tables made anew."""
    return _TABLE.sub(lambda match: f"{match[1]}{match[2]}{table(match[1])}\n", page)


def table(name: str) -> str:
    """Return a table in Markdown."""
    head, *lines = TABLES[name]()
    rule = "|" + "---|" * len(head)
    rows = [f"| {' | '.join(map(_cell, line))} |" for line in (head, *lines)]
    return "\n".join([rows[0], rule, *rows[1:], ""])


def _cell(value: object) -> str:
    """Text of a cell; numbers to three digits."""
    if not isinstance(value, float):
        return str(value)
    if isnan(value):
        return "-"
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


def _defaults() -> Iterator[Line]:
    yield "engine", "error [rad]", "wall [ms]", "CPU [ms]", "ours over it, wall", "CPU"
    for row in read_measurements("aims_defaults").rows:
        yield row["engine"], *_numbers(row, list(row)[1:])


def _errors() -> Iterator[Line]:
    head = ("error at most [rad]", "method", "setting", "error [rad]", "wall [ms]", "CPU [ms]")
    yield *head, "ours over it, wall", "CPU"
    for row in read_measurements("aims_errors").rows:
        yield f"{float(row['at most [rad]']):g}", row["method"], *_numbers(row, list(row)[2:])


def _aims() -> Iterator[Line]:
    yield "aim", "bound", "by wall", "by CPU", "reached"
    for row in read_measurements("aims").rows:
        yield row["aim"], row["bound"], *_numbers(row, ("wall", "CPU")), row["reached"]
    for aim in startup.aims(read_measurements("startup").rows):
        yield tuple(aim.row().values())


def _prototype_costs() -> Iterator[Line]:
    yield "engine, method", "to 1e-3 rad [ms]", "to 1e-5 rad [ms]"
    costs = read_measurements("work_precision").select_rows(figure="prototype")
    methods = dict.fromkeys((row["engine"], row["method"]) for row in costs.rows)
    for engine, method in methods:
        some = costs.select_rows(engine=engine, method=method)
        yield (
            f"{engine}, {method}",
            *(1e3 * cheapest_wall_time(some, target) for target in (1e-3, 1e-5)),
        )


def _growth() -> Iterator[Line]:
    chains = read_measurements("chains")
    methods = chains.values("method")
    yield "segments", *methods
    for count in chains.values("segments"):
        some = chains.select_rows(segments=count)
        walls = dict(zip(some.values("method"), some.column("wall [s]"), strict=True))
        yield count, *(1e3 * float(walls[method]) for method in methods)
    yield (
        "largest doubling",
        *(
            max(chains.select_rows(method=method).column("over half as many")[1:])
            for method in methods
        ),
    )
    yield (
        "largest error [rad]",
        *(f"{max(chains.select_rows(method=m).column('error [rad]')):.1e}" for m in methods),
    )


def _startup() -> Iterator[Line]:
    yield "", "wall [s]", "CPU [s]", "build [ms]", "peak memory [MB]"
    for row in read_measurements("startup").rows:
        process = not isnan(float(row["process [s]"]))
        what = "process" if process else "import"
        build, memory = (float(row[key]) for key in ("build [s]", "peak memory [MB]"))
        name = row["engine"] if process else f"import: {row['engine']}"
        yield name, *_numbers(row, (f"{what} [s]", f"{what} CPU [s]")), 1e3 * build, memory


def _call() -> Iterator[Line]:
    rows = read_measurements("python_share").rows
    parts = [key for key in rows[0] if key.endswith("[ms]")]
    yield "figure", "tolerance [rad]", *(key.removesuffix(" [ms]") for key in parts)
    for row in rows:
        name = f"{row['figure']}, {float(row['time [s]']):g} s"
        yield name, f"{float(row['tolerance [rad]']):g}", *_numbers(row, parts)


def _contact_costs() -> Iterator[Line]:
    yield "fall", "method", "wall [s]", "CPU [s]", "times real time"
    for row in read_measurements("contact_cost").rows:
        yield row["fall"], row["method"], *_numbers(row, ("wall [s]", "CPU [s]", "times real time"))


def _fall_speed() -> Iterator[Line]:
    rows = read_measurements("fall_speed").rows
    keys = [key for key in rows[0] if key != "what"]
    yield "what", *keys
    for row in rows:
        yield row["what"], *_numbers(row, keys)


def _live_page() -> Iterator[Line]:
    rows = read_measurements("live_page").rows
    keys = [key for key in rows[0] if key != "page"]
    yield "page", *keys
    for row in rows:
        yield row["page"], *(float(row[key]) if row[key] else "" for key in keys)


def _engines() -> Iterator[Line]:
    yield "start", "engine", "setting", "joints", "change", "centre of mass [m]", "energy [J]"
    for row in read_measurements("verification").rows:
        unit = {"MuJoCo": " s", "this program": " rad", "Exudyn": " rad"}.get(row["engine"], "")
        keys = ("joints [rad]", "change to next [rad]", "centre of mass [m]", "energy [J]")
        values = [_power(float(row[key])) for key in keys]
        yield row["start"], row["engine"], f"{float(row['setting']):g}{unit}", *values


def _floor_falls() -> Iterator[Line]:
    yield "engine", "contact", *(_kilo(key)[0] for key in _FALL_HEADERS)
    falls = read_measurements("falls")
    for contact in contacts(falls):
        table = select_fall(falls, COLLAPSE, contact)
        yield *contact, *(_mean(table, key) for key in _FALL_HEADERS)


def _hip_forces() -> Iterator[Line]:
    falls = read_measurements("falls")
    manners = [fall for fall in falls.values("fall") if fall != COLLAPSE]
    yield "engine", "contact", *(f"{fall}{what}" for fall in manners for what in ("", ", 10 ms"))
    for contact in contacts(falls):
        tables = [select_fall(falls, fall, contact) for fall in manners]
        keys = (PEAK_HIP_FORCE, SMOOTHED_HIP_FORCE)
        yield *contact, *(_mean(table, key) for table in tables for key in keys)


_FALL_HEADERS = (
    "COM below 0.6 m [s]",
    "COM below 0.25 m [s]",
    "COM height at rest [m]",
    "drift [m]",
    PEAK_FORCE,
    SMOOTHED_FORCE,
    CARRIED,
)


def _kilo(header: str) -> tuple[str, float]:
    """A header with kN for N, and the factor of its values."""
    return (header.replace("[N]", "[kN]"), 1e-3) if "[N]" in header else (header, 1.0)


def _mean(table: Measurements, header: str) -> str:
    """Mean and standard deviation of a column, the latter to two digits."""
    values = _kilo(header)[1] * table.column(header)
    spread = float(np.std(values, ddof=1))
    digits = max(0, 1 - floor(log10(spread)))
    return f"{np.mean(values):.{digits}f} ({spread:.{digits}f})"


def _falls_of_people() -> Iterator[Line]:
    """Each fact with the numbers and the verdict of each body; failing verdicts are bold."""
    data = read_falls()
    bodies = data.tables.names
    yield "fact", "people or dummies", "use", *(head for body in bodies for head in (body, ""))
    for group, facts in data.facts.grouped().items():
        yield f"**{group.value}**", *[""] * (2 + 2 * len(bodies))
        for fact in facts:
            found = [one for one in data.comparisons if one.fact is fact]
            source = f"[{data.facts.source_number(fact)}] {fact.sureness}"
            cells = (cell for one in found for cell in (one.measured or "-", _verdict(one)))
            yield fact.name, f"{fact.value_text} {source}", fact.use.value, *cells


def _verdict(found: Comparison) -> str:
    return f"**{found.verdict}**" if found.outcome is Outcome.DIFFERS else found.verdict


def _falls_that_differ() -> Iterator[Line]:
    """Each fact with the bodies and criteria that differ, and the likely reason."""
    data = read_falls()
    yield "fact", "differs", "likely reason"
    for fact in data.facts.facts:
        found = [one for one in data.comparisons if one.fact is fact and one.failing]
        if not found:
            continue
        labels = "; ".join(f"{one.body}: {', '.join(one.failing)}" for one in found)
        failing = dict.fromkeys(label for one in found for label in one.failing)
        causes = dict.fromkeys(
            cause for label in failing if (cause := CAUSES.get((fact.key, label)))
        )
        yield f"{fact.group.value}: {fact.name}", labels, "; ".join(causes) or "not known"


def _falls_by_direction() -> Iterator[Line]:
    """Falls of each body, awake and limp, by their direction."""
    tables = read_fall_tables()
    yield "falls", *(name for name, _, _ in _DIRECTION_COLUMNS), "falls in number"
    for body in tables.names:
        for falls in Falls:
            for direction in Direction:
                yield from _direction_row(tables, body, falls, direction)


_DIRECTION_COLUMNS = (
    ("head hits [%]", "head_hits", 100.0),
    ("pelvis [m/s]", "pelvis_speed_m_per_s", 1.0),
    ("hand before pelvis [ms]", "hand_lead_ms", 1.0),
    ("force on the pelvis [kN]", "hip_force_N", 1e-3),
    ("in body weights", "hip_force_body_weights", 1.0),
)


def _direction_row(
    tables: FallTables, body: str, falls: Falls, direction: Direction
) -> Iterator[Line]:
    columns = tables.pushes_of(body, falls, direction)
    means = (factor * float(np.nanmean(columns[name])) for _, name, factor in _DIRECTION_COLUMNS)
    yield f"{body}, {falls.value}, {direction.value}", *means, len(columns["seed"])


def _falls_on_floors() -> Iterator[Line]:
    """Backward falls on each floor: forces on the pelvis alone, and with the thighs."""
    yield "body, floor [kN/m]", *(name for name, _, _ in _FLOOR_COLUMNS)
    floors = read_fall_tables().floors
    for row in () if floors is None else floors.rows:
        floor = "hard" if row["floor_kN_m"] == "inf" else row["floor_kN_m"]
        numbers = (factor * float(row[name]) for _, name, factor in _FLOOR_COLUMNS)
        yield f"{row['body']}, {floor}", *numbers


_FLOOR_COLUMNS = (
    ("pelvis [m/s]", "pelvis_speed_m_per_s", 1.0),
    ("on the lower torso [kN]", "pelvis_force_N", 1e-3),
    ("on the part pelvis [kN]", "force_N", 1e-3),
    ("the same at 3.5 m/s [kN]", "floor_force_N", 1e-3),
    ("54 kg alone, at 3.5 m/s [kN]", "alone_force_N", 1e-3),
)


def _fall_sources() -> Iterator[Line]:
    yield "", "source"
    for number, source in enumerate(read_falls().facts.sources, start=1):
        yield f"[{number}]", source.reference


def _exports() -> Iterator[Line]:
    rows = read_measurements("exports").rows
    keys = [key for key in rows[0] if key not in ("warnings", "with springs [deg]")]
    yield tuple(keys)
    for row in rows:
        yield tuple(_measured(row[key]) for key in keys)


def _measured(cell: str) -> str:
    """Text of a cell that may be a number, to two digits."""
    try:
        value = float(cell)
    except ValueError:
        return cell
    return f"{value:.0f}" if value >= 100.0 else f"{value:.2g}"


def _power(value: float) -> str:
    return "" if isnan(value) else f"{value:.1e}"


def _numbers(row: Mapping[str, str], keys: Sequence[str]) -> Iterator[float]:
    return (float(row[key]) for key in keys)


TABLES: Mapping[str, Callable[[], Iterator[Line]]] = {
    "defaults": _defaults,
    "errors": _errors,
    "aims": _aims,
    "prototype-costs": _prototype_costs,
    "fall-speed": _fall_speed,
    "growth": _growth,
    "startup": _startup,
    "call": _call,
    "contact-costs": _contact_costs,
    "engines": _engines,
    "exports": _exports,
    "fall-sources": _fall_sources,
    "falls-by-direction": _falls_by_direction,
    "falls-of-people": _falls_of_people,
    "falls-on-floors": _falls_on_floors,
    "falls-that-differ": _falls_that_differ,
    "floor-falls": _floor_falls,
    "hip-forces": _hip_forces,
    "live-page": _live_page,
}
