"""Measures of a person: sex, stature, mass, and the dimensions that follow or were measured.

A dimension is the value expected of the person's sex, stature and mass (`survey`), or the measured
one. Other dimensions of the body follow the measured ones:

- those of one level (chest, waist, hip, head, hand, foot, ...) by the mean ratio of measured to
  expected values;
- heights of the leg so that the distances between measured heights are divided as expected, and
  those above the last measured one by its ratio;
- heights of the trunk so that they divide the distance from the trochanterion to the cervicale as
  expected. The cervicale and the stature stay where they are.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from math import hypot, isfinite, prod
from typing import Any

from generator.diagnostics import (
    Diagnostics,
    InputError,
    NamedMapping,
    Source,
    Span,
    UsageError,
    closest_match,
    shorten,
)
from generator.file_kind import FileKind
from generator.person.sources import Origin, SourcedNumber
from generator.person.survey import Sex, SurveySample, survey
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import Number
from generator.units import parse_unit
from springs.published.reference import Reference
from springs.short_repr import short_repr

MIN_STATURE, MAX_STATURE = 0.4, 3.0
"""Statures beyond these are mistakes [m]."""

MIN_MASS_INDEX, MAX_MASS_INDEX = 8.0, 100.0
"""Masses over squared statures beyond these are mistakes [kg/m2].

