"""Cases that the values of a study's parameters make."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from math import degrees, inf, isfinite, nan, radians

from generator.contact.scene import Scene
from generator.contact_file.file import MAX_STIFFNESS
from generator.contact_file.parts import BodyPart
from generator.diagnostics import ModelError
from generator.figure import CENTRE_OF_MASS_SITE, Segment, SiteRef, without_followers
from generator.hold.statics import GRIP_SITE
from generator.input_files.scene import SURFACE_NUMBERS
from generator.loads import LoadKind, TimedLoad, constant_load
from generator.model import Model
from generator.run_options import MAX_GRAVITY, RUN_OPTIONS, VARYING_OPTIONS
from generator.simulation.falls import with_start
from generator.simulation.plan import Plan
from generator.springs_file.axes import parallel_sign
from generator.springs_file.read import spring_along
from generator.study.parameter_paths import (
    FREE_MOTIONS,
    MASS_INDEX_UNIT,
    Case,
    Number,
    ParameterPath,
    Quantity,
    Target,
    UnknownPathError,
    parse_path,
)
from generator.study.person_figure import make_person
from generator.study.study import PersonArguments, Study
from generator.toml_file.rows import Number as NumberRow
from generator.units import INPUT_BOUNDS, ROTATION_UNITS, TRANSLATION_UNITS, AxisUnits, Dimension
from springs import AxisSpring, CoupledSpring, JointSprings, SphericalLaw, Stop
from springs.axis import transform
from springs.strength.strengths import Age

MAX_FACTOR = 1e3
"""Largest factor of springs, masses, parts and tone, that of live files; larger ones are typing
errors, with which a run takes minutes or fails."""

MAX_DAMPING = {"N m s/rad": 1e4, "N m": 1e4, "N s/m": 1e6, "N": 1e6}
"""Largest damping and friction by their units; larger ones are typing errors."""

MAX_OFFSET = {"deg": 360.0, "cm": 100.0}
"""Largest shift of an elastic curve by its units; beyond a turn exponentials overflow."""

_FACTOR = NumberRow("factor", 0.0, MAX_FACTOR)
_FACTORS = {
    Quantity.SCALE,
    Quantity.DAMPING_SCALE,
    Quantity.COUPLED_SCALE,
    Quantity.STOP_SCALE,
    Quantity.MASS_SCALE,
    Quantity.INERTIA_SCALE,
    Quantity.PART_STIFFNESS,
    Quantity.PART_DAMPING,
    Quantity.TONE_SCALE,
}

YOUNG_YEARS = 21.5
"""Middle of the ages of the sample by which postures are judged by default [years]."""


def nominal_value(path: ParameterPath, case: Case) -> float:
    """Value of a quantity, in the unit of its path, at which it leaves the case as it is.

    Of several quantities, that of the first. NaN for a height that the plan leaves open.
    """
    match path.quantity:
        case Quantity.OFFSET:
            return 0.0
        case Quantity.VISCOUS | Quantity.COULOMB:
            spring = _spring_at(case, path.targets[0])
            return 0.0 if spring is None else float(getattr(spring.damping, path.quantity))
        case Quantity.MASS:
            return case.figure.segments[path.targets[0].name].mass or 0.0
        case Quantity.POSE | Quantity.VELOCITY:
            target = path.targets[0]
            value = _displacements(case, path.quantity, target.name)[target.index]
            return _units(path).scale * value
        case Quantity.OPTION:
            value = getattr(case.plan, RUN_OPTIONS[path.text].field)
            return nan if value is None else value
        case Quantity.FRICTION | Quantity.STIFFNESS:
            name = path.targets[0].name
            props = case.plan.scene.props
            surface = next(prop.surface for prop in props if prop.name == name)
            return float(getattr(surface, path.quantity))
        case Quantity.PERSON:
            return path.person_value
        case Quantity.SEED:
            return 0.0
        case Quantity.HOLD_AGE:
            return YOUNG_YEARS
        case _:
            return 1.0


def apply_parameters(model: Model, plan: Plan, values: Iterable[tuple[str, float]]) -> Case:
    """Return model and plan with values of parameters, as in a study.

    Args:
        model: Model to change.
        plan: Plan to change, without springs.
        values: Paths with their values, in the units of the paths.

    Raises:
        ModelError: a path is unknown, has no effect or changes a quantity a second time, or a
            quantity cannot have its value.
    """
    case, changed = Case(model, plan), set[Number]()
    assignments = [(parse_path(text, case), value) for text, value in values]
    for path, value in assignments:
        if changed.intersection(path.numbers):
            raise ModelError(f"`{path}` changes a quantity a second time")
        changed.update(path.numbers)
        former, case = case, apply_values(case, [(path, value)])
        if case == former and path.unit == "" and value != nominal_value(path, former):
            raise ModelError(f"`{path}` has no effect: what it scales is zero")
    return case


def apply_values(case: Case, assignments: Sequence[tuple[ParameterPath, float]]) -> Case:
    """Return the case with values of its quantities, set one after the other.

    Scales and offsets change what the case has; other values replace it. A law is always wrapped,
    by a scale of 1 and an offset of 0 as well, so that its compiled form does not depend on the
    values.

    Raises ModelError for a value that a quantity cannot have.
    """
    for path, value in assignments:
        row = _row(path)
        if row is not None and (fault := row.fault(value)):
            raise ModelError(f"`{path}` {fault}")
        try:
            if not isfinite(value):
                raise ValueError("it must be finite")
            case = _apply(case, path, value)
        except ValueError as failure:
            raise ModelError(f"`{path}` cannot be {value:g}: {failure}") from None
    return case


def _row(path: ParameterPath) -> NumberRow | None:
    """Return the bounds that a quantity has in files and options too; None without any."""
    match path.quantity:
        case Quantity.OPTION:
            return VARYING_OPTIONS[path.text]
        case Quantity.FRICTION | Quantity.STIFFNESS:
            return SURFACE_NUMBERS[path.quantity]
        case Quantity.OFFSET:
            most = MAX_OFFSET[path.unit]
            return NumberRow(path.quantity, -most, most, f" {path.unit}")
        case Quantity.VISCOUS | Quantity.COULOMB:
            return NumberRow(path.quantity, 0.0, MAX_DAMPING[path.unit], f" {path.unit}")
        case quantity if quantity in _FACTORS:
            return _FACTOR
        case _:
            return None


def _apply(case: Case, path: ParameterPath, value: float) -> Case:
    """Return the case with one value. Raises ValueError."""
    figure, plan = case.figure, case.plan
    if path.quantity not in _SIGNED and value < 0.0:
        raise ValueError("it must not be negative")
    match path.quantity:
        case Quantity.SCALE | Quantity.COUPLED_SCALE:
            return _scale_springs(case, path, value)
        case Quantity.DAMPING_SCALE:
            return _change_springs(
                case,
                path.targets,
                lambda spring: spring.scaled(1.0, value, stops=False),
                is_elastic=False,
            )
        case Quantity.STOP_SCALE:
            return _change_springs(case, path.targets, partial(_scale_stops, value=value))
        case Quantity.PART_STIFFNESS | Quantity.PART_DAMPING:
            return _scale_parts(case, path, value)
        case Quantity.OFFSET:
            return _shift_springs(case, path, _units(path).si_value(value))
        case Quantity.VISCOUS | Quantity.COULOMB:
            for target in path.targets:
                case = _change_axis(
                    case,
                    target,
                    lambda spring: replace(
                        spring, damping=replace(spring.damping, **{path.quantity: value})
                    ),
                )
            return case
        case Quantity.MASS | Quantity.MASS_SCALE | Quantity.INERTIA_SCALE:
            if value == 0.0:
                raise ValueError("it must be positive")
            segments = (figure.segments[target.name] for target in path.targets)
            changed = [_scale_segment(segment, path.quantity, value) for segment in segments]
            return case.with_figure(figure.with_parts(*changed))
        case Quantity.POSE | Quantity.VELOCITY:
            number = _units(path).si_value(value)
            bound = INPUT_BOUNDS[Dimension.ANGLE if _units(path).is_angle else Dimension.LENGTH]
            if not bound.contains(number):
                raise ValueError(str(bound))
            return _set_displacement(case, path, number)
        case Quantity.GRAVITY:
            x, y, z = plan.gravity
            if value * max(map(abs, plan.gravity)) > MAX_GRAVITY:
                raise ValueError(f"gravity would be larger than {MAX_GRAVITY:g} m/s2")
            return replace(case, plan=replace(plan, gravity=(value * x, value * y, value * z)))
        case Quantity.OPTION:
            return replace(case, plan=replace(plan, **{RUN_OPTIONS[path.text].field: value}))
        case Quantity.FRICTION | Quantity.STIFFNESS:
            name = path.targets[0].name
            props = tuple(
                replace(prop, surface=replace(prop.surface, **{path.quantity: value}))
                if prop.name == name
                else prop
                for prop in plan.scene.props
            )
            return replace(case, plan=replace(plan, scene=replace(plan.scene, props=props)))
        case Quantity.TONE_SCALE:
            tone = plan.tone and plan.tone.scaled(value)
            return replace(case, plan=replace(plan, tone=tone or None))
        case Quantity.LOAD:
            return _add_loads(case, path, value)
        case Quantity.HOLD_AGE:
            return replace(case, age=Age.of_years(value))
        case Quantity.PERSON | Quantity.PERSON_NUMBER | Quantity.SEED:
            raise ValueError("it is of the start of a case, which build_case makes")


def _add_loads(case: Case, path: ParameterPath, mass: float) -> Case:
    """Return the case with the weight of a mass at segments, without its inertia."""
    plan, added = case.plan, list[TimedLoad]()
    for target in path.targets:
        sites = case.figure.segments[target.name].sites
        site = SiteRef(target.name, GRIP_SITE if GRIP_SITE in sites else CENTRE_OF_MASS_SITE)
        weight = [mass * part for part in plan.gravity]
        added.append(constant_load(site, LoadKind.GLOBAL_FORCE, weight, plan.start, plan.stop))
    return replace(case, plan=replace(plan, loads=(*plan.loads, *added)))


_SIGNED = {Quantity.OFFSET, Quantity.POSE, Quantity.VELOCITY, Quantity.OPTION}
"""Quantities that may be negative; a plan checks its own options."""


def _units(path: ParameterPath) -> AxisUnits:
    """Units of the axis of a displacement or a rate."""
    return ROTATION_UNITS if path.unit.startswith("deg") else TRANSLATION_UNITS


def _spring_at(case: Case, target: Target) -> AxisSpring | None:
    """Return the spring about an axis; None without one."""
    own = case.springs.joints.get(target.name)
    if own is None or target.direction is None:
        return None
    return spring_along(own.translations if target.slides else own.axes, target.direction)


def _change_axis(case: Case, target: Target, change: Callable[[AxisSpring], AxisSpring]) -> Case:
    """Return the case with a change of the spring about an axis, which may be a new one."""
    assert target.direction is not None
    former = _spring_at(case, target)
    changed = change(AxisSpring(target.direction) if former is None else former)
    field = "translations" if target.slides else "axes"
    springs = case.springs
    own = springs.joints.get(target.name, JointSprings(target.name))
    axes: tuple[AxisSpring, ...] = getattr(own, field)
    axes = (
        (*axes, changed)
        if former is None
        else tuple(changed if spring is former else spring for spring in axes)
    )
    joints = {**springs.joints, target.name: replace(own, **{field: axes})}
    return case.with_springs(replace(springs, joints=joints))


def _change_springs(
    case: Case,
    targets: Sequence[Target],
    change: Callable[[AxisSpring], AxisSpring],
    *,
    is_elastic: bool = True,
) -> Case:
    """Return the case with a change of the springs about axes, or of all without targets.

    An elastic change of an axis is one of the reach of its joint as well, which has no damping.
    """
    if targets:
        for target in targets:
            if _spring_at(case, target) is not None:
                case = _change_axis(case, target, change)
        names = {target.name for target in targets} if is_elastic else set[str]()
        joints = {
            name: replace(joint, reach=joint.reach and joint.reach.with_laws(change))
            if name in names
            else joint
            for name, joint in case.springs.joints.items()
        }
    else:
        joints = {name: joint.with_laws(change) for name, joint in case.springs.joints.items()}
    return case.with_springs(replace(case.springs, joints=joints))


def _scale_springs(case: Case, path: ParameterPath, value: float) -> Case:
    """Return the case with a factor of elastic torques."""
    if path.quantity is not Quantity.COUPLED_SCALE:
        case = _change_springs(
            case, path.targets, lambda spring: spring.scaled(value, 1.0, stops=False)
        )
    coupled = tuple(
        _scale_coupled(spring, path.targets, value)
        if path.targets
        else replace(spring, law=spring.law.scaled(value), original=None)
        for spring in case.springs.coupled
    )
    return case.with_springs(replace(case.springs, coupled=coupled))


def _scale_stops(spring: AxisSpring, value: float) -> AxisSpring:
    """Return a spring with a factor of the torques of its stops."""
    laws = (
        replace(law, stiffness=value * law.stiffness) if isinstance(law, Stop) else law
        for law in spring.elastic
    )
    return replace(spring, elastic=tuple(laws))


def _scale_parts(case: Case, path: ParameterPath, value: float) -> Case:
    """Return the case with a factor of the stiffness, or of the damping, of parts of the body."""
    assert case.model.contact is not None
    is_stiffness = path.quantity is Quantity.PART_STIFFNESS
    factors = (value, 1.0) if is_stiffness else (1.0, value)
    names = {target.name for target in path.targets}
    own = {part.name: part for part in case.model.contact.parts}
    parts: list[BodyPart] = []
    for part in own.values():
        law = part.law
        if part.name in names:
            law = law.scaled(*factors)
            if part.within and part.within not in names:
                law = law.no_softer_than(own[part.within].law)
            if max(stiffness for _, stiffness in law.stages) > MAX_STIFFNESS:
                raise ValueError(f"`{part.name}` would be stiffer than {MAX_STIFFNESS:g} N/m")
        parts.append(replace(part, law=law))
    contact = replace(case.model.contact, parts=tuple(parts))
    return replace(case, model=replace(case.model, contact=contact))


def _shift_springs(case: Case, path: ParameterPath, offset: float) -> Case:
    """Return the case with curves shifted towards larger angles [rad or m]."""
    for target in path.targets:
        if _spring_at(case, target) is not None:
            case = _change_axis(case, target, partial(_shift_spring, target, offset))
        coupled = tuple(_shift_coupled(spring, target, offset) for spring in case.springs.coupled)
        case = case.with_springs(replace(case.springs, coupled=coupled))
    return case


def _shift_spring(target: Target, offset: float, spring: AxisSpring) -> AxisSpring:
    """Return a spring about the axis of a target with shifted curves; stops stay."""
    assert target.direction is not None
    by = target.sign * parallel_sign(spring.direction, target.direction) * offset
    laws = (law if isinstance(law, Stop) else transform(law, 1.0, by) for law in spring.elastic)
    return replace(spring, elastic=tuple(laws))


def _scale_coupled(spring: CoupledSpring, targets: Sequence[Target], value: float) -> CoupledSpring:
    """Return a law over several joints with a factor of each term that depends on a target."""
    coordinates = [
        coordinate
        for coordinate, axis in zip(spring.law.coordinates, spring.axes, strict=True)
        if any(
            axis.joint == target.name
            and target.direction is not None
            and parallel_sign(axis.direction, target.direction)
            for target in targets
        )
    ]
    law = spring.law.scaled_at(coordinates, value)
    return replace(spring, law=law, original=None) if coordinates else spring


def _shift_coupled(spring: CoupledSpring, target: Target, offset: float) -> CoupledSpring:
    """Return a law over several joints, shifted along the angles about the axis of a target."""
    assert target.direction is not None
    offsets = {
        coordinate: target.sign * sense * offset
        for coordinate, axis in zip(spring.law.coordinates, spring.axes, strict=True)
        if axis.joint == target.name and (sense := parallel_sign(axis.direction, target.direction))
    }
    law = spring.law.scaled(1.0, offsets)
    return replace(spring, law=law, original=None) if offsets else spring


def _scale_segment(segment: Segment, quantity: Quantity, value: float) -> Segment:
    """Return a segment with another mass or inertia."""
    mass, inertia = segment.mass or 0.0, segment.inertia
    if quantity is Quantity.MASS:
        mass, factor = value, value / mass
    else:
        factor = value
        mass = value * mass if quantity is Quantity.MASS_SCALE else mass
    if inertia is not None:
        x, y, z = inertia
        inertia = (factor * x, factor * y, factor * z)
    return replace(segment, mass=mass, inertia=inertia)


def _displacements(case: Case, quantity: Quantity, name: str) -> list[float]:
    """Displacements of a joint at the start, or rates of a joint or free segment [SI]."""
    plan, joint = case.plan, case.figure.joints.get(name)
    if quantity is Quantity.POSE:
        assert joint is not None
        return list(map(float, plan.displacements.get(name, joint.displacement)))
    count = FREE_MOTIONS if joint is None else len(joint.chain)
    return list(map(float, plan.velocities.get(name, [0.0] * count)))


def _set_displacement(case: Case, path: ParameterPath, value: float) -> Case:
    """Return the case with a displacement or rate [SI] of all targets."""
    field = "displacements" if path.quantity is Quantity.POSE else "velocities"
    changed = dict(getattr(case.plan, field))
    for target in path.targets:
        values = _displacements(case, path.quantity, target.name)
        values[target.index] = target.sign * value
        changed[target.name] = tuple(values)
    changed = without_followers(case.figure.joints, changed)
    return replace(case, plan=replace(case.plan, **{field: changed}))


_PATHS_OF_MODELS = ("springs", "segments", "contact")
"""First words of the paths of quantities of a model."""


def with_parameter(model: Model, path: str, value: float) -> Model:
    """Return a model with a quantity set; see `Model.with_parameter`."""
    first = path.split(".")[0]
    if first == "person":
        raise UnknownPathError(f"`{path}`: a person is built anew: change what build_person takes")
    plan = Plan(free_root=True, scene=Scene.floor())
    changed = apply_parameters(model, plan, [(path, value)])
    if first not in _PATHS_OF_MODELS:
        raise UnknownPathError(f"`{path}` is of the run, not of the model: set it in the Plan")
    return changed.model


_paths: list[tuple[Study, tuple[tuple[int, ParameterPath], ...]]] = []
"""The last study of this process, with the paths of its parameters by their numbers."""


def study_paths(study: Study) -> tuple[tuple[int, ParameterPath], ...]:
    """Return the paths of a study's parameters with the parameters' numbers.

    Raises UnknownPathError.
    """
    for known, paths in _paths:
        if known is study:
            return paths
    base = Case(study.model, study.plan)
    paths = tuple(
        (
            number,
            parse_path(text, base, study.persons, falls=bool(study.fall), holds=study.holds),
        )
        for number, parameter in enumerate(study.parameters.values())
        for text in parameter.paths
    )
    _paths[:] = [(study, paths)]
    return paths


def build_case(study: Study, values: Sequence[float]) -> Case:
    """Return the case of a study for values of its parameters, in their order.

    A person is built anew where a `person.*` path varies, and falls from a start of its own; all
    other paths apply to the result.

    Raises MoverError for values that a quantity cannot have.
    """
    assigned = [(path, float(values[number])) for number, path in study_paths(study)]
    case = Case(_person_model(study, assigned), study.plan)
    if study.fall:
        seeds = (value for path, value in assigned if path.quantity is Quantity.SEED)
        seed = next(seeds, 0.0)
        if not 0.0 <= seed < inf:
            raise ModelError(f"`fall.seed` cannot be {seed:g}: it must not be negative")
        case = replace(case, plan=with_start(case.plan, case.figure, study.fall, int(seed)))
    return apply_values(case, [each for each in assigned if each[0].quantity not in _OF_THE_START])


_OF_THE_START = {Quantity.PERSON, Quantity.PERSON_NUMBER, Quantity.SEED}


def _person_model(study: Study, assigned: Sequence[tuple[ParameterPath, float]]) -> Model:
    """Return the model of a case: that of the study, or of the person that the values describe."""
    own = {
        path.targets[0].name: value for path, value in assigned if path.quantity is Quantity.PERSON
    }
    numbers = [value for path, value in assigned if path.quantity is Quantity.PERSON_NUMBER]
    if not own and not numbers:
        return study.model
    count, number = len(study.persons), numbers[0] if numbers else 1.0
    if number not in range(1, count + 1):
        raise ModelError(f"`person` cannot be {number:g}: they are numbered from 1 to {count}")
    person = study.persons[int(number) - 1]
    stature = own.pop("stature", person.stature)
    mass = own.pop("mass", person.mass)
    if any(path.unit == MASS_INDEX_UNIT for path, _ in assigned):
        mass *= stature**2
    datum = radians(own.pop("hip_datum", degrees(person.hip_datum)))
    person = replace(person, stature=stature, mass=mass, hip_datum=datum)
    props, law = study.plan.scene.props, study.model.springs.law
    return _known_person(person, tuple(own.items()), law, bool(props), study.stops_edges)


@lru_cache(maxsize=8)
def _known_person(
    person: PersonArguments,
    measured: tuple[tuple[str, float], ...],
    law: SphericalLaw | None,
    with_spheres: bool,
    stops_edges: bool,
) -> Model:
    """Return the model of a person, which several runs may have in common."""
    return make_person(
        person, dict(measured), law, with_spheres=with_spheres, stops_edges=stops_edges
    )
