"""Reading a pose: displacements of the joints of a figure, in the figure's own language.

    file  := joint*
    joint := "joint" NAME "{" "displacement" "=" value ";" "}"

A joint that is not named stays as the figure has it. What else a figure file says of a joint has no
place in a pose.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from generator.diagnostics import (
    EnoughFaults,
    Fault,
    Findings,
    InputError,
    Source,
    Span,
    nearest,
    shorten,
)
from generator.figure import Figure, Joint
from generator.figure_file.lexer import known_in
from generator.figure_file.parser import Block, Connect, Field, Statement, Word, parse_fragment
from generator.figure_file.resolve import per_axis
from generator.figure_file.values import bound_of
from generator.rotations import Array
from generator.text_io import read_text, unified

POSE_SUFFIX = ".pose"

EXAMPLE = "`joint NAME { displacement = (30deg); }`"

_FIELD = "displacement"


@dataclass(frozen=True)
class PoseReading:
    """What came of reading a pose.

    `displacements` [rad or m] is None when `faults` holds an error, else it has the joints that the
    file names, shape (n,) each.
    """

    displacements: Mapping[str, Array] | None
    faults: tuple[Fault, ...]


def read_pose(path: str | Path, figure: Figure) -> dict[str, Array]:
    """The displacements that a pose file gives the joints of a figure, shape (n,) [rad or m].

    Raises InputError, which holds all faults, when anything is wrong. Warnings pass.
    """
    reading = examine_pose(path, figure)
    if reading.displacements is None:
        raise InputError(reading.faults)
    return dict(reading.displacements)


def examine_pose(path: str | Path, figure: Figure) -> PoseReading:
    """The pose in a file, with all faults; bad input raises nothing."""
    source, fault = read_text(Path(path), str(path))
    return PoseReading(None, (fault,)) if fault is not None else _read(source, figure)


def parse_pose(text: str, figure: Figure, name: str = "<text>") -> PoseReading:
    """The pose that `text` describes, with all faults; `name` is what they call the text."""
    return _read(Source(name, unified(text)), figure)


def _read(source: Source, figure: Figure) -> PoseReading:
    findings, found = Findings(), dict[str, Array]()
    with suppress(EnoughFaults):
        _resolve(parse_fragment(source, findings), figure, found, findings)
    displacements = None if findings.has_errors else found
    return PoseReading(displacements, findings.in_order())


def _resolve(tree: Block, figure: Figure, found: dict[str, Array], findings: Findings) -> None:
    """Put what the statements say into `found`."""
    if not tree.body and not findings.malformed and figure.degrees_of_freedom:
        hint = f"a joint of a pose is written {EXAMPLE}"
        findings.error("there is no joint in this pose", tree.kind.span, hint)
    first: dict[str, Span] = {}
    for statement in tree.body:
        name = _joint_name(statement, findings)
        if name is None or not isinstance(statement, Block):
            continue
        if name.text in first:
            hint = f"the first stands in line {first[name.text].line}"
            findings.error(f"a second joint named `{shorten(name.text)}`", name.span, hint)
            continue
        first[name.text] = name.span
        joint = figure.joints.get(name.text)
        if joint is None:
            hint = nearest(name.text, figure.joints)
            findings.error(f"the figure has no joint `{shorten(name.text)}`", name.span, hint)
            continue
        values = _displacement(statement, joint, findings)
        if values is not None:
            found[joint.name] = values


def _joint_name(statement: Statement, findings: Findings) -> Word | None:
    """The name of a block that is a joint; what else stands in the file is a fault."""
    if isinstance(statement, Block) and statement.kind.text == "joint":
        return statement.name
    word = statement.kind if isinstance(statement, Block) else statement.name
    hint = f"it holds joints only: {EXAMPLE}"
    findings.error(f"`{shorten(word.text)}` has no place in a pose", word.span, hint)
    return None


def _displacement(block: Block, joint: Joint, findings: Findings) -> Array | None:
    """The displacements in a joint's block; None, with a fault noted, when they are not there."""
    given: list[Field] = []
    others = False
    for statement in block.body:
        if isinstance(statement, Field) and statement.name.text == _FIELD:
            given.append(statement)
            continue
        others = True
        if isinstance(statement, Field | Connect):
            _misplaced(statement.name, findings)
    for second in given[1:]:
        hint = f"the first stands in line {given[0].name.span.line}"
        findings.error(f"a second `{_FIELD}` in one joint", second.name.span, hint)
    if not given:
        if not others and not findings.malformed and block.name is not None:
            message = f"joint `{shorten(joint.name)}` has no `{_FIELD}` here"
            findings.error(message, block.name.span, f"write {EXAMPLE}")
        return None
    values = per_axis(given[0], joint.chain, findings)
    if values is None:
        return None
    for factor, value in zip(joint.chain, values, strict=True):
        if not (bound := bound_of(factor)).holds(value):
            place = given[0].value.span if given[0].value else given[0].name.span
            findings.error(
                f"this displacement of `{shorten(joint.name)}` is too large", place, str(bound)
            )
            return None
    return np.array(values, dtype=float)


def _misplaced(word: Word, findings: Findings) -> None:
    """A field of a joint that is none of a pose, or no field at all."""
    if word.text in known_in("joint"):
        message = f"`{shorten(word.text)}` has no place in a pose"
        findings.error(message, word.span, f"of a joint it gives the `{_FIELD}` only")
    else:
        message = f"unknown field `{shorten(word.text)}` in a joint of a pose"
        findings.error(message, word.span, nearest(word.text, [_FIELD]))
