"""The plate of a user's motion: angles, passive moments, energies, centre of mass, contact."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from generator.coupled_motion import CoupledMotion
from generator.figure import is_rotation
from generator.kinematics.centre_of_mass import segment_masses
from generator.kinematics.placement import Displacements
from generator.motion_files import FigureMotion
from generator.recording import Recording
from generator.rotations import (
    Array,
    matrix_from_chain_angles,
    matrix_from_rotation_vector,
    rotation_vector_from_matrix,
)
from plots.canvas import (
    BLACK,
    GREY,
    LINE_STYLES,
    LineStyle,
    create_panels,
    draw_zero_line,
    plot_style,
)
from plots.plate import Plate
from plots.whole_body import centre_velocities
from springs import (
    NUMPY,
    CoupledSpring,
    JointSprings,
    SpringSet,
    rotation_law,
    total_energy,
    total_torque,
)

_ROW_HEIGHT = 1.35
"""Height of a row of panels [inch]."""

_STANDARD_GRAVITY = 9.81
"""For the potential energy of a motion without a run [m/s^2], along the world's -y."""

_AXIS_STYLES = (*LINE_STYLES[:3], LineStyle(BLACK))
"""Styles of components about x, y and z, and of the only one."""

_SIDES = re.compile(r"^(left|right)_")


@dataclass(frozen=True)
class MotionQuantities:
    """Quantities of a motion that are drawn, over n frames.

    Attributes:
        angles: rotations of each joint [rad], shape (n, number of rotations).
        moments: passive moment of each joint on its child in the parent's axes [N m], (n, 3); of a
            joint of one rotation its moment about the axis, (n, 1).
        energies: energies by kind [J], shape (n,).
        centre_of_mass: shape (n, 3) [m].
    """

    angles: Mapping[str, Array]
    moments: Mapping[str, Array]
    energies: Mapping[str, Array]
    centre_of_mass: Array


def motion_quantities(motion: FigureMotion, springs: SpringSet) -> MotionQuantities:
    """Return the quantities of a run, or compute those of a motion without one.

    Without a run rates are those of a cubic spline through the frames, moments those of `springs`,
    and energies kinetic, of gravity along -y and of these springs.
    """
    angles = {
        name: rows[:, rotations]
        for name, rows in motion.displacements.items()
        if (rotations := _rotations(motion, name))
    }
    run = motion.recording
    if run is not None:
        moments = {name: _about_axes(motion, name, run.passive_torques[name]) for name in angles}
        return MotionQuantities(angles, moments, dict(run.energy), run.centre_of_mass)
    rates = _rates(motion)
    masses = segment_masses(motion.tree.figure)
    coupled = _coupled_moments(motion, springs)
    moments = {
        name: _about_axes(
            motion, name, _moment(motion, name, springs, rates[name]) + coupled.get(name, 0.0)
        )
        for name in angles
    }
    return MotionQuantities(
        angles, moments, _energies(motion, springs, rates), masses.centre(motion.poses)
    )


def _rotations(motion: FigureMotion, joint: str) -> list[int]:
    return [k for k, axis in enumerate(motion.chains[joint]) if is_rotation(axis.kind)]


def _rates(motion: FigureMotion) -> Displacements:
    """Rates of the displacements by a cubic spline; zero for a single frame."""
    from scipy.interpolate import CubicSpline

    if len(motion.times) < 2:
        return {name: np.zeros_like(rows) for name, rows in motion.displacements.items()}
    return {
        name: np.asarray(CubicSpline(motion.times, rows).derivative()(motion.times), dtype=float)
        for name, rows in motion.displacements.items()
    }


def _about_axes(motion: FigureMotion, joint: str, torques: Array) -> Array:
    """Return the moment about the axis of a joint of one rotation, else all components."""
    rotations = _rotations(motion, joint)
    if len(rotations) != 1:
        return torques
    axis = np.asarray(motion.chains[joint][rotations[0]].axis)
    return (torques @ (axis / np.linalg.norm(axis)))[:, None]


