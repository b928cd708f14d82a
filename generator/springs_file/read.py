"""The springs of a figure, from a file beside it or a chosen one, and from its own fields."""

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from math import degrees, inf, isfinite, radians
from pathlib import Path
from typing import assert_never

from generator.diagnostics import (
    Diagnostic,
    Diagnostics,
    ModelError,
    NamedMapping,
    Parsed,
    Severity,
    Source,
    TooManyErrors,
    error,
    shorten,
    warning,
)
from generator.figure import AxisKind, Figure, Joint, Vector, is_rotation
from generator.figure_file.read import FIGURE_FILE
from generator.figure_file.resolve import origin_span
from generator.rotations import unit_axis
from generator.springs_file.axes import is_slide, parallel_sign
from generator.springs_file.bind import bind_optional_records, bind_springs_file
from generator.springs_file.bind_coupled import bind_coupled_springs
from generator.springs_file.bind_reach import bind_reaches
from generator.springs_file.extend import extend_springs, stop_of
from generator.springs_file.optional import OPTIONAL_FILE
from generator.springs_file.parse import (
    BASE_KEY,
    EXTENDS_KEY,
    NO_BASE,
    SPRINGS_FILE,
    SpringsFile,
)
from generator.text_io import is_file, load_text, make_source
from springs import (
    AxisSpring,
    Damping,
    Elastic,
    JointSprings,
    Linear,
    SphericalLaw,
    SpringSet,
    Stop,
    rotation_law,
)
from springs.stop import (
    DEFAULT_STOP_ONSET,
    DEFAULT_STOP_STIFFNESS,
    DEFAULT_TRANSLATION_STOP_ONSET,
    DEFAULT_TRANSLATION_STOP_STIFFNESS,
)

NO_SPRINGS = "none"
PRINTED_SPRINGS = "printed"

_FILE_SUFFIXES = (".toml", OPTIONAL_FILE.suffix)


def find_springs_file(
    directory: Path | None, stem: str | None, choice: str | Path | None
) -> tuple[Path | None, Diagnostic | None]:
    """The file to read, None where the figure speaks for itself; and the fault that there is none.

    The former name "coupled" of a person's own springs finds these, with a warning.

    Args:
        directory: where the figure's file lies; None when it is from no file.
        stem: the file's name without the suffix; None likewise.
        choice: None for what stands beside the figure; "printed" for the `optional` file there; the
            path of a file; or NAME for `STEM.NAME.springs.toml` beside the figure.
    """
    if choice is None:
        return _find_sibling(directory, stem, (SPRINGS_FILE.suffix, OPTIONAL_FILE.suffix)), None
    name = str(choice)
    if name == PRINTED_SPRINGS:
        path = _find_sibling(directory, stem, (OPTIONAL_FILE.suffix,))
        return path, None if path is not None else _no_printed_values_error(stem)
    if directory is None or stem is None or not _is_name(choice):
        return Path(choice), None
    for full in (f"{stem}.{name}{SPRINGS_FILE.suffix}", f"{name}{SPRINGS_FILE.suffix}"):
        if is_file(directory / full):
            return directory / full, None
    beside = springs_names(directory, stem)
    known = (*beside, NO_SPRINGS, PRINTED_SPRINGS)
    if name == "coupled" and "riener" in beside:
        own = _find_sibling(directory, stem, (SPRINGS_FILE.suffix,))
        return own, warning(f"springs `{name}` are the default: one law of hip, knee and ankle")
    return None, error(
        f"there are no springs `{shorten(name)}` beside the figure `{shorten(stem)}`",
        hint=f"there are {', '.join(known)}; else name a file",
    )


def springs_names(directory: Path, stem: str) -> tuple[str, ...]:
    """Return the names that choose springs beside a figure."""
    paths = directory.glob("*" + SPRINGS_FILE.suffix)
    names = (path.name.removesuffix(SPRINGS_FILE.suffix) for path in paths)
    return tuple(sorted(n.removeprefix(f"{stem}.") for n in names if n.startswith(f"{stem}.")))


def _is_name(choice: str | Path) -> bool:
    """Return whether a choice looks like a name and not like the path of a file."""
    path = Path(choice)
    is_word = len(path.parts) == 1 and path.suffix not in _FILE_SUFFIXES
    return not str(choice) or (is_word and not is_file(path))


