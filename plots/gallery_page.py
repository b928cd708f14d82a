"""The gallery: a page of Markdown that shows the plates, with their claims."""

import re
from collections.abc import Iterator, Sequence

from plots.claim import Claim
from plots.drawn_plate import DrawnPlate
from plots.report import tally

PICTURE = "svg"


def gallery_page(plates: Sequence[DrawnPlate], folder: str) -> str:
    """The text of the page.

    Args:
        plates: in the order in which they are shown.
        folder: where their pictures are, seen from the page; the page has the same name.
    """
    return "\n".join(_lines(plates, folder)) + "\n"


def _lines(plates: Sequence[DrawnPlate], folder: str) -> Iterator[str]:
    told = tally([claim for plate in plates for claim in plate.claims])
    yield from (
        "# Gallery",
        "",
        "The curves of the joints and the motion that follows from them, each with what is claimed",
        f"of it and what was measured. {told}",
        "",
        f"`mover plots --gallery {folder}.md`, given in this folder, writes the page. The numbers",
        "drawn come from `mover plots -o DIR`, with a report of all claims.",
        "",
    )
    for plate in plates:
        yield f"- [{_plain(plate.title)}](#{plate.name})"
    for plate in plates:
        # Headings make anchors of their own, but out of the title.
        yield from ("", f'<a id="{plate.name}"></a>', "", f"## {_plain(plate.title)}", "")
        yield f"![{_plain(plate.title)}]({folder}/{plate.name}.{PICTURE})"
        yield from ("", _plain(plate.caption), "", f"*Sign:* {_plain(plate.sign)}", "")
        yield from claims_table(plate.claims)
        if plate.references:
            yield from ("", "References:", "")
            yield from (f"{k}. {_plain(one)}" for k, one in enumerate(plate.references, 1))


def claims_table(claims: Sequence[Claim]) -> Iterator[str]:
    """The lines of a table of claims."""
    yield "| claim | measured | bound | verdict |"
    yield "|---|---|---|---|"
    for claim in claims:
        sentence = f"{claim.sentence} ({claim.remark})" if claim.remark else claim.sentence
        cells = (sentence, claim.measured_words, claim.bound_words)
        verdict = claim.verdict if claim.holds else f"**{claim.verdict}**"
        yield f"| {' | '.join(map(_plain, cells))} | {verdict} |"


def _plain(text: str) -> str:
    """A text on one line, in which nothing is taken for markup."""
    return re.sub(r"([\\`*_\[\]<>|#~&$])", r"\\\1", " ".join(text.split()))
