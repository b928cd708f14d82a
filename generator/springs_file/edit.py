"""Changes of springs, and the springs file that states them over the one that it extends."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from math import degrees
from pathlib import Path
from typing import TypeVar

from generator.diagnostics import ModelError, UsageError, shorten
from generator.figure import Figure, Joint, Vector
from generator.springs_file.axes import (
    AXIS_NAMES,
    SLIDE_NAMES,
    AxisError,
    axis_by_name,
    is_slide,
    parallel_sign,
)
from generator.springs_file.bind import modified_law
from generator.springs_file.bind_reach import reach_entry, reach_laws
from generator.springs_file.coupled import CoupledEntry
from generator.springs_file.extend import stop_of
from generator.springs_file.laws import CubicEntry, EntryLaw, SlideEntry, write_law
from generator.springs_file.parse import SPRINGS_FILE, SpringEntry, SpringsFile
from generator.springs_file.published import PublishedLaw
from generator.springs_file.reach import ReachEntry
from generator.springs_file.read import (
    PRINTED_SPRINGS,
    find_springs_file,
    load_springs,
    spring_along,
)
from generator.springs_file.write import write_springs
from springs import (
    AxisSpring,
    CoupledSpring,
    Cubic,
    Damping,
    Elastic,
    JointSprings,
    Linear,
    Reach,
    SphericalLaw,
    SpringSet,
)
from springs.axis import Direction
from springs.damping import DEFAULT_SLIP_RATE
from springs.elastic import Range
from springs.hysteresis import Hysteresis
from springs.lint.curve import other_side
from springs.published.tables import publication, publications
from springs.transformed import Transformed


@dataclass(frozen=True)
class SpringEdit:
    """Changes of the spring about one axis of a joint; what is left out stays.

    Attributes:
        joint: its name.
        direction: direction of the spring, or the opposite one.
        scale: factor of the elastic torque.
        offset: shift of the curve towards larger angles [rad].
        stiffness: stiffness of a linear law [N m/rad].
        dead_zone: edges of a cubic's dead zone, before the shift [rad].
        viscous: damping [N m s/rad].
        coulomb: friction [N m].
    """

    joint: str
    direction: Direction
    scale: float = 1.0
    offset: float = 0.0
    stiffness: float | None = None
    dead_zone: Range | None = None
    viscous: float | None = None
    coulomb: float | None = None


@dataclass(frozen=True)
class PlainLaw:
    """An elastic law as a springs file states it: a law, and what `scale` and the like make of it.

    Attributes:
        law: law without them.
        scale: factor of its torque.
        offset: shift towards larger angles [rad].
        hysteresis: difference of the curves of a decreasing and an increasing angle [N m].
        slip_rate: rate at which friction reaches 76 % of its full value [rad/s].
    """

    law: Elastic
    scale: float = 1.0
    offset: float = 0.0
    hysteresis: float = 0.0
    slip_rate: float = DEFAULT_SLIP_RATE

    @property
    def whole(self) -> Elastic:
        """The law that a file with these values gives."""
        return modified_law(self.law, self.scale, self.offset, self.hysteresis, self.slip_rate)


def plain_law(law: Elastic) -> PlainLaw:
    """Take a law apart into a law that a file can state and its modifiers."""
    if isinstance(law, Hysteresis):
        up, down = law.increasing, law.decreasing
        if isinstance(up, Transformed) and isinstance(down, Transformed):
            width = 2.0 * down.constant
            mean = plain_law(up.law)
            if Hysteresis.from_mean_and_width(up.law, max(width, 0.0), law.slip) == law:
                return replace(mean, hysteresis=width, slip_rate=law.slip)
        first, second = plain_law(up), plain_law(down)
        if (first.scale, first.offset) == (second.scale, second.offset):
            curves = Hysteresis(first.law, second.law, law.slip)
            return PlainLaw(curves, first.scale, first.offset, 0.0, law.slip)
        return PlainLaw(law, slip_rate=law.slip)
    scale, offset = 1.0, 0.0
    while isinstance(law, Transformed) and law.scale >= 0.0 and law.constant == 0.0:
        law, scale, offset = law.law, scale * law.scale, offset + law.offset
    return PlainLaw(law, scale, offset)


def elastic_law(spring: AxisSpring) -> Elastic | None:
    """Return the law of a spring beside its stops; None without one, or with several."""
    laws = spring.laws_besides_stops
    return laws[0] if len(laws) == 1 else None


def cubic_dead_zone(spring: AxisSpring) -> Range | None:
    """Return the dead zone of a cubic as angles about the axis [rad]; None without one."""
    law = elastic_law(spring)
    plain = None if law is None else plain_law(law)
    if plain is None or not isinstance(plain.law, Cubic) or plain.law.dead_zone is None:
        return None
    low, high = plain.law.dead_zone
    at = plain.law.rest + plain.offset
    return low + at, high + at


def edit_spring(spring: AxisSpring, edit: SpringEdit) -> AxisSpring:
    """Return a spring with the changes of an edit.

    Raises:
        ModelError: the spring has no law of the kind that is changed.
    """
    if parallel_sign(spring.direction, edit.direction) < 0:
        zone = edit.dead_zone and (-edit.dead_zone[1], -edit.dead_zone[0])
        edit = replace(edit, offset=-edit.offset, dead_zone=zone, direction=spring.direction)
    damping = replace(
        spring.damping,
        viscous=spring.damping.viscous if edit.viscous is None else edit.viscous,
        coulomb=spring.damping.coulomb if edit.coulomb is None else edit.coulomb,
    )
    remark = _describe_edit(edit)
    if not remark:
        return replace(spring, damping=damping)
    law = elastic_law(spring)
    if law is None:
        raise ModelError(
            f"`{shorten(edit.joint)}` has no single law about this axis that could be changed"
        )
    changed = _edit_law(law, edit)
    laws = tuple(changed if each is law else each for each in spring.elastic)
    why = " ".join(filter(None, [spring.why, remark]))
    return replace(spring, elastic=laws, damping=damping, why=why)


def _edit_law(law: Elastic, edit: SpringEdit) -> Elastic:
    plain = plain_law(law)
    core = plain.law
    if edit.stiffness is not None:
        if not isinstance(core, Linear):
            raise ModelError(f"the law of `{shorten(edit.joint)}` has no stiffness of its own")
        core = replace(core, stiffness=edit.stiffness)
    if edit.dead_zone is not None:
        if not isinstance(core, Cubic):
            raise ModelError(f"the law of `{shorten(edit.joint)}` is not a cubic with a dead zone")
        low, high = (edge - core.rest - plain.offset for edge in edit.dead_zone)
        if low > high:
            raise ModelError(f"the dead zone of `{shorten(edit.joint)}` ends before it begins")
        core = replace(core, dead_zone=(low, high))
    scale, offset = plain.scale * edit.scale, plain.offset + edit.offset
    return replace(plain, law=core, scale=scale, offset=offset).whole


def _describe_edit(edit: SpringEdit) -> str:
    """Return the changes of an elastic law in a sentence, or ""."""
    parts: list[str] = []
    if edit.stiffness is not None:
        parts.append(f"stiffness {edit.stiffness:.4g} N m/rad")
    if edit.dead_zone is not None:
        low, high = (degrees(edge) + 0.0 for edge in edit.dead_zone)
        parts.append(f"dead zone {low:.4g} to {high:.4g} deg")
    if edit.scale != 1.0:
        parts.append(f"torque times {edit.scale:.4g}")
    if edit.offset:
        parts.append(f"moved by {degrees(edit.offset):.4g} deg")
    return f"Changed: {', '.join(parts)}." if parts else ""


def apply_edits(springs: SpringSet, edits: Iterable[SpringEdit]) -> SpringSet:
    """Return springs with changes.

    Raises:
        ModelError: the joint has no spring about the axis, or one with a law of another kind.
    """
    joints = dict(springs.joints)
    for edit in edits:
        own = joints.get(edit.joint)
        axes = () if own is None else own.axes
        if spring_along(axes, edit.direction) is None:
            raise ModelError(f"`{shorten(edit.joint)}` has no spring about this axis")
        assert own is not None
        changed = tuple(
            edit_spring(axis, edit) if parallel_sign(axis.direction, edit.direction) else axis
            for axis in axes
        )
        joints[edit.joint] = replace(own, axes=changed)
    return replace(springs, joints=joints)


def edit_of_other_side(springs: SpringSet, edit: SpringEdit) -> SpringEdit | None:
    """Return the same change of the joint on the other side; None without such a spring.

    The angle of each side's declared axis has the same sense, so that its values are the same.
    """
    name = other_side(edit.joint)
    if name is None or name not in springs.joints or edit.joint not in springs.joints:
        return None
    spring = spring_along(springs.joints[edit.joint].axes, edit.direction)
    if spring is None:
        return None
    for other in springs.joints[name].axes:
        if other.motion == spring.motion and (
            spring.motion or parallel_sign(other.direction, spring.direction)
        ):
            sense = parallel_sign(edit.direction, spring.direction)
            x, y, z = (sense * part for part in other.direction)
            return replace(edit, joint=name, direction=(x, y, z))
    return None


def _paired(
    joint: JointSprings, below: JointSprings
) -> Iterator[tuple[AxisSpring, AxisSpring | None, bool]]:
    """Yield the springs of a joint with those of another set, and whether along a translation."""
    for spring in joint.axes:
        yield spring, spring_along(below.axes, spring.direction), False
    for spring in joint.translations:
        yield spring, spring_along(below.translations, spring.direction), True


def format_changes(
    figure: Figure,
    base: SpringSet,
    springs: SpringSet,
    extends: str | None = None,
    law: SphericalLaw | None = None,
) -> str:
    """Return the springs file that turns springs into others; "" where nothing differs.

    Args:
        figure: figure of the springs.
        base: the extended springs.
        springs: those about axes that differ are stated; laws over several joints stay.
        extends: name of the base in the file; None for what stands beside the figure.
        law: stated law of spherical joints; None for that of the base.

    Raises:
        ModelError: a springs file cannot state a law.
    """
    entries, reaches = _tables(figure, springs, base, is_relative=True)
    if not entries and not reaches and law is None:
        return ""
    stem = None if figure.path is None else figure.path.stem
    return write_springs(SpringsFile(entries, stem, law, reaches=reaches, extends=extends))


def format_all(figure: Figure, springs: SpringSet) -> str:
    """Return a springs file without laws over several joints that extends no other."""
    entries, reaches = _tables(figure, springs)
    stem = None if figure.path is None else figure.path.stem
    file = SpringsFile(entries, stem, springs.law, reaches=reaches, stands_alone=True)
    return write_springs(file) if entries or reaches else ""


def format_besides_fields(figure: Figure, springs: SpringSet) -> str:
    """Return the springs file of all springs that the figure's own fields do not hold.

    "" where the fields hold all of them, laws over several joints included. Where they hold all but
    the law that joins the axes of a joint, the file states this law alone.

    Raises ModelError for a law that a springs file cannot state, or a spring of the fields that the
    springs do not have.
    """
    bare = replace(figure, path=None, springs_text=None)
    own = load_springs(bare).require_value()
    entries, reaches = _tables(figure, springs, own)
    coupled = tuple(_coupled_entry(figure, spring) for spring in springs.coupled)
    text = ""
    law = None if springs.law is own.law else springs.law
    if entries or coupled or reaches or law:
        try:
            text = write_springs(SpringsFile(entries, None, law, coupled, reaches))
        except ValueError as failure:
            raise ModelError(f"a springs file cannot state these springs: {failure}") from None
    made = springs_from_text(text, bare, Path(f"model{SPRINGS_FILE.suffix}"))
    if (made.joints, made.coupled, made.law) != (springs.joints, springs.coupled, springs.law):
        raise ModelError("a springs file cannot state these springs beside the figure's own")
    return text


def _tables(
    figure: Figure, springs: SpringSet, base: SpringSet | None = None, *, is_relative: bool = False
) -> tuple[tuple[SpringEntry, ...], tuple[ReachEntry, ...]]:
    """Return the tables of springs about single axes, and of reaches. Raises ModelError.

    Args:
        figure: figure of the springs.
        springs: springs to state.
        base: springs from which the stated ones differ; None for all with a law or damping.
        is_relative: whether a table leaves out what the base has.
    """
    entries: list[SpringEntry] = []
    reaches: list[ReachEntry] = []
    for name, joint in springs.joints.items():
        below = (base or SpringSet()).joints.get(name, JointSprings(name))
        if joint.reach is not None and joint.reach != below.reach:
            table, laws = reach_tables(figure.joints[name], joint.reach)
            _add_entry(reaches, table)
            for entry in laws:
                _add_entry(entries, entry)
        for spring, before, slides in _paired(joint, below):
            if base is None:
                is_stated = elastic_law(spring) is not None or spring.damping != Damping()
            else:
                is_stated = before is None or spring != before.oriented_along(spring.direction)
            if is_stated:
                known = before if is_relative else None
                _add_entry(entries, _entry(figure.joints[name], spring, known, slides=slides))
    return tuple(entries), tuple(reaches)


def reach_tables(joint: Joint, reach: Reach) -> tuple[ReachEntry, tuple[SpringEntry, ...]]:
    """Return the table of a reach, and those of its laws. Raises ModelError."""
    laws = [_entry_about(axis, joint, law, None) for axis, law in reach_laws(reach)]
    return reach_entry(joint, reach), tuple(replace(entry, damping=None) for entry in laws)


def _coupled_entry(figure: Figure, spring: CoupledSpring) -> CoupledEntry:
    """Return the table of a law over several joints. Raises ModelError."""
    axes = [_declared_axis(figure.joints[axis.joint], axis.direction) for axis in spring.axes]
    return CoupledEntry(
        (tuple(axis.joint for axis in spring.axes),),
        spring.law.coordinates,
        tuple(name for name, _ in axes),
        tuple(
            parallel_sign(axis.direction, declared)
            for axis, (_, declared) in zip(spring.axes, axes, strict=True)
        ),
        explicit_law=spring.law,
        reference=spring.reference,
        why=spring.why,
    )


Entry = TypeVar("Entry", SpringEntry, ReachEntry)


def _add_entry(entries: list[Entry], entry: Entry) -> None:
    """Add an entry, or its joint to an equal one."""
    for k, one in enumerate(entries):
        if replace(one, joints=entry.joints) == entry:
            entries[k] = replace(one, joints=(*one.joints, *entry.joints))
            return
    entries.append(entry)


def _entry(
    joint: Joint, spring: AxisSpring, before: AxisSpring | None, *, slides: bool = False
) -> SpringEntry:
    """Return the table of a spring that differs from another one."""
    axis, direction = _declared_axis(joint, spring.direction, slides=slides)
    before = before and before.oriented_along(direction)
    return _entry_about(axis, joint, spring.oriented_along(direction), before)


def _entry_about(
    axis: str | None, joint: Joint, spring: AxisSpring, before: AxisSpring | None
) -> SpringEntry:
    """Return the table of a spring about a named axis."""
    law, stop = elastic_law(spring), stop_of(spring)
    if law is None and spring.laws_besides_stops:
        raise ModelError(f"a springs file cannot state several laws of `{shorten(joint.name)}`")
    entry = SpringEntry(
        (joint.name,),
        axis,
        damping=spring.damping,
        motion=spring.motion,
        reference=spring.reference,
        why=spring.why,
        stop_stiffness=stop.stiffness,
        stop_onset=stop.onset,
    )
    if law is None:
        return entry
    whole = plain_law(law)
    is_linear = isinstance(whole.law, Linear)  # the fields of a figure have linear laws only
    if before is not None and before.elastic == spring.elastic and not is_linear:
        return replace(entry, reference="", why="")
    plain, stated = _entry_law(joint, whole, slides=is_slide(axis))
    keeps = before is not None and before.damping == spring.damping and not is_linear
    if keeps and not isinstance(stated, PublishedLaw):  # which may bring its own damping
        entry = replace(entry, damping=None)
    return replace(
        entry,
        law=stated,
        scale=plain.scale,
        offset=plain.offset,
        hysteresis=plain.hysteresis,
        slip_rate=plain.slip_rate,
    )


def _declared_axis(
    joint: Joint, direction: Vector, *, slides: bool = False
) -> tuple[str | None, Vector]:
    """Return name and direction of an axis as a springs file states it. Raises ModelError."""
    for name in SLIDE_NAMES if slides else (None, *AXIS_NAMES):
        try:
            found = axis_by_name(joint, name)
        except AxisError:
            continue
        if parallel_sign(found, direction):
            return name, found
    raise ModelError(f"a springs file cannot state this axis of `{shorten(joint.name)}`")


def _entry_law(joint: Joint, plain: PlainLaw, *, slides: bool = False) -> tuple[PlainLaw, EntryLaw]:
    """Return a law with its modifiers as a table states it. Raises ModelError."""
    if slides:
        linear = plain.law
        if not isinstance(linear, Linear) or plain.hysteresis:
            raise ModelError(f"a springs file cannot state the law of `{shorten(joint.name)}`")
        moved = replace(plain, offset=0.0)
        return moved, SlideEntry(linear.stiffness, linear.rest + plain.offset)
    if isinstance(plain.law, Cubic):
        cubic = plain.law
        return plain, CubicEntry(cubic.coefficients, cubic.sense, cubic.dead_zone, True, cubic.rest)
    published = _published_laws().get(plain.law)
    if published is not None:
        return plain, published
    try:
        list(write_law(plain.law))
    except ValueError:
        message = f"a springs file cannot state the law of `{shorten(joint.name)}`"
        raise ModelError(message) from None
    return plain, plain.law


@cache
def _published_laws() -> dict[Elastic, PublishedLaw]:
    """Return the published laws by what they are in a file."""
    laws: dict[Elastic, PublishedLaw] = {}
    for source in publications():
        for name in publication(source).curves:
            for sense in (-1, 1):
                stated = PublishedLaw(f"{source}/{name}", sense)
                laws[stated.law] = stated
    return laws


def springs_from_text(text: str, figure: Figure, file: Path) -> SpringSet:
    """Return the springs of a figure that a text gives as a springs file.

    Args:
        text: text of the file, or "" for the springs of the figure without a choice.
        figure: the figure.
        file: its path; it need not exist. A file that is there may be extended by the text.

    Raises:
        InputError: anything is wrong; it holds all faults.
    """
    folder, stem = (None, None) if figure.path is None else (figure.path.parent, figure.path.stem)
    if not text:
        return load_springs(figure, folder, stem).require_value()
    file = file.with_name(f"{_UNSAVED}{file.name}")  # another name than any file that is extended
    return load_springs(figure, folder, stem, file, text=text).require_value()


_UNSAVED = "unsaved "
"""Begin of the name of a text that is not in its file yet."""


def check_target(figure: Figure, file: Path, choice: str | Path | None) -> None:
    """Raise UsageError for a file that holds the springs of a choice, or the figure's own."""
    if figure.path is None:
        return
    folder, stem = figure.path.parent, figure.path.stem
    for each in (choice, None):
        path, _ = find_springs_file(folder, stem, each)
        if path is not None and path.resolve() == file.resolve():
            raise UsageError(
                f"`{shorten(file.name)}` holds the springs that were changed: choose another name"
            )


