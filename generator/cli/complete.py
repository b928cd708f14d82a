"""`mover complete`: estimate missing masses of a figure from its psurfs."""

from pathlib import Path
from typing import Annotated

import typer

from generator.cli.answer import CommandResult, format_table
from generator.cli.options import Density, FigureName, density_from_option
from generator.cli.outputs import check_suffix, check_writable, write_file
from generator.diagnostics import Diagnostic, InputError, UsageError, warning
from generator.figure_file import FIGURE_FILE
from generator.geometry.completion import Addition, complete_figure
from generator.text_io import load_text, make_source


def complete(
    name: FigureName,
    density: Density,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="OUT.fig", help="Figure file to write.")
    ],
) -> CommandResult:
    """Estimate missing masses and inertias of a figure from psurfs."""
    check_suffix(output, FIGURE_FILE.suffix, "a figure file")
    kg_per_m3 = density_from_option("--density", density)
    reading = FIGURE_FILE.parse_file(name)
    if reading.value is None or reading.value.path is None:
        raise InputError(reading.diagnostics)
    figure, path = reading.value, reading.value.path
    psurfs = {segment.psurf for segment in figure.segments.values() if segment.psurf}
    check_writable([output], (path, *(path.parent / psurf for psurf in psurfs)))
    try:
        done = complete_figure(figure, load_text(path, name)[0], kg_per_m3)
    except ValueError as failure:
        raise UsageError(f"--density {density}: {failure}") from None
    # The warnings of the completed figure, without those about the masses that were missing.
    remaining = FIGURE_FILE.parse(make_source(done.text, str(output))).diagnostics
    write_file(output, done.text.replace("\n", _line_ending(path)))
    faults = (*done.diagnostics, *remaining, *_companion_file_warnings(path, output))
    return CommandResult(
        _text(name, output, done.additions), _data(name, output, done.additions), faults
    )


def _line_ending(path: Path) -> str:
    return "\r\n" if b"\r\n" in path.read_bytes() else "\n"


def _companion_file_warnings(path: Path, output: Path) -> list[Diagnostic]:
    """Warn that the new figure file will not find its psurfs or its springs."""
    faults: list[Diagnostic] = []
    if output.resolve().parent != path.resolve().parent:
        faults.append(
            warning(
                f"the psurfs lie beside `{path}`, not beside `{output}`",
                hint="write the new figure there, or copy the psurfs",
            )
        )
    beside = [path.with_name(path.stem + end) for end in (".springs.toml", ".optional")]
    springs = next((file for file in beside if file.is_file()), None)
    if springs is not None and output.resolve().with_suffix("") != path.resolve().with_suffix(""):
        faults.append(
            warning(
                f"the springs of the figure are in `{springs.name}`, which `{output}` does not use",
                hint=f"use `--springs {springs}`, or copy them under the new name",
            )
        )
    return faults


def _text(name: str, output: Path, additions: tuple[Addition, ...]) -> str:
    if not additions:
        return f"{name}: nothing that a psurf gives was missing; {output} is an exact copy"
    rows = [["segment", "filled in", "density [kg/m^3]", "mass [kg]"]]
    rows += [
        [a.segment, ", ".join(a.fields), f"{a.density:.6g}", f"{a.body.mass:.6g}"]
        for a in additions
    ]
    return f"{output}: {name} with estimates from its psurfs\n{format_table(rows, left_columns=2)}"


def _data(name: str, output: Path, additions: tuple[Addition, ...]) -> dict[str, object]:
    return {
        "figure": name,
        "output": str(output),
        "filled_in": [
            {
                "segment": a.segment,
                "fields": list(a.fields),
                "density_kg_m3": a.density,
                "mass_kg": a.body.mass,
                "inertia_kg_m2": a.body.inertia.diagonal().tolist(),
                "centre_of_mass_m": a.body.centre.tolist(),
            }
            for a in additions
        ],
    }