def _find_sibling(
    directory: Path | None, stem: str | None, suffixes: tuple[str, ...]
) -> Path | None:
    """Return the first file with one of these suffixes beside a figure."""
    if directory is None or stem is None:
        return None
    paths = (directory / f"{stem}{suffix}" for suffix in suffixes)
    return next((path for path in paths if path.exists() or path.is_symlink()), None)


def _no_printed_values_error(stem: str | None) -> Diagnostic:
    if stem is None:
        return error("a figure from no file has no printed values", hint="name a file of springs")
    name = f"{shorten(stem)}{OPTIONAL_FILE.suffix}"
    return error(
        f"there is no `{name}` beside the figure", hint="the printed values are those of that file"
    )


FIGURE_ORIGIN = "figure's own stiff/rest/damp"

WITHIN_FIGURE = f"<figure>{SPRINGS_FILE.suffix}"
"""Origin of springs that are the `springs_text` of their figure."""


def load_springs(
    figure: Figure,
    directory: Path | None = None,
    stem: str | None = None,
    choice: str | Path | None = None,
    law: SphericalLaw | None = None,
    *,
    with_base: bool = True,
    text: str | None = None,
    content: SpringsFile | None = None,
) -> Parsed[SpringSet]:
    """The passive springs of a figure, with all faults; bad input raises nothing.

    A spring from a file replaces `stiff`, `rest` and `damp` on its axis; the figure's limits are
    stops on top of whatever law an axis has. A springs file other than the figure's own extends
    that one, or the file that it names: springs about other axes stay. The figure's own file is its
    `springs_text`, if it has one, or else beside it.

    Args:
        figure: the figure.
        directory: where its file lies; None when it is from no file.
        stem: its file's name without the suffix; None likewise.
        choice: None for `STEM.springs.toml` beside the figure, else `STEM.optional`, else what the
            figure itself says; "none" for no springs and no stops; "printed" for `STEM.optional`
            with every moment as printed; NAME for `STEM.NAME.springs.toml` beside the figure; else
            the path of a springs file (`.toml`) or of an `optional` file.
        law: law of spherical joints; None for what the file says, else
            conservative.
        with_base: whether the springs of an extended file and of the figure's fields stay, and
            the stops of axes that the file does not name.
        text: text of the springs file `choice`, which need not exist; None to read the file.
        content: content of that file, in place of a text.
    """
    if choice is not None and str(choice) == NO_SPRINGS:
        none = SpringSet({}, law or SphericalLaw.CONSERVATIVE, NO_SPRINGS)
        return Parsed(none, ())
    path, fault = find_springs_file(directory, stem, choice)
    if fault is not None and fault.severity is Severity.ERROR:
        return Parsed(None, (fault,))
    own = _find_sibling(directory, stem, (SPRINGS_FILE.suffix, OPTIONAL_FILE.suffix))
    texts = {} if path is None or text is None else {path: make_source(text, str(path))}
    if figure.springs_text is not None:
        own = Path(WITHIN_FIGURE)
        texts[own] = make_source(figure.springs_text, str(own))
        path = own if choice is None else path
    diagnostics, springs, bound = Diagnostics(), None, SpringSet(origin=FIGURE_ORIGIN)
    if fault is not None:
        diagnostics.entries.append(fault)
    with suppress(TooManyErrors):
        if path is not None:
            is_printed = str(choice) == PRINTED_SPRINGS
            contents = {} if content is None else {path: content}
            binder = _FileBinder(figure, own, stem, is_printed, diagnostics, texts, contents)
            bound = binder.bind(path, with_base=with_base)
        bound = replace(bound, law=law or bound.law)
        springs = _complete_springs(figure, bound, diagnostics, with_base=with_base)
    value = None if diagnostics.has_errors else springs
    return Parsed(value, diagnostics.sorted_by_position())


