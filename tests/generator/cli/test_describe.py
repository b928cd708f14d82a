"""`mover describe`: segments, joints and springs of a figure."""

import re
from pathlib import Path

import pytest

from generator.contact.spheres import LARGEST_ERROR
from generator.figure_file import read_figure
from generator.figure_file.write import write_figure
from generator.person.identity import Identity
from generator.person.measures import Sex
from tests.command import answer, run
from tests.paths import FIGURES


def test_the_prototype_is_described():
    said = answer("describe", "prototype")
    assert said["degrees_of_freedom"] == 22
    assert said["total_mass_kg"] == pytest.approx(49.278, abs=1e-3)
    assert len(said["segments"]) == 11
    assert [s["name"] for s in said["segments"] if s["ground"]] == ["body_root"]
    kinds = [joint["kind"] for joint in said["joints"]]
    assert (kinds.count("spherical"), kinds.count("revolute")) == (6, 4)
    knee = said["springs"]["joints"]["left_knee"]["axes"][0]
    assert knee["axis"] == "-y"
    assert knee["viscous"] == pytest.approx(0.08)
    (law,) = knee["laws"]
    assert law["law"] == "cubic"
    assert law["sense"] == -1
    assert law["dead_zone_deg"] == pytest.approx([0.0, 89.0], abs=0.1)
    assert "root_torso" not in said["springs"]["joints"]


def test_sex_and_stature_of_a_person_are_described(tmp_path: Path):
    said = answer("describe", "prototype")
    assert said["sex"] is said["stature_m"] is None
    path = tmp_path / "me.fig"
    person = Identity(Sex.FEMALE, 1.628).attribute
    path.write_text(write_figure(read_figure("pendulum").with_parts(person)), encoding="utf-8")
    said = answer("describe", path)
    assert (said["sex"], said["stature_m"]) == ("female", 1.628)
    assert "\nfemale, stature 1.628 m\n" in run("describe", path).stdout


def test_the_contact_spheres_of_a_figure_are_described():
    said = {
        each["name"]: each["contact_spheres"]
        for each in answer("describe", "prototype")["segments"]
    }
    assert said.pop("body_root") is None
    plain = run("describe", "prototype").stdout
    for name, fit in said.items():
        assert fit["source"] == "fitted"
        assert 0.0 < fit["largest_error_m"] <= LARGEST_ERROR
        assert {len(sphere["centre_m"]) for sphere in fit["spheres"]} == {3}
        (line,) = (line for line in plain.splitlines() if line.startswith(f"{name} "))
        error = 1e3 * fit["largest_error_m"]
        assert line.endswith(f"  {len(fit['spheres'])} fitted within {error:.1f} mm")


def test_the_parts_of_a_person_are_described_in_one_row_for_both_sides():
    said, plain = answer("describe", "male50"), run("describe", "male50").stdout
    spheres = {
        f"{each['name']} {number}": sphere
        for each in said["segments"]
        if each["contact_spheres"]
        for number, sphere in enumerate(each["contact_spheres"]["spheres"])
    }
    assert len(said["parts"]) > 15
    for part in said["parts"]:
        key = "region" if part["within"] else "part"
        assert {spheres[name][key] for name in part["spheres"]} == {part["name"]}
        assert part["class"] in ("published", "scaled", "estimate")
        assert part["source"]
    rows = re.findall(r"^(\S.*?) {2,}[0-9]+ .* (?:scaled|estimate)$", plain, re.MULTILINE)
    assert {"head", "pelvis", "buttocks of pelvis", "hand, left and right"} < set(rows)
    assert not any("left_" in row for row in rows)
    assert answer("describe", "prototype")["parts"] == []


def test_own_spheres_capsules_and_missing_psurfs_are_described(tmp_path: Path):
    text = (FIGURES / "pendulum.fig").read_text(encoding="utf-8")
    path = tmp_path / "pendulum.fig"
    path.write_text(text, encoding="utf-8")
    assert "no contact spheres: `" in run("describe", path).stdout
    assert answer("describe", path)["segments"][1]["contact_spheres"] is None
    psurf = 'psurf = "link1.pss";'
    path.write_text(
        text.replace(psurf, f"{psurf} contact = sphere(0,0,1mm,2cm);"), encoding="utf-8"
    )
    assert "  1 own\n" in run("describe", path).stdout
    assert answer("describe", path)["segments"][1]["contact_spheres"] == {
        "source": "own",
        "largest_error_m": None,
        "spheres": [{"centre_m": [0.0, 0.0, 0.001], "radius_m": 0.02, "part": None}],
    }
    path.write_text(text.replace(psurf, ""), encoding="utf-8")
    assert " capsule\n" in run("describe", path).stdout


def test_a_figure_without_springs_is_described():
    assert "springs: none" in run("describe", "prototype", "--springs", "none").stdout


def test_stiffness_and_limits_are_described(tmp_path: Path):
    limits = "llimit = (-10deg,-20deg,-30deg); ulimit = (10deg,20deg,30deg); damp = (1,1,1);"
    text = (FIGURES / "pendulum.fig").read_text(encoding="utf-8")
    path = tmp_path / "limited.fig"
    path.write_text(text.replace("type = ", limits + " type = "), encoding="utf-8")
    plain = run("describe", path).stdout
    assert plain.startswith(f"{path}: 1 moving segment, 1 joint, 3 degrees of freedom, 0.025 kg\n")
    assert "40 deg 20 deg" in plain
    assert "spherical" in plain
    assert "linear " in plain
    assert "stops at -20 deg .. 20 deg" in plain
    (shoulder,) = answer("describe", path)["springs"]["joints"].values()
    assert [law["law"] for law in shoulder["axes"][0]["laws"]] == ["linear", "stop"]


def test_the_coupled_springs_of_a_figure_are_described():
    words = ("describe", "prototype", "--springs", "coupled")
    assert "hip flexion at left_hip_joint y, knee flexion at left_knee -y" in run(*words).stdout
    said = answer(*words)["springs"]
    left, right = said["coupled"]
    assert [axis["joint"] for axis in right["axes"]] == ["right_hip_joint", "right_knee"]
    assert left["coordinates"] == ["hip flexion", "knee flexion"]
    assert left["conservative"] is True
    assert said["joints"]["left_knee"]["axes"][0]["laws"] == []


def test_springs_that_are_coupled_only_are_described(tmp_path: Path):
    path = tmp_path / "own.springs.toml"
    path.write_text(
        '[[coupled]]\njoints = ["shoulder", "shoulder"]\naxes = ["x", "y"]\n'
        'coordinates = ["a", "b"]\n'
        "terms = [{ amplitudes_Nm = [-1, -1], rates_1_rad = [1, 1] }]\n",
        encoding="utf-8",
    )
    plain = run("describe", "pendulum", "--springs", path).stdout
    assert "a at shoulder x, b at shoulder y" in plain
