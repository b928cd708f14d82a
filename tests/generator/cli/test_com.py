"""`mover com`: the centre of mass, its slopes, and its path along a motion."""

import numpy as np
import pytest

from generator.figure_file import read_figure
from generator.figure_file.write import write_figure
from generator.kinematics.centre_of_mass import centre_of_mass
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.person.identity import Identity
from generator.person.measures import Sex
from tests.command import answer, run
from tests.paths import FIGURES


def centre_cm(*words: object) -> np.ndarray:
    return np.array(answer("com", "prototype", *words)["centre_of_mass_cm"])


def test_the_centre_of_mass_of_a_pose(prototype):
    said = answer("com", "prototype", "--set", "left_elbow=90")
    values = {**initial_displacements(prototype), "left_elbow": np.array([np.pi / 2])}
    expected = 100.0 * centre_of_mass(forward_kinematics(prototype, values))
    assert said["centre_of_mass_cm"] == pytest.approx(expected.tolist(), abs=1e-12)
    assert said["mass_kg"] == pytest.approx(49.27798)
    parts = [(part["mass_kg"], part["centre_of_mass_cm"]) for part in said["segments"]]
    mean = sum(mass * np.array(where) for mass, where in parts) / said["mass_kg"]
    assert mean == pytest.approx(expected)
    assert "49.28 kg" in run("com", "prototype").stdout


def test_the_height_of_the_centre_of_mass_over_the_stature(tmp_path):
    said = answer("com", "prototype")
    assert said["height_cm"] == pytest.approx(said["centre_of_mass_cm"][1])
    assert said["height_over_stature"] is None
    assert "of the stature" not in run("com", "prototype").stdout
    path = tmp_path / "me.fig"
    person = Identity(Sex.FEMALE, 1.6).attribute
    path.write_text(write_figure(read_figure("prototype").with_parts(person)), encoding="utf-8")
    said = answer("com", path)
    assert said["height_over_stature"] == pytest.approx(said["height_cm"] / 160.0)
    ratio = f"{said['height_over_stature']:.3f}"
    assert f"cm; its height is {ratio} of the stature\n" in run("com", path).stdout


def test_a_slope_is_the_change_for_a_degree_more():
    slopes = answer("com", "prototype", "--set", "waist=0,0,20")["slopes"]
    assert len(slopes) == 22
    flexion = next(one for one in slopes if (one["joint"], one["displacement"]) == ("waist", 3))
    assert flexion["unit"] == "cm/deg"
    more, less = (centre_cm("--set", f"waist=0,0,{bend}") for bend in (20.5, 19.5))
    assert flexion["slope"] == pytest.approx(more - less, abs=1e-4)


def test_the_centre_of_mass_of_some_segments():
    said = answer("com", "prototype", "--segments", "left_lower_leg, left_upper_leg")
    assert [part["name"] for part in said["segments"]] == ["left_lower_leg", "left_upper_leg"]
    assert said["mass_kg"] == pytest.approx(12.20632)


def test_segments_without_mass_may_be_left_out(tmp_path):
    path = tmp_path / "light.fig"
    text = (FIGURES / "prototype.fig").read_text(encoding="utf-8")
    path.write_text(text.replace("mass = 1815.81g;", "", 1), encoding="utf-8")
    assert answer("com", path, "--segments", "left_lower_arm")["mass_kg"] == pytest.approx(1.81581)


def test_the_centre_of_mass_along_a_motion(bending, tmp_path):
    table = tmp_path / "com.csv"
    said = answer("com", "prototype", "--along", bending, "-o", table)
    lines = table.read_text(encoding="utf-8").splitlines()
    head = [line for line in lines if line.startswith("#")]
    assert "# figure prototype.fig" in head
    assert any(line.startswith("# segments right_lower_leg left_lower_leg") for line in head)
    assert lines[len(head)] == "time [s],x [cm],y [cm],z [cm]"
    rows = np.array([line.split(",") for line in lines[len(head) + 1 :]], dtype=float)
    assert rows[:, 0].tolist() == said["times_s"] == pytest.approx(np.arange(8) * 0.1)
    assert rows[:, 1:] == pytest.approx(np.array(said["centre_of_mass_cm"]), abs=1e-12)
    for k in (0, 7):
        bent = centre_cm("--set", f"waist=0,0,{-5 * k}")
        assert rows[k, 1:] == pytest.approx(bent, abs=1e-9)
    assert "8 frames, 0 to 0.7 s" in run("com", "prototype", "--along", bending).stdout