def read_springs(
    path_or_name: str | Path | None, figure: Figure, law: SphericalLaw | None = None
) -> SpringSet:
    """Read a springs file and bind it to the joints of a figure.

    Joints that the file does not name keep the springs of the file that it extends, by default the
    figure's own; then the figure's `stiff`, `rest` and `damp`. All joints keep its limits.

    Args:
        path_or_name: path or name of the file, or what `--springs` takes: NAME for
            `FIGURE.NAME.springs.toml` beside the figure's file, "printed" or "none"; None for the
            springs that a run of the figure has without a choice.
        figure: figure to which they are bound.
        law: law of spherical joints; None for what the file says.

    Raises:
        InputError: anything is wrong; it holds all faults. Warnings pass.
        ModelError: the file replaces a `stiff`, `rest` or `damp` that was changed in Python.
    """

    def load(figure: Figure) -> SpringSet:
        file = figure.path
        folder, stem = (None, None) if file is None else (file.parent, file.stem)
        return load_springs(figure, folder, stem, path_or_name, law).require_value()

    springs = load(figure)
    if springs.origin not in (NO_SPRINGS, FIGURE_ORIGIN):
        _check_changed_joints(figure, springs, load)
    return springs


def _check_changed_joints(
    figure: Figure, springs: SpringSet, load: Callable[[Figure], SpringSet]
) -> None:
    """Raise ModelError for a spring of a joint that was changed in Python without effect.

    Args:
        figure: read from a file or made, and perhaps changed since.
        springs: springs of the figure, from a file of springs.
        load: loads the springs of another version of the figure.
    """
    for joint in figure.joints.values():
        written = _joint_as_read(joint)
        for name in ("stiff", "rest", "damp"):
            values, former = getattr(joint, name), getattr(written, name, None)
            for k in range(len(joint.chain)):
                value = 0.0 if values is None else values[k]
                before = 0.0 if former is None else former[k]
                if value == before:
                    continue
                others = values or (0.0,) * len(joint.chain)
                unchanged = replace(joint, **{name: (*others[:k], before, *others[k + 1 :])})
                versions = (figure, figure.with_parts(unchanged))
                bare = [replace(each, springs_text=None) for each in versions]
                own = [load_springs(each).require_value() for each in bare]
                has_effect = own[0] != own[1]
                if has_effect and load(versions[1]) == springs:
                    raise ModelError(
                        f"`{name}` of joint `{joint.name}` was changed in Python, but the springs "
                        f"of {springs.origin} replace it: change them instead, as Plan(springs=...)"
                    )


def _joint_as_read(joint: Joint) -> Joint | None:
    """Return the joint of this name in the file from which a joint was read; None without one."""
    span = joint.origins.get("name")
    return None if span is None else _joints_in(span.source).get(joint.name)


@lru_cache(maxsize=16)
def _joints_in(source: Source) -> Mapping[str, Joint]:
    """Return the joints of a figure's text."""
    return FIGURE_FILE.parse_text(source.text).require_value().joints


