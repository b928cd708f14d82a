"""The shipped plates, each made once for all tests."""

from functools import cache
from importlib import import_module
from typing import Any

from plots import run
from plots.plate import Plate


def maker(name: str) -> Any:
    """The definition that makes a plate."""
    path, _, attribute = run.PLATES[name].partition(":")
    return getattr(import_module(path), attribute)


@cache
def data(name: str) -> Any:
    """What a plate shows: runs, curves or tables."""
    return maker(name).collect()


@cache
def plate(name: str) -> Plate:
    """A plate drawn."""
    return maker(name).build(data(name))
