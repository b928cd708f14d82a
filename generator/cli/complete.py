"""`mover complete`: estimate missing masses of a figure from its psurfs."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

from generator.cli.answer import CommandResult, Paragraphs, Table
from generator.cli.options import Density, FigureName, density_from_option, output_option
from generator.cli.outputs import check_suffix, check_writable, write_file
from generator.diagnostics import Diagnostic, InputError, UsageError, warning
from generator.figure_file import FIGURE_FILE
from generator.geometry.completion import complete_figure
from generator.rotations import Array
from generator.text_io import load_text, make_source


class FilledIn(NamedTuple):
    """Estimates for a segment."""

    segment: str
    fields: Sequence[str]
    density_kg_m3: float
    mass_kg: float
    inertia_kg_m2: Array
    centre_of_mass_m: Array


@dataclass(frozen=True)
class CompletedFigure(CommandResult):
    """Estimates in a figure file."""

    figure: str
    output: Path
    filled_in: Sequence[FilledIn]

    def paragraphs(self) -> Paragraphs:
        """Return a table of the segments with estimates."""
        if not self.filled_in:
            yield (
                f"{self.figure}: nothing that a psurf gives was missing; {self.output} is an "
                "exact copy"
            )
            return
        rows = [["segment", "filled in", "density [kg/m^3]", "mass [kg]"]]
        for one in self.filled_in:
            numbers = f"{one.density_kg_m3:.6g}", f"{one.mass_kg:.6g}"
            rows.append([one.segment, ", ".join(one.fields), *numbers])
        yield f"{self.output}: {self.figure} with estimates from its psurfs\n{Table(rows, 2)}"


def complete(
    name: FigureName,
    density: Density,
    output: Annotated[Path, output_option("OUT.fig", "Figure file to write.")],
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
    diagnostics = (*done.diagnostics, *remaining, *_companion_file_warnings(path, output))
    filled_in = [
        FilledIn(
            one.segment,
            one.fields,
            one.density,
            one.body.mass,
            one.body.inertia.diagonal(),
            one.body.centre,
        )
        for one in done.additions
    ]
    return CompletedFigure(name, output, filled_in, diagnostics=diagnostics)


def _line_ending(path: Path) -> str:
    return "\r\n" if b"\r\n" in path.read_bytes() else "\n"


def _companion_file_warnings(path: Path, output: Path) -> list[Diagnostic]:
    """Warn that the new figure file will not find its psurfs or its springs."""
    diagnostics: list[Diagnostic] = []
    if output.resolve().parent != path.resolve().parent:
        diagnostics.append(
            warning(
                f"the psurfs lie beside `{path}`, not beside `{output}`",
                hint="write the new figure there, or copy the psurfs",
            )
        )
    beside = [path.with_name(path.stem + end) for end in (".springs.toml", ".optional")]
    springs = next((file for file in beside if file.is_file()), None)
    if springs is not None and output.resolve().with_suffix("") != path.resolve().with_suffix(""):
        diagnostics.append(
            warning(
                f"the springs of the figure are in `{springs.name}`, which `{output}` does not use",
                hint=f"use `--springs {springs}`, or copy them under the new name",
            )
        )
    return diagnostics
