"""Pages of motions: what they hold, and that text of files cannot become markup or scripts."""

import json
import re
from base64 import b64encode
from dataclasses import replace
from hashlib import sha256
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import Plan, read_springs, simulate
from generator.contact.appearance import FORCE_COLOUR
from generator.contact.scene import Scene
from generator.losses import Losses
from generator.model import Model
from generator.motion_files import (
    FigureMotion,
    motion_from_recording,
    motion_writer,
    page,
)
from generator.motion_files.page import (
    MAX_PAGE_FRAMES,
    SCRIPTS,
    kept_frames,
    page_data,
    script_json,
    springs_of_header,
    write,
)
from generator.passive_curve import passive_curves, passive_torque
from tests.chains import BALL, at, body, chain, figure, ground, joint, one_body
from tests.contacts import with_contact
from tests.motion_readers import Page
from tests.motions import any_motion, clip, shipped

ASSETS = files("generator.motion_files").joinpath("page_assets")
HOSTILE = "</script><!--<img src=x onerror=alert(1)>"


def hostile_motion() -> FigureMotion:
    """A motion in which every text that a file may state is an attack."""
    made = figure(
        [ground(near=at()), body(HOSTILE, sites={"far&<b>": at(shift=(0.0, 0.3, 0.0))})],
        [joint(f"hinge {HOSTILE}", "ground.near", f"{HOSTILE}.near", chain("Rx"))],
    )
    motion = any_motion(replace(made, name=HOSTILE))
    texts = {"figure": HOSTILE, "springs": HOSTILE, "law": HOSTILE, "message": HOSTILE}
    return replace(motion, header=replace(motion.header, **texts))


def asset(name: str) -> str:
    return ASSETS.joinpath(name).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["prototype", "hostile"])
def test_nothing_refers_to_another_place(name: str, tmp_path: Path):
    write(hostile_motion() if name == "hostile" else clip(name), tmp_path / "out.html")
    read = Page(tmp_path / "out.html")
    addresses = [
        value
        for _, attributes in read.tags
        for key, value in attributes.items()
        if key in {"src", "href", "srcset", "action", "formaction", "data", "poster", "background"}
    ]
    assert addresses == ["data:,"]  # an icon, so that the browser does not ask for one
    assert not [tag for tag, _ in read.tags if tag in {"iframe", "object", "embed", "img", "base"}]
    assert not [key for _, found in read.tags for key in found if key.startswith("on")]
    styles = "".join(read.contents["style"])
    assert "url(" not in styles
    assert "@import" not in styles


def test_only_the_scripts_of_the_page_may_run(tmp_path: Path):
    write(hostile_motion(), tmp_path / "out.html")
    read = Page(tmp_path / "out.html")
    policy = dict(part.strip().split(" ", 1) for part in read.policy.split(";"))
    assert policy["default-src"] == "'none'"
    assert policy["img-src"] == "data:"
    assert not {"connect-src", "frame-src", "object-src", "worker-src"} & policy.keys()
    assert "unsafe" not in read.policy
    for directive, texts in (("script-src", read.scripts), ("style-src", read.contents["style"])):
        digests = [b64encode(sha256(text.encode()).digest()).decode() for text in texts]
        assert policy[directive].split() == [f"'sha256-{digest}'" for digest in digests]
    assert len(read.scripts) == len(SCRIPTS)


def test_text_of_files_stays_text(tmp_path: Path):
    motion = hostile_motion()
    write(motion, tmp_path / "out.html")
    read = Page(tmp_path / "out.html")
    assert read.contents["title"] == [HOSTILE]
    assert read.data["outcome"] == HOSTILE
    assert read.data["rows"][0]["joint"] == f"hinge {HOSTILE}"
    assert [tag for tag, _ in read.tags].count("script") == len(SCRIPTS) + 2


TEXTS = st.text() | st.sampled_from([HOSTILE, "<!--", "]]>", "<script", "\u2028", "&lt;"])


@given(st.dictionaries(TEXTS, TEXTS | st.lists(TEXTS) | st.floats(-1e300, 1e300)))
def test_data_in_a_script_are_read_back_and_end_nothing(content: dict[str, object]):
    text = script_json(content)
    assert json.loads(text) == content
    assert not set(text) & set("<>&")


def test_the_frames_of_a_run_are_all_there_bit_for_bit(tmp_path: Path):
    motion = clip("flying")
    write(motion, tmp_path / "out.html")
    read = Page(tmp_path / "out.html")
    assert np.array_equal(read.doubles(read.data["times"]), motion.times)
    recording = motion.recording
    assert recording is not None
    energy = {row["name"]: read.floats(row["values"]) for row in read.data["energy"]}
    assert set(energy) == {k for k, values in recording.energy.items() if np.any(values)}
    for kind, values in energy.items():
        assert np.allclose(values, recording.energy[kind], rtol=1e-6)


