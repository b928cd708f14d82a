"""What was read of DYSPAM's files as a figure file and a springs file hold it."""

from generator.errors import InputError
from generator.exchange.dyspam_reader import DyspamReading
from generator.exchange.imported import Imported
from generator.figure import Figure
from generator.reader.joint_axes import AXES
from generator.reader.springs_file import SpringEntry, SpringsFile
from springs import AxisSpring, Cubic, SpringSet

_REFERENCE = "DYSPAM's file `optional`"


def imported_of(reading: DyspamReading) -> Imported:
    """The figure with its cubics as a springs file; linear springs are the figure's own fields.

    Raises InputError for a reading with errors.
    """
    figure, springs = reading.figure, reading.springs
    if figure is None or springs is None:
        raise InputError(reading.faults)
    entries = tuple(_entries(figure, springs))
    content = SpringsFile(entries) if entries else None
    return Imported(figure, content, reading.losses, {})


def _entries(figure: Figure, springs: SpringSet) -> list[SpringEntry]:
    return [
        _entry(name, law, spring, spherical=len(figure.joints[name].chain) > 1)
        for name, joint in springs.joints.items()
        for spring in joint.axes
        for law in spring.elastic
        if isinstance(law, Cubic)
    ]


def _entry(joint: str, law: Cubic, spring: AxisSpring, *, spherical: bool) -> SpringEntry:
    """A cubic with the sense and the dead zone that reading gave it; the axes are all positive."""
    return SpringEntry(
        joints=(joint,),
        axis=AXES[spring.direction.index(1.0)] if spherical else None,
        coefficients=law.coefficients,
        sense=law.sense,
        dead_zone=law.dead_zone,
        dead_zone_stated=True,
        rest=law.rest,
        damping=spring.damping,
        reference=_REFERENCE,
        why=spring.why,
    )
