"""`mover hold`: whether a person can hold a posture with loads, in a pose or along a motion."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import degrees, isfinite, pi
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

from generator.cli import inputs, options, outputs
from generator.cli.answer import CommandResult, Paragraphs, Table, format_written
from generator.cli.options import option, output_option
from generator.diagnostics import Diagnostic, InputError, ModelError, UsageError, error
from generator.figure import Figure
from generator.hold.hands import HandDemand
from generator.hold.page import posture_page, posture_svg
from generator.hold.passive import range_excess, ranges_exceeded
from generator.hold.posture import LARGEST_LOAD, HeaviestLoad, Holder, JointDemand, Posture
from generator.hold.response import page_data, page_loads
from generator.hold.spine import LIMITS, SpineLoad
from generator.hold.statics import GRAVITY, Load, site_point
from generator.hold.support import OffGroundError, Standing
from generator.input_files.tone import STRENGTH_FILE
from generator.kinematics.placement import Displacements, forward_kinematics
from generator.model import Model
from generator.motion_files import FigureMotion
from generator.person.survey import Sex
from generator.text_io import format_csv_comment, format_csv_rows
from springs import SpringSet
from springs.elastic import Range
from springs.strength.strengths import Age, Body

_LOAD = re.compile(r"\s*([^=\s.]+)(?:\.([^=\s]+))?\s*=\s*(.+?)\s*")
_LOAD_SYNTAX = "SEGMENT[.SITE]=10kg or SEGMENT[.SITE]=X,Y,ZN"

LARGEST_FORCE = 1e5
"""Largest component of a load [N]."""

LARGEST_USE = 10.0
"""Use up to which a posture is judged by shares of people."""

_LARGEST_JUDGED_FORCE = -LARGEST_LOAD * GRAVITY[1]
"""Force of a load above which nobody holds what exceeds a strength [N]."""

SHOWN_USE = 0.05
"""Use below which a joint is listed with `--verbose` only."""

SHOWN_ROWS = 9
"""Joints that are listed without `--verbose`."""

SHOWN_NOTES = 3
"""Notes that are listed without `--verbose`."""


def load_from_text(text: str) -> Load:
    """Parse a load of `--load`. Raises UsageError."""
    match = _LOAD.fullmatch(text)
    if match is None:
        raise UsageError(f"--load {text}: expected {_LOAD_SYNTAX}")
    segment, site, value = match[1], match[2] or "", match[3]
    if "," not in value:
        try:
            mass = options.mass_from_option("--load", value)
        except UsageError as failure:
            raise UsageError(f"--load {text}: {str(failure).partition(': ')[2]}") from None
        if mass < 0.0:
            raise UsageError(f"--load {text}: a mass is not below zero")
        return Load(segment, mass, site=site)
    parts = value.removesuffix("N").strip().split(",")
    if not value.endswith("N") or len(parts) != 3:
        raise UsageError(f"--load {text}: expected {_LOAD_SYNTAX}, three components in newtons")
    try:
        x, y, z = map(float, parts)
    except ValueError:
        raise UsageError(f"--load {text}: `{value}` is not three numbers in newtons") from None
    if not all(isfinite(part) and abs(part) <= LARGEST_FORCE for part in (x, y, z)):
        raise UsageError(
            f"--load {text}: components are from -{LARGEST_FORCE:g} to {LARGEST_FORCE:g} N"
        )
    return Load(segment, force=(x, y, z), site=site)


@dataclass(frozen=True)
class PoseHold(CommandResult):
    """Answer for a pose."""

    figure: str
    body: Body | None
    posture: Posture
    heaviest: HeaviestLoad | None
    files: Sequence[Path]

    def paragraphs(self) -> Paragraphs:
        """Return the verdict, a table of joints, balance, spine and hands."""
        yield f"{self.figure}: {_verdict(self.posture, self.body)}"
        if self.heaviest is not None:
            yield _heaviest_sentence(self.heaviest, self.posture.weakest)
        rows = list(_merged(self.posture.joints))
        shown = [row for row in rows if _is_listed(row[1])][:SHOWN_ROWS]
        yield _joint_table(shown)
        yield "\n".join(_lines(self.posture))
        notes = _short_notes(self.posture.notes)
        yield "\n".join(notes[:SHOWN_NOTES])
        left = len(notes) - SHOWN_NOTES
        yield f"{left} more notes: see them with --verbose" if left > 0 else ""
        yield format_written(self.files)

    def details(self) -> Paragraphs:
        """Return all axes, all notes and sources."""
        yield _joint_table([(one.joint, one) for one in self.posture.joints])
        yield "\n".join(_short_notes(self.posture.notes)[SHOWN_NOTES:])
        sources = {one.source for one in self.posture.joints if one.source}
        yield "\n".join(sorted(sources))

    def to_json(self) -> dict[str, object]:
        """Return the keys of `docs/hold.md`."""
        posture, body = self.posture, self.body
        weakest, heaviest = posture.weakest, self.heaviest
        standing = posture.standing
        return {
            "figure": self.figure,
            "person": body
            and {
                "sex": body.sex,
                "age": body.age,
                "mass_kg": body.mass,
                "stature_m": body.stature,
            },
            "loads": [
                {
                    "segment": load.segment,
                    "site": load.site or None,
                    "mass_kg": load.mass,
                    "force_N": load.force,
                    "point_m": site_point(posture.placement, load.segment, load.site),
                }
                for load in posture.loads
            ],
            "joints": [_joint_data(one) for one in posture.joints],
            "weakest": weakest
            and {"joint": weakest.joint, "direction": weakest.direction, "use": weakest.use},
            "percent_capable": posture.percent_capable,
            "beyond_range": [
                {"joint": name, "angle_deg": degrees(angle), "range_deg": [*map(_finite, known)]}
                for name, (angle, known) in posture.beyond.items()
            ],
            "spine": _spine_data(posture.spine),
            "balance": None if standing is None else _balance_data(standing),
            "hands": [_hand_data(one) for one in posture.hands],
            "max": heaviest
            and {
                "segment": heaviest.segment,
                "mass_kg": heaviest.mass,
                "limited_by": heaviest.limited_by,
            },
            "notes": posture.notes,
            "files": self.files,
        }


@dataclass(frozen=True)
class MotionHold(CommandResult):
    """Answer along a motion, taken as a series of postures at rest."""

    figure: str
    motion: Path
    times_s: Sequence[float]
    joint: Sequence[str | None]
    direction: Sequence[str | None]
    use: Sequence[float | None]
    percent_capable: Sequence[float | None]
    compression_N: Sequence[float | None]
    margin_m: Sequence[float | None]
    files: Sequence[Path]

    def paragraphs(self) -> Paragraphs:
        """Return the frame with the largest use, that with the largest compression, and balance."""
        yield f"{options.format_frames(self.times_s)}, each taken as a posture at rest"
        uses = np.array([-1.0 if use is None else use for use in self.use])
        rows: list[tuple[str, str]] = []
        k = int(np.argmax(uses))
        if uses[k] >= 0.0:
            where = f"{self.joint[k]} {self.direction[k]} at {self.times_s[k]:.6g} s"
            percent = self.percent_capable[k]
            capable = "" if percent is None else f"; {percent:.1f} % capable"
            rows.append(("largest use", f"{_percent(float(uses[k]))} of {where}{capable}"))
        spine = [force for force in self.compression_N if force is not None]
        if spine:
            k = int(np.argmax([force or 0.0 for force in self.compression_N]))
            rows.append(
                ("largest compression of L5/S1", f"{max(spine):.0f} N at {self.times_s[k]:.6g} s")
            )
        beyond = sum(
            use is not None and percent is None
            for use, percent in zip(self.use, self.percent_capable, strict=True)
        )
        if beyond:
            rows.append(
                ("beyond the range of a joint", f"{beyond} of {len(self.use)} frames; no use of it")
            )
        out = sum(1 for margin in self.margin_m if margin is not None and margin < 0.0)
        if out:
            rows.append(("out of balance", f"{out} of {len(self.times_s)} frames"))
        off = sum(1 for use in self.use if use is None)
        if off:
            rows.append(("off its feet", f"{off} of {len(self.times_s)} frames"))
        yield Table(rows, 2)
        yield format_written(self.files)


def hold(
    name: options.FigureName,
    pose: options.PoseFile = None,
    displacements: options.JointValues = None,
    load: Annotated[
        list[str] | None,
        option(
            "SEGMENT=10kg|SEGMENT=X,Y,ZN",
            "Mass that hangs from a segment, or force on it in world axes; at SEGMENT.SITE, "
            "or else at its site `grip`, which shipped persons lack: there at the centre of mass "
            "of the segment. May be repeated.",
        ),
    ] = None,
    support: Annotated[
        list[str] | None,
        option(
            "left_foot,...|seat|ground|SEGMENT.SITE",
            "What bears the body. [default: the feet that are lowest]",
        ),
    ] = None,
    balance: Annotated[
        bool, typer.Option("--balance", help="Shift the pelvis until the body is balanced.")
    ] = False,
    age: Annotated[Age, typer.Option(help="Ages of the sample of strengths.")] = Age.YOUNG,
    sex: Annotated[
        Sex | None, typer.Option(help="Sex of the sample. [default: that of the figure]")
    ] = None,
    strength: Annotated[
        Path | None, option("FILE.toml", "Strengths of your own: [[strength]] tables.")
    ] = None,
    springs: options.SpringsChoice = None,
    heaviest: Annotated[
        list[str] | None,
        option(
            "SEGMENT",
            "Find the heaviest load of one segment, in addition to the loads named.",
            "--max",
        ),
    ] = None,
    along: options.MotionFile = None,
    output: Annotated[
        list[Path] | None,
        output_option(
            "FILE.csv|.html|.svg",
            "Table of joints, or of frames; page, or picture, of a posture. May be repeated.",
        ),
    ] = None,
) -> CommandResult:
    """Judge whether a person can hold a posture with loads."""
    files = output or []
    for path in files:
        _check_output(path, along)
    outputs.check_distinct_paths(files)
    if len(heaviest or ()) > 1:
        raise UsageError("--max finds the heaviest load of one segment: name it once")
    sought = next(iter(heaviest or ()), None)
    loads = tuple(map(load_from_text, load or ()))
    figure, warnings = inputs.load_figure(name)
    holder, more = _holder(figure, name, age, sex, strength, springs, support or ())
    _check_loads(figure, [*(one.segment for one in loads), *(heaviest or ())])
    outputs.check_writable(files, (figure.path, along, strength))
    if along is not None:
        if balance or sought is not None:
            raise UsageError("--along takes postures as they are: leave out --balance and --max")
        motion, others = inputs.motion_from_options(figure, along, pose, displacements or ())
        # A body that was free has no joints to the ground.
        holder = replace(holder, model=Model(motion.tree.figure, holder.model.springs))
        return _along_motion(holder, name, along, motion, loads, files, (*warnings, *more, *others))
    placement, others = inputs.placement_from_options(figure, pose, displacements or ())
    values: Displacements = placement.displacements
    if balance and sought is None:
        values = holder.balanced(values, loads)
    for joint, (angle, known) in ranges_exceeded(forward_kinematics(holder.tree, values)).items():
        if range_excess(angle, known) > pi:
            raise ModelError(
                f"{joint} at {degrees(angle):.0f} deg is more than half a turn beyond its range, "
                f"{_range_text(known)}"
            )
    found = None
    if sought is not None:
        found = holder.heaviest(sought, values, loads, balance=balance)
    posture = holder.posture(values, loads) if found is None else found.posture
    outputs.write_files({path: _content(path, name, posture, holder) for path in files})
    return PoseHold(
        name, holder.body, posture, found, files, diagnostics=(*warnings, *more, *others)
    )


def _check_output(output: Path, along: Path | None) -> None:
    """Raise UsageError for a suffix that frames, or a single posture, cannot have."""
    known = (".csv",) if along is not None else (".csv", ".html", ".svg")
    if output.suffix.lower() not in known:
        reason = outputs.suffix_fault(output)
        if along is not None and output.suffix.lower() in (".html", ".svg"):
            reason = "a page is of a single posture"
        raise UsageError(f"-o {output}: {reason}; known are {', '.join(known)}")


def _content(path: Path, name: str, posture: Posture, holder: Holder) -> str:
    """Return the content of the file of a posture."""
    match path.suffix.lower():
        case ".html":
            lines = [_verdict(posture, holder.body), *_lines(posture)]
            table = _joint_table(list(_merged(posture.joints))).rows
            # The use is third: a narrow screen shows three columns.
            rows = [[*row[:2], row[7], *row[2:7], *row[8:]] for row in table]
            notes = _short_notes(posture.notes)
            loads = page_loads(holder.model.figure, posture.loads)
            posture = replace(posture, loads=loads)
            data = page_data(holder, posture)
            for key in ("notes_before", "notes_after"):
                data[key] = _short_notes(data[key])
            data |= _page_texts(posture, holder.body)
            return posture_page(f"Posture of {name}", lines, rows, notes, posture, data)
        case ".svg":
            return posture_svg(posture)
        case _:
            return _joint_csv(name, posture)


def _page_texts(posture: Posture, body: Body | None) -> dict[str, object]:
    """Return texts and bounds of the command by which a page states its answer."""
    return {
        "who": _people(body),
        "beyond": _beyond_sentence(posture),
        "largest_use": LARGEST_USE,
        "largest_force": _LARGEST_JUDGED_FORCE,
        "shown_use": SHOWN_USE,
        "same": _SAME,
    }


def _holder(
    figure: Figure,
    name: str,
    age: Age,
    sex: Sex | None,
    strength: Path | None,
    springs: str | None,
    support: Sequence[str],
) -> tuple[Holder, tuple[Diagnostic, ...]]:
    """Return the holder of the options, with warnings."""
    spring_set, warnings = inputs.springs_from_option(figure, springs)
    stated = None if strength is None else STRENGTH_FILE.parse_file(strength).require_value()
    supports = [one.strip() for text in support for one in text.split(",")]
    try:
        holder = Holder.of(
            Model(figure, spring_set),
            age,
            is_female=None if sex is None else sex is Sex.FEMALE,
            stated=stated,
            supports=supports or None,
            motions=_motions(figure, spring_set),
        )
    except UsageError as failure:
        raise UsageError(f"--support {','.join(support)}: {failure}") from None
    except ModelError as failure:
        if strength is None:
            raise
        raise UsageError(f"--strength {strength}: {failure}") from None
    if holder.body is None and stated is None:
        raise InputError(
            [
                error(
                    f"`{figure.path or name}` states no sex and stature, on which strength depends",
                    hint='write `attribute person { sex = "male"; stature_m = 1.75; }`, or state '
                    "strengths by --strength FILE.toml",
                )
            ]
        )
    return holder, warnings


def _motions(figure: Figure, springs: SpringSet) -> SpringSet | None:
    """Return the figure's own springs where those that are chosen name no motions."""
    if any(axis.motion for joint in springs.joints.values() for axis in joint.axes):
        return None
    return inputs.parse_springs_option(figure, None).require_value()


