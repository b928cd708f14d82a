"""Key of the content of a study: equal for equal studies, in every process and on every machine."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from enum import Enum
from hashlib import sha256
from importlib.metadata import version
from typing import Any, cast

import numpy as np

from generator.figure import Figure
from generator.geometry.read import with_surfaces
from generator.geometry.surface import Indices, Surface
from generator.rotations import Array
from generator.study.study import Study

_EXACT_INTEGERS = 2**53
"""Size up to which every whole number is a float."""


@dataclass(frozen=True)
class Versions:
    """Versions of the programs that a run depends on."""

    exudyn_mover: str
    exudyn: str

    def __str__(self) -> str:
        """Both, as a sentence lists them."""
        return f"exudyn-mover {self.exudyn_mover} and Exudyn {self.exudyn}"


def installed_versions() -> Versions:
    """Return the versions of the installed programs."""
    return Versions(version("exudyn-mover"), version("exudyn"))


def content_key(study: Study, points: Array, versions: Versions) -> str:
    """Return the SHA-256 of all that the rows of a study depend on, in hexadecimal.

    It covers the points as well as the design, since a library may draw others from the same seed.
    The names of files have no effect, but the psurfs do, which give contact spheres. The settings
    of sensitivity indices have none, since the indices are computed from the rows.

    Args:
        study: Study.
        points: values of the parameters of each run, shape (runs, parameters).
        versions: versions of the programs that run it.

    Raises:
        TypeError: a value in the study has no canonical form.
    """
    model = replace(study.model, springs=replace(study.model.springs, origin=""))
    counted = replace(study, name="", model=model, sensitivity=None)
    return digest((counted, points, _surfaces(model.figure), versions))


def digest(value: object) -> str:
    """Return the SHA-256 of the canonical form of a value, in hexadecimal.

    Numbers that are equal have the same form, as have tuples and lists; dataclasses are taken by
    the fields that they compare.

    Raises TypeError for a value without a canonical form.
    """
    summary = sha256()
    _add(value, summary.update)
    return summary.hexdigest()


def _surfaces(figure: Figure) -> Mapping[str, tuple[Array, Indices, Indices] | None]:
    """Return vertices and faces of the psurfs, by name; None for one that cannot be read."""
    found: dict[str, Surface | None] = {
        name: parsed.value for name, parsed in with_surfaces(figure).surfaces.items()
    }
    return {
        name: None if surface is None else (surface.vertices, surface.corners, surface.starts)
        for name, surface in found.items()
    }


def _add(value: object, update: Callable[[bytes], object]) -> None:
    """Feed the canonical form of a value: a letter for its kind, its size or name, its content."""
    if value is None:
        update(b"n;")
    elif isinstance(value, Enum):
        _add_text("e", f"{type(value).__name__}.{value.name}", update)
    elif isinstance(value, bool | np.bool_):
        update(b"b1;" if value else b"b0;")
    elif isinstance(value, int | float | np.integer | np.floating):
        _add_text("f", _format_number(cast("int | float", value)), update)
    elif isinstance(value, str):
        _add_text("s", value, update)
    elif is_dataclass(value) and not isinstance(value, type):
        compared = [field.name for field in fields(value) if field.compare]
        _add_text("d", type(value).__name__, update)
        _add({name: getattr(value, name) for name in compared}, update)
    elif isinstance(value, np.ndarray):
        array = cast("np.ndarray[Any, Any]", value)
        update(f"a{array.shape};".encode())
        if array.dtype.kind in "fiu" and (np.abs(array) <= _EXACT_INTEGERS).all():
            update((array.astype("<f8") + 0.0).tobytes())  # one form of zero
            return
        for item in array.ravel().tolist():
            _add(item, update)
    elif isinstance(value, Mapping):
        mapping = cast("Mapping[object, object]", value)
        update(f"m{len(mapping)};".encode())
        for key, item in mapping.items():
            _add(key, update)
            _add(item, update)
    elif isinstance(value, Sequence) and not isinstance(value, bytes | bytearray):
        items = cast("Sequence[object]", value)
        update(f"t{len(items)};".encode())
        for item in items:
            _add(item, update)
    else:
        raise TypeError(f"a {type(value).__name__} has no canonical form")


def _add_text(kind: str, text: str, update: Callable[[bytes], object]) -> None:
    data = text.encode("utf-8", "surrogatepass")
    update(f"{kind}{len(data)};".encode() + data)


def _format_number(value: int | float) -> str:
    """Exact form of a number: equal ones are alike, whatever their types."""
    if not isinstance(value, int | np.integer):
        return (float(value) + 0.0).hex()  # one form of zero
    number = int(value)
    try:
        rounded = float(number)
    except OverflowError:
        return str(number)
    return rounded.hex() if int(rounded) == number else str(number)
