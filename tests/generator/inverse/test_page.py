"""The page of a measured motion: its data, and in a real browser."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.contact.arrows import MIN_ARROW_FORCE
from generator.motion_files import COORDINATES_FILE
from tests.browser import WIDTHS, assert_accessible, launch_browser, offline_page
from tests.command import answer, run
from tests.generator.inverse.walking import FORCES, LOADS, MODEL, MOTION
from tests.motion_readers import Page

Said = tuple[dict[str, Any], Path]
"""Answer of the command, and its page."""

FRAME = 66
"""A frame in which the right foot alone is on the ground."""


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> Said:
    path = tmp_path_factory.mktemp("walk") / "walk.html"
    words = ("inverse", MODEL, MOTION, "--forces", LOADS, "--cutoff", "6Hz")
    return answer(*words, "-o", path), path


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with launch_browser() as browser:
        yield browser


def test_rows_have_the_numbers_of_the_command(said: Said):
    data, path = said
    rows = {row["label"]: row for row in Page(path).data["rows"]}
    assert path.stat().st_size < 2_500_000
    residuals = [label for label, row in rows.items() if row["net"]["residual"]]
    assert residuals == [f"pelvis_{name} (residual)" for name in ("tilt", "ty", "tx")]
    for name, powers in data["powers_W"].items():
        row = rows[f"{name} (residual)" if name in data["residuals"] else name]
        kind = "force" if row["net"]["unit"] == "N" else "moment"
        expected = np.array(data["moments"][f"{name}_{kind}"])
        moments, rates = Page.floats(row["net"]["moments"]), Page.floats(row["net"]["rates"])
        np.testing.assert_allclose(moments, expected, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(moments * rates, powers, rtol=1e-5, atol=1e-4)
        assert ("lower" in row["net"]) == (name in data["passive"])
    net = Page(path).data["net"]
    assert net["sure"] == pytest.approx(data["sure_s"])
    assert "riener_edrich_1999/leg" in net["band"]
    assert any("J. Biomech. 32:539-544" in source for source in net["sources"])


def test_forces_are_those_of_the_table(said: Said):
    """Forces and their points as in the rows of the plates' file at the times of the frames."""
    _, path = said
    data, table = Page(path).data, COORDINATES_FILE.parse_file(FORCES, has_angles=False)
    titles = [title.text for title in table.require_value().titles]
    numbers, times = table.require_value().numbers, Page.doubles(data["times"])
    total = np.zeros((len(times), 3))
    for row, prefix in zip(data["forces"], ("ground_force", "1_ground_force"), strict=True):
        columns = [titles.index(f"{prefix}_{kind}{axis}") for kind in "vp" for axis in "xyz"]
        rows = [np.interp(times, table.require_value().times, numbers[:, k]) for k in columns]
        force, point = np.stack(rows[:3], axis=1), np.stack(rows[3:], axis=1)
        frames = Page.floats(row["frames"]).astype(int)
        assert (np.linalg.norm(force[frames], axis=1) >= MIN_ARROW_FORCE).all()
        np.testing.assert_allclose(
            Page.floats(row["forces"]).reshape(-1, 3), force[frames], atol=1e-3
        )
        np.testing.assert_allclose(
            Page.floats(row["points"]).reshape(-1, 3), point[frames], atol=1e-6
        )
        total[frames] += force[frames]
    sizes = np.linalg.norm(total, axis=1)
    np.testing.assert_allclose(
        Page.floats(data["total_force"]["values"]), sizes, rtol=1e-5, atol=1e-3
    )


def test_a_page_without_forces_has_no_strip_and_says_why_moments_are_in_doubt(tmp_path: Path):
    path = tmp_path / "walk.html"
    run("inverse", MODEL, MOTION, "-o", path)
    data = Page(path).data
    assert data["forces"] == []
    assert data["total_force"] is None
    assert not data["succeeded"]
    warnings = [text for name, text in data["facts"] if name == "Warning"]
    assert any("do not trust the moments" in text for text in warnings)


