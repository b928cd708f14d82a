"""`mover person`: the figure of a person, with springs, surfaces and the sources of its numbers."""

from collections import Counter
from collections.abc import Iterator, Sequence
from enum import StrEnum
from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from generator.cli.answer import CommandResult, format_count, format_table
from generator.cli.options import CM, length_from_option, mass_from_option
from generator.cli.outputs import check_suffix, check_writable, format_files, write_models
from generator.diagnostics import InputError, error, warning
from generator.figure_file.read import FIGURE_FILE
from generator.model_files.figure_files import springs_path
from generator.model_files.model_files import ModelFiles
from generator.person.densities import (
    DENSITY_REFERENCES,
    SegmentDensity,
    segment_densities,
)
from generator.person.measures import MEASURES_FILE, Sex, estimate_measures
from generator.person.person import Person, build_person
from generator.person.person_files import (
    COUPLED_SPRINGS,
    MADE_BY,
    describe_measures,
    person_files,
    springs_title,
)
from generator.person.sources import Origin


class PersonSprings(StrEnum):
    """Springs of a person."""

    PUBLISHED = "published"
    NONE = "none"


def person(
    sex: Annotated[Sex, typer.Option(help="Sex of the samples from which the numbers come.")],
    stature: Annotated[str, typer.Option(metavar="1.75m", help="Stature with its unit.")],
    mass: Annotated[str, typer.Option(metavar="75kg", help="Mass with its unit.")],
    measures: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="Measured dimensions (docs/person.md); the others follow them.",
        ),
    ] = None,
    springs: Annotated[
        PersonSprings, typer.Option(help="Springs of the joints.")
    ] = PersonSprings.PUBLISHED,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE.fig",
            help="Figure to write, with springs, geometry and sources beside it.",
        ),
    ] = None,
) -> CommandResult:
    """Make the figure of a person of a sex, stature and mass.

    Each number comes from published measurements, follows from them by a rule, or is an estimate;
    FILE.sources.csv says which. Without -o the person is shown only.
    """
    if output is not None:
        check_suffix(output, FIGURE_FILE.suffix, "a figure")
        check_writable([output], [measures])
    metres = length_from_option("--stature", stature, "1.75m")
    kilograms = mass_from_option("--mass", mass)
    parsed = None if measures is None else MEASURES_FILE.parse_file(measures)
    made = build_person(
        estimate_measures(sex, metres, kilograms, parsed and parsed.require_value()),
        springs=springs is PersonSprings.PUBLISHED,
    )
    files = None if output is None else person_files(made, output)
    models = [] if files is None else [files]
    for model in models:
        _check_files(model, measures)
    written = write_models(models)
    doubts = [
        *made.body.measures.warnings,
        *(str(loss) for losses in written.values() for loss in losses.entries),
    ]
    densities = segment_densities(made)
    return CommandResult(
        text="\n\n".join(_sections(made, densities, files)),
        data={
            **_data(made, densities),
            "warnings": doubts,
            "files": [str(file) for model in models for file in model.contents],
        },
        diagnostics=(*(parsed.diagnostics if parsed else ()), *map(warning, doubts)),
    )


def _check_files(model: ModelFiles, measures: Path | None) -> None:
    """Raise InputError for files that cannot be written, or springs that are not of a person."""
    beside = [file for file in model.contents if file.parent == model.path.parent]
    check_writable(beside, [measures])
    faults = [
        error(
            f"`{path}` exists with other springs and would be replaced",
            hint="move it, or write another figure",
        )
        for path in (springs_path(model.path), springs_path(model.path, COUPLED_SPRINGS))
        if path in model.contents and path.exists() and not _may_be_replaced(path, model.path)
    ]
    if faults:
        raise InputError(faults)


def _may_be_replaced(springs: Path, figure: Path) -> bool:
    """Return whether this command made the springs, and for the same figure.

    The springs of `me.coupled.fig` are where the coupled ones of `me.fig` are.
    """
    with springs.open(encoding="utf-8", errors="replace") as file:
        first = file.readline(1000).rstrip("\n")
    return first.startswith(f"# {springs_title(figure)}, ") and first.endswith(MADE_BY)


def _sections(
    made: Person, densities: Sequence[SegmentDensity], files: ModelFiles | None
) -> Iterator[str]:
    """Yield the paragraphs of the answer."""
    segments, joints = len(made.figure.bodies), len(made.figure.joints)
    yield (
        f"{describe_measures(made.body.measures)}: {format_count(segments, 'segment')}, "
        f"{format_count(joints, 'joint')}, {made.figure.degrees_of_freedom} degrees of freedom"
    )
    rows = [["segment", "mass [kg]", "length [cm]", "density [kg/m3]", "published"]]
    for one in densities:
        segment = made.body.segments.get(one.name)
        length = "" if segment is None else f"{segment.length / CM:.1f}"
        low, high = (f"{f(one.published.values(), default=0):.0f}" for f in (min, max))
        published = "" if not one.published else low if low == high else f"{low} to {high}"
        rows.append([one.name, f"{one.mass:.3f}", length, f"{one.density:.0f}", published])
    years = ", ".join(
        f"{author} {reference.text[-4:]}" for author, reference in DENSITY_REFERENCES.items()
    )
    yield f"{format_table(rows)}\npublished: densities of cadavers, {years}"
    yield f"springs: {_springs_text(made)}"
    if files is None:
        yield "nothing is written without -o, such as -o me.fig"
    else:
        yield "\n".join(format_files([files.path], files.contents))
        yield f"next: mover simulate {quote(str(files.path))} --floor --stop 2 -o fall.html"


def _springs_text(made: Person) -> str:
    """State how many curves are published, and how many are not."""
    if made.springs_file is None:
        return "none"
    counts = _count_curves(made)
    parts = (f"{counts[origin]} {words}" for origin, words in _ORIGINS.items())
    curves = format_count(counts.total(), "curve")
    return f"{curves}, scaled with mass times stature squared: {', '.join(parts)}"


_ORIGINS = {
    Origin.PUBLISHED: "published",
    Origin.SCALED: "partly estimated",
    Origin.ESTIMATE: "estimates",
}


def _count_curves(made: Person) -> Counter[Origin]:
    """Count the curves of the springs by their origins; left and right are one."""
    return Counter(axis.origin for axis in made.passive_axes)


def _data(made: Person, densities: Sequence[SegmentDensity]) -> dict[str, object]:
    measures = made.body.measures
    counts = _count_curves(made)
    return {
        "sex": measures.sex.value,
        "stature_m": measures.stature,
        "total_mass_kg": made.figure.total_mass,
        "degrees_of_freedom": made.figure.degrees_of_freedom,
        "segments": [
            {
                "name": one.name,
                "mass_kg": one.mass,
                "length_m": made.body.segments[one.name].length,
                "density_kg_m3": one.density,
                "published_densities_kg_m3": dict(one.published),
            }
            for one in densities
            if one.name in made.body.segments
        ],
        "density_kg_m3": densities[-1].density,
        "density_references": {name: str(one) for name, one in DENSITY_REFERENCES.items()},
        "dimensions": [
            {
                "name": one.name,
                "value_m": one.value,
                "expected_m": one.expected,
                "standard_error_m": one.standard_error,
                "measured": one.is_measured,
            }
            for one in measures.dimensions.values()
        ],
        "springs": None
        if made.springs_file is None
        else {origin.value: counts[origin] for origin in _ORIGINS},
    }
