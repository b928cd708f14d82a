"""Broken models: included files and damage; `tests/faults/model` has a file for each fault."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from generator.diagnostics import InputError, Source
from generator.model_files.formats import parse_model, read_model
from tests.generator.model_files.imported_models import MODELS


def mjcf(body: str, before: str = "") -> str:
    return f"<mujoco>{before}<worldbody>{body}</worldbody></mujoco>"


def test_a_fault_in_an_included_file_is_placed_there(tmp_path):
    (tmp_path / "main.xml").write_text(
        mjcf('<body><joint/><geom size="0.1"/></body>', '<include file="part.xml"/>')
    )
    (tmp_path / "part.xml").write_text("<mujoco>\n<oops></mujoco>")
    with pytest.raises(InputError) as caught:
        read_model(tmp_path / "main.xml")
    (fault,) = caught.value.diagnostics
    assert fault.span.source.name == str(tmp_path / "part.xml")
    assert fault.span.line == 2


def test_a_file_that_includes_itself_ends(tmp_path):
    (tmp_path / "main.xml").write_text(mjcf("", '<include file="main.xml"/>'))
    with pytest.raises(InputError, match="included a second time"):
        read_model(tmp_path / "main.xml")


@pytest.mark.parametrize("name", ["missing.xml", "."])
def test_a_file_that_cannot_be_read_is_a_sentence(tmp_path, name):
    with pytest.raises(InputError):
        read_model(tmp_path / name)


SAMPLES = [
    (MODELS / name).read_text(encoding="utf-8")
    for name in ("humanoid.xml", "mechanism.xml", "arm.urdf", "leg.osim")
]


@given(st.data())
@settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_a_damaged_model_is_read_or_refused(data):
    text = data.draw(st.sampled_from(SAMPLES))
    start = data.draw(st.integers(0, len(text) - 1))
    end = min(len(text), start + data.draw(st.integers(0, 40)))
    middle = data.draw(st.sampled_from(["", "0", "-", "nan", "é", "<", ">", '"', "&lt;", "1e300"]))
    damaged = text[:start] + middle + text[end:]
    try:
        said = parse_model(Source("model.xml", damaged), MODELS).require_value().losses.entries
    except InputError as failure:
        said = failure.diagnostics
    assert all(str(one) for one in said)
    assert said
