"""Response of a posture to its loads, and the page that is driven by it, in a real browser."""

import html
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.figure_file import read_figure
from generator.hold.posture import Holder
from generator.hold.response import page_data, page_loads
from generator.hold.statics import Load
from generator.model import Model
from tests.browser import assert_accessible, launch_browser, offline_page
from tests.command import answer, mover, run

WIDTHS = ((390, 844), (768, 1024), (1366, 768))
"""Windows of a phone, a tablet and a small laptop."""

ARMS = ("--set", "left_shoulder=0,0,90", "--set", "right_shoulder=0,0,90")
SEATED = (
    *("--set", "left_hip_joint=0,0,80", "--set", "right_hip_joint=0,0,80"),
    *("--set", "left_knee=80", "--set", "right_knee=80", "--support", "seat,left_foot,right_foot"),
)

LAME = "right_foot,left_foot.heel"
BEYOND = ("male50", "--set", "left_elbow=0,160")

CASES = [
    # Figure with its posture; masses [kg] and forces [N] of right and left hand, and how many
    # of these loads are refused.
    (("male50",), [(7.3, None, 0.0, None), (12.0, None, 4.5, None), (0.0, None, 0.0, None)], 0),
    (("female50", *ARMS), [(1.5, (10.0, 20.0, -30.0), 3.0, None), (60.0, None, 0.0, None)], 1),
    (("female50", *SEATED, "--age", "over-65"), [(4.0, None, 2.0, (-15.0, 0.0, 40.0))], 0),
    (
        ("male50", "--support", LAME),
        [(2.0, None, 0.0, None), (0.0, (-900.0, 0.0, 0.0), 0.0, None)],
        1,
    ),
    (("male50", "--support", "ground", *ARMS), [(700.0, None, 700.0, None)], 0),
    (BEYOND, [(0.0, (0.0, 2000.0, 0.0), 1.0, None), (0.0, None, 1.0, None)], 1),
]


def options(values: tuple[Any, ...]) -> list[str]:
    """The loads of a case as options, with forces and masses apart."""
    words: list[str] = []
    for hand, mass, force in (("right_hand", *values[:2]), ("left_hand", *values[2:])):
        words += ["--load", f"{hand}={mass}kg"]
        if force is not None:
            words += ["--load", f"{hand}={','.join(map(str, force))}N"]
    return words


@pytest.mark.parametrize("supports", [None, ("seat", "left_foot", "right_foot"), ("ground",)])
def test_moments_are_linear_in_loads_and_forces_of_supports(supports: tuple[str, ...] | None):
    holder = Holder.of(Model.of(read_figure("male50")), supports=supports)
    pose = {"waist": np.array([0.1, 0.2, 0.3]), "left_shoulder": np.array([0.1, 0.2, 1.0])}
    loads = page_loads(holder.model.figure, [Load("right_hand", 3.0), Load("head", 1.0)])
    data = page_data(holder, holder.posture(pose, loads, must_balance=False))
    json.dumps(data, allow_nan=False)
    other = [Load("right_hand", 9.0, (5.0, -8.0, 3.0)), Load("head"), Load("left_hand", 2.0)]
    found = holder.posture(pose, other, must_balance=False)
    rows = np.array(data["base"])
    for row, load in zip(data["loads"], other, strict=True):
        assert row["segment"] == load.segment
        rows += load.total @ np.array(row["columns"])
    bearings = {} if found.standing is None else {one.name: one for one in found.standing.bearings}
    for support in data["supports"]:
        wrench = bearings.pop(support["name"]).wrench
        rows += np.concatenate([wrench.force, wrench.moment]) @ np.array(support["columns"])
    assert not bearings
    moments = rows[: len(data["axes"])].tolist()
    for demand, axis, moment in zip(found.joints, data["axes"], moments, strict=True):
        is_opposite = moment - axis["passive"] < -1e-9
        way = axis["directions"][is_opposite]
        assert demand.direction == way["name"]
        assert demand.capacity == way["capacity"]
        assert demand.net == pytest.approx(-moment if is_opposite else moment, abs=1e-9)
    assert found.spine is not None
    assert found.spine.moment == pytest.approx(rows[-3], abs=1e-9)


def test_capacities_depend_on_the_angle_only():
    # A page keeps them while loads change.
    holder = Holder.of(Model.of(read_figure("female50")))
    heavy = holder.posture(None, [Load("right_hand", 30.0), Load("left_hand", 30.0)])
    light = {(one.joint, one.direction): one for one in holder.posture().joints}
    for one in heavy.joints:
        if (one.joint, one.direction) in light:
            assert one.capacity == light[one.joint, one.direction].capacity


