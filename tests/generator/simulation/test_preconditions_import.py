"""Why Exudyn cannot be loaded, as a sentence."""

import builtins

import pytest

from generator.diagnostics import NotInstalledError
from generator.simulation.preconditions import import_exudyn


@pytest.mark.parametrize(
    ("failure", "said"),
    [
        (
            "libGL.so.1: cannot open shared object file",
            "this system lacks the library libGL.so.1; on Debian and Ubuntu, install it with "
            "`apt-get install libgl1`",
        ),
        ("No module named 'exudyn'", "Exudyn cannot be loaded: No module named 'exudyn'"),
    ],
)
def test_what_is_missing_is_named(failure: str, said: str, monkeypatch: pytest.MonkeyPatch):
    genuine = builtins.__import__

    def refuse(name: str, *others: object) -> object:
        if name == "exudyn":
            raise ImportError(failure)
        return genuine(name, *others)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(NotInstalledError) as raised:
        import_exudyn()
    assert str(raised.value).endswith(said)