def _check_loads(figure: Figure, names: Sequence[str]) -> None:
    """Raise UsageError for a load on a part of the ground."""
    for name in names:
        if name.partition(".")[0] in figure.ground:
            raise UsageError(f"segment `{name}` is part of the ground, which bears any load")


def _along_motion(
    holder: Holder,
    name: str,
    path: Path,
    motion: FigureMotion,
    loads: Sequence[Load],
    files: Sequence[Path],
    diagnostics: tuple[Diagnostic, ...],
) -> MotionHold:
    rows = [_frame(holder, motion, loads, k) for k in range(len(motion.times))]
    for file in files:
        titles = "time [s],joint,direction,use,capable [%],compression [N],margin [m]"
        cells = (["" if cell is None else _cell(cell) for cell in row] for row in rows)
        outputs.write_frame_table(file, motion.header.lines(), titles, motion.times, cells)
    return MotionHold(
        name,
        path,
        motion.times.tolist(),
        joint=[row.joint for row in rows],
        direction=[row.direction for row in rows],
        use=[row.use for row in rows],
        percent_capable=[row.percent_capable for row in rows],
        compression_N=[row.compression for row in rows],
        margin_m=[row.margin for row in rows],
        files=files,
        diagnostics=diagnostics,
    )


class _Frame(NamedTuple):
    """Weakest joint, its direction and use, percentage, compression and margin of a frame."""

    joint: str | None = None
    direction: str | None = None
    use: float | None = None
    percent_capable: float | None = None
    compression: float | None = None
    margin: float | None = None