def _rotation_vectors(motion: FigureMotion, joint: str) -> Array:
    chain, rotations = motion.chains[joint], _rotations(motion, joint)
    matrices = matrix_from_chain_angles(
        [chain[k].axis for k in rotations], motion.displacements[joint][:, rotations]
    )
    return rotation_vector_from_matrix(matrices)


def _moment(motion: FigureMotion, joint: str, springs: SpringSet, rates: Array) -> Array:
    """Passive moment of a joint's own springs on its child, parent's axes, (n, 3) [N m]."""
    own = springs.joints.get(joint, JointSprings(joint))
    rotations = _rotations(motion, joint)
    if not own.axes and not own.reach:
        return np.zeros((len(motion.times), 3))
    if len(rotations) == 1:
        spring, k = own.axes[0], rotations[0]
        axis = np.asarray(spring.direction)
        sign = float(np.sign(axis @ np.asarray(motion.chains[joint][k].axis)))
        angle = sign * motion.displacements[joint][:, k]
        size = total_torque(spring.elastic, angle)
        size = size + spring.resistance(angle, sign * rates[:, k], NUMPY)
        return np.asarray(size)[:, None] * axis
    vectors = _rotation_vectors(motion, joint)
    half = matrix_from_rotation_vector(0.5 * vectors)
    twists = motion.tree.chains[joint].twists(motion.displacements[joint])
    angular = np.sum(twists[..., :3] * rates[..., None], axis=1)
    rate = (np.swapaxes(half, -1, -2) @ angular[..., None])[..., 0]
    law = rotation_law(own, springs.law, motion.tree.chains[joint].rotation_axes)
    return (half @ (law.torque(vectors) + law.damping(vectors, rate))[..., None])[..., 0]


def _coupled_motion(
    motion: FigureMotion, springs: SpringSet, spring: CoupledSpring
) -> CoupledMotion:
    """Return the rotations of the joints of a coupled law."""
    rotations = {
        axis.joint: motion.displacements[axis.joint][:, own[0]]
        if len(own := _rotations(motion, axis.joint)) == 1
        else _rotation_vectors(motion, axis.joint)
        for axis in spring.axes
    }
    return CoupledMotion(motion.tree.chains, springs, rotations)


def _coupled_moments(motion: FigureMotion, springs: SpringSet) -> dict[str, Array]:
    """Moments of the laws over several joints on the children, parent's axes, (n, 3) [N m]."""
    moments: dict[str, Array] = {}
    for spring in springs.coupled:
        if any(axis.joint not in motion.chains for axis in spring.axes):
            continue
        moved = _coupled_motion(motion, springs, spring)
        for name, torque in moved.torques(spring).items():
            if torque.ndim == 1:
                axis = np.asarray(motion.chains[name][_rotations(motion, name)[0]].axis)
                vector = np.outer(torque, axis / np.linalg.norm(axis))
            else:
                half = matrix_from_rotation_vector(0.5 * moved.rotations[name])
                vector = (half @ torque[..., None])[..., 0]
            moments[name] = moments.get(name, 0.0) + vector
    return moments


def _stored_energy(motion: FigureMotion, springs: SpringSet) -> Array:
    """Energy of the springs, shape (n,) [J]."""
    stored = np.zeros(len(motion.times))
    for name, own in springs.joints.items():
        if name not in motion.chains:
            continue
        rotations, chain = _rotations(motion, name), motion.chains[name]
        if len(rotations) == 1 and own.axes:
            axis = np.asarray(own.axes[0].direction) @ chain[rotations[0]].axis
            angle = float(np.sign(axis)) * motion.displacements[name][:, rotations[0]]
            stored += total_energy(own.axes[0].elastic, angle)
        elif rotations and (own.axes or own.reach):
            law = rotation_law(own, springs.law, motion.tree.chains[name].rotation_axes)
            stored += law.energy(_rotation_vectors(motion, name))
        for spring in own.translations:
            for k, factor in enumerate(chain):
                along = float(np.dot(spring.direction, factor.axis))
                if not is_rotation(factor.kind) and abs(along) > 1.0 - 1e-9:
                    displacement = np.sign(along) * motion.displacements[name][:, k]
                    stored += total_energy(spring.elastic, displacement)
    for spring in springs.coupled:
        if spring.law.is_conservative and all(a.joint in motion.chains for a in spring.axes):
            stored += _coupled_motion(motion, springs, spring).energy(spring)
    return stored