def test_loads_of_a_page_are_one_for_each_place():
    figure = read_figure("male50")
    loads = [Load("right_hand", 2.0), Load("head", 1.0), Load("right_hand", force=(1.0, 2.0, 3.0))]
    assert page_loads(figure, loads) == (
        Load("right_hand", 2.0, (1.0, 2.0, 3.0)),
        Load("head", 1.0),
        Load("left_hand"),
    )
    apart = [Load("right_hand", 2.0), Load("right_hand", 3.0, site="distal")]
    assert page_loads(figure, apart) == (*apart, Load("left_hand"))


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with launch_browser() as found:
        yield found


def texts_of_file(path: Path) -> list[list[str]]:
    """Verdict, lines, cells and notes of a page as the command wrote it."""
    text = path.read_text(encoding="utf-8")
    parts = ("lines", "p"), ("rows", "td"), ("notes", "li")
    blocks = (
        re.findall(rf'id="{name}"[^>]*>(.*?)</(?:div|tbody|ul)>', text, re.S) for name, _ in parts
    )
    found = [
        re.findall(rf"<{tag}>(.*?)</{tag}>", block[0])
        for block, (_, tag) in zip(blocks, parts, strict=True)
    ]
    verdict = re.findall(r'id="verdict"[^>]*>(.*?)</p>', text)
    return [[html.unescape(cell) for cell in cells] for cells in (verdict, *found)]


def texts_of_page(tab: Any) -> list[list[str]]:
    return [
        tab.locator(selector).all_text_contents()
        for selector in ("#verdict", "#lines p", "#rows td", "#notes li")
    ]


def fill(tab: Any, values: tuple[Any, ...]) -> None:
    """Type the loads of a case."""
    for hand, mass, force in (("right_hand", *values[:2]), ("left_hand", *values[2:])):
        tab.get_by_label(f"{hand} mass [kg]", exact=True).fill(str(mass))
        for axis, part in zip("xyz", force or (0.0, 0.0, 0.0), strict=True):
            tab.get_by_label(f"{hand} {axis} [N]", exact=True).fill(str(part))


