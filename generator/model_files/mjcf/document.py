"""An MJCF document as a whole: files that it includes, default classes, compiler settings."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from generator.diagnostics import Diagnostics, shorten, spelling_hint
from generator.model_files.mjcf.joints import ORIENTATION_ATTRIBUTES, AngleConvention
from generator.model_files.xml import SourceText, XmlElement, parse_xml
from generator.text_io import load_text

MAIN = "main"
MAX_INCLUDED_FILES: Final = 50

COMPILER_CHOICES: Final = {
    "angle": ("degree", "radian"),
    "coordinate": ("local",),
    "inertiafromgeom": ("auto", "true", "false"),
    "autolimits": ("true", "false"),
    "balanceinertia": ("true", "false"),
}
"""Values of settings of the compiler that are known here."""

_ClassDefaults = Mapping[str, Mapping[str, SourceText]]


@dataclass(frozen=True)
class Document:
    """The sections of a model, its included files in their places.

    Attributes:
        root: the element `mujoco`, without any `include`.
        compiler: settings of all `compiler` elements; the last one wins.
        classes: classes by name, default attributes by kind of element.
    """

    root: XmlElement
    compiler: XmlElement
    classes: Mapping[str, _ClassDefaults]

    @property
    def angle_convention(self) -> AngleConvention:
        """The convention of its angles."""
        degrees = self.setting("angle", "degree") != "radian"
        sequence = self.setting("eulerseq", "xyz")
        return AngleConvention(degrees, sequence if _is_euler_sequence(sequence) else "xyz")

    def setting(self, name: str, default: str) -> str:
        """A setting of the compiler."""
        return self.compiler.get(name) or default

    def with_defaults(self, element: XmlElement, childclass: str) -> XmlElement:
        """Return the element with the attributes of its default class."""
        name = element.get("class") or childclass
        if name not in self.classes:
            element.error(
                f"there is no default class `{shorten(name)}`",
                spelling_hint(name, self.classes),
                "class",
            )
            return element
        defaults = dict(self.classes[name].get(element.tag, {}))
        if any(way in element.attributes for way in ORIENTATION_ATTRIBUTES):
            defaults = {
                key: value for key, value in defaults.items() if key not in ORIENTATION_ATTRIBUTES
            }
        return replace(element, attributes={**defaults, **element.attributes})


def parse_document(root: XmlElement, directory: Path | None) -> Document:
    """The whole of a model whose main file has the root element `root`.

    Args:
        root: the element `mujoco`.
        directory: directory in which included files are looked for; None when there is none.
    """
    whole = _expanded(root, directory, set())
    settings: dict[str, SourceText] = {}
    for element in whole.find_all("compiler"):
        settings |= element.attributes
    compiler = replace(root, tag="compiler", attributes=settings, children=())
    _check_compiler(compiler)
    classes: dict[str, _ClassDefaults] = {MAIN: {}}
    for element in whole.find_all("default"):
        _collect_defaults(element, element.get("class") or MAIN, {}, classes)
    return Document(whole, compiler, classes)


def _check_compiler(compiler: XmlElement) -> None:
    for name, known in COMPILER_CHOICES.items():
        written = compiler.get(name)
        if written is not None and written not in known:
            compiler.error(
                f"`{shorten(written)}` is not a value of `{name}`",
                f"known here: {', '.join(known)}",
                name,
            )
    sequence = compiler.get("eulerseq")
    if sequence is not None and not _is_euler_sequence(sequence):
        message = "`eulerseq` has three letters out of xyzXYZ"
        compiler.error(message, "as in `xyz` or `XYZ`", "eulerseq")


def _is_euler_sequence(text: str) -> bool:
    return len(text) == 3 and set(text) <= set("xyzXYZ")


def _collect_defaults(
    element: XmlElement, name: str, inherited: _ClassDefaults, classes: dict[str, _ClassDefaults]
) -> None:
    """The class of a `default` element and those in it."""
    here = {
        tag: dict(attributes) for tag, attributes in {**inherited, **classes.get(name, {})}.items()
    }
    for child in element.children:
        if child.tag != "default":
            here[child.tag] = {**here.get(child.tag, {}), **child.attributes}
    classes[name] = here
    for child in element.find_all("default"):
        inner = child.get("class")
        if inner is None:
            child.error("a default class within another has no name", 'write `class="..."`')
            continue
        _collect_defaults(child, inner, here, classes)


def _expanded(element: XmlElement, directory: Path | None, included: set[str]) -> XmlElement:
    """Return the element with the contents of all files that are included below it."""
    if not any(below.tag == "include" for below in element.walk()):
        return element
    children: list[XmlElement] = []
    for child in element.children:
        if child.tag == "include":
            children += _read_included(child, directory, included)
        else:
            children.append(_expanded(child, directory, included))
    return replace(element, children=tuple(children))


def _read_included(
    include: XmlElement, directory: Path | None, included: set[str]
) -> tuple[XmlElement, ...]:
    name = include.get("file")
    if not name:
        include.error("`include` names no file", 'write `file="..."`', "file")
        return ()
    if name in included or len(included) >= MAX_INCLUDED_FILES:
        message = f"more than {MAX_INCLUDED_FILES} files are included"
        if name in included:
            message = f"`{shorten(name)}` is included a second time"
        include.error(message, "each file is included once at most", "file")
        return ()
    included.add(name)
    path = (directory or Path()) / name
    source, fault = load_text(path, str(path))
    if fault is not None:
        include.error(f"the included file cannot be used: {fault.message}", at="file")
        return ()
    if "<mujoco" not in source.text and parse_xml(source, Diagnostics()) is None:
        # The text is not quoted: any file of the system may be named, and it is not a model.
        message = f"the included file `{shorten(name)}` is not a model"
        hint = "an included file is XML with the root element `mujoco`"
        include.error(message, hint, "file")
        return ()
    root = parse_xml(source, include.diagnostics)
    return () if root is None else _expanded(root, directory, included).children