@pytest.mark.slow
def test_a_page_of_a_run_has_its_contact_forces(tmp_path: Path):
    fall, path = tmp_path / "fall.npz", tmp_path / "fall.html"
    run("simulate", "male50", "--floor", "--stop", "0.3", "--frame", "0.005", "-o", fall)
    run("inverse", "male50", fall, "-o", path)
    data = Page(path).data
    assert {"left foot", "right foot"} <= {row["name"] for row in data["forces"]}
    assert data["total_force"]["noun"] == "contact force"
    assert "left_knee_1" in [row["label"] for row in data["rows"]]


@pytest.mark.slow
def test_a_walk_plays_with_forces_and_moments(browser: Any, said: Said):
    data, path = said
    with offline_page(browser, path, 1366, 768) as page:
        times = data["times_s"]
        left = "document.querySelector('#moment-plot .point').getBoundingClientRect()"
        places: list[list[float]] = []
        for name in ("hip_flexion_r", "knee_angle_l"):
            page.select_option("#row", label=name)
            for frame in (20, FRAME):
                page.evaluate("time => page.seek(time)", times[frame])
                _, moment, power = page.evaluate("page.point()")
                assert moment == pytest.approx(data["moments"][f"{name}_moment"][frame], abs=1e-4)
                assert power == pytest.approx(data["powers_W"][name][frame], abs=1e-3)
                assert f"net {moment:.1f} N m, {power:.1f} W" in page.inner_text("#moment-reading")
                places.append(page.evaluate(f"[{left}.x, {left}.y]"))
        # The point moves with the time, and is elsewhere on the curve of another joint.
        assert places[1][0] - places[0][0] > 50.0
        assert places[2][0] == pytest.approx(places[0][0], abs=3.0)
        assert places[2][1] != places[0][1]
        assert page.evaluate("page.forces()") == ["calcn_r"]
        assert "Arrow of 50 cm: 500 N" in page.inner_text("#scale")

        # A click on the trunk, the largest segment, chooses its joint.
        box = page.locator("#body").bounding_box()
        for part in np.linspace(0.2, 0.45, 6):  # the hips are below
            page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + part * box["height"])
        chosen = page.evaluate("document.querySelector('#row').selectedOptions[0].label")
        assert chosen in ("lumbar_extension", "pelvis_tilt (residual)", "pelvis_tx (residual)")

        # Power with a band, and the forces, over time; a click sets the time.
        assert any(
            "power [W]" in text for text in page.locator("#quantity option").all_inner_texts()
        )
        page.select_option("#quantity", label="External forces [N]")
        assert "calcn_l" in page.inner_text("#time-legend")
        plot = page.locator("#moment-plot .u-over").bounding_box()
        page.mouse.click(plot["x"] + 0.5 * plot["width"], plot["y"] + 0.5 * plot["height"])
        assert page.evaluate("page.time") == pytest.approx(1.25, abs=0.02)


@pytest.mark.slow
def test_plots_and_controls_fit_each_width(browser: Any, said: Said):
    _, path = said
    for width, height in WIDTHS:
        with offline_page(browser, path, width, height) as page:
            assert page.evaluate("document.documentElement.scrollWidth") == width
            for part in ("#body", "#play", "#time", "#force-plot .u-over"):
                box = page.locator(part).bounding_box()
                assert box["x"] >= 0.0, part
                assert box["x"] + box["width"] <= width, part
                assert box["y"] + box["height"] <= height, part
            for name in ("hip_flexion_r", "lumbar_extension", "ankle_angle_l"):
                page.select_option("#row", label=name)
                for part in ("#moment-plot", "#time-plot"):
                    host = page.locator(part).bounding_box()
                    drawn = page.locator(f"{part} canvas").bounding_box()
                    assert drawn["height"] == pytest.approx(host["height"], abs=1.0), part
                    assert drawn["width"] == pytest.approx(host["width"], abs=1.0), part


@pytest.mark.slow
@pytest.mark.parametrize(("width", "theme"), [(390, "light"), (1366, "dark")])
def test_a_page_is_accessible(browser: Any, said: Said, width: int, theme: str):
    assert_accessible(browser, said[1], width, theme)
