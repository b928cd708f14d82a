"""Files of published numbers of the body, `data/*.toml`: one publication each.

The head of a file is that of a published table of springs: `reference`, `sureness`, `doi`, `place`
and `note`. The rest is its numbers as printed, whose units end their keys.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from springs.published.parse import PublishedError, parse_reference
from springs.published.reference import Reference

_SUFFIX = ".toml"
_HEAD_KEYS = ("reference", "sureness", "doi", "place", "note")


@dataclass(frozen=True)
class DataFile:
    """A file of published numbers.

    Attributes:
        name: of the file without its suffix ("de_leva_1996").
        reference: the publication.
        note: on the sample, and on how the numbers were checked.
        content: the tables and keys below the head.
    """

    name: str
    reference: Reference
    note: str
    content: Mapping[str, Any]


def data_file_names() -> tuple[str, ...]:
    """Names of all files, in alphabetical order."""
    names = (entry.name for entry in files("generator").joinpath("person", "data").iterdir())
    return tuple(sorted(name.removesuffix(_SUFFIX) for name in names if name.endswith(_SUFFIX)))


@cache
def load_data_file(name: str) -> DataFile:
    """Return the file of this name. Raises PublishedError for one that cannot be read."""
    path = files("generator").joinpath("person", "data", name + _SUFFIX)
    if not path.is_file():
        known = ", ".join(data_file_names())
        raise PublishedError(f"there is no data file `{name}`; there are {known}")
    return parse_data_file(path.read_text(encoding="utf-8"), name)


def parse_data_file(text: str, name: str = "<text>") -> DataFile:
    """Parse a file that errors call `name`. Raises PublishedError."""
    try:
        content = tomllib.loads(text)
        reference = parse_reference(content)
    except KeyError as failure:
        raise PublishedError(f"{name}: there is no `{failure.args[0]}`") from failure
    except ValueError as failure:
        raise PublishedError(f"{name}: {failure}") from failure
    rest = {key: value for key, value in content.items() if key not in _HEAD_KEYS}
    return DataFile(name, reference, content.get("note", ""), rest)
