"""Forces of the props on the segments of a run, computed again from its poses and rates."""

import numpy as np

from generator.contact.spheres import fit_contact_spheres
from generator.contact.states import ContactModel, evaluate_contacts
from generator.inverse.external_loads import ExternalForce
from generator.inverse.smoothing import input_error
from generator.model import contact_of_figure
from generator.motion_files import FigureMotion
from generator.rotations import Array
from springs.contact_part import PartLaw

MAX_FORCE_ERROR = 1e-3
"""Largest difference of a force from the recorded one, over the largest of all forces."""


def contact_of_run(motion: FigureMotion) -> tuple[ExternalForce, ...]:
    """Return the forces of props on the segments of a run, none for one without contact.

    A recording holds the force on each segment, not its moment. Both follow from the contact
    spheres of the figure and from the props of the run.

    Raises InputError where they do not add up to the recorded forces.
    """
    run = motion.recording
    if run is None or run.contact is None:
        return ()
    tree, figure = motion.tree, motion.tree.figure
    kinematics = tree.kinematics
    twists = kinematics.twists(kinematics.displacement_vector(run.displacements))
    rates = kinematics.displacement_vector(run.velocities)
    states_of: list[tuple[Array, Array, Array, Array]] = []
    for name, body in figure.bodies.items():
        twist = np.einsum("nki,nk->ni", twists, rates * kinematics.motion_masks[name])
        pose = run.poses[name]
        place = pose[:, :3, :3] @ np.asarray(body.centre_of_mass) + pose[:, :3, 3]
        speed = twist[:, 3:] + np.cross(twist[:, :3], place)
        states_of.append((place, pose[:, :3, :3], speed, twist[:, :3]))
    spheres = {
        name: fit.spheres for name, fit in fit_contact_spheres(motion.figure).items() if fit.spheres
    }
    parts, laws = contact_of_figure(motion.figure), dict[str, PartLaw]()
    if parts is not None:
        spheres, laws = parts.assign(spheres), parts.laws
    if motion.scene.covers:
        laws = motion.scene.cover(laws, None if parts is None else parts.regions)
    states = evaluate_contacts(
        ContactModel(motion.scene, spheres, (), laws),
        figure,
        *(np.stack(some, axis=1) for some in zip(*states_of, strict=True)),
    )
    found = dict(zip(spheres, np.moveaxis(states.wrenches, 1, 0), strict=True))
    recorded = run.contact.forces
    largest = max((float(np.abs(one).max()) for one in recorded.values()), default=0.0)
    for name in recorded.keys() | found.keys():
        here = found[name][:, :3] if name in found else 0.0
        if np.abs(here - recorded.get(name, 0.0)).max() > MAX_FORCE_ERROR * max(largest, 1.0):
            raise input_error(
                f"the contact forces of the run on `{name}` do not follow from its figure and "
                "scene, so that their moments are unknown",
                "give the figure of the run, with the file of its contact beside it",
            )
    # The wrenches are in the world, in which the ground of a model may be turned.
    ground = next(iter(figure.ground))
    pose: Array = kinematics.poses(np.zeros((1, kinematics.size)))[ground][0]
    frame = (ground, np.asarray(np.linalg.inv(pose), dtype=float))
    return tuple(
        ExternalForce(
            name,
            name,
            name,
            run.times,
            one[:, :3],
            np.zeros((len(one), 3)),
            one[:, 3:],
            frame,
            frame,
        )
        for name, one in found.items()
        if one.any()
    )
