"""`mover person`: the figure of a person, with springs, surfaces and the sources of its numbers."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from math import degrees
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from generator.cli.answer import HIDDEN, CommandResult, Paragraphs, Table, format_count
from generator.cli.options import (
    CM,
    UpAxis,
    angle_from_option,
    length_from_option,
    mass_from_option,
    option,
    output_option,
)
from generator.cli.outputs import check_suffix, check_writable, format_files, write_models
from generator.contact_file.file import CONTACT_FILE
from generator.diagnostics import InputError, UsageError, error, warning
from generator.figure_file.read import FIGURE_FILE
from generator.model_files.model_files import ModelFiles, springs_path
from generator.person.densities import DENSITY_REFERENCES, SegmentDensity, segment_densities
from generator.person.joints import DEFAULT_NECK, Neck
from generator.person.measures import (
    MEASURES_FILE,
    MeasuredDimensions,
    Measures,
    Sex,
    estimate_measures,
)
from generator.person.person import Person, build_person
from generator.person.person_files import (
    MADE_BY,
    RIENER_SPRINGS,
    contact_title,
    describe_measures,
    person_files,
    springs_title,
)
from generator.person.segment_regression import regression_weight
from generator.person.sources import Origin

if TYPE_CHECKING:
    from generator.inverse.static_trial import StaticMeasures


class PersonSprings(StrEnum):
    """Springs of a person."""

    PUBLISHED = "published"
    RIENER = "riener"
    COUPLED = "coupled"
    NONE = "none"


class PersonContact(StrEnum):
    """Contact of a person with props."""

    SPHERES = "spheres"
    PARTS = "parts"


_ORIGINS = {
    Origin.PUBLISHED: "published",
    Origin.SCALED: "partly estimated",
    Origin.ESTIMATE: "estimates",
}


class SegmentData(NamedTuple):
    """A segment of a person."""

    name: str
    mass_kg: float
    length_m: float
    density_kg_m3: float
    published_densities_kg_m3: Mapping[str, float]
    density_excess: float


class DimensionData(NamedTuple):
    """A dimension of a person."""

    name: str
    value_m: float
    expected_m: float
    standard_error_m: float
    measured: bool


@dataclass(frozen=True)
class PersonResult(CommandResult):
    """Body of a person, and the files of its figure."""

    sex: Sex
    stature_m: float
    total_mass_kg: float
    degrees_of_freedom: int
    segments: Sequence[SegmentData]
    regression_weight: float
    density_kg_m3: float
    density_references: Mapping[str, str]
    dimensions: Sequence[DimensionData]
    springs: Mapping[str, int] | None
    warnings: Sequence[str]
    files: Sequence[Path]
    leg: str = field(metadata=HIDDEN)
    from_markers: Mapping[str, str] = field(metadata=HIDDEN)
    made: Person = field(metadata=HIDDEN)
    densities: Sequence[SegmentDensity] = field(metadata=HIDDEN)
    output: Path | None = field(metadata=HIDDEN)

    def paragraphs(self) -> Paragraphs:
        """Return the body, its segments, the origins of its springs, and the files."""
        segments, joints = len(self.made.figure.bodies), len(self.made.figure.joints)
        yield (
            f"{describe_measures(self.made.body.measures)}: {format_count(segments, 'segment')}, "
            f"{format_count(joints, 'joint')}, {self.degrees_of_freedom} degrees of freedom"
        )
        lengths = {one.name: f"{one.length_m / CM:.1f}" for one in self.segments}
        rows = [["segment", "mass [kg]", "length [cm]", "density [kg/m3]", "published", "beyond"]]
        for one in self.densities:
            low, high = (f"{f(one.published.values(), default=0):.0f}" for f in (min, max))
            published = "" if not one.published else low if low == high else f"{low} to {high}"
            numbers = f"{one.mass:.3f}", lengths.get(one.name, ""), f"{one.density:.0f}"
            beyond = f"{one.excess:+.0%}" if one.excess else ""
            rows.append([one.name, *numbers, published, beyond])
        years = ", ".join(
            f"{author} {reference.text[-4:]}" for author, reference in DENSITY_REFERENCES.items()
        )
        yield (
            f"{Table(rows)}\npublished: densities of cadavers, {years}\n"
            f"{_mass_sentence(self.regression_weight)}"
        )
        if self.from_markers:
            yield self._trial_table()
        if self.springs is None:
            yield "springs: none"
        else:
            counts = zip(self.springs.values(), _ORIGINS.values(), strict=True)
            parts = ", ".join(f"{count} {words}" for count, words in counts)
            curves = format_count(sum(self.springs.values()), "curve")
            yield (
                f"springs: {curves}, scaled with mass times stature squared: {parts}\n{self.leg}"
            )
        if self.output is None:
            yield "nothing is written without -o, such as -o me.fig"
        else:
            yield "\n".join(format_files([self.output], self.files))
            command = f"mover simulate {quote(str(self.output))} --floor --stop 2 -o fall.html"
            yield f"next: {command}"

    def _trial_table(self) -> Table:
        """Return the table of dimensions that a static trial gives."""
        rows = [["dimension of the static trial", "markers", "measured [cm]", "expected [cm]"]]
        for one in self.dimensions:
            if one.name in self.from_markers:
                lengths = (f"{metres / CM:.1f}" for metres in (one.value_m, one.expected_m))
                rows.append([one.name, self.from_markers[one.name], *lengths])
        return Table(rows, left_columns=2)


def person(
    sex: Annotated[Sex, typer.Option(help="Sex of the samples from which the numbers come.")],
    mass: Annotated[str, typer.Option(metavar="75kg", help="Mass with its unit.")],
    stature: Annotated[
        str | None,
        typer.Option(
            metavar="1.75m",
            help="Stature with its unit; only a static trial with a marker on the top of the head "
            "can do without it.",
            show_default=False,
        ),
    ] = None,
    measures: Annotated[
        Path | None,
        option("FILE.toml", "Measured dimensions (docs/person.md); the others follow them."),
    ] = None,
    markers: Annotated[
        Path | None,
        option(
            "STATIC.trc",
            "Static trial, .trc or .c3d: dimensions from markers on landmarks (docs/person.md).",
        ),
    ] = None,
    marker: Annotated[
        list[str] | None,
        option("LANDMARK=NAME", "Marker on a landmark, such as left_knee=LKNE; repeat it."),
    ] = None,
    up: UpAxis = "y",
    springs: Annotated[
        PersonSprings,
        typer.Option(
            help="Springs of the joints: one law of hip, knee and ankle (published; formerly "
            "coupled), or of hip and knee (riener)."
        ),
    ] = PersonSprings.PUBLISHED,
    hip_datum: Annotated[
        str,
        option(
            "10deg",
            "Hip flexion of an upright person in the coordinate of the law of hip, knee and "
            "ankle, from 0 to 15 deg: an estimate.",
        ),
    ] = "10deg",
    contact: Annotated[
        PersonContact,
        typer.Option(
            help="Contact with props: parts of the body have laws of their own (parts), or each "
            "sphere resists by itself, with the stiffness of pelvic flesh (spheres)."
        ),
    ] = PersonContact.PARTS,
    neck: Annotated[
        Neck | None,
        typer.Option(
            help="Neck: it turns only (rigid), or gives way to shear and to a force along it "
            f"(elastic); without springs it is rigid. [default: {DEFAULT_NECK.value}]",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        output_option("FILE.fig", "Figure to write, with springs, geometry and sources beside it."),
    ] = None,
) -> CommandResult:
    """Make the figure of a person of a sex, stature and mass.

    Each number comes from published measurements, follows from them by a rule, or is an estimate;
    FILE.sources.csv says which. Without -o the person is shown only.
    """
    if output is not None:
        check_suffix(output, FIGURE_FILE.suffix, "a figure")
        check_writable([output], [measures, markers])
    metres = None if stature is None else length_from_option("--stature", stature, "1.75m")
    kilograms = mass_from_option("--mass", mass)
    trial = _read_trial(markers, marker or (), up, sex, kilograms, metres)
    if trial is not None:
        metres = trial.stature
    if metres is None:
        raise UsageError("state the --stature, such as --stature 1.75m")
    datum = angle_from_option("--hip-datum", hip_datum)
    parsed = None if measures is None else MEASURES_FILE.parse_file(measures)
    stated = parsed and parsed.require_value()
    made = build_person(
        _measures(sex, metres, kilograms, stated, trial, markers),
        springs=springs,
        hip_datum=datum,
        neck=neck,
    )
    files = (
        None
        if output is None
        else person_files(made, output, has_parts=contact is PersonContact.PARTS)
    )
    models = [] if files is None else [files]
    for model in models:
        _check_files(model, measures)
    written = write_models(models)
    densities = segment_densities(made)
    notices = [
        *(() if trial is None else trial.notices),
        *made.body.measures.warnings,
        *(one.fault for one in densities if one.fault is not None),
        *(str(loss) for losses in written.values() for loss in losses.entries),
    ]
    body = made.body.measures
    curves = Counter(axis.origin for axis in made.passive_axes)  # left and right are one
    return PersonResult(
        sex=body.sex,
        stature_m=body.stature,
        total_mass_kg=made.figure.total_mass,
        degrees_of_freedom=made.figure.degrees_of_freedom,
        segments=[
            SegmentData(
                *(one.name, one.mass, made.body.segments[one.name].length, one.density),
                *(one.published, one.excess),
            )
            for one in densities
            if one.name in made.body.segments
        ],
        regression_weight=regression_weight(body.sex, body.stature, body.mass),
        density_kg_m3=densities[-1].density,
        density_references={name: str(one) for name, one in DENSITY_REFERENCES.items()},
        dimensions=[
            DimensionData(one.name, one.value, one.expected, one.standard_error, one.is_measured)
            for one in body.dimensions.values()
        ],
        springs=made.springs_file and {origin.value: curves[origin] for origin in _ORIGINS},
        warnings=notices,
        files=[file for model in models for file in model.contents],
        leg=_leg_sentence(springs, datum),
        from_markers={} if trial is None else trial.markers,
        made=made,
        densities=densities,
        output=output,
        diagnostics=(*(parsed.diagnostics if parsed else ()), *map(warning, notices)),
    )


def _read_trial(
    path: Path | None, choices: Sequence[str], up: str, sex: Sex, mass: float, stature: float | None
) -> "StaticMeasures | None":
    """Return the measures of a static trial; None without one."""
    if path is None:
        if choices:
            raise UsageError("--marker says what the markers of --markers STATIC.trc are on")
        return None
    from generator.inverse.markers import read_markers  # no other person needs markers
    from generator.inverse.static_trial import measure_static_trial

    if up not in ("y", "z"):
        raise UsageError(f"--up {up}: y or z points up")
    names: dict[str, str] = {}
    for choice in choices:
        landmark, equals, name = (part.strip() for part in choice.partition("="))
        if not (landmark and equals and name):
            raise UsageError(f"--marker {choice}: expected LANDMARK=NAME, such as left_knee=LKNE")
        names[landmark] = name
    try:
        return measure_static_trial(read_markers(path, up), sex, mass, stature, names, up)
    except UsageError as failure:
        raise UsageError(f"{path}: {failure}") from None


def _measures(
    sex: Sex,
    stature: float,
    mass: float,
    stated: MeasuredDimensions | None,
    trial: "StaticMeasures | None",
    markers: Path | None,
) -> Measures:
    """Return the measures of a person; dimensions of a file come before those of markers."""
    if trial is None:
        return estimate_measures(sex, stature, mass, stated)
    try:
        if stated is None:
            return estimate_measures(sex, stature, mass, trial.lengths)
        lengths = {**trial.lengths, **stated.lengths}
        own = MeasuredDimensions(lengths, stated.units, stated.spans)
        return estimate_measures(sex, stature, mass, own)
    except UsageError as failure:
        more = f"\n{trial.hint}" if trial.hint else ""
        raise UsageError(f"{markers}: {failure}{more}") from None


def _mass_sentence(weight: float) -> str:
    """Return a sentence on the rules of the masses."""
    regressions = "regressions of Zatsiorsky 2002 on mass and stature"
    if weight == 0.0:
        return "masses: percentages of de Leva 1996"
    if weight == 1.0:
        return f"masses: {regressions}"
    return f"masses: {weight:.2f} of {regressions}, the rest percentages of de Leva 1996"


def _leg_sentence(springs: PersonSprings, hip_datum: float) -> str:
    """Return a sentence on the law of the legs; "" without springs."""
    match springs:
        case PersonSprings.NONE:
            return ""
        case PersonSprings.RIENER:
            return "hip and knee have one law, of Riener & Edrich 1999"
        case _:
            is_former = springs is PersonSprings.COUPLED
            start = "coupled is the default: " if is_former else ""
            return (
                f"{start}hip, knee and ankle have one law, of Silder et al. 2007, in which an "
                f"upright hip is at {degrees(hip_datum):g} deg"
            )


def _check_files(model: ModelFiles, measures: Path | None) -> None:
    """Raise InputError for files that cannot be written, or springs that are not of a person."""
    beside = [file for file in model.contents if file.parent == model.path.parent]
    check_writable(beside, [measures])
    titles = {
        springs_path(model.path): ("springs", springs_title),
        springs_path(model.path, RIENER_SPRINGS): ("springs", springs_title),
        CONTACT_FILE.beside(model.path): ("parts", contact_title),
    }
    errors = [
        error(
            f"`{path}` exists with other {what} and would be replaced",
            hint="move it, or write another figure",
        )
        for path, (what, title) in titles.items()
        if path in model.contents
        and path.exists()
        and not _may_be_replaced(path, title(model.path))
    ]
    if errors:
        raise InputError(errors)


def _may_be_replaced(path: Path, title: str) -> bool:
    """Return whether this command made a file, and for the figure in its title.

    The springs of `me.riener.fig` are where the other ones of `me.fig` are.
    """
    with path.open(encoding="utf-8", errors="replace") as file:
        first = file.readline(1000).rstrip("\n")
    return first.startswith(f"# {title}, ") and first.endswith(MADE_BY)
