"""What is known of a surface while it is examined, and how its parts are called."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from generator.errors import Fault
from generator.geometry.surface import Indices, Surface
from generator.geometry.tetrahedra import Tetrahedra
from generator.source import Span

NAMED = 10
"""How many faces, edges or vertices a sentence names."""


@dataclass(frozen=True)
class Shell:
    """A closed part of a surface, connected over its edges.

    Attributes:
        first_face: index of its first face, which names it.
        face_count: number of its faces.
        volume: [m3], negative for a void.
        depth: in how many other shells it lies.
    """

    first_face: int
    face_count: int
    volume: float
    depth: int

    @property
    def is_void(self) -> bool:
        """Whether it is the inner wall of a body."""
        return self.depth % 2 == 1


@dataclass
class Examination:
    """What is known of a surface so far.

    Attributes:
        surface: as it can be used: vertices joined and faces turned where that was needed.
        faults: what is wrong or odd.
        shells: its closed parts; none while there are errors.
        turned: faces that were turned, by index.
        joined: vertices that were given up for others at the same place.
        tetrahedra: the sums over the surface as it can be used.
    """

    surface: Surface
    faults: list[Fault] = field(default_factory=list[Fault])
    shells: tuple[Shell, ...] = ()
    turned: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    joined: int = 0
    tetrahedra: Tetrahedra | None = None

    def note(
        self,
        make: Callable[[str, Span | None, str], Fault],
        message: str,
        face: int | None,
        hint: str = "",
    ) -> None:
        """Note a fault at a face; it names the file itself where there is no line to show."""
        place = None if face is None else self.surface.place(face)
        said = message if place else f"{self.surface.name}: {message}"
        self.faults.append(make(said, place, hint))

    def faces_are(self, faces: Indices) -> str:
        """`face 3 is`, `faces 3, 5 are`."""
        names = listed([self.surface.face_name(f) for f in faces[:NAMED].tolist()], len(faces))
        return f"face {names} is" if len(faces) == 1 else f"faces {names} are"

    def in_parts(self, firsts: Indices, all_of_them: int) -> str:
        """Which shells, given by their first faces, a sentence is about, unless it is about all."""
        if len(firsts) == all_of_them:
            return ""
        names = [self.surface.face_name(face) for face in firsts[:NAMED].tolist()]
        return f" in the part of face {listed(names, len(firsts))}"


def listed(names: Sequence[str], count: int) -> str:
    """The names, and how many more there are."""
    more = count - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")
