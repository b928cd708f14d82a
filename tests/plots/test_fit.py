"""`mover fit`: what it prints, what it writes, and with which code it ends."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from generator.figure_file import read_figure
from generator.springs_file.read import load_springs
from springs import Cubic
from springs.cubic import Coefficients, polynomial
from springs.fit import fit_cubic
from springs.fit_forms import Form, FormFit
from tests.command import answer, mover, run
from tests.paths import FIGURES

HIP_ABDUCTION = (-0.131, 136.0, 8.42, -218.0)
ELBOW = (1.014, 29.224, -6.13885, 214.423)

LIGHT = """
import sys
from typer.testing import CliRunner
from generator.cli.app import app
for words in (["fit", sys.argv[1]], ["plots", "--list"]):
    assert CliRunner().invoke(app, words).exit_code == 0
assert not {"matplotlib", "exudyn"} & set(sys.modules)
"""


def data_file(folder: Path, coefficients: Coefficients, unit: str = "N m") -> Path:
    """A file of exact moments of a cubic from -50 to 55 deg."""
    angles = np.arange(-50.0, 56.0, 5.0)
    factor = {"N m": 1.0, "dyn cm": 1e7}[unit]
    moments = factor * polynomial(coefficients, np.radians(angles))
    rows = [f"{a},{float(m)!r}" for a, m in zip(angles, moments, strict=True)]
    path = folder / "data.csv"
    path.write_text("\n".join([f"angle [deg],moment [{unit}]", *rows, ""]), encoding="utf-8")
    return path


def test_matplotlib_is_imported_for_pictures_only(tmp_path: Path):
    line = [sys.executable, "-c", LIGHT, str(data_file(tmp_path, ELBOW))]
    assert subprocess.run(line, check=False).returncode == 0


def test_a_fit_is_told(tmp_path: Path):
    result = run("fit", data_file(tmp_path, HIP_ABDUCTION), "--form", "cubic")
    assert "22 moments from -50 to 55 deg" in result.stdout
    assert "; columns `angle [deg]` and `moment [N m]`\n" in result.stdout
    assert "R^2 1.000000; rms residual" in result.stdout
    assert "sense +1: c3 is negative, so the moment acts on the child" in result.stdout
    assert "the dead zone, -44.2 to 46.3 deg" in result.stdout
    assert "doubt: within the dead zone the law leaves out" in result.stdout
    table = result.stdout.split("angle [deg]")[-1].splitlines()
    assert len(table) == 1 + 22


@pytest.mark.parametrize("unit", ["N m", "dyn cm"])
def test_the_json(tmp_path: Path, unit: str):
    path = data_file(tmp_path, ELBOW, unit)
    said = answer("fit", path)
    assert said["coefficients"] == pytest.approx(ELBOW, rel=1e-9)
    assert len(said["standard_errors"]) == 4
    assert said["r_squared"] == pytest.approx(1.0)
    assert said["law"]["sense"] == -1
    assert said["law"]["dead_zone_deg"] is None
    assert said["bounds_hold"] is False
    assert said["points"][0]["angle_deg"] == pytest.approx(-50.0)
    moment = float(polynomial(ELBOW, np.radians(-50.0)))
    assert said["points"][0]["moment"] == pytest.approx(moment)
    assert said["points"][0]["law"] == pytest.approx(moment)
    assert said["files"] == []


def test_the_spring_that_is_written_is_the_law(tmp_path: Path):
    output = tmp_path / "hip.springs.toml"
    result = run(
        *("fit", data_file(tmp_path, HIP_ABDUCTION), "-o", output, "--form", "cubic"),
        *("--joint", "left_hip_joint", "--joint", "right_hip_joint", "--axis", "x"),
        *("--motion", "abduction", "--reference", 'A "study" of 2000'),
    )
    assert f"wrote {output}" in result.stdout
    reading = load_springs(read_figure("prototype"), choice=output)
    assert reading.diagnostics == ()
    assert reading.value is not None
    for name, x in (("left_hip_joint", 1.0), ("right_hip_joint", -1.0)):
        (spring,) = (s for s in reading.value.joints[name].axes if s.motion)
        assert spring.direction == (x, 0.0, 0.0)
        assert spring.motion == "abduction"
        assert spring.reference == 'A "study" of 2000'
        assert "22 moments from -50 to 55 deg" in spring.why
        (law,) = spring.elastic
        assert isinstance(law, Cubic)
        assert law.sense == 1
        assert law.coefficients == pytest.approx(HIP_ABDUCTION, rel=1e-9)
        assert law.dead_zone is not None
        assert np.degrees(law.dead_zone) == pytest.approx([-44.19, 46.35], abs=0.01)


def test_what_is_written_can_be_checked_and_named(tmp_path: Path):
    output = tmp_path / "elbow.springs.toml"
    data = data_file(tmp_path, ELBOW)
    run("fit", data, "-o", output, "--joint", "left_elbow")
    checked = run("check", output).stdout
    assert "a stable equilibrium at -2.0 deg" in checked
    assert "`right_elbow` has no spring about this axis" in checked
    cited = run("cite", "prototype", "--springs", output)
    assert f"the moments in {data}, of unknown origin" in cited.stdout


def test_a_fit_takes_the_place_of_a_law_over_several_joints(tmp_path: Path):
    data, output = tmp_path / "five.csv", tmp_path / "knee.springs.toml"
    data.write_text("angle [deg],moment [N m]\n-5,12\n0,6\n30,1\n90,-1\n130,-10\n", "utf-8")
    joints = ("--joint", "left_knee", "--joint", "right_knee", "--motion", "flexion")
    run("fit", data, "-o", output, *joints)
    found = load_springs(read_figure("male50"), FIGURES, "male50", output)
    springs = found.require_value()
    (told,) = found.diagnostics
    assert "`left_knee` and `right_knee` have curves of this file" in told.message
    (law, _) = springs.joints["left_knee"].axes[0].elastic
    assert isinstance(law, Cubic)
    assert [len(one.axes) for one in springs.coupled] == [2, 2]


def test_a_passive_fit_restores_at_both_ends(tmp_path: Path):
    path = tmp_path / "odd.csv"
    path.write_text(
        "angle [deg],moment [N m]\n0,5\n20,1\n40,0\n60,-1\n80,-4\n100,-3\n", encoding="utf-8"
    )
    free, bound = answer("fit", path), answer("fit", path, "--passive")
    assert not free["bounds_hold"]
    assert bound["bounds_hold"]
    assert bound["standard_errors"] is None
    assert bound["rms"] > free["rms"]
    sense = bound["law"]["sense"]
    assert sense * bound["points"][0]["cubic"] >= 0.0 >= sense * bound["points"][-1]["cubic"]


@pytest.mark.parametrize(
    ("coefficients", "said", "labels"),
    [
        (HIP_ABDUCTION, "the torque on the child is +M", {"cubic", "measured", "dead zone"}),
        (ELBOW, "the torque on the child is -M", {"cubic", "measured"}),
    ],
)
def test_what_the_picture_shows(coefficients: Coefficients, said: str, labels: set[str]):
    from plots.fit_drawing import draw_fit

    angles = np.radians(np.arange(-50.0, 56.0, 5.0))
    fitted = fit_cubic(angles, polynomial(coefficients, angles))
    chosen = FormFit(Form.CUBIC, 4, fitted.law, fitted.law.sense)
    figure = draw_fit(fitted, chosen, "hip", "abduction", "a study")
    upper, lower = figure.axes
    shown = {text.get_text() for text in upper.get_legend().get_texts()}
    assert shown - {"law, with its dead zone"} == labels
    assert "[N m]" in upper.get_ylabel()
    assert "[deg], positive in abduction" in lower.get_xlabel()
    assert "residual" in lower.get_ylabel()
    words = figure.get_supxlabel()
    assert said in words
    assert "a study" in words
    points = next(line for line in upper.get_lines() if line.get_label() == "measured")
    assert points.get_xdata() == pytest.approx(np.degrees(angles))


def knee_file(folder: Path) -> Path:
    """A file of moments of two exponentials that resist, with noise, from -10 to 130 deg."""
    angles = np.radians(np.linspace(-10.0, 130.0, 25))
    torques = 1.8 * np.exp(-6.0 * angles) - 9.4e-5 * np.exp(5.0 * angles) + 0.3
    noise = 0.1 * np.random.default_rng(1).normal(size=25)
    rows = [f"{a:.6f},{m:.4f}" for a, m in zip(np.degrees(angles), noise - torques, strict=True)]
    path = folder / "knee.csv"
    path.write_text("\n".join(["angle [deg],moment [N m]", *rows, ""]), encoding="utf-8")
    return path


def test_the_form_is_chosen_by_cross_validation(tmp_path: Path):
    data, output = knee_file(tmp_path), tmp_path / "knee.springs.toml"
    said = answer("fit", data, "-o", output, "--joint", "left_knee", "--motion", "flexion")
    errors = {one["form"]: one["error"] for one in said["forms"]}
    assert said["form"] == "exponentials" == min(errors, key=lambda form: errors[form])
    assert errors["exponentials"] < 0.2 < 0.25 < min(errors["cubic"], errors["points"])
    assert said["law"]["sense"] == -1
    steep = sorted(term["rate_1_rad"] for term in said["law"]["terms"])
    assert steep == pytest.approx([-6.0, 5.0], rel=0.1)
    assert "exponentials_Nm_1_rad" in output.read_text("utf-8")
    assert "cubic" in output.read_text("utf-8")  # its error, in `why`


@pytest.mark.parametrize("form", Form)
def test_each_form_is_written_as_the_law_that_is_told(form: Form, tmp_path: Path):
    output = tmp_path / "knee.springs.toml"
    words = ("-o", output, "--joint", "left_knee", "--form", form)
    said = answer("fit", knee_file(tmp_path), *words)
    assert said["form"] == form
    reading = load_springs(read_figure("prototype"), choice=output)
    assert reading.value is not None
    (spring,) = reading.value.joints["left_knee"].axes
    for point in said["points"]:
        torque = sum(float(law.torque(np.radians(point["angle_deg"]))) for law in spring.elastic)
        assert torque == pytest.approx(-point["law"], abs=1e-6)
    text = run("fit", knee_file(tmp_path), "--form", form, "--plot", tmp_path / "a.svg").stdout
    assert f"{form} (chosen)" in text


def test_equal_moments_make_a_spring_only_if_passive(tmp_path: Path):
    path, output = tmp_path / "flat.csv", tmp_path / "flat.springs.toml"
    path.write_text("angle [deg],moment [N m]\n0,3\n20,3\n40,3\n60,3\n80,3\n", encoding="utf-8")
    said = run("fit", path, "--plot", tmp_path / "flat.svg").stdout
    assert "doubt: no sense makes this cubic restoring" in said
    assert "R^2 undefined, all moments are equal" in said
    assert answer("fit", path)["law"] is None
    run("fit", path, "-o", output, "--joint", "knee", "--passive")
    assert output.exists()


def test_a_text_that_no_file_holds(tmp_path: Path):
    words = ("-o", tmp_path / "a.springs.toml", "--joint", "left_knee", "--motion", "x" * 2000)
    result = mover("fit", data_file(tmp_path, ELBOW), *words)
    assert result.exit_code == 2
    assert "at most 1000 characters" in result.stderr


@pytest.mark.parametrize("passive", [(), ("--passive",)])
def test_the_largest_numbers_are_fitted(passive: tuple[str, ...], tmp_path: Path):
    path = tmp_path / "data.csv"
    rows = "-720,1e12\n-719,-1e12\n0,1e12\n719,1e12\n720,-1e12\n"
    path.write_text(f"angle [deg],moment [N m]\n{rows}", encoding="utf-8")
    assert None not in answer("fit", path, *passive)["coefficients"]
