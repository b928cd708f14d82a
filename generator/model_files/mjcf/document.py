"""An MJCF document as a whole: files that it includes, default classes, compiler settings."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from generator.diagnostics import Diagnostics, Span, shorten, spelling_hint
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

    def with_defaults(
        self, element: XmlElement, childclass: str, diagnostics: Diagnostics
    ) -> XmlElement:
        """Return the element with the attributes of its default class."""
        name = element.get("class") or childclass
        if name not in self.classes:
            diagnostics.error(
                f"there is no default class `{shorten(name)}`",
                element.span_of("class"),
                spelling_hint(name, self.classes),
            )
            return element
        defaults = dict(self.classes[name].get(element.tag, {}))
        if any(way in element.attributes for way in ORIENTATION_ATTRIBUTES):
            defaults = {
                key: value for key, value in defaults.items() if key not in ORIENTATION_ATTRIBUTES
            }
        return replace(element, attributes={**defaults, **element.attributes})


def parse_document(root: XmlElement, directory: Path | None, diagnostics: Diagnostics) -> Document:
    """The whole of a model whose main file has the root element `root`.

    Args:
        root: the element `mujoco`.
        directory: directory in which included files are looked for; None when there is none.
        diagnostics: collects errors.
    """
    whole = _Includer(directory, diagnostics).expand(root)
    settings: dict[str, SourceText] = {}
    for element in whole.find_all("compiler"):
        settings |= element.attributes
    compiler = replace(root, tag="compiler", attributes=settings, children=())
    _check_compiler(compiler, diagnostics)
    classes: dict[str, _ClassDefaults] = {MAIN: {}}
    for element in whole.find_all("default"):
        _collect_defaults(element, element.get("class") or MAIN, {}, classes, diagnostics)
    return Document(whole, compiler, classes)


def _check_compiler(compiler: XmlElement, diagnostics: Diagnostics) -> None:
    for name, known in COMPILER_CHOICES.items():
        written = compiler.get(name)
        if written is not None and written not in known:
            diagnostics.error(
                f"`{shorten(written)}` is not a value of `{name}`",
                compiler.span_of(name),
                f"known here: {', '.join(known)}",
            )
    sequence = compiler.get("eulerseq")
    if sequence is not None and not _is_euler_sequence(sequence):
        message = "`eulerseq` has three letters out of xyzXYZ"
        diagnostics.error(message, compiler.span_of("eulerseq"), "as in `xyz` or `XYZ`")


def _is_euler_sequence(text: str) -> bool:
    return len(text) == 3 and set(text) <= set("xyzXYZ")


def _collect_defaults(
    element: XmlElement,
    name: str,
    inherited: _ClassDefaults,
    classes: dict[str, _ClassDefaults],
    diagnostics: Diagnostics,
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
            diagnostics.error(
                "a default class within another has no name", child.span, 'write `class="..."`'
            )
            continue
        _collect_defaults(child, inner, here, classes, diagnostics)


@dataclass
class _Includer:
    """Replaces `include` elements by the contents of their files."""

    directory: Path | None
    diagnostics: Diagnostics
    included: dict[str, Span] = field(default_factory=dict[str, Span])

    def expand(self, element: XmlElement) -> XmlElement:
        """Return the element with all included files below it."""
        if not any(below.tag == "include" for below in element.walk()):
            return element
        children: list[XmlElement] = []
        for child in element.children:
            if child.tag == "include":
                children += self._read_included(child)
            else:
                children.append(self.expand(child))
        return replace(element, children=tuple(children))

    def _read_included(self, include: XmlElement) -> tuple[XmlElement, ...]:
        name, place = include.get("file"), include.span_of("file")
        if not name:
            self.diagnostics.error("`include` names no file", place, 'write `file="..."`')
            return ()
        if name in self.included or len(self.included) >= MAX_INCLUDED_FILES:
            self.diagnostics.error(
                f"`{shorten(name)}` is included a second time"
                if name in self.included
                else f"more than {MAX_INCLUDED_FILES} files are included",
                place,
                "each file is included once at most",
            )
            return ()
        self.included[name] = place
        path = (self.directory or Path()) / name
        source, fault = load_text(path, str(path))
        if fault is not None:
            self.diagnostics.error(f"the included file cannot be used: {fault.message}", place)
            return ()
        found = Diagnostics()
        root = parse_xml(source, found)
        if root is None and "<mujoco" not in source.text:
            # The text is not quoted: any file of the system may be named, and it is not a model.
            message = f"the included file `{shorten(name)}` is not a model"
            hint = "an included file is XML with the root element `mujoco`"
            self.diagnostics.error(message, place, hint)
            return ()
        self.diagnostics.extend(found)
        return () if root is None else self.expand(root).children