def _frame(holder: Holder, motion: FigureMotion, loads: Sequence[Load], k: int) -> _Frame:
    """Return what is known of a frame; nothing where both feet are off the ground."""
    joints = holder.tree.kinematics.columns
    values = {joint: motion.displacements[joint][k] for joint in joints}
    try:
        posture = holder.posture(values, loads, must_balance=False)
    except OffGroundError:
        return _Frame()
    weakest, spine, standing = posture.weakest, posture.spine, posture.standing
    return _Frame(
        weakest and weakest.joint,
        weakest and weakest.direction,
        weakest and weakest.use,
        posture.percent_capable,
        spine and spine.compression,
        standing and standing.margin,
    )


def _heaviest_sentence(found: HeaviestLoad, weakest: JointDemand | None) -> str:
    # The last load is the one sought.
    named = found.posture.loads[:-1]
    if found.mass == 0.0 and weakest is not None:
        what = "the loads named exceed" if named else "the posture alone exceeds"
        return (
            f"{what} the strength of {found.limited_by} already ({_percent(weakest.use or 0.0)}): "
            f"{found.segment} holds nothing more"
        )
    more = " in addition to the loads named" if named else ""
    return (
        f"the heaviest load of {found.segment} is {found.mass:.2f} kg{more}, limited by "
        f"{found.limited_by}; what follows is with it"
    )


