"""Poses: displacements of the joints of a figure, in the figure's own language.

    file  := joint*
    joint := "joint" NAME "{" "displacement" "=" value ";" "}"

A joint that is not named stays as the figure has it. What else a figure file says of a joint has no
place in a pose.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from generator.diagnostics import (
    Diagnostics,
    Source,
    Span,
    shorten,
    spelling_hint,
)
from generator.figure import Figure, Joint, follower_faults
from generator.figure_file.check import FOLLOWER_HINT
from generator.figure_file.lexer import keywords_in
from generator.figure_file.parser import (
    Block,
    Connect,
    Field,
    ItemList,
    Statement,
    Word,
    parse_statements,
)
from generator.figure_file.resolve import resolve_joint_field
from generator.figure_file.values import displacement_bound
from generator.file_kind import FileKind
from generator.rotations import Array

POSE_EXAMPLE = "`joint NAME { displacement = (30deg); }`"

_DISPLACEMENT_FIELD = "displacement"


def read_pose(path: str | Path, figure: Figure) -> dict[str, Array]:
    """The displacements that a pose file gives the joints of a figure, shape (n,) [rad or m].

    Raises InputError with all diagnostics on any error. Warnings pass.
    """
    return dict(POSE_FILE.read(path, figure))


def _parse_pose(source: Source, diagnostics: Diagnostics, figure: Figure) -> Mapping[str, Array]:
    tree = parse_statements(source, diagnostics)
    displacements: dict[str, Array] = {}
    if not tree.body and not diagnostics.has_syntax_errors and figure.degrees_of_freedom:
        hint = f"a joint of a pose is written {POSE_EXAMPLE}"
        diagnostics.error("there is no joint in this pose", tree.kind.span, hint)
    first: dict[str, Span] = {}
    for statement in tree.body:
        name = _joint_name(statement, diagnostics)
        if name is None or not isinstance(statement, Block):
            continue
        if name.text in first:
            hint = f"the first is in line {first[name.text].line}"
            diagnostics.error(f"a second joint named `{shorten(name.text)}`", name.span, hint)
            continue
        first[name.text] = name.span
        joint = figure.joints.get(name.text)
        if joint is None:
            hint = spelling_hint(name.text, figure.joints)
            diagnostics.error(f"the figure has no joint `{shorten(name.text)}`", name.span, hint)
            continue
        values = _resolve_displacement(statement, joint, diagnostics)
        if values is not None:
            displacements[joint.name] = values
    drawn = {name: joint.displacement for name, joint in figure.joints.items()}
    for name, fault in follower_faults(figure.joints, displacements, {**drawn, **displacements}):
        diagnostics.warning(fault, first[name], FOLLOWER_HINT)
    return displacements


POSE_FILE = FileKind("pose", ".pose", _parse_pose)


def _joint_name(statement: Statement, diagnostics: Diagnostics) -> Word | None:
    """Name of a block that is a joint; report any other statement."""
    if isinstance(statement, Block) and statement.kind.text == "joint":
        return statement.name
    word = statement.kind if isinstance(statement, Block) else statement.name
    hint = f"it holds joints only: {POSE_EXAMPLE}"
    diagnostics.error(f"`{shorten(word.text)}` has no place in a pose", word.span, hint)
    return None


def _resolve_displacement(block: Block, joint: Joint, diagnostics: Diagnostics) -> Array | None:
    """The displacements in a joint's block; None, with an error reported, if they are missing."""
    fields: list[Field] = []
    others = False
    for statement in block.body:
        if isinstance(statement, Field) and statement.name.text == _DISPLACEMENT_FIELD:
            fields.append(statement)
            continue
        others = True
        if isinstance(statement, Field | Connect):
            _report_misplaced(statement.name, diagnostics)
    for second in fields[1:]:
        hint = f"the first is in line {fields[0].name.span.line}"
        diagnostics.error(f"a second `{_DISPLACEMENT_FIELD}` in one joint", second.name.span, hint)
    if not fields:
        if not others and not diagnostics.has_syntax_errors and block.name is not None:
            message = f"joint `{shorten(joint.name)}` has no `{_DISPLACEMENT_FIELD}` here"
            diagnostics.error(message, block.name.span, f"write {POSE_EXAMPLE}")
        return None
    items = fields[0].value
    chain = joint.axes_of(len(items.items) if isinstance(items, ItemList) else 1)
    values = resolve_joint_field(fields[0], chain, diagnostics)
    if values is None:
        return None
    values = joint.complete(values)
    for factor, value in zip(joint.chain, values, strict=True):
        if not (bound := displacement_bound(factor)).contains(value):
            place = fields[0].value.span if fields[0].value else fields[0].name.span
            diagnostics.error(
                f"this displacement of `{shorten(joint.name)}` is too large", place, str(bound)
            )
            return None
    return np.array(values, dtype=float)


def _report_misplaced(word: Word, diagnostics: Diagnostics) -> None:
    """Report a field that does not belong in a pose, or is unknown."""
    if word.text in keywords_in("joint"):
        message = f"`{shorten(word.text)}` has no place in a pose"
        diagnostics.error(
            message, word.span, f"of a joint it gives the `{_DISPLACEMENT_FIELD}` only"
        )
    else:
        message = f"unknown field `{shorten(word.text)}` in a joint of a pose"
        diagnostics.error(message, word.span, spelling_hint(word.text, [_DISPLACEMENT_FIELD]))