@pytest.mark.slow
@pytest.mark.parametrize(("words", "loads", "refused"), CASES)
def test_page_states_what_the_command_states(
    browser: Any,
    tmp_path: Path,
    words: tuple[str, ...],
    loads: list[tuple[Any, ...]],
    refused: int,
):
    path, again = tmp_path / "hold.html", tmp_path / "again.html"
    run("hold", *words, "--load", "right_hand=0.5kg", "-o", path)
    with offline_page(browser, path, 1366, 768) as tab:
        assert texts_of_page(tab) == texts_of_file(path)
        for values in loads:
            fill(tab, values)
            command = ("hold", *words, *options(values))
            result = mover(*command, "--json", "-o", again)
            if result.exit_code:
                refused -= 1
                sentence = json.loads(result.stdout)["error"]
                assert tab.inner_text("#verdict") == f"The command refuses this: {sentence}"
                assert texts_of_page(tab)[1:] == [[], [], []]
                continue
            told = json.loads(result.stdout)
            assert texts_of_page(tab) == texts_of_file(again)
            shown = tab.evaluate("JSON.parse(JSON.stringify(page.result))")
            for one, row in zip(shown["demands"], told["joints"], strict=True):
                assert (one["joint"], one["direction"]) == (row["joint"], row["direction"])
                for key, name in (
                    *(("net", "net_Nm"), ("passive", "passive_Nm"), ("active", "active_Nm")),
                    *(("use", "use"), ("percent", "percent_capable"), ("endurance", "endurance_s")),
                ):
                    if row[name] is None:
                        assert one[key] is None
                    else:
                        assert one[key] == pytest.approx(row[name], rel=1e-9, abs=1e-9)
            for key, name in (
                ("compression", "compression_N"),
                ("low", "low_N"),
                ("high", "high_N"),
            ):
                assert shown["spine"][key] == pytest.approx(told["spine"][name], rel=1e-9)
            for one, row in zip(shown["hands"], told["hands"], strict=True):
                assert one["capacity"] == pytest.approx(row["capacity_N"], rel=1e-9)
            if told["balance"]:
                margin = told["balance"]["margin_m"]
                assert shown["standing"]["margin"] == pytest.approx(margin, abs=1e-9)
    assert refused == 0


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), WIDTHS)
def test_a_load_is_dragged_and_keys_move_it(browser: Any, tmp_path: Path, width: int, height: int):
    path = tmp_path / "hold.html"
    run("hold", "male50", "--load", "right_hand=5kg", "-o", path)
    with offline_page(browser, path, width, height) as tab:
        assert tab.evaluate("document.documentElement.scrollWidth") == width
        assert (
            tab.evaluate(
                "Math.max(...[...document.querySelectorAll('svg')].map(s => s.clientWidth))"
            )
            <= width
        )
        for view, axis in ((0, "x"), (1, "z")):
            tip = tab.locator("svg.view").nth(view).locator('[data-load="0"]')
            tip.scroll_into_view_if_needed()
            box = tip.bounding_box()
            x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
            before = texts_of_page(tab)
            tab.mouse.move(x, y)
            tab.mouse.down()
            tab.mouse.move(x + 20, y - 10, steps=3)
            tab.mouse.up()
            assert texts_of_page(tab) != before
            assert float(tab.input_value(f'[aria-label="right_hand {axis} [N]"]')) > 20.0
        # 500 N are a metre; a narrow picture is smaller, and a pixel of it more.
        x, y, z = tab.evaluate("page.loads[0].force")
        assert 2.0 * (y / 2.0) == pytest.approx((x + z) / 2.0, abs=3.0)
        said = tab.inner_text("#options")
        assert said == f"--load right_hand=5kg --load right_hand={x:g},{y:g},{z:g}N"
        told = answer("hold", "male50", *said.split())
        assert tab.evaluate("page.result.weakest.use") == pytest.approx(told["weakest"]["use"])
        tab.get_by_role("button", name="As the command had it").press("Enter")
        assert texts_of_page(tab) == texts_of_file(path)
        slider = tab.get_by_label("left_hand mass [kg], slider")
        for _ in range(20):
            slider.press("ArrowRight")
        assert tab.input_value('[aria-label="left_hand mass [kg]"]') == "10"
        assert tab.inner_text("#options") == "--load right_hand=5kg --load left_hand=10kg"
        colour = tab.locator('svg.view circle[data-joint="left_elbow"]').first.get_attribute("fill")
        assert re.fullmatch(r"rgb\(\d+,\d+,\d+\)", colour)
        # What cannot be a load leaves the last one, and is said.
        mass = tab.get_by_label("left_hand mass [kg]", exact=True)
        for text in ("-3", "1e9", ""):
            mass.fill("10")
            assert mass.get_attribute("aria-invalid") is None
            mass.fill(text)
            assert mass.get_attribute("aria-invalid") == "true"
            said = tab.locator(f"#{mass.get_attribute('aria-describedby')}")
            assert said.inner_text().endswith("all numbers are still those of 10")
            assert tab.evaluate("page.loads[1].mass") == 10
        tab.get_by_role("button", name="As the command had it").press("Enter")
        assert (mass.input_value(), mass.get_attribute("aria-invalid")) == ("0", None)
        assert tab.locator("[aria-invalid], .fault:not(:empty)").count() == 0
        # The use is seen without scrolling the table.
        assert tab.locator("th").nth(2).inner_text() == "use"
        tab.evaluate("page.set(0, { mass: 30 })")
        assert "lateral bend" in tab.locator("#rows td").nth(1).inner_text()
        box = tab.locator("#rows td").nth(2).bounding_box()
        assert box["x"] + box["width"] <= width
        # A refusal moves no picture, though the page has less to show.
        tab.evaluate("scrollTo(0, document.documentElement.scrollHeight)")
        place = tab.locator("svg.view").first.bounding_box()
        for force in ([900, 0, 0], [0, 5000, 0], [-900, 0, -900], [0, 0, 0]):
            tab.evaluate("force => page.set(0, { force })", force)
            assert tab.evaluate("'refusal' in page.result") == any(force)
            assert tab.locator("svg.view").first.bounding_box() == place


@pytest.mark.slow
@pytest.mark.parametrize(("width", "theme"), [(390, "light"), (1366, "dark")])
def test_axe_finds_no_serious_fault(browser: Any, tmp_path: Path, width: int, theme: str):
    path = tmp_path / "hold.html"
    run("hold", "male50", "--load", "right_hand=15kg", "-o", path)
    assert_accessible(browser, path, width, theme, {"color-contrast", "button-name", "label"})
