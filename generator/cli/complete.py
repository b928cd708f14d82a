"""`mover complete`: a figure with the masses that it lacks, estimated from its psurfs."""

from pathlib import Path
from typing import Annotated

import typer

from generator.cli.answer import CommandResult, format_table
from generator.cli.options import Density, FigureName, density_from_option
from generator.cli.outputs import check_suffix, check_writable, write_file
from generator.diagnostics import Diagnostic, InputError, UsageError, warning
from generator.figure_file import parse_figure, parse_figure_file
from generator.figure_file.read import FIGURE_SUFFIX
from generator.geometry.completion import Addition, complete_figure
from generator.text_io import load_text


def complete(
    name: FigureName,
    density: Density,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="OUT.fig", help="Where the figure goes.")
    ],
) -> CommandResult:
    """Fill in the masses, inertias and centres of mass that a figure lacks, from its psurfs."""
    check_suffix(output, FIGURE_SUFFIX, "a figure file")
    meant = density_from_option("--density", density)
    reading = parse_figure_file(name)
    if reading.value is None or reading.value.path is None:
        raise InputError(reading.diagnostics)
    figure, path = reading.value, reading.value.path
    psurfs = {segment.psurf for segment in figure.segments.values() if segment.psurf}
    check_writable([output], (path, *(path.parent / psurf for psurf in psurfs)))
    try:
        done = complete_figure(figure, load_text(path, name)[0], meant)
    except ValueError as failure:
        raise UsageError(f"--density {density}: {failure}") from None
    # The warnings of what is written: those about masses that are filled in are gone.
    remaining = parse_figure(done.text, str(output)).diagnostics
    write_file(output, done.text.replace("\n", _line_ending(path)))
    faults = (*done.diagnostics, *remaining, *_companion_file_warnings(path, output))
    return CommandResult(
        _text(name, output, done.additions), _data(name, output, done.additions), faults
    )


def _line_ending(path: Path) -> str:
    return "\r\n" if b"\r\n" in path.read_bytes() else "\n"


def _companion_file_warnings(path: Path, output: Path) -> list[Diagnostic]:
    """What the new file will not find: psurfs lie beside a figure, springs bear its name."""
    faults: list[Diagnostic] = []
    if output.resolve().parent != path.resolve().parent:
        faults.append(
            warning(
                f"the psurfs lie beside `{path}`, not beside `{output}`",
                hint="put the new figure there, or copy them",
            )
        )
    beside = [path.with_name(path.stem + end) for end in (".springs.toml", ".optional")]
    springs = next((file for file in beside if file.is_file()), None)
    if springs is not None and output.resolve().with_suffix("") != path.resolve().with_suffix(""):
        faults.append(
            warning(
                f"the springs of the figure are in `{springs.name}`, which `{output}` does not use",
                hint=f"give them by `--springs {springs}`, or copy them under the new name",
            )
        )
    return faults


def _text(name: str, output: Path, additions: tuple[Addition, ...]) -> str:
    if not additions:
        return f"{name}: nothing was missing that a psurf could tell; {output} is the same text"
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
