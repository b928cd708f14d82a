"""Broken models: included files and damage; `tests/faults/model` has a file for each fault."""

import re
import warnings

import pytest

from generator.diagnostics import InputError, Source
from generator.model_files.formats import parse_model, read_model
from generator.model_files.mjcf.write import format_files
from springs import SpringSet
from tests.chains import chain, row
from tests.generator.model_files.imported_models import MODELS

SPRINGS = SpringSet()


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


def test_an_included_file_that_is_not_a_model_is_not_quoted(tmp_path):
    (tmp_path / "main.xml").write_text(mjcf("", '<include file="secret"/>'))
    (tmp_path / "secret").write_text("root:x:0:0:the word of the day\n")
    with pytest.raises(InputError) as caught:
        read_model(tmp_path / "main.xml")
    (fault,) = caught.value.diagnostics
    assert fault.message == "the included file `secret` is not a model"
    assert fault.span.text == "secret"
    assert "root:x" not in str(caught.value)


@pytest.mark.slow
def test_a_long_chain_is_read_back(tmp_path):
    made = row(500, [chain("Rz")], bend=0.0)
    losses = format_files(made, SPRINGS, tmp_path / "a.xml").write()
    assert not any("way back" in loss.what for loss in losses.entries)
    assert len(read_model(tmp_path / "a.xml").figure.bodies) == 500


def test_a_chain_that_is_not_read_back_is_a_loss(tmp_path):
    losses = format_files(row(650, [chain("Rz")], bend=0.0), SPRINGS, tmp_path / "a.xml").write()
    said = "a way back into this program: elements are nested 653 deep, and 600 levels are read"
    assert said in [loss.what for loss in losses.entries]
    with pytest.raises(InputError, match="nested too deeply"):
        read_model(tmp_path / "a.xml")


@pytest.mark.parametrize("sequence", ["0zYx", "xyw", "zz"])
def test_a_wrong_sequence_of_angles_is_a_sentence(sequence):
    text = (MODELS / "mechanism.xml").read_text(encoding="utf-8").replace('"zYx"', f'"{sequence}"')
    (fault,) = parse_model(Source("model.xml", text), MODELS).diagnostics
    assert fault.message == "`eulerseq` has three letters out of xyzXYZ"


@pytest.mark.parametrize("number", ["1e308", "1e155"])
def test_an_immense_inertia_is_a_sentence(number, tmp_path):
    """A traceback or warnings of numpy would be an error here."""
    text = (MODELS / "arm.urdf").read_text(encoding="utf-8")
    text = re.sub('ixx="[^"]*"', f'ixx="{number}"', text, count=1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        diagnostics = parse_model(Source("arm.urdf", text), MODELS).diagnostics
    assert diagnostics[0].message == f"`{number}` is too large"
