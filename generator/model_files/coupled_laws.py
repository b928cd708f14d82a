"""Laws over several joints that come back from an edited model, whose own elements are unchanged.

Their elements do not tell the laws, which are in the springs that the model carries. A law comes
back while the model has all the elements that a writer makes of it, and its joints their axes.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from generator.diagnostics import Diagnostics, MoverError, Source
from generator.figure import is_rotation
from generator.losses import Losses
from generator.model import Model
from generator.model_files.body_tree.to_figure import figure_from_tree
from generator.model_files.body_tree.tree import BodyTree
from generator.model_files.embedded import canonical_element, edited_model, imported_from_embedded
from generator.model_files.model_files import Imported
from generator.model_files.xml import Element, XmlElement, format_document, parse_xml
from generator.springs_file.edit import format_besides_fields, springs_from_text
from generator.springs_file.parse import SPRINGS_FILE, SpringsFile
from generator.springs_file.write import write_springs
from generator.text_io import make_source
from springs import CoupledSpring

CoupledElements = Sequence[tuple[CoupledSpring, Sequence[Element]]]
"""Laws over several joints, each with the elements that a writer makes of it."""


@dataclass(frozen=True)
class CarriedLaws:
    """Laws over several joints of an edited model.

    Attributes:
        model: Figure and springs that the model carries; None without laws that come back.
        springs: Laws whose elements are unchanged.
        elements: `id` of each of these elements.
    """

    model: Model | None = None
    springs: tuple[CoupledSpring, ...] = ()
    elements: frozenset[int] = frozenset()

    def without(self, elements: Iterable[XmlElement]) -> list[XmlElement]:
        """Return the elements that are of no law."""
        return [one for one in elements if id(one) not in self.elements]


def find_carried_laws(
    root: XmlElement, elements: Iterable[XmlElement], write: Callable[[Model], CoupledElements]
) -> CarriedLaws:
    """Return the laws over several joints that an edited model still has.

    Args:
        root: Element of the model.
        elements: Its springs.
        write: Function that makes the elements of the laws of a model.
    """
    model = edited_model(root)
    if model is None or not model.springs.coupled:
        return CarriedLaws()
    places: dict[bytes, list[int]] = {}
    for one in elements:
        places.setdefault(canonical_element(one), []).append(id(one))
    springs: list[CoupledSpring] = []
    used: list[int] = []
    for spring, made in write(model):
        counts = Counter(map(canonical_element, _parsed(made)))
        if counts and all(len(places.get(line, ())) >= count for line, count in counts.items()):
            springs.append(spring)
            used += [places[line].pop() for line, count in counts.items() for _ in range(count)]
    return CarriedLaws(model, tuple(springs), frozenset(used))


def _parsed(elements: Sequence[Element]) -> tuple[XmlElement, ...]:
    """Return elements of a writer as those of a reader."""
    root = Element("springs")
    root.extend(elements)
    parsed = parse_xml(Source("springs", format_document(root, ())), Diagnostics())
    return () if parsed is None else parsed.children


def imported_with_laws(
    root: XmlElement, tree: BodyTree, laws: CarriedLaws, losses: Losses, *, separate: bool
) -> Imported | None:
    """Return the figure that a model carries, or else that of its bodies with the carried laws.

    None, with diagnostics, if that is impossible.

    Args:
        root: Element of the model.
        tree: Bodies of the model as they were read.
        laws: Laws over several joints that come back.
        losses: Losses of the reading.
        separate: See `figure_from_tree`.
    """
    carried = None if root.diagnostics.has_errors else imported_from_embedded(root, tree, losses)
    figure = carried or figure_from_tree(tree, root.diagnostics, losses, separate=separate)
    return figure if carried is not None else _with_laws(figure, laws, losses)


def _with_laws(imported: Imported | None, laws: CarriedLaws, losses: Losses) -> Imported | None:
    """Return an imported model with the laws whose joints have the axes that they had."""
    if imported is None or laws.model is None or not laws.springs:
        return imported
    figure = replace(imported.figure, path=None, springs_text=None)
    file = Path(f"model{SPRINGS_FILE.suffix}")
    text = "" if imported.springs is None else write_springs(imported.springs)
    kept: list[CoupledSpring] = []
    content: SpringsFile | None = None
    try:
        springs = springs_from_text(text, figure, file)
        for spring in laws.springs:
            if _has_axes(
                imported, laws.model, spring, is_same_law=springs.law is laws.model.springs.law
            ):
                kept.append(spring)
        if kept:
            text = format_besides_fields(figure, replace(springs, coupled=tuple(kept)))
            content = SPRINGS_FILE.parse(make_source(text, "the springs of the model")).value
    except MoverError:
        content = None
    for spring in laws.springs:
        if content is None or spring not in kept:
            joints = dict.fromkeys(axis.joint for axis in spring.axes)
            losses.add("laws over several joints, whose joints were changed", " and ".join(joints))
    return imported if content is None else replace(imported, springs=content)


def _has_axes(
    imported: Imported, model: Model, spring: CoupledSpring, *, is_same_law: bool
) -> bool:
    """Return whether the joints of a law have the axes and angles that they had."""
    shifted = {
        at.joint for at in imported.coordinates.values() if (at.offset, at.scale) != (0.0, 1.0)
    }
    for name in {axis.joint for axis in spring.axes}:
        joint = imported.figure.joints.get(name)
        if joint is None or joint.chain != model.figure.joints[name].chain or name in shifted:
            return False
        if not is_same_law and sum(is_rotation(one.kind) for one in joint.chain) > 1:
            return False
    return True
