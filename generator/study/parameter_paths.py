"""Paths of the quantities that a study varies.

    springs.scale                        elastic torques of all joints, stops excepted
    springs.damping_scale                damping and friction of all joints
    springs.JOINT[.AXIS].scale           those of a joint and its reach, and of the terms of a law
                                         over several joints that depend on it
    springs.JOINT[.AXIS].damping_scale
    springs.JOINT[.AXIS].offset_deg      shift of the elastic curve
    springs.JOINT[.AXIS].viscous_Nms_rad
    springs.JOINT[.AXIS].coulomb_Nm
    springs.coupled.scale                laws over several joints
    springs[.JOINT[.AXIS]].stop_scale    torques of the stops
    segments.NAME.mass                   [kg]; the radius of gyration stays
    segments[.NAME].mass_scale           also of all segments
    segments[.NAME].inertia_scale
    pose.JOINT[.k], velocity.JOINT[.k]   [deg or cm, per second]
    gravity                              factor of its size
    height                               [m]
    floor.friction, floor.stiffness      or another prop of the scene
    contact[.PART].stiffness_scale       of the parts of the body, or of one with its regions
    contact[.PART].damping_scale
    load.SEGMENT                         [kg] that hang from its grip, or else its centre of mass
    hold.age                             [years] of those who hold the posture at the start
    tone.scale                           shares of strength of the tone of muscles
    fall.seed                            of the start of a kind of fall, rounded down
    person                               number of the person, of several, from 1
    person.stature, person.mass          [m, kg]
    person.mass_index                    [kg/m2]
    person.DIMENSION                     [m]
    person.hip_datum                     [deg]

`knee` is `left_knee` and `right_knee`, both with the same anatomical change, counted as on the
left; `hip` is also `left_hip_joint` and `right_hip_joint`. An axis is the name of its motion, such
as `flexion`, or its number in the chain of the joint. Quantities of a slide end in `offset_cm`,
`viscous_Ns_m` and `coulomb_N`.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import degrees, nan
from typing import NoReturn

from generator.diagnostics import ModelError, UnknownNameError, shorten, spelling_hint
from generator.figure import (
    CENTRE_OF_MASS_SITE,
    Figure,
    Joint,
    Vector,
    follower_sentence,
    is_rotation,
)
from generator.hold.statics import GRIP_SITE
from generator.kinematics.free_root import FREE_CHAINS
from generator.kinematics.links import mirror_rotations, mirror_signs, mirrored_name
from generator.model import Model
from generator.rotations import unit_axis
from generator.run_options import STUDY_OPTIONS, VARYING_OPTIONS
from generator.simulation.plan import Plan, option_faults
from generator.springs_file.axes import parallel_sign
from generator.study.study import PersonArguments
from springs import AxisSpring, JointSprings, SpringSet, Stop
from springs.short_repr import short_repr
from springs.strength.strengths import Age


class UnknownPathError(UnknownNameError):
    """A study cannot vary such a quantity; the message states the nearest one."""


@short_repr
@dataclass(frozen=True)
class Case:
    """A model and its run.

    Attributes:
        model: Figure and springs.
        plan: Plan of the run, without springs.
        age: Ages of the sample of strengths by which a held posture is judged.
    """

    model: Model
    plan: Plan
    age: Age = Age.YOUNG

    @property
    def figure(self) -> Figure:
        """Figure of the model."""
        return self.model.figure

    @property
    def springs(self) -> SpringSet:
        """Springs of the model."""
        return self.model.springs

    def with_springs(self, springs: SpringSet) -> "Case":
        """Return the case with other springs."""
        return replace(self, model=replace(self.model, springs=springs))

    def with_figure(self, figure: Figure) -> "Case":
        """Return the case with another figure."""
        return replace(self, model=replace(self.model, figure=figure))


class Quantity(StrEnum):
    """Kind of a quantity; the value is the last word of its path without a unit."""

    SCALE = "scale"
    DAMPING_SCALE = "damping_scale"
    OFFSET = "offset"
    VISCOUS = "viscous"
    COULOMB = "coulomb"
    COUPLED_SCALE = "coupled scale"
    STOP_SCALE = "stop_scale"
    MASS = "mass"
    MASS_SCALE = "mass_scale"
    INERTIA_SCALE = "inertia_scale"
    POSE = "pose"
    VELOCITY = "velocity"
    GRAVITY = "gravity"
    OPTION = "option"
    FRICTION = "friction"
    STIFFNESS = "stiffness"
    PART_STIFFNESS = "stiffness_scale"
    PART_DAMPING = "part damping_scale"
    TONE_SCALE = "tone scale"
    LOAD = "load"
    HOLD_AGE = "hold age"
    SEED = "seed"
    PERSON = "person"
    PERSON_NUMBER = "person number"


@dataclass(frozen=True)
class Target:
    """A number of a case.

    Attributes:
        name: name of the joint, segment, prop, part or dimension.
        direction: direction of a spring's axis; None for all axes of the joint.
        slides: whether that axis is of a slide.
        index: index of a displacement, in the chain of the joint.
        sign: sign of the number for a positive value of the path.
    """

    name: str
    direction: Vector | None = None
    slides: bool = False
    index: int = 0
    sign: int = 1


@dataclass(frozen=True)
class ParameterPath:
    """A quantity that a study may vary.

    Attributes:
        text: text as written.
        unit: unit of its values, such as "deg"; "" for a factor.
        quantity: its kind.
        targets: numbers that get its value, the left side first.
        person_value: person value of a person without a change [m or kg]; NaN for other quantities.
    """

    text: str
    unit: str
    quantity: Quantity
    targets: tuple[Target, ...] = ()
    person_value: float = nan

    @property
    def numbers(self) -> tuple["Number", ...]:
        """Numbers that get its value; a path without targets is one itself."""
        return tuple((self.quantity, target) for target in self.targets or (None,))

    def __str__(self) -> str:
        """As written."""
        return self.text


Number = tuple[Quantity, Target | None]
"""A quantity and the number of a case that it is of."""

_SPRING_WORDS: Mapping[str, tuple[Quantity, str, bool | None]] = {
    "scale": (Quantity.SCALE, "", None),
    "damping_scale": (Quantity.DAMPING_SCALE, "", None),
    "stop_scale": (Quantity.STOP_SCALE, "", None),
    "offset_deg": (Quantity.OFFSET, "deg", False),
    "viscous_Nms_rad": (Quantity.VISCOUS, "N m s/rad", False),
    "coulomb_Nm": (Quantity.COULOMB, "N m", False),
    "offset_cm": (Quantity.OFFSET, "cm", True),
    "viscous_Ns_m": (Quantity.VISCOUS, "N s/m", True),
    "coulomb_N": (Quantity.COULOMB, "N", True),
}
"""Quantity, unit, and whether it is of slides, by the last word of a path."""

_SEGMENT_WORDS: Mapping[str, tuple[Quantity, str]] = {
    "mass": (Quantity.MASS, "kg"),
    "mass_scale": (Quantity.MASS_SCALE, ""),
    "inertia_scale": (Quantity.INERTIA_SCALE, ""),
}
_SURFACE_WORDS: Mapping[str, str] = {"friction": "", "stiffness": "N/m"}
_PART_WORDS: Mapping[str, Quantity] = {
    "stiffness_scale": Quantity.PART_STIFFNESS,
    "damping_scale": Quantity.PART_DAMPING,
}

MASS_INDEX = "mass_index"
"""Mass of a person over the squared stature, in place of the mass: it hardly depends on stature."""

MASS_INDEX_UNIT = "kg/m2"

FREE_MOTIONS = 6
"""Number of velocities of a free segment."""

_SIDE = re.compile(r"(?:left|right)_?|_(?:left|right)$")
_JOINT_SUFFIX = "_joint"


def parse_path(
    text: str,
    case: Case,
    persons: Sequence[PersonArguments] = (),
    *,
    falls: bool = False,
    holds: bool = False,
) -> ParameterPath:
    """Return the quantity of a path. Raises UnknownPathError.

    Args:
        text: the path.
        case: its figure, springs and scene.
        persons: arguments of the figure, where it is a person, or of all that it may be.
        falls: Whether each run has the start of a kind of fall.
        holds: Whether the posture at the start is judged as held.
    """
    return _PathParser(text, case, persons, falls, holds).parse()


@dataclass(frozen=True)
class _Axis:
    """An axis of a joint with its spring, if it has one."""

    direction: Vector
    number: int | None
    slides: bool
    spring: AxisSpring | None

    @property
    def motion(self) -> str:
        """Name of a positive angle, as a path writes it."""
        return "" if self.spring is None else _motion_word(self.spring.motion)


def _motion_word(motion: str) -> str:
    return re.sub(r"\W+", "_", motion.strip().lower())


def _joint_axes(case: Case, joint: Joint) -> list[_Axis]:
    """Return the axes of a joint's chain, and those of its other springs."""
    own = case.springs.joints.get(joint.name, JointSprings(joint.name))
    springs = [(axis, False) for axis in own.axes] + [(axis, True) for axis in own.translations]
    axes: list[_Axis] = []
    for number, factor in enumerate(joint.chain, 1):
        direction, slides = unit_axis(factor.axis), not is_rotation(factor.kind)
        found = next(
            (
                (axis, kind)
                for axis, kind in springs
                if kind is slides and parallel_sign(axis.direction, direction)
            ),
            None,
        )
        if found is None:
            axes.append(_Axis(direction, number, slides, None))
        else:
            springs.remove(found)
            axes.append(_Axis(found[0].direction, number, slides, found[0]))
    return [*axes, *(_Axis(axis.direction, None, kind, axis) for axis, kind in springs)]


