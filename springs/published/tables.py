"""The published tables that come with the program: curves of the literature, each cited.

A row is asked for by `publication/name`, as in `curve("saul_2015/elbow_flexion")`.
"""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from typing import TypeVar

from springs.published.parse import PublishedError, parse_publication
from springs.published.rows import (
    Publication,
    PublishedCoupledLaw,
    PublishedCurve,
    PublishedRhythm,
)

_SUFFIX = ".toml"

_RowType = TypeVar("_RowType")

_BODY_PARTS = (
    *("ankle", "elbow", "forearm", "hip", "knee", "lumbar", "neck", "shoulder", "thorax", "waist"),
    "wrist",
)
"""Words before a motion that name what moves."""


def publications() -> tuple[str, ...]:
    """Names of all publications, in alphabetical order."""
    names = (entry.name for entry in files("springs").joinpath("published", "data").iterdir())
    return tuple(sorted(name.removesuffix(_SUFFIX) for name in names if name.endswith(_SUFFIX)))


@cache
def publication(name: str) -> Publication:
    """The publication of this name. Raises PublishedError when there is none."""
    known = publications()
    if name not in known:
        raise PublishedError(f"there is no published table `{name}`{_suggest_name(name, known)}")
    text = (
        files("springs").joinpath("published", "data", name + _SUFFIX).read_text(encoding="utf-8")
    )
    return parse_publication(text, name)


def curve(key: str) -> PublishedCurve:
    """The curve `publication/name`. Raises PublishedError when there is none."""
    return _find_row(key, "curve", _publication_of_key(key).curves)


def curves_of_motion(joint: str, motion: str) -> list[tuple[str, PublishedCurve]]:
    """Curves of a motion of a joint with their keys, one of each publication, measurements first.

    Args:
        joint: name of the joint in its figure; one of its words says which it is ("left_elbow").
        motion: name of a positive angle ("flexion", "twist to the left").
    """
    parts, kind = split_motion(joint, motion)
    wanted = {f"{word} {kind}" for words in parts for word in words}
    found: list[tuple[str, PublishedCurve]] = []
    for name in publications():
        rows = publication(name).curves.values()
        row = next((row for row in rows if row.motion in wanted), None)
        if row is not None:
            found.append((f"{name}/{row.name}", row))
    return sorted(found, key=lambda one: bool(one[1].obstacle))


def split_motion(joint: str, motion: str) -> tuple[tuple[tuple[str, ...], ...], str]:
    """Split what moves from how: words of the part of the body, the preferred ones first.

    The part is a word before the motion ("lumbar flexion"); else one of the joint's words.
    """
    kind, words = motion.partition(" to the ")[0], tuple(joint.lower().split("_"))
    part, _, rest = kind.partition(" ")
    if part in _BODY_PARTS:
        return ((part,), words), rest
    return (words,), kind


def coupled_law(key: str) -> PublishedCoupledLaw:
    """The coupled law `publication/name`. Raises PublishedError when there is none."""
    return _find_row(key, "coupled law", _publication_of_key(key).coupled_laws)


def rhythm(key: str) -> PublishedRhythm:
    """The shoulder rhythm `publication/name`. Raises PublishedError when there is none."""
    return _find_row(key, "rhythm", _publication_of_key(key).rhythms)


def _find_row(key: str, kind: str, rows: Mapping[str, _RowType]) -> _RowType:
    source, _, name = key.partition("/")
    if name not in rows:
        raise PublishedError(f"`{source}` has no {kind} `{name}`{_suggest_name(name, rows)}")
    return rows[name]


def _publication_of_key(key: str) -> Publication:
    return publication(key.partition("/")[0])


def _suggest_name(name: str, known: Iterable[str]) -> str:
    words = list(known)
    near = get_close_matches(name, words, n=1)
    if near:
        return f"; did you mean `{near[0]}`?"
    return f"; there are {', '.join(words)}" if words else ""
