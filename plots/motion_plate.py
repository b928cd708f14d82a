"""The plate of a user's motion: angles, passive moments, energies, centre of mass, contact."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from generator.figure import is_rotation
from generator.kinematics.centre_of_mass import segment_masses
from generator.model import Model
from generator.motion_files import FigureMotion
from generator.rotations import Array
from generator.simulation.plan import Plan
from plots.canvas import (
    BLACK,
    GREY,
    LINE_STYLES,
    LineStyle,
    Look,
    create_panels,
    draw_zero_line,
    plot_style,
)
from plots.plate import Plate
from plots.whole_body import centre_velocities
from springs import SpringSet

_ROW_HEIGHT = 1.35
"""Height of a row of panels [inch]."""

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
    return _quantities_of_frames(motion, springs, angles)


def _quantities_of_frames(
    motion: FigureMotion, springs: SpringSet, angles: Mapping[str, Array]
) -> MotionQuantities:
    from scipy.interpolate import CubicSpline

    # Imported here, since Exudyn takes a second and runs do not need it.
    from generator.simulation.joint_motion import SegmentMotion, energy_by_kind
    from generator.simulation.run_model import prepare_run
    from generator.simulation.statics.static_forces import StaticState

    figure = motion.tree.figure
    model = prepare_run(Model(figure, springs.of_joints(figure.joints)), Plan())
    rates = {
        name: np.zeros_like(rows)
        if len(motion.times) < 2
        else np.asarray(CubicSpline(motion.times, rows).derivative()(motion.times), dtype=float)
        for name, rows in motion.displacements.items()
    }
    moved = {
        name: (angular, linear)
        for name, _, angular, linear in centre_velocities(motion, motion.poses, rates)
    }
    angular, linear = (
        np.stack([moved[name][k] for name in model.figure.bodies], axis=1) for k in range(2)
    )
    values = motion.tree.kinematics.displacement_vector(motion.displacements)
    trace = replace(
        StaticState.from_displacements(model, values).trace,
        velocities=linear,
        angular_velocities=angular,
        displacements=motion.displacements,
    )
    segments = SegmentMotion(model, trace)
    joints = {
        name: segments.joint(joint, motion.displacements[name][0])
        for name, joint in model.figure.joints.items()
    }
    torques = segments.passive_torques(joints)
    moments = {name: _about_axes(motion, name, torques[name]) for name in angles}
    energies = energy_by_kind(model, trace, joints, None)
    return MotionQuantities(angles, moments, energies, segment_masses(figure).centre(motion.poses))


def _rotations(motion: FigureMotion, joint: str) -> list[int]:
    return [k for k, axis in enumerate(motion.chains[joint]) if is_rotation(axis.kind)]


def _about_axes(motion: FigureMotion, joint: str, torques: Array) -> Array:
    """Return the moment about the axis of a joint of one rotation, else all components."""
    rotations = _rotations(motion, joint)
    if len(rotations) != 1:
        return torques
    axis = np.asarray(motion.chains[joint][rotations[0]].axis)
    return (torques @ (axis / np.linalg.norm(axis)))[:, None]


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
        for (kind, values), style in zip(quantities.energies.items(), _ENERGY_STYLES, strict=False):
            look: Look = {"color": style.colour, "lw": 1.2, "label": kind}
            energies.plot(motion.times, values - values[0], style.dash, **look)
        energies.set_ylabel("change of energy [J]", fontsize=8.0)
        _legend_above(energies)
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
        caption=_SHOWN + (_OF_FRAMES if run is None else _OF_RUN),
        sign=(
            "Angles are the joint's own, in the order of its chain. Moments act on the child: "
            "about the axis of a joint of one rotation, otherwise along x, y and z of its parent's "
            "site."
        ),
        figure=figure,
        tables={name: _table(motion, quantities)},
        references=springs.references if run is None else (),
    )


_SHOWN = "Each row is a joint, or a pair of joints: left solid, right dashed. "
_OF_RUN = "Moments and energies are those of the run."
_OF_FRAMES = (
    "The file holds no run: rates are those of a cubic spline through the frames, moments those of "
    "the springs named below, gravity 9.81 m/s2 along -y."
)


def _legend_handles() -> list[Line2D]:
    names = ("about x", "about y", "about z", "about the only axis")
    lines = [
        Line2D([], [], color=style.colour, lw=1.2, label=name)
        for style, name in zip(_AXIS_STYLES, names, strict=True)
    ]
    sides = (("-", "left"), ("--", "right"))
    return [*lines, *(Line2D([], [], ls=dash, color=GREY, label=name) for dash, name in sides)]


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
            place = k if values.shape[1] > 1 else 3
            if unit == "deg" and place < 3:
                axis = motion.chains[name][_rotations(motion, name)[k]].axis
                place = int(np.argmax(np.abs(axis)))
            colour, dash = _AXIS_STYLES[place].colour, "--" if is_second else "-"
            axes.plot(motion.times, column, dash, color=colour, lw=1.2)
    draw_zero_line(axes)
    axes.set_ylabel(_SIDES.sub("", next(iter(rows))).replace("_", " "), fontsize=8.0)


_ENERGY_STYLES = (*LINE_STYLES, *(LineStyle(style.colour, ":") for style in LINE_STYLES[:2]))


def _draw_components(axes: Axes, times: Array, vectors: Array, label: str) -> None:
    for column, style, name in zip(vectors.T, _AXIS_STYLES, "xyz", strict=False):
        axes.plot(times, column, "-", color=style.colour, lw=1.2, label=name)
    axes.set_ylabel(label, fontsize=8.0)
    _legend_above(axes)


def _legend_above(axes: Axes) -> None:
    place: Look = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.0}
    axes.legend(ncols=4, fontsize=6.5, handlelength=1.2, columnspacing=0.8, **place)


def _table(motion: FigureMotion, quantities: MotionQuantities) -> dict[str, Array]:
    columns = {"time [s]": motion.times}
    for name, values in quantities.angles.items():
        columns |= {f"{name}.{k + 1} [deg]": np.degrees(row) for k, row in enumerate(values.T)}
    for name, values in quantities.moments.items():
        columns |= {f"moment of {name}.{k + 1} [N m]": row for k, row in enumerate(values.T)}
    columns |= {f"{kind} [J]": values for kind, values in quantities.energies.items()}
    centres = zip("xyz", quantities.centre_of_mass.T, strict=True)
    columns |= {f"centre of mass {axis} [m]": row for axis, row in centres}
    if motion.recording is not None and motion.recording.contact is not None:
        forces = motion.recording.contact.ground_reaction[:, :3].T
        columns |= {f"ground reaction {'xyz'[k]} [N]": row for k, row in enumerate(forces)}
    return columns