@dataclass
class _FileBinder:
    """Binds a file of springs, and the files that it extends, to a figure.

    Attributes:
        figure: figure to whose joints they are bound.
        own_path: file of the figure's own springs, which others extend.
        stem: name of the figure's file without the suffix.
        use_printed_values: use printed values as for `bind_optional_records`.
        diagnostics: diagnostics for faults.
        texts: texts of files that are not read, by path.
        contents: contents of springs files that are not read, by path.
    """

    figure: Figure
    own_path: Path | None
    stem: str | None
    use_printed_values: bool
    diagnostics: Diagnostics
    texts: Mapping[Path, Source]
    contents: Mapping[Path, SpringsFile]

    def bind(
        self, path: Path, extended_by: tuple[Path, ...] = (), *, with_base: bool = True
    ) -> SpringSet:
        """Return the springs of a file and of those that it extends; faults are noted.

        Their stops have no limits, as those of `extend_springs`.

        Args:
            path: path of the file.
            extended_by: the files that lead to it.
            with_base: whether to read the files that it extends.
        """
        base, figure, diagnostics = SpringSet(origin=""), self.figure, self.diagnostics
        content = self.contents.get(path)
        if content is None:
            known = self.texts.get(path)
            source, fault = load_text(path, str(path)) if known is None else (known, None)
            if fault is not None:
                diagnostics.error(fault.message, fault.span, fault.hint)
                return base
            if path.suffix.lower() != ".toml":
                records = OPTIONAL_FILE.parser(source, diagnostics) or ()
                own = bind_optional_records(figure, records, self.use_printed_values, diagnostics)
                return replace(extend_springs(base, own, (), {}, diagnostics), origin=path.name)
            content = _parse_content(source, self.stem, diagnostics)
        if content is None:
            return base
        own = bind_springs_file(figure, content, diagnostics)
        coupled = bind_coupled_springs(figure, content, diagnostics)
        reaches = bind_reaches(figure, content, diagnostics)
        base_path = self._find_base(path, content) if with_base else None
        files = (*extended_by, path.resolve())
        if base_path is not None and base_path.resolve() in files:
            names = ", ".join(one.name for one in files)
            diagnostics.error(
                f"the files extend each other in a circle: {names}",
                content.origins.get(EXTENDS_KEY),
                f'leave out `{EXTENDS_KEY}`, or write `{BASE_KEY} = "{NO_BASE}"` in one of them',
            )
        elif base_path is not None:
            base = self.bind(base_path, files)
        return replace(
            extend_springs(base, own, coupled, reaches, diagnostics),
            law=content.law or base.law,
            origin=" over ".join(filter(None, (path.name, base.origin))),
        )

    def _find_base(self, path: Path, content: SpringsFile) -> Path | None:
        """Return the file that a springs file extends; None without one, or with a fault noted."""
        if content.stands_alone:
            return None
        if content.extends is None:
            own = self.own_path
            return None if own is None or own.resolve() == path.resolve() else own
        name = content.extends
        if Path(name).suffix in _FILE_SUFFIXES:
            found = path.parent / name
        else:
            folders = [path.parent, *([self.own_path.parent] if self.own_path else [])]
            files = [
                folder / f"{start}{name}{SPRINGS_FILE.suffix}"
                for folder in folders
                for start in ([f"{self.stem}."] if self.stem else []) + [""]
            ]
            found = next(filter(is_file, files), None)
        if found is None or not is_file(found):
            self.diagnostics.error(
                f"there are no springs `{shorten(name)}` to extend",
                content.origins.get(EXTENDS_KEY),
                f'`{BASE_KEY} = "{NO_BASE}"` keeps no other springs'
                if name == NO_SPRINGS
                else "name a file, or springs beside the figure or this file",
            )
            return None
        return found


def _complete_springs(
    figure: Figure, bound: SpringSet, diagnostics: Diagnostics, *, with_base: bool
) -> SpringSet:
    """Return springs of a file with the figure's limits and, with a base, those of its fields."""
    joints = {
        name: springs
        for name, joint in figure.joints.items()
        if (springs := _complete_joint(joint, bound.joints.get(name), diagnostics, with_base))
    }
    if bound.law is SphericalLaw.COORDINATES:
        for name in joints:
            _check_coordinates(figure.joints[name], joints[name], diagnostics)
    return replace(bound, joints=NamedMapping(joints, "the springs have no joint"))


MAX_MIDDLE_LIMIT = radians(80.0)
"""Limit of the middle one of three rotations beyond which a law of coordinates gets a warning."""


def _check_coordinates(joint: Joint, springs: JointSprings, diagnostics: Diagnostics) -> None:
    """Report what a joint lacks for a law of coordinates, and a middle axis that nears its pole."""
    turns = [k for k, factor in enumerate(joint.chain) if is_rotation(factor.kind)]
    if len(turns) < 2 or springs.reach is not None:
        return
    try:
        rotation_law(
            springs, SphericalLaw.COORDINATES, [unit_axis(joint.chain[k].axis) for k in turns]
        )
    except ValueError as failure:
        diagnostics.error(f"joint `{joint.name}`: {failure}", origin_span(joint.origins, "type"))
        return
    if len(turns) == 2:
        return
    low, high = (
        (-inf if joint.lower_limit is None else joint.lower_limit[turns[1]]),
        (inf if joint.upper_limit is None else joint.upper_limit[turns[1]]),
    )
    if max(-low, high) > MAX_MIDDLE_LIMIT:
        ends = f"{degrees(low):.0f} to {degrees(high):.0f} deg"
        diagnostics.warning(
            f"joint `{joint.name}`: the middle one of its rotations may pass 80 deg ({ends}), and "
            "a run ends at 90",
            origin_span(joint.origins, "ulimit", "llimit", "type"),
            'give it limits (`llimit`, `ulimit`), or another `law` than "coordinates"',
        )


MIN_STIFFNESS = 1e-3
"""Stiffness below which a linear spring does not hold a joint [N m/rad or N/m]."""