def _finite(angle: float) -> float | None:
    return degrees(angle) if isfinite(angle) else None


def _range_text(known: Range) -> str:
    low, high = (f"{degrees(end):.0f}" if isfinite(end) else "any" for end in known)
    return f"{low} to {high} deg"


def _beyond_sentence(posture: Posture) -> str:
    """Return that a posture is beyond the range of joints; "" within."""
    joints = [f"{name} ({_range_text(known)})" for name, (_, known) in posture.beyond.items()]
    return f"this posture is beyond the range of {', '.join(joints)}" if joints else ""


def _people(body: Body | None) -> str:
    """Return the words of those whose strengths are taken."""
    if body is None:
        return "people with the strengths stated"
    sex = "women" if body.is_female else "men"
    return f"{sex} over 65 years" if body.age is Age.OLD else f"{sex} of {body.age} years"


def _verdict(posture: Posture, body: Body | None) -> str:
    weakest, percent = posture.weakest, posture.percent_capable
    if posture.beyond:
        return _beyond_sentence(posture)
    if weakest is None or weakest.use is None or percent is None:
        return "no strength of its joints is known"
    who = _people(body)
    if weakest.active == 0.0:
        return f"holds without muscles; {who}"
    joint = f"{weakest.joint} {weakest.direction}"
    loads = page_loads(posture.placement.tree.figure, posture.loads)
    largest = max((float(np.linalg.norm(one.total)) for one in loads), default=0.0)
    if weakest.use > (LARGEST_USE if largest <= _LARGEST_JUDGED_FORCE else 1.0):
        times = (
            f"{float(f'{weakest.use:.3g}'):g} times" if isfinite(weakest.use) else "it is beyond"
        )
        return f"nobody holds this: {times} the strength of {joint} of {who}"
    least, where = percent, ""
    if posture.least_capable is not None:
        where = f"{posture.least_capable.joint} {posture.least_capable.direction}"
    for hand in posture.hands:
        if round(hand.percent_capable, 9) < round(least, 9):
            least, where = hand.percent_capable, f"{hand.hand} by the Arm Force Field"
    text = f"{least:.0f} % of {who} are strong enough"
    if least < (weakest.percent_capable or 0.0) - 0.5:
        text += f" ({where})"
    text += f"; weakest joint is {joint} with {_percent(weakest.use)} of its strength"
    time = weakest.endurance
    return text + (f", for {_duration(time)}" if time else "")


