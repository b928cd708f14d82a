"""The container of a binary glTF file (`.glb`): one JSON document and one block of numbers.

glTF 2.0, Khronos Group (ISO/IEC 12113:2022), sections 3.6 (buffers, accessors) and 4 (GLB).
"""

import json
import struct
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from generator.frames import Array

_MAGIC, _VERSION = b"glTF", 2
_JSON, _BIN = b"JSON", b"BIN\x00"
_FLOAT = 5126
_VERTICES = 34962

Kind = Literal["SCALAR", "VEC3", "VEC4"]


class Buffer:
    """The block of numbers, and the accessors that say what lies where in it."""

    def __init__(self) -> None:
        """Begin without any."""
        self._data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(
        self, values: Array, kind: Kind, *, bounds: bool = False, vertices: bool = False
    ) -> int:
        """Put values, a row each, into the block as floats of 32 bits; the accessor's number.

        Args:
            values: shape (n,) for scalars, (n, 3) or (n, 4) for vectors.
            kind: what a row is.
            bounds: whether the accessor must tell least and greatest, as positions and times do.
            vertices: whether the values belong to the vertices of a mesh.
        """
        rounded: NDArray[np.float32] = np.ascontiguousarray(values, dtype="<f4")
        view: dict[str, Any] = {
            "buffer": 0,
            "byteOffset": len(self._data),
            "byteLength": rounded.nbytes,
        }
        if vertices:
            view["target"] = _VERTICES
        self._data += rounded.tobytes()
        self.views.append(view)
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": _FLOAT,
            "count": len(rounded),
            "type": kind,
        }
        if bounds:
            flat = rounded.reshape(len(rounded), -1).astype(float)
            accessor["min"] = flat.min(axis=0).tolist()
            accessor["max"] = flat.max(axis=0).tolist()
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def packed(self, document: dict[str, Any]) -> bytes:
        """The file of a document, which gets buffer, views and accessors. Lists may be empty."""
        whole = {
            **document,
            "buffers": [{"byteLength": len(self._data)}] if self._data else [],
            "bufferViews": self.views,
            "accessors": self.accessors,
        }
        present = {name: part for name, part in whole.items() if part != []}
        text = json.dumps(present, separators=(",", ":"), allow_nan=False).encode()
        chunks = _chunk(_JSON, text, b" ")
        if self._data:
            chunks += _chunk(_BIN, bytes(self._data), b"\x00")
        return _MAGIC + struct.pack("<II", _VERSION, 12 + len(chunks)) + chunks


def _chunk(kind: bytes, content: bytes, filler: bytes) -> bytes:
    padded = content + filler * (-len(content) % 4)
    return struct.pack("<I", len(padded)) + kind + padded
