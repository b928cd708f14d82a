"""Springs file of a fit, read back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator.diagnostics import UsageError
from generator.figure_file import read_figure
from generator.identification.fit import Fit, fit_springs
from generator.identification.fitted_springs import describe_fit, fitted_springs_text
from generator.model import Model
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.springs_file.read import read_springs
from generator.study.parameter_paths import Case, parse_path
from tests.swings import ALONE, TRUTH, VISCOUS, swing, write_leg


def fit_leg(folder: Path, *texts: str) -> Fit:
    figure = read_figure(write_leg(folder))
    case = Case(Model.of(figure), Plan())
    return fit_springs(case, swing(), [parse_path(text, case) for text in texts], ALONE)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    return fit_leg(tmp_path_factory.mktemp("leg"), *TRUTH)


def folder_of(fit: Fit) -> Path:
    path = fit.nominal.figure.path
    assert path is not None
    return path.parent


def test_a_file_gives_the_fitted_motion(whole: Fit):
    file = folder_of(whole) / "leg.fitted.springs.toml"
    file.write_text(fitted_springs_text(whole, file), encoding="utf-8")
    springs = read_springs("fitted", whole.nominal.figure)
    runs = [
        simulate(Model(whole.case.figure, one), replace(whole.case.plan, tolerance=1e-8))
        for one in (springs, whole.case.springs)
    ]
    first, second = (run.displacements["left_knee"] for run in runs)
    np.testing.assert_allclose(first, second, rtol=0.0, atol=1e-7)
    spring = springs.joints["left_knee"].axes[0]
    assert spring.damping.viscous == whole.values[VISCOUS]
    assert spring.reference == "invented"
    assert describe_fit(whole) in spring.why
    assert "151 angles of swing.csv, 0 to 3 s, given the masses of the figure" in spring.why


def test_damping_alone_keeps_the_elastic_law(tmp_path: Path):
    fit = fit_leg(tmp_path, VISCOUS)
    text = fitted_springs_text(fit, tmp_path / "leg.fitted.springs.toml")
    assert "viscous_Nms_rad" in text
    assert "points_deg_Nm" not in text
    assert text.startswith("# Made by mover identify.\n# left_knee.viscous_Nms_rad 0.")


def test_the_springs_before_the_fit_are_not_overwritten(whole: Fit):
    with pytest.raises(UsageError, match="choose another name"):
        fitted_springs_text(whole, folder_of(whole) / "leg.springs.toml")


def test_a_fit_without_springs_writes_none(whole: Fit):
    start = replace(whole, estimates=whole.estimates[3:])
    with pytest.raises(UsageError, match="the fit has changed none"):
        fitted_springs_text(start, folder_of(whole) / "leg.fitted.springs.toml")


def test_fitted_masses_are_not_called_those_of_the_figure(whole: Fit):
    first, *others = whole.estimates
    mass = replace(first, path="segments.shank.mass", unit="kg", mass_slope=None)
    remark = describe_fit(replace(whole, estimates=(mass, *others)))
    assert "given the masses" not in remark
    assert "segments.shank.mass 1.3" in remark
