"""Springs file of a fit: the figure's springs with the estimates, and their origin."""

from dataclasses import replace
from math import degrees
from pathlib import Path

import numpy as np

from generator.diagnostics import ModelError, UsageError, shorten
from generator.identification.fit import Estimate, Fit
from generator.identification.measured_angles import format_time
from generator.springs_file.axes import parallel_sign
from generator.springs_file.edit import check_target, springs_and_text
from springs import AxisSpring, SpringSet

_TEST_ANGLES = np.radians(np.linspace(-150.0, 150.0, 61))
"""Angles at which the torques of the file are compared with those of the fit [rad]."""

_MAX_TORQUE_DIFFERENCE = 1e-9
"""Largest relative difference of torques that a springs file may have from a fit."""


def fitted_springs_text(fit: Fit, file: Path, choice: str | Path | None = None) -> str:
    """Return the springs file of a fit, which extends the springs that were fitted.

    Args:
        fit: fit whose springs are stated.
        file: path of the springs file; it need not exist.
        choice: choice of the springs before the fit, as for `read_springs`.

    Raises:
        UsageError: the fit has changed no springs, or the file holds those before the fit.
        ModelError: a springs file cannot state a law.
    """
    figure, before, after = fit.nominal.figure, fit.nominal.springs, fit.case.springs
    if not any(one.path.startswith("springs.") for one in fit.estimates):
        raise UsageError("-o writes springs, and the fit has changed none")
    check_target(figure, file, choice)
    noted = _with_why(before, after, describe_fit(fit))
    made, text = springs_and_text(figure, before, noted, file, choice)
    _check_same_torques(made, after)
    comment = ["Made by mover identify.", *map(describe_estimate, fit.estimates)]
    head = "\n".join(f"# {line}" for line in comment)
    return f"{head}\n\n{text}"


def describe_fit(fit: Fit) -> str:
    """Return a sentence about data, estimates and noise of a fit."""
    values = ", ".join(map(describe_estimate, fit.estimates))
    data, noise = fit.data, degrees(fit.noise_sd)
    count = data.angles.size
    masses = "" if fit.has_fitted_masses else ", given the masses of the figure"
    first, last = map(format_time, data.times[[0, -1]])
    return (
        f"Fitted by mover identify to {count} angles of {data.name}, {first} to {last} s{masses}: "
        f"{values}; noise {noise:.3g} deg."
    )


def describe_estimate(estimate: Estimate) -> str:
    """Return an estimate with its standard deviation: `knee.scale 1.30 (sd 0.02)`."""
    unit = f" {estimate.unit}" if estimate.unit else ""
    digits = decimals(estimate.sd)
    name = estimate.path.removeprefix("springs.")
    return f"{name} {estimate.value:.{digits}f}{unit} (sd {estimate.sd:.2g})"


def decimals(sd: float) -> int:
    """Number of decimals that show two digits of a standard deviation, at most 8."""
    return 6 if not sd > 0.0 else int(np.clip(1 - np.floor(np.log10(sd)), 0, 8))


def _with_why(before: SpringSet, after: SpringSet, remark: str) -> SpringSet:
    """Return springs whose changed axes name their fit."""
    joints = dict(after.joints)
    for name, joint in after.joints.items():
        own = before.joints.get(name)
        if own is None or own == joint:
            continue
        axes = tuple(
            spring
            if spring in own.axes
            else replace(spring, why=" ".join(filter(None, [spring.why, remark])))
            for spring in joint.axes
        )
        joints[name] = replace(joint, axes=axes)
    return replace(after, joints=joints)


def _check_same_torques(made: SpringSet, fitted: SpringSet) -> None:
    """Raise ModelError if springs from a file differ from those of a fit."""
    for name, joint in fitted.joints.items():
        for spring in joint.axes:
            others = made.joints[name].axes if name in made.joints else ()
            other = next(
                (one for one in others if parallel_sign(one.direction, spring.direction)), None
            )
            if other is None:
                agree = not spring.elastic
            else:
                agree = _agree(other.oriented_along(spring.direction), spring)
            if not agree:
                raise ModelError(
                    f"a springs file cannot state the fitted spring of `{shorten(name)}`"
                )


def _agree(one: AxisSpring, other: AxisSpring) -> bool:
    """Return whether two springs about an axis have the same torques."""
    if (one.damping.viscous, one.damping.coulomb) != (other.damping.viscous, other.damping.coulomb):
        return False
    for rate in (-1.0, 1.0):
        first, second = (
            sum(np.asarray(law.torque(_TEST_ANGLES)) for law in spring.elastic)
            + np.asarray(spring.resistance(_TEST_ANGLES, np.full_like(_TEST_ANGLES, rate)))
            for spring in (one, other)
        )
        size = 1e-12 + float(np.max(np.abs(second)))
        if not float(np.max(np.abs(first - second))) <= _MAX_TORQUE_DIFFERENCE * size:
            return False
    return True
