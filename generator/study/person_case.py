"""Figure and springs of a person in memory, as `mover person` writes them."""

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from generator.diagnostics import UsageError
from generator.figure import Figure
from generator.person.measures import estimate_measures
from generator.person.person import build_person
from generator.person.person_files import COUPLED_SPRINGS
from generator.springs_file.parse import SPRINGS_SUFFIX
from generator.springs_file.read import load_springs
from generator.springs_file.write import write_springs
from generator.study.study import PersonArguments
from springs import Joining, SpringSet

PERSON_SPRINGS = ("published", COUPLED_SPRINGS, "none")
"""Choices of the springs of a person."""

_STEM = "person"


def person_case(
    person: PersonArguments,
    measured: Mapping[str, float] | None = None,
    joining: Joining | None = None,
) -> tuple[Figure, SpringSet]:
    """Return the figure of a person and its springs; without springs its limits stay.

    Args:
        person: the arguments.
        measured: dimensions by name [m].
        joining: law of its spherical joints.

    Raises UsageError for an impossible person, and for unknown springs.
    """
    if person.springs not in PERSON_SPRINGS:
        known = ", ".join(PERSON_SPRINGS)
        raise UsageError(f"springs of a person cannot be `{person.springs}`; one of {known}")
    measures = estimate_measures(person.sex, person.stature, person.mass, measured)
    made = build_person(measures, springs=person.springs != "none")
    if made.springs is None or made.coupled_springs is None:
        return made.figure, load_springs(made.figure, joining=joining).require_value().springs
    files = {Path(f"{_STEM}{SPRINGS_SUFFIX}"): made.springs}
    if person.springs == COUPLED_SPRINGS:  # these extend the others
        files[Path(f"{_STEM}.{COUPLED_SPRINGS}{SPRINGS_SUFFIX}")] = made.coupled_springs
    with TemporaryDirectory() as folder:
        for file, springs in files.items():
            (Path(folder) / file).write_text(write_springs(springs), "utf-8")
        choice = person.springs if person.springs == COUPLED_SPRINGS else None
        parsed = load_springs(made.figure, Path(folder), _STEM, choice, joining)
    return made.figure, parsed.require_value().springs
