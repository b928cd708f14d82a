"""Tone of muscles in a file, `NAME.tone.toml`, and in the options of a command.

In a file each number has its class (published, scaled, estimate) and its source. Names of joints
and groups are those of `generator.tone`.
"""

import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from generator.diagnostics import Diagnostics, Source, UsageError, shorten
from generator.file_kind import FileKind
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import Choice, Names, Number, Numbers, TableRows, Text
from generator.tone import ALL, Tone
from springs.strength.strengths import StrengthClass

_SHARE_TABLES = ("hold", "righting")
_STRENGTH_TABLE = "strength"
_LARGEST_TIME = 1e3
_LARGEST_TORQUE = 1e6

_SOURCE_ROWS = (
    Choice("class", tuple(StrengthClass), example='"estimate"'),
    Text("source", is_long=True),
)
FILE_ROWS = TableRows(
    "tone file",
    (
        Number("width_rad", 1e-3, 10.0, " rad", attribute="width"),
        Number("lead_s", 0.0, 10.0, " s", attribute="lead"),
        Number("delay_s", 0.0, _LARGEST_TIME, " s", attribute="delay"),
        Number("release_s", 0.0, _LARGEST_TIME, " s", attribute="release"),
        Number("rise_s", 1e-4, 10.0, " s", attribute="rise"),
    ),
    ("why", *_SHARE_TABLES, _STRENGTH_TABLE),
)
_STRENGTH_FILE_ROWS = TableRows("strength file", (), ("why", _STRENGTH_TABLE))
_SHARE_ROWS = {
    name: TableRows(
        f"{name} table",
        (
            Names("joints", example='["neck", "trunk"]'),
            Number("share", 0.0, 1.0, example="0.03", hint="a share of the strength"),
            *_SOURCE_ROWS,
        ),
    )
    for name in _SHARE_TABLES
}
_STRENGTH_ROWS = TableRows(
    f"{_STRENGTH_TABLE} table",
    (
        Text("motion", example='"left_knee flexion"'),
        Numbers(
            "torque_Nm",
            _LARGEST_TORQUE,
            "[in the sense of the motion, against it]",
            "torque",
            negative_error=("a strength is not below zero", "both are sizes"),
            count=2,
            example="[100, 200]",
        ),
        *_SOURCE_ROWS,
    ),
)


def _parse_tone(source: Source, diagnostics: Diagnostics) -> Tone | None:
    top = parse_document(source, FILE_ROWS.noun, diagnostics)
    if top is None:
        return None
    FILE_ROWS.check_keys(top)
    top.text("why")
    values = FILE_ROWS.read(top)
    shares: dict[str, dict[str, float]] = {}
    for name, rows in _SHARE_ROWS.items():
        own = shares[name] = {}
        for table in top.tables(name, f"{name} tables"):
            rows.check_keys(table)
            _require_source(table)
            read = rows.read(table)
            for joint in read.get("joints", ()):
                if joint in own:
                    table.error("joints", f"a second share of `{shorten(joint)}`")
                if name == "righting" and joint == ALL:
                    table.error("joints", "righting is of joints or groups, not of all")
                own[joint] = read.get("share", 0.0)
    strengths, classes = _parse_strengths(top)
    if diagnostics.has_errors:
        return None
    try:
        return Tone(
            shares["hold"],
            shares["righting"],
            **values,
            strengths=strengths,
            strength_classes=classes,
        )
    except ValueError as failure:
        diagnostics.error(str(failure), top.spans.table(""))
        return None


TONE_FILE = FileKind("tone", ".tone.toml", _parse_tone, is_shipped=True)


def _parse_strengths(
    top: TableReader,
) -> tuple[dict[str, tuple[float, float]], dict[str, StrengthClass]]:
    """Return the strengths of a document and their classes, by motion."""
    strengths: dict[str, tuple[float, float]] = {}
    classes: dict[str, StrengthClass] = {}
    for table in top.tables(_STRENGTH_TABLE, "strengths"):
        _STRENGTH_ROWS.check_keys(table)
        _require_source(table)
        read = _STRENGTH_ROWS.read(table)
        if {"motion", "torque_Nm", "class"} <= read.keys():
            if read["motion"] in strengths:
                table.error("motion", f"a second strength of `{shorten(read['motion'])}`")
            strengths[read["motion"]] = read["torque_Nm"]
            classes[read["motion"]] = read["class"]
    return strengths, classes


