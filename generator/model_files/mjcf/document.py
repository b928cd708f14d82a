"""An MJCF document as a whole: files that it includes, default classes, compiler settings."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from generator.diagnostics import Findings, Span, nearest, shorten
from generator.model_files.mjcf.joints import WAYS, Angles
from generator.model_files.xml_read import Element, Written, parse_xml
from generator.text_io import read_text

MAIN = "main"
MOST_FILES: Final = 50

_Class = Mapping[str, Mapping[str, Written]]


@dataclass(frozen=True)
class Document:
    """The sections of a model, its included files in their places.

    Attributes:
        root: the element `mujoco`, without any `include`.
        compiler: the settings of all `compiler` elements; the last one wins.
        classes: by name, default attributes by kind of element.
    """

    root: Element
    compiler: Mapping[str, Written]
    classes: Mapping[str, _Class]

    @property
    def angles(self) -> Angles:
        """How angles are told."""
        degrees = self.setting("angle", "degree") != "radian"
        return Angles(degrees, self.setting("eulerseq", "xyz"))

    def setting(self, name: str, default: str) -> str:
        """A setting of the compiler."""
        written = self.compiler.get(name)
        return default if written is None else written.text

    def with_defaults(self, element: Element, childclass: str, findings: Findings) -> Element:
        """The element with what its default class says and it does not say itself."""
        name = element.get("class") or childclass
        if name not in self.classes:
            findings.error(
                f"there is no default class `{shorten(name)}`",
                element.place("class"),
                nearest(name, self.classes),
            )
            return element
        said = dict(self.classes[name].get(element.tag, {}))
        if any(way in element.attributes for way in WAYS):
            said = {key: value for key, value in said.items() if key not in WAYS}
        return replace(element, attributes={**said, **element.attributes})


def document_of(root: Element, directory: Path | None, findings: Findings) -> Document:
    """The whole of a model whose main file has the root element `root`.

    Args:
        root: the element `mujoco`.
        directory: in which included files are looked for; None when there is none.
        findings: for faults.
    """
    whole = _Includer(directory, findings).expanded(root)
    compiler: dict[str, Written] = {}
    for element in whole.all("compiler"):
        compiler |= element.attributes
    _check_compiler(compiler, findings)
    classes: dict[str, _Class] = {MAIN: {}}
    for element in whole.all("default"):
        _gather(element, element.get("class") or MAIN, {}, classes, findings)
    return Document(whole, compiler, classes)


def _check_compiler(compiler: Mapping[str, Written], findings: Findings) -> None:
    choices = {
        "angle": ("degree", "radian"),
        "coordinate": ("local",),
        "inertiafromgeom": ("auto", "true", "false"),
        "autolimits": ("true", "false"),
        "balanceinertia": ("true", "false"),
    }
    for name, known in choices.items():
        written = compiler.get(name)
        if written is not None and written.text not in known:
            findings.error(
                f"`{shorten(written.text)}` is no value of `{name}`",
                written.span,
                f"known here: {', '.join(known)}",
            )
    sequence = compiler.get("eulerseq")
    if sequence is not None and not (
        len(sequence.text) == 3 and set(sequence.text.lower()) <= set("xyz")
    ):
        findings.error(
            "`eulerseq` has three letters out of xyzXYZ", sequence.span, "as in `xyz` or `XYZ`"
        )


def _gather(
    element: Element,
    name: str,
    inherited: _Class,
    classes: dict[str, _Class],
    findings: Findings,
) -> None:
    """The class of a `default` element and those in it."""
    here = {tag: dict(said) for tag, said in {**inherited, **classes.get(name, {})}.items()}
    for child in element.children:
        if child.tag != "default":
            here[child.tag] = {**here.get(child.tag, {}), **child.attributes}
    classes[name] = here
    for child in element.all("default"):
        inner = child.get("class")
        if inner is None:
            findings.error(
                "a default class within another has no name", child.span, 'write `class="..."`'
            )
            continue
        _gather(child, inner, here, classes, findings)


@dataclass
class _Includer:
    """Puts the content of included files in the place of `include` elements."""

    directory: Path | None
    findings: Findings
    taken: dict[str, Span] = field(default_factory=dict[str, Span])

    def expanded(self, element: Element) -> Element:
        """The element with everything that is included below it."""
        if not any(below.tag == "include" for below in element.walk()):
            return element
        children: list[Element] = []
        for child in element.children:
            if child.tag == "include":
                children += self._content(child)
            else:
                children.append(self.expanded(child))
        return replace(element, children=tuple(children))

    def _content(self, include: Element) -> tuple[Element, ...]:
        name, place = include.get("file"), include.place("file")
        if not name:
            self.findings.error("`include` names no file", place, 'write `file="..."`')
            return ()
        if name in self.taken or len(self.taken) >= MOST_FILES:
            self.findings.error(
                f"`{shorten(name)}` is included a second time"
                if name in self.taken
                else f"more than {MOST_FILES} files are included",
                place,
                "each file is included once at most",
            )
            return ()
        self.taken[name] = place
        path = (self.directory or Path()) / name
        source, fault = read_text(path, str(path))
        if fault is not None:
            self.findings.error(f"the included file cannot be used: {fault.message}", place)
            return ()
        root = parse_xml(source, self.findings)
        return () if root is None else self.expanded(root).children
