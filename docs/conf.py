"""Configuration of the site: `sphinx-build -W --keep-going -n docs site`."""

import re
import tomllib
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.util.docstrings import prepare_docstring

PROJECT = tomllib.loads(
    (Path(__file__).parent.parent / "pyproject.toml").read_text(encoding="utf-8")
)["project"]

project = PROJECT["name"]
author = copyright = PROJECT["authors"][0]["name"]
version = release = PROJECT["version"]

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}
nb_execution_mode = "off"
"""Notebooks are shown with the outputs that they have; docs/notebooks/execute.py makes them."""
exclude_patterns = ["paper"]

html_theme = "furo"
html_title = f"{project} {version}"
html_copy_source = False

myst_enable_extensions = ["attrs_inline"]
myst_heading_anchors = 4

default_role = "code"
"""Docstrings mark code as Markdown does, with single backticks."""
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
napoleon_use_ivar = True
highlight_language = "text"

maximum_signature_line_length = 88
nitpick_ignore_regex = [
    ("py:class", r".*[.\[].*|DataFrame"),
    ("py:exc", r"(WallLimit|Cluster|NotInstalled|OffGround|OutOfBalance|UnknownPath)Error"),
]
"""Types in signatures, with their modules, and errors: not all of them are in docs/api.md."""

_GALLERY_ANCHOR = re.compile(r'<a id="(\w+)"></a>')
_ARRAY = re.compile(r"~?numpy\.ndarray\[tuple\[[^]]*\], ~?numpy\.dtype\[[^]]*\]\]")
_ENUM_DEFAULT = re.compile(r"<(\w+\.\w+): [^>]*>")


def name_anchors(app: Sphinx, page: str, text: list[str]) -> None:
    """Turn the anchors of the gallery, which are HTML for other readers, into targets of MyST."""
    if page == "gallery":
        text[0] = _GALLERY_ANCHOR.sub(r"(\1)=", text[0])


def keep_property(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Undo what napoleon does to a property: to take the text before a colon for its type."""
    if what == "property":
        lines[:] = prepare_docstring(thing.__doc__ or "")


def shorten_signature(
    app: Sphinx, what: str, name: str, thing: object, options: object, *texts: str | None
) -> tuple[str | None, ...]:
    """Write defaults that no parser reads, `<factory>` and `<Enum.NAME: value>`, as Python.

    Arrays are shown without the type of their numbers, which is float everywhere.
    """
    return tuple(
        text
        and _ENUM_DEFAULT.sub(r"\1", _ARRAY.sub("numpy.ndarray", text.replace("<factory>", "...")))
        for text in texts
    )


def setup(app: Sphinx) -> None:
    """Connect the hooks; napoleon has the priority 500."""
    app.connect("source-read", name_anchors)
    app.connect("autodoc-process-docstring", keep_property, priority=600)
    app.connect("autodoc-process-signature", shorten_signature)