def _percent(use: float) -> str:
    if not isfinite(use):
        return "more than all"
    return f"{100.0 * use:.0f} %" if use <= LARGEST_USE else f"over {100.0 * LARGEST_USE:.0f} %"


def _duration(seconds: float | None) -> str:
    if seconds is None:
        return "long"
    if seconds == 0.0:
        return "none"
    return f"{seconds:.0f} s" if seconds < 120.0 else f"{seconds / 60.0:.0f} min"


_SAME = 5e-3
"""Difference of the sides of a body below which they are one row, over the larger one."""


def _merged(joints: Sequence[JointDemand]) -> Iterator[tuple[str, JointDemand]]:
    """Yield demands by use, the largest first, both sides as one row where they are equal."""
    ordered = sorted(joints, key=lambda one: -round(one.use or 0.0, 9))
    done: set[int] = set()
    for k, one in enumerate(ordered):
        if k in done:
            continue
        side, _, rest = one.joint.partition("_")
        name = one.joint
        if side in ("left", "right"):
            other = f"{'right' if side == 'left' else 'left'}_{rest}"
            for n, twin in enumerate(ordered):
                if (
                    (twin.joint, twin.direction) == (other, one.direction)
                    and abs(twin.active - one.active) <= _SAME * max(one.active, 0.1)
                    and abs(twin.angle - one.angle) < 1e-6
                ):
                    done.add(n)
                    name = f"both {rest.removesuffix('_joint')}s"
        yield name, one


