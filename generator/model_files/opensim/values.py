"""Values that OpenSim's files keep in elements of their own: `<mass>4</mass>`."""

from generator.diagnostics import Findings
from generator.model_files.xml_read import Element, numbers


def numbers_in(
    element: Element, name: str, default: tuple[float, ...], findings: Findings
) -> tuple[float, ...]:
    """As many numbers as `default` has; `default` where there are none, or wrong ones."""
    held = element.first(name)
    read = None
    if held is not None and held.text.text:
        read = numbers(held.text, findings, len(default))
    return default if read is None else read


def number_in(element: Element, name: str, findings: Findings) -> float:
    """One number; zero where there is none, or a wrong one."""
    return numbers_in(element, name, (0.0,), findings)[0]


def text_in(element: Element, name: str) -> str:
    """The text, empty where there is none."""
    held = element.first(name)
    return "" if held is None else held.text.text


def is_true(element: Element, name: str) -> bool:
    """Whether it says `true`."""
    return text_in(element, name).lower() == "true"
