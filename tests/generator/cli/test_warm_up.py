"""`mover warm-up`: what is compiled ahead, and where it is stored."""

from generator.simulation import compiled_run
from generator.simulation.exudyn_model.model import ExudynModel
from tests.command import answer, run


def test_it_compiles_the_laws_of_the_prototype_and_contact(monkeypatch):
    models: list[ExudynModel] = []
    monkeypatch.setattr(compiled_run, "compile_model", models.append)
    data = answer("warm-up")
    (model,) = models
    assert model.contacts is not None
    assert [prop.name for prop in model.contacts.scene.props] == ["floor"]
    assert model.spring_set.joints
    assert data["wall_s"] > 0.0


def test_a_second_time_it_says_that_nothing_was_left_to_compile(monkeypatch):
    run("warm-up")
    lines = run("warm-up").stdout.splitlines()
    assert lines[0].startswith("The integrator was compiled already; the laws and contact took ")
    assert lines[1].startswith("stored  ")
