"""`mover stability`: the verdict, its margin, and the table along a motion."""

import pytest

from tests.command import answer, run

TOP = """figure {
  segment floor { mass = -1g; site a->location = trans(0,0,0); }
  segment top {
    mass = 1kg; inertia = (1,1,1);
    site tip->location = trans(0,0,0);
    site CM->location = trans(0,5cm,0);
  }
  joint ball { connect floor.a to top.tip; type = R(1,0,0)*R(0,1,0)*R(0,0,1); }
  root = floor.a;
}
"""


def test_the_standing_figure_is_balanced():
    said = answer("stability", "prototype", "--below", "0cm")
    assert said["balance"] == "inside"
    assert said["margin_cm"] == pytest.approx(5.0443186, abs=1e-6)
    assert said["direction"] == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)
    assert {said["corners"][k]["of"] for k in said["pivot"]} == {
        "left_lower_leg:496",
        "right_lower_leg:496",
    }
    text = run("stability", "prototype", "--below", "0cm").stdout
    assert "prototype: balanced, the centre of mass is 5.04 cm inside the edge" in text


@pytest.mark.parametrize(
    ("words", "balance", "sentence"),
    [
        (["--below=-5 mm"], "unsupported", "not balanced, nothing supports the figure"),
        (["--support", "body_root.base"], "outside", "is a single point and the centre of mass"),
        (
            ["--support", "left_lower_leg.distal", "--support", "right_lower_leg.distal"],
            "outside",
            "is a single line and the centre of mass is 0.44 cm off it",
        ),
        (["--support", "left_lower_leg"], "outside", "cm outside the support"),
        (["--below", "0", "--set", "waist=0,0,-60"], "outside", "cm outside the support"),
        (["--support", "left_lower_leg:496, 497"], "outside", "cm outside the support"),
    ],
)
def test_a_figure_that_does_not_stand_has_its_sentence(words, balance, sentence):
    data = answer("stability", "prototype", *words)
    assert data["balance"] == balance
    assert sentence in data["sentence"]
    assert data["sentence"] in run("stability", "prototype", *words).stdout
    assert (data["margin_cm"] is None) is (balance == "unsupported")


def test_a_point_directly_below_the_centre_is_marginal(tmp_path):
    figure = tmp_path / "top.fig"
    figure.write_text(TOP, encoding="utf-8")
    said = answer("stability", figure, "--support", "top.tip")
    assert (said["balance"], said["margin_cm"], said["direction"]) == ("on the edge", 0.0, None)
    assert said["sentence"] == (
        "marginal, the support is a single point directly below the centre of mass"
    )
    leaning = answer("stability", figure, "--support", "top.tip", "--set", "ball=0,0,90")
    assert leaning["margin_cm"] == pytest.approx(-5.0)


def test_the_ground_may_have_another_normal():
    said = answer("stability", "prototype", "--support", "center_torso", "--up", "0,0,-3")
    assert said["up"] == [0.0, 0.0, -1.0]
    assert all(corner["on_ground_cm"][2] == 0.0 for corner in said["corners"])


def test_the_stability_along_a_motion(bending, tmp_path):
    table = tmp_path / "standing.csv"
    said = answer("stability", "prototype", "--below", "0", "--along", bending, "-o", table)
    assert said["balance"] == ["inside"] * 5 + ["outside"] * 3
    lines = [li for li in table.read_text(encoding="utf-8").splitlines() if li[0] != "#"]
    assert lines[0] == "time [s],balance,margin [cm],x [cm],y [cm],z [cm]"
    rows = [line.split(",") for line in lines[1:]]
    assert [float(row[0]) for row in rows] == pytest.approx([0.1 * k for k in range(8)])
    assert [row[1] for row in rows] == said["balance"]
    for k in (0, 7):
        one = answer("stability", "prototype", "--below", "0", "--set", f"waist=0,0,{-5 * k}")
        _, balance, margin, *centre = rows[k]
        assert balance == one["balance"]
        assert float(margin) == pytest.approx(one["margin_cm"], abs=1e-9)
        assert list(map(float, centre)) == pytest.approx(one["centre_of_mass_cm"], abs=1e-9)
    text = run("stability", "prototype", "--below", "0", "--along", bending).stdout
    assert "5 inside, 3 outside" in text
    assert "first not balanced" in text
    assert "0.5 s" in text


def test_frames_without_support_have_no_margin(bending, tmp_path):
    table = tmp_path / "air.csv"
    said = answer("stability", "prototype", "--below=-1cm", "--along", bending, "-o", table)
    assert said["margin_cm"] == [None] * 8
    assert table.read_text(encoding="utf-8").splitlines()[-1].split(",")[1:3] == ["unsupported", ""]