def test_contact_forces_are_there_in_the_frames_in_which_a_part_is_touched(tmp_path: Path):
    motion = with_contact(clip("slides"))
    assert "results of the run" in "".join(map(str, write(motion, tmp_path / "out.html").entries))
    read = Page(tmp_path / "out.html")
    assert motion.recording is not None
    contact = motion.recording.contact
    assert contact is not None
    (row,) = read.data["forces"]  # nothing touches the sole
    frames = read.floats(row["frames"])
    assert frames.tolist() == list(range(1, 21))
    for key, expected in (("forces", contact.part_forces), ("points", contact.force_points)):
        found = read.floats(row[key]).reshape(-1, 3)
        assert np.allclose(found, expected["pelvis"][1:], rtol=1e-6)
    props = dict(read.data["facts"])["Props"]
    assert props.startswith("floor: plane")
    assert "crate: box" in props
    glb = read.glb()
    assert [node["name"] for node in glb.nodes if "prop" in node.get("extras", {})] == [
        "floor",
        "crate",
        "wall",
    ]


def test_arrows_of_a_page_have_the_colour_of_forces():
    red, green, blue = (round(255.0 * part) for part in FORCE_COLOUR)
    style = ASSETS.joinpath("page.css").read_text(encoding="utf-8")
    assert f"--force: #{red:02x}{green:02x}{blue:02x};" in style


def test_a_run_from_an_older_file_says_that_its_props_are_unknown(tmp_path: Path):
    motion = replace(with_contact(clip("slides")), scene=Scene())
    losses = write(motion, tmp_path / "out.html")
    assert "the props of the scene, which the recording does not hold" in str(losses)


def test_the_point_of_a_curve_is_on_its_law():
    """The moment beside an angle is the law's; a run from rest begins with the same moment."""
    motion = clip("prototype")
    springs = springs_of_header(motion.header, motion.figure)
    assert springs == read_springs(None, motion.figure)
    rows = curve_rows(motion)
    curves = passive_curves(motion.figure, springs)
    assert len(rows) == sum(map(len, curves.values())) > 15
    for curve in (each for group in curves.values() for each in group):
        row = rows[curve.label]
        angles, moments = (Page.floats(row[key]) for key in ("values", "moments"))
        expected = curve.component(motion.displacements)
        assert np.allclose(np.radians(angles), expected, atol=1e-6)
        assert np.allclose(moments, curve.moment_at(expected), rtol=1e-6)
        if len(curve.chain.rotations) == 1:
            assert Page.floats(row["recorded"])[0] == pytest.approx(moments[0], abs=1e-9)
    assert any(np.any(Page.floats(row["moments"])) for row in rows.values())
    knee = rows["Left knee flexion"]
    assert {one["label"] for one in knee["published"]} >= {"Silder 2007", "Otani 1989"}
    assert any("low" in one for one in knee["published"])


def test_the_moment_of_the_run_is_about_the_axis_of_the_law():
    """Without damping it is the elastic torque of all axes of the ball, in the half-way frame."""
    made = one_body(BALL, (0.8, -0.5, 0.6), stiff=(1.0, 3.0, 6.0))
    springs = read_springs(None, made)
    recording = simulate(made, Plan(stop=0.2, tolerance=1e-4))
    motion = motion_from_recording(recording)
    frames = kept_frames(motion.times.size)
    rows = page_data(motion, frames, springs, Losses("page"))["rows"]
    for curve, shown in zip(passive_curves(made, springs)["pin"], rows, strict=True):
        poses = ({"pin": at} for at in recording.displacements["pin"])
        torques = [passive_torque(made, springs, "pin", pose) for pose in poses]
        expected = np.array(torques) @ curve.spring.direction
        assert np.max(np.abs(expected)) > 0.1
        assert np.allclose(Page.floats(shown["recorded"]), expected, rtol=1e-4, atol=1e-5)


def curve_rows(motion: FigureMotion) -> dict[str, dict[str, str]]:
    springs = springs_of_header(motion.header, motion.figure)
    frames = kept_frames(motion.times.size)
    rows = page_data(motion, frames, springs, Losses("page"))["rows"]
    return {row["label"]: {**row, **row["curve"]} for row in rows if "curve" in row}


def test_the_legend_names_authors_and_year():
    motion = any_motion(shipped("prototype"))
    springs = read_springs(None, motion.figure)
    rows = page_data(motion, kept_frames(3), springs, Losses("page"))["rows"]
    labels = {one["label"] for row in rows if "curve" in row for one in row["curve"]["published"]}
    assert {"van Arkel 2015", "Davy & Audu 1987", "Anderson, Madigan & Nussbaum 2007"} <= labels


def test_a_curve_of_a_law_over_several_joints_says_where_it_is_taken():
    motion = any_motion(shipped("prototype"))
    springs = read_springs("coupled", motion.figure)
    rows = page_data(motion, kept_frames(3), springs, Losses("page"))["rows"]
    held = {row["label"]: row["curve"]["held"] for row in rows if "curve" in row}
    assert "at knee flexion 0 deg" in held["Left hip flexion"]
    assert held["Waist flexion"] == ""