def joints_without_elastic_law(figure: Figure, springs: SpringSet) -> tuple[str, ...]:
    """Return the moving joints without an elastic law; stops and feeble springs do not count."""
    coupled = {axis.joint for spring in springs.coupled for axis in spring.axes}
    return tuple(
        name
        for name, joint in figure.joints.items()
        if joint.chain and name not in coupled and not _is_elastic(springs.joints.get(name))
    )


def _is_elastic(springs: JointSprings | None) -> bool:
    """Return whether a joint has an elastic law besides stops and feeble springs."""
    if springs is not None and springs.reach is not None:
        return True
    axes = () if springs is None else (*springs.axes, *springs.translations)
    laws = (law for axis in axes for law in axis.laws_besides_stops)
    return any(not isinstance(law, Linear) or law.stiffness >= MIN_STIFFNESS for law in laws)


def _parse_content(
    source: Source, stem: str | None, diagnostics: Diagnostics
) -> SpringsFile | None:
    """Parse a springs file, with a warning if it names another figure."""
    content = SPRINGS_FILE.parser(source, diagnostics)
    if content is not None and content.figure and stem and content.figure != stem:
        diagnostics.warning(
            f"these springs were written for the figure `{shorten(content.figure)}`",
            content.origins.get("figure"),
            f"they are used for `{shorten(stem)}`",
        )
    return content


def _complete_joint(
    joint: Joint, bound: JointSprings | None, diagnostics: Diagnostics, with_base: bool
) -> JointSprings | None:
    """Return the springs of a joint in the order of its chain, then those about other axes.

    None for a joint without springs.
    """
    bound = bound or JointSprings(joint.name)
    if bound.reach is not None:
        along = (replace(one, elastic=one.laws_besides_stops) for one in bound.translations)
        return replace(bound, translations=tuple(along))
    used: list[AxisSpring] = []
    axes: list[AxisSpring] = []
    slides: list[AxisSpring] = []
    for k, factor in enumerate(joint.chain):
        axis = unit_axis(factor.axis)
        match factor.kind:
            case AxisKind.ROTATION:
                own = spring_along(bound.axes, axis)
                if own is None:
                    stop = (DEFAULT_STOP_STIFFNESS, DEFAULT_STOP_ONSET)
                    axes += _figure_spring(joint, k, axis, stop, diagnostics) if with_base else ()
                elif own not in used:
                    used.append(own)
                    axes.append(_add_limits(joint, own))
            case AxisKind.TRANSLATION:
                own = spring_along(bound.translations, axis)
                stop = (DEFAULT_TRANSLATION_STOP_STIFFNESS, DEFAULT_TRANSLATION_STOP_ONSET)
                if own is None:
                    slides += _figure_spring(joint, k, axis, stop, diagnostics) if with_base else ()
                else:
                    laws = (*own.laws_besides_stops, *_build_stops(joint, k, *stop))
                    slides.append(replace(own, elastic=laws))
            case _:
                assert_never(factor.kind)
    axes += [_add_limits(joint, one) for one in bound.axes if one not in used]
    return JointSprings(joint.name, tuple(axes), tuple(slides)) if axes or slides else None


def spring_along(springs: Iterable[AxisSpring], axis: Vector) -> AxisSpring | None:
    """Return the first spring along an axis in either sense; None without one."""
    return next((one for one in springs if parallel_sign(one.direction, axis)), None)


def _add_limits(joint: Joint, spring: AxisSpring) -> AxisSpring:
    """Return a spring with the stops of all the joint's factors about its axis."""
    laws, stop, middle = list(spring.laws_besides_stops), stop_of(spring), 0.0
    for k, factor in enumerate(joint.chain):
        sign = parallel_sign(spring.direction, factor.axis) if is_rotation(factor.kind) else 0
        if sign:
            stops = _build_stops(joint, k, stop.stiffness, stop.onset)
            laws += stops if sign > 0 else [stop.mirrored() for stop in stops]
            middle = sign * _middle_of_range(joint, k)
    return replace(spring, elastic=tuple(laws), middle=middle)