def _is_listed(one: JointDemand) -> bool:
    return one.use is not None and one.use >= SHOWN_USE


def _joint_table(rows: Sequence[tuple[str, JointDemand]]) -> Table:
    titles = ["joint", "direction", "angle [deg]", "net", "passive", "active", "capacity [N m]"]
    table = [[*titles, "use", "capable", "held for", "class"]]
    for name, one in rows:
        known = one.capacity is not None
        table.append(
            [
                name,
                f"{one.direction}*" if one.is_antagonist else one.direction,
                options.format_rounded(degrees(one.angle), 0),
                *(options.format_rounded(x, 1) for x in (one.net, one.passive, one.active)),
                options.format_rounded(one.capacity or 0.0, 1) if known else "",
                "" if one.use is None else _percent(one.use),
                "" if one.percent_capable is None else f"{one.percent_capable:.1f} %",
                _duration(one.endurance) if known else "",
                "" if one.origin is None else one.origin.value,
            ]
        )
    return Table(table if rows else [], 2)


def _lines(posture: Posture) -> Iterator[str]:
    """Yield lines on balance, spine and hands."""
    standing, spine = posture.standing, posture.spine
    if standing is not None:
        x, _, z = (100.0 * standing.centre_of_pressure).tolist()
        yield (
            f"balance: centre of pressure {abs(x):.1f} cm to the {'left' if x >= 0.0 else 'right'} "
            f"and {abs(z):.1f} cm {'forward' if z >= 0.0 else 'back'} of the world's origin, "
            f"{100 * standing.margin:.1f} cm inside the edge of the support"
        )
    if spine is not None:
        forward, left = round(spine.moment), round(spine.lateral)
        yield (
            f"L5/S1: bent by {abs(forward)} N m {'forward' if forward >= 0 else 'back'} and "
            f"{abs(left)} N m to the {'left' if left >= 0 else 'right'}, "
            f"compression {spine.compression:.0f} N ({spine.low:.0f} to {spine.high:.0f}); "
            f"{_spine_verdict(spine)}"
        )
    for hand in posture.hands:
        yield (
            f"{hand.hand}: {hand.force:.0f} N of {hand.strength.capacity:.0f} N by the Arm Force "
            f"Field, {hand.percent_capable:.1f} % capable ({hand.origin.value})"
        )
    if any(one.is_antagonist for one in posture.joints if _is_listed(one)):
        yield "* against the passive moment, which is larger than the net one"