The body of a man of 1.75 m at the larger one has 1193 kg/m3, more than any tissue but bone.
"""

MAX_ERRORS = 3.0
"""Standard errors of the regression beyond which a measured dimension gets a warning."""

MIN_RATIO, MAX_RATIO = 0.4, 2.5
"""Ratios of a measured dimension to the expected one beyond which it is a mistake."""

LENGTH_UNITS = ("mm", "cm", "m", "in", "ft")
"""Units in which the keys of a file of measured dimensions may end."""

MAX_DIMENSION = 3.0
"""Largest dimension in a file [m]."""

_FILE_KIND = "measures file"
_EXAMPLE = "write `waist_circumference_cm = 94`, for example"
_KEY = re.compile(rf"(.+)_({'|'.join(LENGTH_UNITS)})", re.DOTALL)
_OPTIONS: Mapping[str, str] = {
    "sex": "sex",
    "stature": "stature",
    "height": "stature",
    "mass": "mass",
    "weight": "mass",
}
"""Options of the command for what a newcomer may write into the file."""

_SYNONYMS: Mapping[str, str] = {"girth": "circumference", "width": "breadth"}
"""Words that a newcomer may use instead of those of the survey."""

_LIKELY_RATIOS = (0.7, 1.4)
"""Ratios of a dimension to the expected one for which another unit is suggested."""

_GIRTH_TOLERANCE = 1.1
"""Factor by which a circumference may miss the bounds that breadth and depth set: the survey
measured them at slightly different heights and breaths."""

_MIN_DEPTH_RATIO, _MAX_DEPTH_RATIO = 0.4, 1.6
"""Depth of the trunk over its breadth."""

_LEG_LEVEL, _TRUNK_LEVEL = "leg", "trunk"
_TROCHANTERION, _CERVICALE = "trochanterion_height", "cervicale_height"

_ASCENDING = (
    ("tibial_height", "lateral_femoral_epicondyle_height"),
    ("lateral_femoral_epicondyle_height", "crotch_height"),
    ("crotch_height", "trochanterion_height"),
    ("trochanterion_height", "iliocristale_height"),
    ("trochanterion_height", "waist_height"),
    ("iliocristale_height", "suprasternale_height"),
    ("waist_height", "suprasternale_height"),
    ("iliocristale_height", "acromial_height"),
    ("suprasternale_height", "cervicale_height"),
    ("acromial_height", "cervicale_height"),
    ("biacromial_breadth", "bideltoid_breadth"),
    ("bicristal_breadth", "hip_breadth"),
    ("palm_length", "hand_length"),
    ("hand_breadth", "hand_length"),
    ("ball_of_foot_length", "foot_length"),
    ("heel_breadth", "foot_length"),
    ("tragion_to_top_of_head", "head_length"),
)
"""Pairs of which the second is the larger one in every person."""

_PARTS_OF_STATURE = (
    ("lateral_malleolus_height", "tibial_height"),
    ("tibial_height", "trochanterion_height"),
    ("trochanterion_height", "cervicale_height"),
    ("waist_height", "cervicale_height"),
    ("cervicale_height", "stature"),
)
"""Ends of the shank, the thigh, the trunk, the chest, and the head with the neck."""

_MIN_PART_RATIO, _MAX_PART_RATIO = 0.6, 1.6
"""Ratios of a part of the stature to the expected one beyond which a height is a mistake."""

_TOP_OF_CHEST = ("suprasternale_height", "acromial_height")
"""Heights that are little below the cervicale."""

_LEVELS_OF_GIRTH = (
    ("chest_breadth", "chest_depth", "chest_circumference"),
    ("waist_breadth", "waist_depth", "waist_circumference"),
    ("hip_breadth", "buttock_depth", "buttock_circumference"),
)


@short_repr
@dataclass(frozen=True)
class BodyDimension:
    """A dimension of the body.

    Attributes:
        name: name of ANSUR II, in words joined by "_" ("chest_breadth",
            "lateral_malleolus_height").
        value: [m].
        expected: expected of the person's sex, stature and mass [m].
        standard_error: standard error of the expected value [m].
        is_measured: whether the user stated the value.
    """

    name: str
    value: float
    expected: float
    standard_error: float
    is_measured: bool = False

    @property
    def ratio(self) -> float:
        """Value over the expected one; 1 unless it, or one that it follows, was measured."""
        return self.value / self.expected


@dataclass(frozen=True, eq=False)
class MeasuredDimensions(Mapping[str, float]):
    """Dimensions of a measures file [m], by name, with their places.

    Attributes:
        lengths: lengths by name [m].
        units: units of the file's keys, by name.
        spans: spans of the file's values, by name.
    """

    lengths: Mapping[str, float]
    units: Mapping[str, str] = field(default_factory=dict[str, str], repr=False)
    spans: Mapping[str, Span] = field(default_factory=dict[str, Span], repr=False)

    def __getitem__(self, name: str) -> float:
        """The dimension [m]."""
        return self.lengths[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self.lengths)

    def __len__(self) -> int:
        """Number of the dimensions."""
        return len(self.lengths)


@short_repr
@dataclass(frozen=True)
class Measures:
    """Measures of a person.

    Attributes:
        sex: sex of the samples that are used.
        stature: [m].
        mass: [kg].
        dimensions: dimensions by their names; every dimension of ANSUR II that is used.
        warnings: sentences on measures outside the samples.
    """

    sex: Sex
    stature: float
    mass: float
    dimensions: Mapping[str, BodyDimension]
    warnings: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        """Make unknown names state the nearest one."""
        dimensions = NamedMapping(self.dimensions, "a person has no dimension")
        object.__setattr__(self, "dimensions", dimensions)

    def length(self, name: str) -> float:
        """Value of a dimension [m]. Raises UnknownNameError."""
        return self.dimensions[name].value

    def ratio(self, name: str) -> float:
        """Ratio of a dimension to the expected one; 1 without measured ones that it follows."""
        return self.dimensions[name].ratio


def estimate_measures(
    sex: Sex, stature: float, mass: float, measured: Mapping[str, float] | None = None
) -> Measures:
    """Estimate all dimensions of a person.

    Args:
        sex: sex of the sample.
        stature: [m].
        mass: [kg].
        measured: dimensions by name [m], as `MEASURES_FILE.read` returns them.

    Raises:
        UsageError: for an impossible stature or mass, and for measured dimensions that are unknown,
            impossible, or contradict each other.
        InputError: instead of it for the dimensions of a file, with their places.
    """
    measured = measured or {}
    _check_person(stature, mass)
    expected = {name: survey().expected(name, sex, stature, mass) for name in survey().dimensions}
    _raise_problems(_find_impossible(measured, expected), measured)
    usual = {name: value for name, (value, _) in expected.items()}
    values = _follow(usual, measured, stature)
    _raise_problems(_find_contradictions(values, usual, measured, stature), measured)
    dimensions = {
        name: BodyDimension(name, values[name], *expected[name], name in measured)
        for name in expected
    }
    warnings = (
        *_sample_warnings(sex, stature, mass),
        *_dimension_warnings(dimensions[name] for name in measured),
    )
    return Measures(sex, stature, mass, dimensions, warnings)


def _check_person(stature: float, mass: float) -> None:
    """Raise UsageError for an impossible stature or mass."""
    least, largest = MIN_STATURE, MAX_STATURE
    if not least <= stature <= largest:
        meant = _intended(stature, least, largest, (0.01, 0.001), "m")
        raise UsageError(
            f"a stature of {stature:g} m is impossible; "
            f"it must be from {least:g} m to {largest:g} m{meant}"
        )
    least, largest = MIN_MASS_INDEX * stature**2, MAX_MASS_INDEX * stature**2
    if not least <= mass <= largest:
        meant = _intended(mass, least, largest, (0.1, 10.0, 0.001), "kg")
        raise UsageError(
            f"a mass of {mass:g} kg is impossible at a stature of {stature:g} m; "
            f"it must be from {least:.1f} kg to {largest:.1f} kg{meant}"
        )


def _intended(
    value: float, least: float, largest: float, factors: Iterable[float], unit: str
) -> str:
    """Ask for the first multiple of a value within bounds; "" without one."""
    found = (factor * value for factor in factors if least <= factor * value <= largest)
    return next((f"; did you mean {one:g} {unit}?" for one in found), "")


@dataclass(frozen=True)
class _Problem:
    """A sentence on a measured dimension, and a hint."""

    name: str
    message: str
    hint: str


def _raise_problems(problems: Iterable[_Problem], measured: Mapping[str, float]) -> None:
    """Raise all problems at once, if there are any."""
    problems = list(problems)
    # An estimated dimension contradicts another one only because of a measured one.
    problems = [problem for problem in problems if problem.name in measured] or problems
    if problems and isinstance(measured, MeasuredDimensions):
        diagnostics = Diagnostics()
        first = next(iter(measured.spans.values()), None)
        for problem in problems:
            span = measured.spans.get(problem.name, first)
            diagnostics.error(problem.message, span, problem.hint)
        raise InputError(diagnostics.sorted_by_position())
    sentences = [f"{problem.message}; {problem.hint}" for problem in problems]
    if sentences:
        raise UsageError("\n".join(sentences))


def _find_impossible(
    measured: Mapping[str, float], expected: Mapping[str, tuple[float, float]]
) -> Iterator[_Problem]:
    """Yield unknown names and impossible values."""
    for name, value in measured.items():
        if name not in expected:
            message = f"a person has no dimension `{shorten(name)}`"
            yield _Problem(name, message, _suggest_dimension(name))
            continue
        least, largest = (ratio * expected[name][0] for ratio in (MIN_RATIO, MAX_RATIO))
        if not (isfinite(value) and least <= value <= largest):
            hint = f"from {least:.3g} m to {largest:.3g} m at this stature and mass"
            unit = _suggest_unit(name, expected[name][0], measured)
            if unit is not None:
                hint = f"did you mean `{name}_{unit}`?"
            yield _Problem(name, f"`{name}` cannot be {value:.4g} m", hint)


def _suggest_unit(name: str, expected: float, measured: Mapping[str, float]) -> str | None:
    """Return the unit in which a number of a file would be likely."""
    if not isinstance(measured, MeasuredDimensions) or name not in measured.units:
        return None
    number = measured[name] / float(parse_unit(measured.units[name]).factor)
    least, largest = (ratio * expected for ratio in _LIKELY_RATIOS)
    factors = {unit: float(parse_unit(unit).factor) for unit in LENGTH_UNITS}
    likely = (unit for unit in LENGTH_UNITS if least <= number * factors[unit] <= largest)
    return next(likely, None)


def _follow(
    expected: Mapping[str, float], measured: Mapping[str, float], stature: float
) -> dict[str, float]:
    """All dimensions [m]: those measured, and the others as expected or following them."""
    values = {**expected, **measured}
    levels: dict[str, list[str]] = {}
    for row in survey().dimensions.values():
        if row.level:
            levels.setdefault(row.level, []).append(row.name)
    for level, names in levels.items():
        known = [name for name in names if name in measured]
        others = [name for name in names if name not in measured]
        if level in (_LEG_LEVEL, _TRUNK_LEVEL):
            if level == _TRUNK_LEVEL:
                # The legs have been changed before: rows of the survey run upwards.
                known = [_TROCHANTERION, *known]
                if _CERVICALE in others:
                    others.remove(_CERVICALE)
                    known.append(_CERVICALE)
            anchors = [(expected[name], values[name]) for name in known]
            if all(old == new for old, new in anchors):
                continue
            anchors = [(0.0, 0.0), *sorted(anchors)]
            if level == _TRUNK_LEVEL:
                anchors.append((stature, stature))
            for name in others:
                values[name] = _interpolate(expected[name], anchors)
        elif known:
            ratio = prod(measured[name] / expected[name] for name in known) ** (1 / len(known))
            for name in others:
                values[name] = ratio * expected[name]
    return values


def _interpolate(height: float, anchors: list[tuple[float, float]]) -> float:
    """New height of a point, from pairs of expected and new heights that begin with (0, 0)."""
    for (old, new), (next_old, next_new) in pairwise(anchors):
        if height < next_old:
            return new + (height - old) * (next_new - new) / (next_old - old)
    last_old, last_new = anchors[-1]
    return height * last_new / last_old


def _find_contradictions(
    values: Mapping[str, float],
    expected: Mapping[str, float],
    measured: Mapping[str, float],
    stature: float,
) -> Iterator[_Problem]:
    """Yield contradictions between dimensions, one of which at least is measured."""
    if not measured:
        return
    values, expected = ({**one, "stature": stature} for one in (values, expected))

    def quote(name: str) -> str:
        note = ", estimated" if name in survey().dimensions and name not in measured else ""
        return f"`{name}` ({values[name]:.4g} m{note})"

    def culprit(*names: str) -> str:
        return next((name for name in reversed(names) if name in measured), names[0])

    for small, large in _ASCENDING:
        if values[small] >= values[large]:
            message = f"{quote(small)} must be smaller than {quote(large)}"
            yield _Problem(culprit(small, large), message, "one of them is wrong")
    for low, high in _PARTS_OF_STATURE:
        usual, distance = expected[high] - expected[low], values[high] - values[low]
        least, largest = _MIN_PART_RATIO * usual, _MAX_PART_RATIO * usual
        if not least <= distance <= largest:
            message = f"{quote(low)} does not fit {quote(high)}"
            hint = f"the distance is from {least:.3g} m to {largest:.3g} m"
            yield _Problem(culprit(low, high), message, hint)
    top = values[_CERVICALE]
    chest_ratio = (top - values["waist_height"]) / (expected[_CERVICALE] - expected["waist_height"])
    for name in _TOP_OF_CHEST:
        largest = MAX_RATIO * chest_ratio * (expected[_CERVICALE] - expected[name])
        if top - values[name] > largest:
            message = f"{quote(name)} is too far below {quote(_CERVICALE)}"
            hint = f"the distance is at most {largest:.3g} m"
            yield _Problem(culprit(_CERVICALE, name), message, hint)
    arm = ("acromion_radiale_length", "radiale_stylion_length", "hand_length")
    length = sum(values[name] for name in arm)
    if length >= values["acromial_height"]:
        message = f"an arm of {length:.3g} m reaches the floor from {quote('acromial_height')}"
        yield _Problem(culprit("acromial_height", *arm), message, "one of them is wrong")
    for breadth, depth, girth in _LEVELS_OF_GIRTH:
        b, d = values[breadth], values[depth]
        if not _MIN_DEPTH_RATIO * b <= d <= _MAX_DEPTH_RATIO * b:
            message = f"{quote(depth)} does not fit {quote(breadth)}"
            hint = f"the depth is from {_MIN_DEPTH_RATIO * b:.3g} m to {_MAX_DEPTH_RATIO * b:.3g} m"
            yield _Problem(culprit(breadth, depth), message, hint)
        # A closed convex curve that touches all sides of a rectangle is at least as long as its
        # diamond, and no longer than the rectangle itself.
        least, largest = 2 * hypot(b, d) / _GIRTH_TOLERANCE, 2 * (b + d) * _GIRTH_TOLERANCE
        if not least <= values[girth] <= largest:
            message = f"{quote(girth)} does not fit {quote(breadth)} and {quote(depth)}"
            hint = f"the circumference is from {least:.3g} m to {largest:.3g} m"
            yield _Problem(culprit(breadth, depth, girth), message, hint)


def _sample_warnings(sex: Sex, stature: float, mass: float) -> Iterator[str]:
    sample = survey().samples[sex]
    for noun, value, spread, unit in (
        ("stature", stature, sample.stature, "m"),
        ("mass", mass, sample.mass, "kg"),
    ):
        lower, upper = spread.limits
        if not lower <= value <= upper:
            yield (
                f"a {noun} of {value:g} {unit} is beyond {lower:.3g} to {upper:.3g} {unit}, "
                f"two standard deviations of {describe_sample(sex, sample)}; "
                "dimensions are extrapolated"
            )


def describe_sample(sex: Sex, sample: SurveySample) -> str:
    """The people of one sex who were measured, in words."""
    return f"{sample.subjects} {'men' if sex is Sex.MALE else 'women'} of the US Army"


def _dimension_warnings(dimensions: Iterable[BodyDimension]) -> Iterator[str]:
    for one in dimensions:
        errors = (one.value - one.expected) / one.standard_error
        if abs(errors) > MAX_ERRORS:
            yield (
                f"`{one.name}` of {one.value:.4g} m is {abs(errors):.1f} standard errors "
                f"{'above' if errors > 0 else 'below'} the {one.expected:.4g} m "
                "expected of this sex, stature and mass"
            )


def measure_sources(measures: Measures) -> tuple[SourcedNumber, ...]:
    """Sources of stature, mass and all dimensions."""
    sex, sample = measures.sex, survey().samples[measures.sex]
    cited = survey().reference
    place = f"regression computed from the public rows of {describe_sample(sex, sample)}"
    reference = Reference(cited.text, cited.sureness, cited.doi, place)
    is_scaled = bool(tuple(_sample_warnings(sex, measures.stature, measures.mass)))
    sources = [
        SourcedNumber("person", "stature", measures.stature, "m", Origin.STATED),
        SourcedNumber("person", "mass", measures.mass, "kg", Origin.STATED),
    ]
    for name, one in measures.dimensions.items():
        row = survey().dimensions[name]
        origin, rule = Origin.PUBLISHED, f"regression {row.fits[sex]}"
        if is_scaled:
            origin, rule = Origin.SCALED, f"{rule}; beyond the sample as a {row.scaling.value}"
        if one.is_measured:
            origin, rule = Origin.STATED, ""
        elif one.value != one.expected:
            origin, rule = Origin.SCALED, f"{rule}; times {one.ratio:.4g} as measured ones near it"
        quantity = name.replace("_", " ")
        cited = None if one.is_measured else reference
        sources.append(SourcedNumber("person", quantity, one.value, "m", origin, cited, rule))
    return tuple(sources)


def _parse_measures(source: Source, diagnostics: Diagnostics) -> MeasuredDimensions | None:
    """Dimensions of a text; errors go to `diagnostics`, which may raise TooManyErrors."""
    table = parse_document(source, _FILE_KIND, diagnostics)
    if table is None:
        return None
    if not table.content:
        diagnostics.error("the file states no dimension", table.spans.table(""), _EXAMPLE)
    lengths: dict[str, float] = {}
    units: dict[str, str] = {}
    for key in table.content:
        parsed = _parse_key(table, key)
        length = Number(key, 0.0, MAX_DIMENSION, " m", "it is a length", is_positive=True)
        value = None if parsed is None else length.read(table)
        if parsed is None or value is None:
            continue
        name, unit = parsed
        if name in lengths:
            first = table.spans.key("", 0, f"{name}_{units[name]}")
            hint = f"the first is in line {first.line}"
            diagnostics.error(f"a second value of `{name}`", table.spans.key("", 0, key), hint)
            continue
        lengths[name], units[name] = value, unit
    places = {name: table.span(f"{name}_{unit}") for name, unit in units.items()}
    return MeasuredDimensions(lengths, units, places)


MEASURES_FILE = FileKind("measured dimensions", ".toml", _parse_measures)


def _parse_key(table: TableReader, key: str) -> tuple[str, str] | None:
    """Name and unit of a key; None, with an error noted, if one of them is wrong."""
    match = _KEY.fullmatch(key)
    name, unit = (key, "") if match is None else (match[1], match[2])
    known, shown = survey().dimensions, shorten(key)
    if unit and name in known:
        return name, unit
    content: Any = table.content[key]
    if isinstance(content, dict):
        message, hint = f"unknown table `{shown}`", f"{_EXAMPLE}, without a header"
    elif name in survey().validation:
        message = f"`{name}` does not change a person"
        hint = "it is only compared with that of a finished person; leave it out"
    elif key.partition("_")[0] in _OPTIONS and name.count("_") <= 1:
        message = f"`{shown}` is not a dimension of this file"
        hint = f"it is an option of the command: `--{_OPTIONS[key.partition('_')[0]]}`"
    elif (whole := _longest_known_prefix(key)) is not None:
        message = f"`{shown}` does not end in a unit of length"
        hint = f"write `{whole}_cm`; the units are {', '.join(LENGTH_UNITS)}"
    else:
        message, hint = f"unknown dimension `{shown}`", _suggest_dimension(name, unit or "cm")
    table.diagnostics.error(message, table.spans.key("", 0, key), hint)
    return None


def _suggest_dimension(name: str, unit: str = "") -> str:
    """Hint for an unknown dimension: those with its only word, or the nearest name."""
    known = survey().dimensions
    for word, usual in _SYNONYMS.items():
        name = name.replace(word, usual)
    near = [other for other in known if name in other.split("_")]
    if not near:
        match = closest_match(name, known)
        near = [] if match is None else [match]
    if not near:
        return "docs/person.md lists the names"
    listed = ", ".join(f"`{other}{'_' if unit else ''}{unit}`" for other in near)
    return f"did you mean {listed}?" if len(near) == 1 else f"one of {listed}"


def _longest_known_prefix(key: str) -> str | None:
    """Name of a dimension that a key is, or begins with before "_"."""
    found = (name for name in survey().dimensions if f"{key}_".startswith(f"{name}_"))
    return max(found, key=len, default=None)
