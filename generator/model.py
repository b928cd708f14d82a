"""A figure with the springs of its joints: all of a body that a run needs."""

from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import cast

from generator.contact_file.file import CONTACT_FILE, read_contact
from generator.contact_file.parts import BodyContact
from generator.diagnostics import UnknownNameError, shorten, spelling_hint
from generator.figure import Figure
from generator.notebook import html_table
from generator.springs_file.read import read_springs
from generator.text_io import is_file
from springs import SphericalLaw, SpringSet


@dataclass(frozen=True)
class Model:
    """A figure with the springs of its joints.

    Attributes:
        figure: Segments and joints.
        springs: Springs of its joints; none by default.
        contact: Parts of the body that touch props as wholes; without any each contact sphere
            resists by itself.
    """

    figure: Figure
    springs: SpringSet = field(default_factory=SpringSet)
    contact: BodyContact | None = None

    def __post_init__(self) -> None:
        """Check the types, and that the figure has the joints of the springs.

        Raises TypeError and UnknownNameError.
        """
        figure, springs = cast("tuple[object, object]", (self.figure, self.springs))
        if not isinstance(figure, Figure):
            raise TypeError(f"a Model needs a Figure, such as read_figure(...), not {figure!r}")
        if not isinstance(springs, SpringSet):
            kind = type(springs).__name__
            raise TypeError(f"springs are a SpringSet, such as read_springs(...), not a {kind}")
        for name in self.springs.joints.keys() - self.figure.joints.keys():
            hint = spelling_hint(name, self.figure.joints)
            message = f"the springs are for joint `{name}`, unknown to the figure; {hint}"
            raise UnknownNameError(message)

    @classmethod
    def of(
        cls,
        figure: Figure,
        choice: str | Path | None = None,
        law: SphericalLaw | None = None,
    ) -> "Model":
        """Return a figure with the springs and the parts that a run of it has.

        See `read_springs` and `contact_of_figure`.
        """
        return cls(figure, read_springs(choice, figure, law), contact_of_figure(figure))

    def __repr__(self) -> str:
        """The figure and its springs, in a line."""
        return f"<Model of {self.figure!r} with springs from {shorten(self.springs.origin)}>"

    def _repr_html_(self) -> str:
        """Table of the passive curves, of joints with a reach their names alone."""
        # By name, since curves are above.
        curves = import_module("generator.passive_curve").passive_curves(self.figure, self.springs)
        rows = [curve.summary() for of_joint in curves.values() for curve in of_joint]
        reaches = (name for name, one in self.springs.joints.items() if one.reach is not None)
        rows += [(name, "reach and turn", "", "", "") for name in reaches]
        columns = ("joint", "motion", "known [deg]", "at its ends [N m]", "viscous [N m s/rad]")
        return html_table(repr(self).strip("<>"), columns, rows)

    def with_parameter(self, path: str, value: float) -> "Model":
        """Return the model with a quantity set as a study sets it.

        `model.with_parameter("springs.knee.scale", 4)` makes both knees four times as stiff.

        Args:
            path: Path of a quantity of the springs or the segments, as in a study file.
            value: Value in the unit of the path.

        Raises:
            UnknownPathError: The model has no such quantity; the message states the nearest one.
            ModelError: The quantity cannot have this value.
        """
        # By name, since studies are above: what they vary beside the model is the run.
        return import_module("generator.study.parameters").with_parameter(self, path, value)


def contact_of_figure(figure: Figure) -> BodyContact | None:
    """Return the parts in the file beside that of a figure; None without one.

    Raises InputError with all errors.
    """
    path = None if figure.path is None else CONTACT_FILE.beside(figure.path)
    return read_contact(path) if path is not None and is_file(path) else None