class _PathParser:
    """Reader of one path."""

    def __init__(
        self,
        text: str,
        case: Case,
        persons: Sequence[PersonArguments],
        falls: bool,
        holds: bool,
    ) -> None:
        self._text = text
        self._words = text.split(".")
        self._case = case
        self._persons = persons
        self._falls = falls
        self._holds = holds
        self._figure = case.figure

    def parse(self) -> ParameterPath:
        """Return the quantity. Raises UnknownPathError."""
        props = {prop.name for prop in self._case.plan.scene.props}
        readers: dict[str, Callable[[], ParameterPath]] = {
            "springs": self._parse_springs,
            "segments": self._parse_segments,
            "contact": self._parse_parts,
            "pose": self._parse_motion,
            "velocity": self._parse_motion,
            "gravity": self._parse_gravity,
            **dict.fromkeys(VARYING_OPTIONS, self._parse_option),
            "tone": self._parse_tone,
            "load": self._parse_load,
            "hold": self._parse_hold,
            "fall": self._parse_fall,
            "person": self._parse_person,
            **dict.fromkeys(props, self._parse_prop),
        }
        if self._words[0] == "floor" and "floor" not in props:
            self._fail("the scene has no floor; the option `floor` adds one")
        reader = readers.get(self._words[0])
        if reader is None:
            self._fail("unknown first word", 0, readers)
        return reader()

    def _fail(self, reason: str, place: int | None = None, known: Iterable[str] = ()) -> NoReturn:
        """Raise UnknownPathError, with the path in which a known word is at a place."""
        hint = "" if place is None else spelling_hint(self._words[place], known)
        match = re.fullmatch(r"did you mean `(.*)`\?", hint)
        if match is not None and place is not None:
            near = [*self._words[:place], match[1], *self._words[place + 1 :]]
            hint = f"did you mean `{'.'.join(near)}`?"
        message = f"`{shorten(self._text)}`: {reason}"
        raise UnknownPathError(f"{message}; {hint}" if hint else message)

    def _check_length(self, *counts: int, form: str) -> None:
        if len(self._words) not in counts:
            self._fail(f"the path is written `{form}`")

    def _names(self, place: int, noun: str, known: Iterable[str]) -> tuple[str, ...]:
        """Return the names that a word means: one, or those of both sides with the left first."""
        names = list(known)
        word = self._words[place]
        if word in names:
            return (word,)
        meanings: dict[str, list[str]] = {}
        for name in names:
            plain = {name, name.removesuffix(_JOINT_SUFFIX)}
            if mirrored_name(name) in names and mirrored_name(name) != name:
                plain |= {_SIDE.sub("", each) for each in tuple(plain)}
            for each in plain:
                meanings.setdefault(each, []).append(name)
        if word not in meanings:
            self._fail(f"the figure has no {noun} `{shorten(word)}`", place, meanings)
        return tuple(sorted(meanings[word], key=lambda name: "left" not in name))

    def _parse_springs(self) -> ParameterPath:
        self._check_length(2, 3, 4, form="springs.JOINT.QUANTITY")
        last = len(self._words) - 1
        joints = self._figure.joints
        if last == 1:
            if self._words[1] not in ("scale", "damping_scale", "stop_scale"):
                if self._words[1] not in _SPRING_WORDS:
                    self._names(1, "joint", joints)
                    self._fail(f"the quantity is missing; `{self._text}.scale`, for example")
                self._fail(
                    "all joints together have a `scale`, a `damping_scale` and a `stop_scale` only"
                )
            return ParameterPath(self._text, "", Quantity(self._words[1]))
        if self._words[1] == "coupled" and self._case.springs.coupled:
            if self._words[2:] != ["scale"]:
                self._fail("laws over several joints have a scale only", last, ("scale",))
            return ParameterPath(self._text, "", Quantity.COUPLED_SCALE)
        names = self._names(1, "joint", (name for name in joints if joints[name].chain))
        if self._words[last] not in _SPRING_WORDS:
            kinds = {axis.slides for axis in _joint_axes(self._case, joints[names[0]])}
            known = (w for w, row in _SPRING_WORDS.items() if row[2] is None or row[2] in kinds)
            self._fail(f"unknown quantity `{shorten(self._words[last])}`", last, known)
        quantity, unit, slides = _SPRING_WORDS[self._words[last]]
        first = self._axis_targets(joints[names[0]], quantity, slides)
        targets = list(first)
        for name in names[1:]:
            targets += self._mirrored_targets(name, first)
        return ParameterPath(self._text, unit, quantity, tuple(targets))

    def _axis_targets(
        self, joint: Joint, quantity: Quantity, slides: bool | None
    ) -> tuple[Target, ...]:
        """Return the axes of the joint of the path's first side that the path means."""
        axes = [a for a in _joint_axes(self._case, joint) if slides is None or a.slides is slides]
        if not axes:
            kind = "slide" if slides else "turn"
            self._fail(f"`{joint.name}` does not {kind}")
        if len(self._words) == 4:
            axes = [self._named_axis(joint, axes)]
        needs_law = quantity in (Quantity.SCALE, Quantity.OFFSET)
        if quantity is Quantity.STOP_SCALE:
            return self._stopped_axes(joint, axes)
        found = [axis for axis in axes if self._has_law(joint, axis, needs_law)]
        if quantity in (Quantity.VISCOUS, Quantity.COULOMB) and not found:
            found = axes
        if not found:
            kind = "elastic law" if needs_law else "damping"
            self._fail(f"`{joint.name}` has no {kind} here, so that it cannot be changed")
        if quantity not in (Quantity.SCALE, Quantity.DAMPING_SCALE) and len(found) > 1:
            word = found[0].motion or str(found[0].number)
            example = ".".join([*self._words[:2], word, self._words[-1]])
            self._fail(
                f"`{joint.name}` has {len(found)} axes, of which the path names one: `{example}`"
            )
        return tuple(Target(joint.name, axis.direction, axis.slides) for axis in found)

    def _stopped_axes(self, joint: Joint, axes: Sequence[_Axis]) -> tuple[Target, ...]:
        own = self._case.springs.joints.get(joint.name)
        reach = own and own.reach
        found = tuple(
            Target(joint.name, axis.direction, axis.slides)
            for axis in axes
            if reach or (axis.spring and any(isinstance(law, Stop) for law in axis.spring.elastic))
        )
        if not found:
            self._fail(f"`{joint.name}` has no stop here, so that it cannot be changed")
        return found

    def _has_law(self, joint: Joint, axis: _Axis, needs_law: bool) -> bool:
        """Return whether an axis has a spring, with an elastic law if one is needed."""
        coupled = [each for spring in self._case.springs.coupled for each in spring.axes]
        if needs_law and any(
            each.joint == joint.name and parallel_sign(each.direction, axis.direction)
            for each in coupled
        ):
            return True
        own = self._case.springs.joints.get(joint.name)
        if needs_law and own is not None and own.reach is not None:
            return len(self._words) == 3 and self._words[2] == Quantity.SCALE.value
        if axis.spring is None:
            return False
        return not needs_law or bool(axis.spring.laws_besides_stops)

    def _named_axis(self, joint: Joint, axes: Sequence[_Axis]) -> _Axis:
        word = self._words[2]
        exact = [axis for axis in axes if word in (str(axis.number), axis.motion)]
        parts = set(_motion_word(word).split("_"))
        found = exact or [axis for axis in axes if parts <= set(axis.motion.split("_"))]
        if len(found) != 1:
            known = [axis.motion or str(axis.number) for axis in axes]
            self._fail(f"`{joint.name}` has no axis `{shorten(word)}`", 2, known)
        return found[0]

    def _mirrored_targets(self, name: str, first: Sequence[Target]) -> Iterator[Target]:
        """Yield the axes of a joint that are mirror images of those of the other side."""
        images = mirror_rotations(self._figure)
        axes = _joint_axes(self._case, self._figure.joints[name])
        for target in first:
            assert target.direction is not None
            image = images[target.name][1] @ target.direction
            # A slide's image is the opposite of that of a rotation about the same axis.
            x, y, z = (-image if target.slides else image).tolist()
            for axis in axes:
                sense = parallel_sign(axis.direction, (x, y, z))
                if sense and axis.slides is target.slides:
                    yield Target(name, axis.direction, axis.slides, sign=sense)
                    break
            else:
                self._fail_asymmetric(target.name, name)

    def _fail_asymmetric(self, one: str, other: str) -> NoReturn:
        self._fail(f"`{one}` and `{other}` are not mirror images, so that the path names one side")

    def _parse_segments(self) -> ParameterPath:
        self._check_length(2, 3, form="segments.NAME.mass")
        bodies = {name: body for name, body in self._figure.bodies.items() if body.mass}
        last = len(self._words) - 1
        known = [w for w in _SEGMENT_WORDS if last == 2 or w != "mass"]
        names = self._names(1, "segment", bodies) if last == 2 else tuple(bodies)
        if self._words[last] not in known:
            self._fail(f"unknown quantity `{shorten(self._words[last])}`", last, known)
        quantity, unit = _SEGMENT_WORDS[self._words[last]]
        return ParameterPath(self._text, unit, quantity, tuple(map(Target, names)))

    def _parse_parts(self) -> ParameterPath:
        self._check_length(2, 3, form="contact.PART.stiffness_scale")
        contact = self._case.model.contact
        if contact is None:
            self._fail("the figure has no parts of the body (docs/contact-parts.md)")
        word = self._words[-1]
        if word not in _PART_WORDS:
            self._fail(f"unknown quantity `{shorten(word)}`", len(self._words) - 1, _PART_WORDS)
        parts = [part.name for part in contact.parts]
        names = self._names(1, "part", parts) if len(self._words) == 3 else parts
        targets = {
            Target(part.name)
            for part in contact.parts
            if part.name in names or part.within in names
        }
        ordered = sorted(targets, key=lambda target: parts.index(target.name))
        return ParameterPath(self._text, "", _PART_WORDS[word], tuple(ordered))

    def _parse_motion(self) -> ParameterPath:
        quantity = Quantity(self._words[0])
        self._check_length(2, 3, form=f"{quantity}.JOINT[.NUMBER]")
        figure = self._figure
        free = figure.bodies if quantity is Quantity.VELOCITY and self._case.plan.free_root else ()
        moving = [name for name, joint in figure.joints.items() if joint.chain]
        names = self._names(1, "joint", [*moving, *free])
        joint = figure.joints.get(names[0])
        count = FREE_MOTIONS if joint is None else len(joint.chain)
        numbers = [str(k) for k in range(1, count + 1)]
        if len(self._words) == 2 and count > 1:
            self._fail(f"`{names[0]}` has {count} numbers; write `{self._text}.1` for the first")
        index = 0
        if len(self._words) == 3:
            if self._words[2] not in numbers:
                self._fail(f"`{names[0]}` has the numbers 1 to {count}")
            index = int(self._words[2]) - 1
        if joint is None:
            units, signs = FREE_CHAINS[0][index].units, {}
            if len(names) > 1:
                self._fail("a free segment is one of the figure")
        else:
            units = joint.chain[index].units
            for name in names:
                followers = figure.joints[name].followers
                if followers and (one := followers[index]) is not None:
                    self._fail(f"{follower_sentence(name, index, one)}; vary that one")
            signs = {name: self._mirror_sign(joint, name, index) for name in names[1:]}
        unit = units.rate if quantity is Quantity.VELOCITY else units.displacement
        targets = tuple(Target(name, index=index, sign=signs.get(name, 1)) for name in names)
        return ParameterPath(self._text, unit, quantity, targets)

    def _mirror_sign(self, joint: Joint, name: str, index: int) -> int:
        try:
            return mirror_signs(self._figure, joint, self._figure.joints[name])[index]
        except ModelError:
            self._fail_asymmetric(joint.name, name)

    def _parse_gravity(self) -> ParameterPath:
        self._check_length(1, form="gravity")
        return ParameterPath(self._text, "", Quantity.GRAVITY)

    def _parse_option(self) -> ParameterPath:
        key = self._words[0]
        self._check_length(1, form=key)
        settings = {key: 0.0} | ({"free_root": True} if self._case.plan.free_root else {})
        known = {option.key for option in STUDY_OPTIONS}
        for fault in option_faults(settings, known, "`{}`".format):
            self._fail(fault.sentence)
        return ParameterPath(key, VARYING_OPTIONS[key].unit.strip(), Quantity.OPTION)

    def _parse_prop(self) -> ParameterPath:
        self._check_length(2, form=f"{self._words[0]}.friction")
        word = self._words[1]
        if word not in _SURFACE_WORDS:
            self._fail(f"unknown quantity `{shorten(word)}`", 1, _SURFACE_WORDS)
        if word == "stiffness" and self._case.model.contact is not None:
            self._fail(
                "parts of the body have stiffnesses of their own; `contact.stiffness_scale` varies "
                "them, and a mat (docs/contact.md) is in series with them"
            )
        target = Target(self._words[0])
        return ParameterPath(self._text, _SURFACE_WORDS[word], Quantity(word), (target,))

    def _parse_tone(self) -> ParameterPath:
        if self._words != ["tone", "scale"]:
            self._fail("the path is written `tone.scale`")
        if not self._case.plan.tone:
            self._fail("the runs have no tone; the option `tone` gives it")
        return ParameterPath(self._text, "", Quantity.TONE_SCALE)

    def _parse_load(self) -> ParameterPath:
        self._check_length(2, form="load.SEGMENT")
        names = self._names(1, "segment", self._figure.bodies)
        for name in names:
            if not {GRIP_SITE, CENTRE_OF_MASS_SITE} & self._figure.segments[name].sites.keys():
                self._fail(f"segment `{name}` has neither a grip nor a centre of mass")
        return ParameterPath(self._text, "kg", Quantity.LOAD, tuple(map(Target, names)))

    def _parse_hold(self) -> ParameterPath:
        if self._words != ["hold", "age"]:
            self._fail("the path is written `hold.age`")
        if not self._holds:
            self._fail(
                'no measure is of the held posture; `column = "hold.use [1]", take = "start"` is'
            )
        return ParameterPath(self._text, "years", Quantity.HOLD_AGE)

    def _parse_fall(self) -> ParameterPath:
        if self._words != ["fall", "seed"]:
            self._fail("the path is written `fall.seed`")
        if not self._falls:
            self._fail("the runs have no random start; the option `fall` of a study gives it")
        return ParameterPath(self._text, "", Quantity.SEED)

    def _parse_person(self) -> ParameterPath:
        self._check_length(1, 2, form="person.stature")
        if not self._persons:
            self._fail("the figure is a file; a study has a person in its own table, `[person]`")
        if len(self._words) == 1:
            return ParameterPath(self._text, "", Quantity.PERSON_NUMBER)
        person, word = self._persons[0], self._words[1]
        from generator.person.measures import estimate_measures

        measures = estimate_measures(person.sex, person.stature, person.mass)
        index = person.mass / person.stature**2
        values = {"stature": person.stature, "mass": person.mass, MASS_INDEX: index}
        values |= {name: one.value for name, one in measures.dimensions.items()}
        values["hip_datum"] = degrees(person.hip_datum)
        if word not in values:
            self._fail(f"a person has no dimension `{shorten(word)}`", 1, values)
        units = {"mass": "kg", MASS_INDEX: MASS_INDEX_UNIT, "hip_datum": "deg"}
        unit = units.get(word, "m")
        target = Target("mass" if word == MASS_INDEX else word)
        return ParameterPath(
            self._text, unit, Quantity.PERSON, (target,), person_value=values[word]
        )
