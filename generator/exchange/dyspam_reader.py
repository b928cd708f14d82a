"""Reading DYSPAM's input files: a folder in, a figure and its springs out."""

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from generator.errors import Fault, InputError, error, errors_among
from generator.exchange.dyspam import FILES, FORMAT, LOADS, OPTIONAL, STRUCTURE, TABLES
from generator.exchange.dyspam_jackforce import jackforce_in
from generator.exchange.dyspam_rows import MOST
from generator.exchange.dyspam_structure import Structure, Times, structure_in
from generator.exchange.dyspam_tables import tables_in
from generator.exchange.dyspam_to_figure import figure_of, rates_of
from generator.exchange.losses import Loss, Losses
from generator.figure import Figure
from generator.reader.findings import EnoughFaults, Findings
from generator.reader.passive import springs_for
from generator.reader.text_file import read_text
from generator.source import Source
from springs import SpringSet


@dataclass(frozen=True)
class DyspamReading:
    """What came of reading a folder.

    Attributes:
        figure: None when `faults` holds an error.
        springs: of the figure, from `ndyspamfile` and `optional`; None likewise.
        faults: all that was found.
        losses: what the files say that a figure and its springs do not hold.
        times: of the simulation; None when they could not be read.
        rates: by joint, rates of the displacements at the start [rad/s], where there are any.
    """

    figure: Figure | None
    springs: SpringSet | None
    faults: tuple[Fault, ...]
    losses: Losses
    times: Times | None
    rates: Mapping[str, tuple[float, ...]]


def examine(path: Path) -> DyspamReading:
    """The figure and the springs in a folder, with all faults; bad input raises nothing."""
    if not path.is_dir():
        missing = error(f"there is no folder `{path}`", hint=f"it holds {', '.join(FILES)}")
        return DyspamReading(None, None, (missing,), Losses(FORMAT), None, {})
    faults: list[Fault] = []
    sources = {name: _source(path, name, faults) for name in (STRUCTURE, TABLES, LOADS)}
    structure, figure, springs = None, None, None
    rates: dict[str, tuple[float, ...]] = {}
    if not faults:
        structure = _structure(sources[STRUCTURE], faults)
    if structure is not None and not errors_among(faults):
        figure, rates = _figure(sources, structure, faults)
    if figure is not None:
        springs = _springs(figure, path / OPTIONAL, faults)
    if figure is not None and not errors_among(faults):
        figure = replace(figure, path=path / TABLES)
    else:
        figure = springs = None
    losses = Losses.of(FORMAT, () if structure is None else _losses_of_reading(structure, rates))
    times = None if structure is None else structure.times
    return DyspamReading(figure, springs, tuple(faults), losses, times, rates)


def read(path: Path) -> DyspamReading:
    """As `examine`, with figure and springs. Raises InputError, which holds all faults."""
    reading = examine(path)
    if errors_among(reading.faults):
        raise InputError(reading.faults)
    return reading


def _source(folder: Path, name: str, faults: list[Fault]) -> Source:
    source, fault = read_text(folder / name, os.fspath(folder / name))
    if fault is not None:
        faults.append(fault)
    return source


def _structure(source: Source, faults: list[Fault]) -> Structure | None:
    findings, structure = Findings(), None
    with suppress(EnoughFaults):
        structure = structure_in(source, findings)
    faults += findings.in_order()
    return structure


def _figure(
    sources: Mapping[str, Source], structure: Structure, faults: list[Fault]
) -> tuple[Figure | None, dict[str, tuple[float, ...]]]:
    """The figure, and the rates with which it starts; faults are added."""
    in_tables, in_loads, mechanism, loads = Findings(), Findings(), None, ()
    with suppress(EnoughFaults):
        mechanism = tables_in(sources[TABLES], structure, in_tables)
    if mechanism is not None:
        with suppress(EnoughFaults):
            points = MOST if in_tables.has_errors else len(mechanism.points)
            loads = jackforce_in(sources[LOADS], structure.loads, points, in_loads)
    figure = None
    if mechanism is not None and structure.place is not None and not in_tables.has_errors:
        with suppress(EnoughFaults):
            figure = figure_of(mechanism, loads, structure.place, in_tables)
    faults += [*in_tables.in_order(), *in_loads.in_order()]
    if mechanism is None or figure is None:
        return None, {}
    counted = Findings()
    has_loops = len(mechanism.connections) > len(mechanism.bodies)
    if not has_loops and structure.freedoms != figure.degrees_of_freedom:
        counted.error(
            f"the number of degrees of freedom is {structure.freedoms}",
            structure.place,
            f"the joints of {TABLES} have {figure.degrees_of_freedom}",
        )
    faults += counted.faults
    return figure, rates_of(mechanism)


def _springs(figure: Figure, path: Path, faults: list[Fault]) -> SpringSet | None:
    """The springs of `ndyspamfile`, and those of `optional` where there is one with a record."""
    choice = None
    if path.exists():
        source, fault = read_text(path, os.fspath(path))
        if fault is not None or source.text.strip():
            choice = path
    reading = springs_for(figure, choice=choice)
    faults += reading.faults
    return reading.springs


def _losses_of_reading(
    structure: Structure, rates: Mapping[str, tuple[float, ...]]
) -> list[Loss | None]:
    times = structure.times
    return [
        Loss(
            f"the times of the simulation, {times.start:g} to {times.stop:g} s with a step of "
            f"{times.step:g} s and a frame of {times.frame:g} s"
        ),
        Loss("flags that are set, whose meaning is not known") if structure.flagged else None,
        Loss("rates with which joints start", tuple(rates)) if rates else None,
    ]