def _middle_of_range(joint: Joint, k: int) -> float:
    """Middle of the limits of factor `k` [rad]; 0 without two."""
    if joint.lower_limit is None or joint.upper_limit is None:
        return 0.0
    middle = 0.5 * (joint.lower_limit[k] + joint.upper_limit[k])
    return middle if isfinite(middle) else 0.0


def _figure_spring(
    joint: Joint, k: int, axis: Vector, stop: tuple[float, float], diagnostics: Diagnostics
) -> list[AxisSpring]:
    """Return the spring of the figure's fields for factor `k`, if any."""
    laws: list[Elastic] = []
    if joint.stiff is not None and joint.stiff[k] != 0.0:
        laws.append(Linear(joint.stiff[k], joint.rest[k] if joint.rest is not None else 0.0))
    laws += _build_stops(joint, k, *stop)
    viscous = joint.damp[k] if joint.damp is not None else 0.0
    if viscous < 0.0:
        diagnostics.error(
            f"the damping of `{shorten(joint.name)}` is negative",
            origin_span(joint.origins, "damp"),
            "it would feed energy",
        )
        return []
    if not laws and not viscous:
        return []
    spring = AxisSpring(axis, tuple(laws), middle=_middle_of_range(joint, k))
    return [replace(spring, damping=Damping(viscous)) if viscous else spring]


def _build_stops(joint: Joint, k: int, stiffness: float, onset: float) -> list[Stop]:
    """The stop at the limits of factor `k`, if it has any."""
    lower = None if joint.lower_limit is None else joint.lower_limit[k]
    upper = None if joint.upper_limit is None else joint.upper_limit[k]
    return [] if lower is None and upper is None else [Stop(lower, upper, stiffness, onset)]


def load_springs_file(path: Path) -> Parsed[tuple[SpringSet, SpringSet, Figure | None]]:
    """The springs in a file, with all faults; bad input raises nothing.

    The figure that the file names is looked for beside it and among the shipped ones. Without one,
    joints and their axes are taken as the file has them.

    Returns:
        The file's own springs, these with those of the file that it extends, and the figure.
    """
    parsed = SPRINGS_FILE.parse_file(path)
    content = parsed.value
    if content is None:
        return Parsed(None, parsed.diagnostics)
    file = _find_figure_file(content, path.parent)
    figure = None if file is None else FIGURE_FILE.parse_file(file).value
    if figure is not None:
        folder = path.parent if file is None else file.parent
        own = load_springs(figure, folder, content.figure, path, with_base=False)
        complete = load_springs(figure, folder, content.figure, path)
        if own.value is None or complete.value is None:
            return Parsed(None, (own if own.value is None else complete).diagnostics)
        return Parsed((own.value, complete.value, figure), complete.diagnostics)
    diagnostics = Diagnostics(list(parsed.diagnostics))
    if content.figure is not None:
        diagnostics.warning(
            f"the figure `{shorten(content.figure)}` is not found or cannot be read",
            content.origins.get("figure"),
            "joints and axes are taken from this file alone",
        )
    loaded = None
    with suppress(TooManyErrors):
        springs = _springs_without_figure(content, path.name, diagnostics)
        loaded = springs, springs, None
    value = None if diagnostics.has_errors else loaded
    return Parsed(value, diagnostics.sorted_by_position())


def _find_figure_file(content: SpringsFile, folder: Path) -> Path | None:
    """The file of the figure for which springs were written."""
    if content.figure is None:
        return None
    beside = folder / f"{content.figure}{FIGURE_FILE.suffix}"
    return beside if beside.is_file() else FIGURE_FILE.shipped().get(content.figure)


def _springs_without_figure(
    content: SpringsFile, origin: str, diagnostics: Diagnostics
) -> SpringSet:
    """The springs without a figure: no limits bound an axis, and which is the only one is unknown.

    Whatever that is, a second spring about it is one too many, and so is one about another axis.
    """
    joints: dict[str, JointSprings] = {}
    for entry, spring in bind_springs_file(None, content, diagnostics):
        own = joints.get(entry.joints[0], JointSprings(entry.joints[0]))
        field = "translations" if is_slide(entry.axis) else "axes"
        joints[own.joint] = replace(own, **{field: (*getattr(own, field), spring)})
    coupled = bind_coupled_springs(None, content, diagnostics)
    return SpringSet(joints, content.law or SphericalLaw.CONSERVATIVE, origin, coupled)