def _parse_strength_file(source: Source, diagnostics: Diagnostics) -> Tone | None:
    top = parse_document(source, _STRENGTH_FILE_ROWS.noun, diagnostics)
    if top is None:
        return None
    _STRENGTH_FILE_ROWS.check_keys(top)
    top.text("why")
    if _STRENGTH_TABLE not in top.content:
        diagnostics.error("this strength file has no [[strength]]", top.spans.table(""))
    strengths, classes = _parse_strengths(top)
    if diagnostics.has_errors:
        return None
    return Tone(strengths=strengths, strength_classes=classes)


STRENGTH_FILE = FileKind("strength", ".strength.toml", _parse_strength_file)
"""Strengths without a tone."""


def _require_source(table: TableReader) -> None:
    """Note an error for a number that is not an estimate and has no source."""
    if table.content.get("class") in ("published", "scaled") and "source" not in table.content:
        message = f"this {table.name} is {table.content['class']} and has no `source`"
        table.error("class", message, 'write `source = "..."`, or `class = "estimate"`')


_TIME = re.compile(r"([0-9]*\.?[0-9]+(?:e[+-]?[0-9]+)?) ?(ms|s)", re.IGNORECASE)


def tone_from_options(
    tone: str | None,
    right: Iterable[str] = (),
    hold: Iterable[str] = (),
    delay: str | None = None,
    release: str | None = None,
    base: Tone | None = None,
) -> Tone:
    """Return the tone that options of a command state.

    Args:
        tone: Share of all joints, or the name or path of a tone file.
        right: Shares of righting, as `neck,trunk=0.5`.
        hold: Shares of joints or groups, as `knee=0.1`.
        delay: Time at which tone begins to rise, as `0.1s`.
        release: Time at which it begins to fall, as `0.3s`.
        base: Tone to which the others add where `tone` is None; None for no tone.

    Raises:
        UsageError: A value cannot be read.
        InputError: The file is missing or has errors.
    """
    base = (base or Tone()) if tone is None else _named_tone(tone)
    times: dict[str, Any] = {
        "delay": base.delay if delay is None else _time("--delay", delay),
        "release": base.release if release is None else _time("--release", release),
    }
    shares: dict[str, Any] = {
        "hold": {**base.hold, **_shares("--hold", hold)},
        "righting": {**base.righting, **_shares("--right", right)},
    }
    try:
        return replace(base, **shares, **times)
    except ValueError as failure:
        raise UsageError(str(failure)) from None


def _named_tone(text: str) -> Tone:
    """Return the tone of a share of all joints, or of a file."""
    try:
        share = float(text)
    except ValueError:
        found = TONE_FILE.parse_file(text).require_value()
        name = Path(text).name.removesuffix(TONE_FILE.suffix)
        return replace(found, name=name)
    if not 0.0 <= share <= 1.0:
        raise UsageError(f"--tone {text}: a share of the strength is from 0 to 1")
    return Tone({ALL: share})


def _shares(flag: str, texts: Iterable[str]) -> dict[str, float]:
    """Return shares by joint or group."""
    found: dict[str, float] = {}
    for text in texts:
        names, _, number = text.partition("=")
        share = None
        with suppress(ValueError):
            share = float(number)
        if share is None or not all(name.strip() for name in names.split(",")):
            raise UsageError(f"{flag} {text}: expected JOINTS=SHARE, such as neck,trunk=0.5")
        if not 0.0 <= share <= 1.0:
            raise UsageError(f"{flag} {text}: a share of the strength is from 0 to 1")
        found |= {name.strip(): share for name in names.split(",")}
    return found


def _time(flag: str, text: str) -> float:
    match = _TIME.fullmatch(text.strip())
    if match is None:
        raise UsageError(f"{flag} {text}: expected a time such as 0.3s or 300ms")
    return float(match[1]) * (1e-3 if match[2].lower() == "ms" else 1.0)