@pytest.mark.parametrize(
    ("origin", "found"),
    [
        ("prototype.springs.toml", True),
        ("prototype.coupled.springs.toml over prototype.springs.toml", True),
        ("none", True),
        ("prototype.missing.springs.toml", False),
        ("prototype.coupled.springs.toml", False),
        ("\0", False),
    ],
)
def test_springs_are_found_by_the_name_in_the_header(origin: str, found: bool, tmp_path: Path):
    motion = any_motion(shipped("prototype"))
    motion = replace(motion, header=replace(motion.header, springs=origin))
    springs = springs_of_header(motion.header, motion.figure)
    assert (springs is not None) == found
    if springs is not None:
        assert springs.origin == origin
    losses = write(motion, tmp_path / "out.html")
    told = [
        loss.what for loss in losses.entries if "springs of the motion are not known" in loss.what
    ]
    assert bool(told) != found


def test_springs_that_the_writer_gets_are_shown(tmp_path: Path):
    """A run with springs that stand in no file beside the figure."""
    motion = clip("prototype")
    recording = motion.recording
    assert recording is not None
    springs = replace(read_springs(None, motion.figure).scaled(2.0, 1.0), origin="doubled")
    recording = replace(recording, springs="doubled", model=None)
    path = tmp_path / "out.html"
    without = motion_writer(path)(motion_from_recording(recording, motion.figure), path)
    assert not [row for row in Page(path).data["rows"] if "curve" in row]
    assert "passive torques" in str(without)
    losses = replace(recording, model=Model(motion.figure, springs)).write(path)
    assert "passive torques" not in str(losses)
    rows = {row["label"]: row for row in Page(path).data["rows"]}
    own = curve_rows(motion)["Left knee flexion"]
    doubled = Page.floats(rows["Left knee flexion"]["curve"]["law"])
    assert np.allclose(doubled, 2.0 * Page.floats(own["law"]), rtol=1e-6)


@given(st.integers(1, 3_000_000))
def test_few_frames_are_kept_with_the_first_and_the_last(count: int):
    frames = kept_frames(count)
    assert frames.size <= MAX_PAGE_FRAMES
    assert (frames[0], frames[-1]) == (0, count - 1)
    assert np.all(np.diff(frames) > 0)
    assert np.unique(np.diff(frames)[:-1]).size <= 1
    assert (frames.size == count) == (count <= MAX_PAGE_FRAMES)


def test_a_long_motion_loses_frames_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    motion = clip("prototype")
    monkeypatch.setattr(page, "MAX_PAGE_FRAMES", 7)
    losses = write(motion, tmp_path / "out.html")
    assert "frames: 6 of 21 are kept" in str(losses.entries[0])
    read = Page(tmp_path / "out.html")
    frames = kept_frames(motion.times.size)
    assert np.array_equal(read.doubles(read.data["times"]), motion.times[frames])
    poses = read.glb().poses()
    for segment in motion.figure.segments.values():
        for name, each in segment.sites.items():
            expected = (motion.poses[segment.name] @ each.pose_in_segment)[frames]
            assert np.allclose(poses[f"{segment.name}.{name}"], expected, atol=1e-5)
    assert read.floats(read.data["rows"][-1]["recorded"]).size == frames.size


def test_a_page_of_two_seconds_is_small(tmp_path: Path):
    write(any_motion(shipped("prototype"), np.linspace(0.0, 2.0, 101)), tmp_path / "out.html")
    assert (tmp_path / "out.html").stat().st_size < 3_000_000


@pytest.mark.parametrize("name", ["three.min.js", "uPlot.min.js", "uPlot.min.css", "page.js"])
def test_scripts_and_styles_end_nowhere_else(name: str):
    text = asset(name).lower()
    assert not [end for end in ("</script", "<script", "</style", "<!--") if end in text]
    assert "\r" not in text  # a digest counts the text as the browser reads it
    namespaces = re.sub(r"http://www\.w3\.org/[\w/]+", "", text)
    assert "http://" not in namespaces
    assert "https://" not in namespaces


def test_vendored_code_has_its_licence_and_its_version(tmp_path: Path):
    note = asset("VENDORED.md")
    for library in ("three", "uPlot"):
        (version,) = set(
            re.findall(rf"{library}(?:\.js)? (\d+\.\d+\.\d+)", asset(f"{library}.min.js")[:200])
        )
        assert f"| {version} | `{library}.LICENSE.txt` |" in note
        assert f"{library.lower()}@{version}" in note
        assert "Permission is hereby granted, free of charge" in asset(f"{library}.LICENSE.txt")
    write(any_motion(shipped("pendulum")), tmp_path / "out.html")
    text = Page(tmp_path / "out.html").contents["pre"][0]
    assert asset("three.LICENSE.txt") in text
    assert asset("uPlot.LICENSE.txt") in text