def springs_and_text(
    figure: Figure,
    springs: SpringSet,
    changed: SpringSet,
    file: Path,
    choice: str | Path | None = None,
) -> tuple[SpringSet, str]:
    """Return changed springs as a springs file gives them, and this file.

    Args:
        figure: the figure.
        springs: springs of the choice.
        changed: the same springs with changes of those about axes.
        file: path of the springs file; it need not exist.
        choice: choice of the springs, as for `read_springs`.

    Raises:
        ModelError: a springs file cannot state the change.
        InputError: the text cannot be read, as with a cubic that restores in no sense.
    """
    if changed == springs:
        return springs, ""
    if str(choice) == PRINTED_SPRINGS:
        text = format_all(figure, changed)
        return springs_from_text(text, figure, file), text
    extends = _name_of_base(figure, choice, file.parent)
    text = format_changes(figure, springs, changed, extends)
    made = springs_from_text(text, figure, file)
    if made.law is not springs.law:  # another one was chosen than the base has
        text = format_changes(figure, springs, changed, extends, springs.law)
        made = springs_from_text(text, figure, file)
    if made.coupled != changed.coupled:
        raise ModelError("a springs file cannot state this change beside a law over several joints")
    return made, text


def _name_of_base(figure: Figure, choice: str | Path | None, folder: Path) -> str | None:
    """Return the name by which a springs file in a folder extends the springs of a choice."""
    if figure.path is None:
        return None if choice is None else Path(choice).resolve().as_posix()
    path, _ = find_springs_file(figure.path.parent, figure.path.stem, choice)
    own, _ = find_springs_file(figure.path.parent, figure.path.stem, None)
    if path is None:
        return None
    stem, name = figure.path.stem, path.name.removesuffix(SPRINGS_FILE.suffix)
    if own is not None and path.resolve() == own.resolve():
        return stem if own.name.endswith(SPRINGS_FILE.suffix) else None
    if path.resolve().parent == folder.resolve():
        return path.name
    is_beside = own is not None and path.resolve().parent == own.resolve().parent
    if is_beside and name != path.name and name.startswith(f"{stem}."):
        return name.removeprefix(f"{stem}.")
    return path.resolve().as_posix()