def _energies(motion: FigureMotion, springs: SpringSet, rates: Displacements) -> dict[str, Array]:
    kinetic, gravity = np.zeros(len(motion.times)), np.zeros(len(motion.times))
    for name, centre, angular, linear in centre_velocities(motion, motion.poses, rates):
        segment, turn = motion.tree.figure.segments[name], motion.poses[name][:, :3, :3]
        spin = (np.swapaxes(turn, -1, -2) @ angular[..., None])[..., 0]
        kinetic += 0.5 * (segment.mass or 0.0) * np.sum(linear**2, axis=1)
        kinetic += 0.5 * np.sum(np.asarray(segment.inertia or (0.0,) * 3) * spin**2, axis=1)
        gravity += (segment.mass or 0.0) * _STANDARD_GRAVITY * centre[:, 1]
    return {"kinetic": kinetic, "gravity": gravity, "spring": _stored_energy(motion, springs)}


def motion_plate(motion: FigureMotion, springs: SpringSet, name: str) -> Plate:
    """Draw a motion; `name` is the stem of the files.

    Raises:
        MoverError: the motion is not one of its figure.
        InputError: a segment has no mass.
    """
    quantities = motion_quantities(motion, springs)
    groups = _groups(quantities.angles)
    run = motion.recording
    with plot_style():
        contact = None if run is None else run.contact
        rows = len(groups) + (1 if contact is None else 2)
        figure, panels = create_panels(0.7 + _ROW_HEIGHT * rows, rows, 2, share_rows=False)
        for (left, right), group in zip(panels, groups, strict=False):
            _draw_group(left, motion, {n: np.degrees(quantities.angles[n]) for n in group}, "deg")
            _draw_group(right, motion, {n: quantities.moments[n] for n in group}, "N m")
        energies, centre = panels[len(groups)]
        _draw_energies(energies, motion.times, quantities.energies)
        moved = quantities.centre_of_mass - quantities.centre_of_mass[0]
        _draw_components(centre, motion.times, moved, "centre of mass,\nmoved by [m]")
        if contact is not None:
            forces = contact.ground_reaction
            _draw_components(panels[-1][0], motion.times, forces, "ground reaction [N]")
            deepest = 1e3 * np.max(list(contact.depths.values()), axis=0)
            panels[-1][1].plot(motion.times, deepest, "-", color=BLACK, lw=1.2)
            panels[-1][1].set_ylabel("deepest\npenetration [mm]", fontsize=8.0)
        figure.legend(handles=_legend_handles(), ncols=6, loc="outside upper left", fontsize=7.5)
        if groups:
            panels[0][0].set_title("joint angles [deg]")
            panels[0][1].set_title("passive moments on the child [N m]")
        for axes in panels[-1]:
            axes.set_xlabel("time [s]")
    return Plate(
        name=name,
        title=f"{motion.header.figure}: {motion.header.message}",
        caption=_caption(run),
        sign=(
            "Angles are the joint's own, in the order of its chain. Moments act on the child: "
            "about the axis of a joint of one rotation, otherwise along x, y and z of its parent's "
            "site."
        ),
        figure=figure,
        claims=(),
        tables={name: _table(motion, quantities)},
        references=springs.references if run is None else (),
    )


