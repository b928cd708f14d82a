"""Writer of springs files, the inverse of the reader."""

from collections.abc import Iterator

from generator.springs_file.coupled import NEAREST_CONSERVATIVE, CoupledEntry
from generator.springs_file.laws import HYSTERESIS_KEY, MEASURED_KEY, SLIP_RATE_KEY, write_law
from generator.springs_file.parse import (
    BASE_KEY,
    COUPLED_TABLE,
    EXTENDS_KEY,
    NO_BASE,
    SPRING_TABLE,
    SpringEntry,
    SpringsFile,
)
from generator.springs_file.published import PUBLISHED_KEY
from generator.toml_file.reader import MAX_LINE_LENGTH
from generator.toml_file.writer import (
    degree_to_toml,
    degrees_to_toml,
    list_to_toml,
    names_to_toml,
    number_to_toml,
    numbers_to_toml,
    quote_long_toml,
    quote_toml,
)
from springs.coupled import CoupledExponential
from springs.damping import DEFAULT_SLIP_RATE
from springs.stop import DEFAULT_STOP_ONSET, DEFAULT_STOP_STIFFNESS


def write_springs(content: SpringsFile, comment: str = "") -> str:
    """Return the text of a springs file; reading it returns equal springs, bit for bit.

    Args:
        content: springs to write.
        comment: one or more lines above them.

    Raises:
        ValueError: for a number that is not finite, a line that is too long, or a law that no key
            holds.
    """
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    lines += [""] if lines else []
    if content.figure is not None:
        lines.append(f"figure = {quote_toml(content.figure)}")
    if content.extends is not None:
        lines.append(f"{EXTENDS_KEY} = {quote_toml(content.extends)}")
    if content.stands_alone:
        lines.append(f"{BASE_KEY} = {quote_toml(NO_BASE)}")
    if content.joining is not None:
        lines.append(f"law = {quote_toml(content.joining.value)}")
    tables = [(SPRING_TABLE, _entry(entry)) for entry in content.entries]
    tables += [(COUPLED_TABLE, _coupled_entry(entry)) for entry in content.coupled]
    for name, content_lines in tables:
        lines += [*([""] if lines and lines[-1] else []), f"[[{name}]]", *content_lines]
    text = "\n".join([*lines, ""])
    if any(len(line) > MAX_LINE_LENGTH for line in text.split("\n")):
        raise ValueError(f"a line of a springs file has at most {MAX_LINE_LENGTH} characters")
    return text


def _entry(entry: SpringEntry) -> Iterator[str]:
    yield f"joints = {names_to_toml(entry.joints)}"
    yield f"axis = {quote_toml(entry.axis or 'joint')}"
    if entry.motion:
        yield f"motion = {quote_toml(entry.motion)}"
    if entry.law is not None:
        yield from write_law(entry.law)
    if entry.scale != 1.0:
        yield f"scale = {number_to_toml(entry.scale)}"
    if entry.offset:
        yield f"offset_deg = {degree_to_toml(entry.offset)}"
    if entry.hysteresis:
        yield f"{HYSTERESIS_KEY} = {number_to_toml(entry.hysteresis)}"
    if entry.slip_rate != DEFAULT_SLIP_RATE:
        yield f"{SLIP_RATE_KEY} = {number_to_toml(entry.slip_rate)}"
    if entry.damping is not None:
        yield f"viscous_Nms_rad = {number_to_toml(entry.damping.viscous)}"
    if entry.damping is not None and entry.damping.coulomb:
        yield f"coulomb_Nm = {number_to_toml(entry.damping.coulomb)}"
    if entry.stop_stiffness != DEFAULT_STOP_STIFFNESS:
        yield f"stop_stiffness_Nm_rad = {number_to_toml(entry.stop_stiffness)}"
    if entry.stop_onset != DEFAULT_STOP_ONSET:
        yield f"stop_onset_deg = {degree_to_toml(entry.stop_onset)}"
    yield from _provenance_lines(entry)


def _provenance_lines(entry: SpringEntry | CoupledEntry) -> Iterator[str]:
    for key, text in (("reference", entry.reference), ("why", entry.why)):
        if text:
            yield f"{key} = {quote_long_toml(text)}"


def _coupled_entry(entry: CoupledEntry) -> Iterator[str]:
    sides = [names_to_toml(side) for side in entry.joints]
    yield f"joints = {sides[0] if len(sides) == 1 else list_to_toml(sides)}"
    if any(axis is not None for axis in entry.axes):
        yield f"axes = {names_to_toml(axis or 'joint' for axis in entry.axes)}"
    if any(sense != 1 for sense in entry.senses):
        yield f"senses = [{', '.join(f'{sense:+d}' for sense in entry.senses)}]"
    yield f"coordinates = {names_to_toml(entry.coordinates)}"
    if entry.published is not None:
        yield f"{PUBLISHED_KEY} = {quote_toml(entry.published)}"
    if entry.held_angles:
        yield f"held = {names_to_toml(name for name, _ in entry.held_angles)}"
        yield f"held_deg = {degrees_to_toml(angle for _, angle in entry.held_angles)}"
    if entry.explicit_law is not None:
        yield from _explicit_law(entry.explicit_law)
    if entry.is_nearest_conservative:
        yield f"conservative = {quote_toml(NEAREST_CONSERVATIVE)}"
    if entry.scale != 1.0:
        yield f"scale = {number_to_toml(entry.scale)}"
    if any(entry.offsets):
        yield f"offsets_deg = {degrees_to_toml(entry.offsets)}"
    yield from _provenance_lines(entry)


def _explicit_law(law: CoupledExponential) -> Iterator[str]:
    """A coupled law in numbers."""
    terms: list[str] = []
    for term in law.terms:
        exponent = f", exponent = {number_to_toml(term.exponent)}" if term.exponent else ""
        amplitudes, rates = numbers_to_toml(term.amplitudes), numbers_to_toml(term.rates)
        terms.append(f"{{ amplitudes_Nm = {amplitudes}, rates_1_rad = {rates}{exponent} }}")
    yield f"terms = {list_to_toml(terms)}"
    if any(law.constants):
        yield f"constants_Nm = {numbers_to_toml(law.constants)}"
    known = [one for one in law.valid_ranges if one is not None]
    if known and len(known) < len(law.valid_ranges):
        raise ValueError("a springs file knows the ranges of all coordinates or of none")
    if known:
        yield f"{MEASURED_KEY} = {list_to_toml(map(degrees_to_toml, known))}"
