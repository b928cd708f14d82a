"""Values that OpenSim's files keep in elements of their own: `<mass>4</mass>`."""

from generator.diagnostics import Diagnostics
from generator.model_files.xml_read import XmlElement, parse_numbers


def child_numbers(
    element: XmlElement, name: str, default: tuple[float, ...], diagnostics: Diagnostics
) -> tuple[float, ...]:
    """As many numbers as `default` has; `default` where there are none, or wrong ones."""
    held = element.find(name)
    read = None
    if held is not None and held.text.text:
        read = parse_numbers(held.text, diagnostics, len(default))
    return default if read is None else read


def child_number(element: XmlElement, name: str, diagnostics: Diagnostics) -> float:
    """One number; zero where there is none, or a wrong one."""
    return child_numbers(element, name, (0.0,), diagnostics)[0]


def child_text(element: XmlElement, name: str) -> str:
    """The text, empty where there is none."""
    held = element.find(name)
    return "" if held is None else held.text.text


def is_child_true(element: XmlElement, name: str) -> bool:
    """Whether it says `true`."""
    return child_text(element, name).lower() == "true"