def _spine_verdict(spine: SpineLoad) -> str:
    action, largest = LIMITS
    if spine.high <= action:
        return f"below NIOSH's {action:.0f} N"
    if spine.low > largest:
        return f"above NIOSH's {action:.0f} and {largest:.0f} N"
    if spine.high > largest:
        return f"NIOSH's {largest:.0f} N is within the band"
    if spine.low <= action:
        return f"NIOSH's {action:.0f} N is within the band"
    return f"above NIOSH's {action:.0f} N, below {largest:.0f} N"


def _short_notes(notes: Sequence[str]) -> list[str]:
    """Return notes, each once, both sides of a body as one."""
    found: dict[str, None] = {}
    for note in notes:
        both = re.sub(r"\b(left|right)_", "both ", note).replace("_joint ", " ")
        other = re.sub(
            r"\b(left|right)_", lambda side: "right_" if side[1] == "left" else "left_", note
        )
        found[both if other != note and other in notes else note] = None
    return list(found)


def _joint_data(one: JointDemand) -> dict[str, object]:
    return {
        "joint": one.joint,
        "direction": one.direction,
        "angle_deg": degrees(one.angle),
        "net_Nm": one.net,
        "passive_Nm": one.passive,
        "active_Nm": one.active,
        "capacity_Nm": one.capacity,
        "capacity_5_Nm": one.capacity_5,
        "use": one.use,
        "percent_capable": one.percent_capable,
        "endurance_s": one.endurance,
        "class": one.origin,
        "source": one.source or None,
    }


def _spine_data(spine: SpineLoad | None) -> Mapping[str, object] | None:
    return spine and {
        "moment_Nm": spine.moment,
        "lateral_Nm": spine.lateral,
        "compression_N": spine.compression,
        "low_N": spine.low,
        "high_N": spine.high,
        "limits_N": LIMITS,
    }


def _balance_data(standing: Standing) -> dict[str, object]:
    return {
        "centre_of_pressure_m": standing.centre_of_pressure,
        "margin_m": standing.margin,
        "supports": {one.name: one.force for one in standing.bearings},
    }


def _hand_data(hand: HandDemand) -> dict[str, object]:
    return {
        "hand": hand.hand,
        "force_N": hand.force,
        "capacity_N": hand.strength.capacity,
        "percent_capable": hand.percent_capable,
        "class": hand.origin,
    }


def _cell(value: object) -> str:
    return repr(value) if isinstance(value, float) else str(value)


def _joint_csv(name: str, posture: Posture) -> str:
    """Return the table of joints, with the keys of the JSON as titles."""
    rows = [_joint_data(one) for one in posture.joints]
    cells = ([getattr(value, "value", value) for value in row.values()] for row in rows)
    titles = list(rows[0]) if rows else []
    return format_csv_comment(f"figure {name}") + format_csv_rows([titles, *cells])