def _legend_handles() -> list[Line2D]:
    names = ("about x", "about y", "about z", "about the only axis")
    lines = [
        Line2D([], [], color=style.colour, lw=1.2, label=name)
        for style, name in zip(_AXIS_STYLES, names, strict=True)
    ]
    sides = (("-", "left"), ("--", "right"))
    return [*lines, *(Line2D([], [], ls=dash, color=GREY, label=name) for dash, name in sides)]


def _caption(run: Recording | None) -> str:
    shown = "Each row is a joint, or a pair of joints: left solid, right dashed. "
    if run is not None:
        return shown + "Moments and energies are those of the run."
    return shown + (
        "The file holds no run: rates are those of a cubic spline through the frames, moments "
        "those of the springs named below, gravity 9.81 m/s2 along -y."
    )


def _groups(names: Mapping[str, Array]) -> list[list[str]]:
    """Return the joints that share a row: pairs that differ in left and right."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(_SIDES.sub("", name), []).append(name)
    return list(groups.values())


def _draw_group(axes: Axes, motion: FigureMotion, rows: Mapping[str, Array], unit: str) -> None:
    for name, values in rows.items():
        is_second = name.startswith("right_") and len(rows) > 1
        for k, column in enumerate(values.T):
            style = _AXIS_STYLES[_component(motion, name, k, values.shape[1], unit)]
            dash = "--" if is_second else "-"
            axes.plot(motion.times, column, dash, color=style.colour, lw=1.2)
    draw_zero_line(axes)
    axes.set_ylabel(_SIDES.sub("", next(iter(rows))).replace("_", " "), fontsize=8.0)


def _component(motion: FigureMotion, name: str, k: int, count: int, unit: str) -> int:
    """Axis 0, 1 or 2 that is nearest to a component; 3 for the only one of a joint."""
    if count == 1:
        return 3
    if unit != "deg":
        return k
    axis = motion.chains[name][_rotations(motion, name)[k]].axis
    return int(np.argmax(np.abs(axis)))


_ENERGY_STYLES = (*LINE_STYLES, *(LineStyle(style.colour, ":") for style in LINE_STYLES[:2]))


def _draw_energies(axes: Axes, times: Array, energies: Mapping[str, Array]) -> None:
    for (kind, values), style in zip(energies.items(), _ENERGY_STYLES, strict=False):
        change = values - values[0]
        axes.plot(times, change, style.dash, color=style.colour, lw=1.2, label=kind)
    axes.set_ylabel("change of energy [J]", fontsize=8.0)
    _legend_above(axes)


def _draw_components(axes: Axes, times: Array, vectors: Array, label: str) -> None:
    for column, style, name in zip(vectors.T, _AXIS_STYLES, "xyz", strict=False):
        axes.plot(times, column, "-", color=style.colour, lw=1.2, label=name)
    axes.set_ylabel(label, fontsize=8.0)
    _legend_above(axes)


def _legend_above(axes: Axes) -> None:
    axes.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=4,
        fontsize=6.5,
        borderaxespad=0.0,
        handlelength=1.2,
        columnspacing=0.8,
    )


def _table(motion: FigureMotion, quantities: MotionQuantities) -> dict[str, Array]:
    columns = {"time [s]": motion.times}
    for name, values in quantities.angles.items():
        columns |= {f"{name}.{k + 1} [deg]": np.degrees(row) for k, row in enumerate(values.T)}
    for name, values in quantities.moments.items():
        columns |= {f"moment of {name}.{k + 1} [N m]": row for k, row in enumerate(values.T)}
    columns |= {f"{kind} [J]": values for kind, values in quantities.energies.items()}
    columns |= {
        f"centre of mass {'xyz'[k]} [m]": row for k, row in enumerate(quantities.centre_of_mass.T)
    }
    if motion.recording is not None and motion.recording.contact is not None:
        forces = motion.recording.contact.ground_reaction[:, :3].T
        columns |= {f"ground reaction {'xyz'[k]} [N]": row for k, row in enumerate(forces)}
    return columns
