"""Figures and their motion: the public names of exudyn-mover, which `__init__.pyi` lists.

Each name is imported at its first use, so that a script which does not simulate does not wait for
Exudyn.
"""

import sys
from collections.abc import Callable
from importlib.util import find_spec
from os.path import basename, dirname, realpath, splitext
from typing import cast

import lazy_loader  # pyright: ignore[reportMissingTypeStubs]


def _require_own_packages() -> None:
    """Raise ImportError when another module hides a package that is installed beside this one."""
    installed = dirname(dirname(realpath(__file__)))
    for name in ("springs", "plots", "figures"):
        spec = find_spec(name)
        origin = None if spec is None else spec.origin
        if origin is None or dirname(dirname(realpath(origin))) == installed:
            continue
        hiding = dirname(origin) if basename(origin) == "__init__.py" else origin
        message = (
            f"{hiding} hides the {name} package of exudyn-mover ({installed}): "
            "rename it or run from another folder"
        )
        # The command shows no traceback; `python -m generator.cli` is called `-m` while it starts.
        if splitext(basename("".join(sys.argv[:1])))[0] in ("mover", "-m"):
            sys.exit(f"error: {message}")
        raise ImportError(message)


_require_own_packages()


_import_name, __dir__, __all__ = cast(
    "tuple[Callable[[str], object], Callable[[], list[str]], list[str]]",
    lazy_loader.attach_stub(__name__, __file__),
)


def __getattr__(name: str) -> object:
    """Import a public name from the module that defines it."""
    if name not in __all__:
        from difflib import get_close_matches

        near = get_close_matches(name, __all__, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")
    return _import_name(name)
