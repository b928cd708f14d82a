"""The report of all plates, one self-contained HTML file, and the gallery, a Markdown page."""

import re
from base64 import b64encode
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from io import BytesIO

from plots.plate import Claim, ClaimKind, DrawnPlate, FailedPlate, Outcome

LARGEST_SVG = 1_000_000
"""A larger SVG is shown as PNG: browsers draw it slowly [bytes]."""

_THUMBNAIL_WIDTH = 400
"""Width of a small picture [pixels]."""

_TITLE = "Curves and motions"

_KINDS: Mapping[ClaimKind, tuple[str, str]] = {
    ClaimKind.VERIFICATION: (
        "Verification",
        "The program computes what it says: the model reproduces its law, keeps its energy and "
        "agrees with other engines.",
    ),
    ClaimKind.COMPARISON: (
        "Comparison",
        "The thesis's body of 1989, or a person of `mover person`, beside measurements of people. "
        "A difference is one of that body, not an error of the program.",
    ),
    ClaimKind.SPEED: ("Speed", "The cost of a run."),
}
"""Heading of each kind of claim, and what its outcomes mean."""

# Captions cannot make the page fetch anything.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"

_STYLE = """
:root { color-scheme: light dark; --ink: #1a1a1a; --paper: #fff; --soft: #595959;
  --line: #c8c8c8; --bad: #a33b00; --bad-paper: #fdeee4; --link: #005a91; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e6e6; --paper: #161616; --soft: #a8a8a8;
  --line: #444; --bad: #ffab7a; --bad-paper: #3a2417; --link: #7cc4f0; } }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper);
  max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1, h2, h3 { line-height: 1.25; }
section { margin-top: 3rem; }
a { color: var(--link); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; table-layout: fixed; width: 100%; min-width: 46rem;
  font-size: 0.9rem; }
th, td { text-align: left; vertical-align: top; padding: 0.35rem 0.5rem;
  border-bottom: 1px solid var(--line); }
th { box-sizing: border-box; width: 12%; }
th:nth-child(1) { width: 30%; }
th:nth-child(5) { width: 22%; }
td { overflow-wrap: anywhere; }
td.number { font-variant-numeric: tabular-nums; }
tr.fails { background: var(--bad-paper); }
tr.fails td.verdict { color: var(--bad); font-weight: bold; }
nav.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(12rem, 1fr));
  gap: 1rem; font-size: 0.9rem; }
nav.pictures img { display: block; width: 100%; aspect-ratio: 1; object-fit: cover;
  object-position: top; background: #fff; border: 1px solid var(--line); }
dl.verdicts { display: grid; grid-template-columns: max-content 1fr; gap: 0.2rem 1rem; }
dl.verdicts dd { margin: 0; }
figure { margin: 1rem 0; }
figure img { display: block; width: 100%; max-width: 48rem; height: auto; background: #fff;
  border: 1px solid var(--line); }
figcaption { margin-top: 0.6rem; }
.files, .references, .made { font-size: 0.9rem; color: var(--soft); overflow-wrap: anywhere; }
dl.made { display: grid; grid-template-columns: max-content 1fr; gap: 0.1rem 1rem; }
dl.made dd { margin: 0; }
@media print {
  :root { --ink: #000; --paper: #fff; --soft: #333; --line: #999; --bad: #000;
    --bad-paper: #eee; --link: #000; }
  body { font-size: 10pt; max-width: none; margin: 0; }
  section.plate { break-before: page; margin-top: 0; }
  table { font-size: 8pt; min-width: 0; }
  figure img { width: auto; max-width: 100%; max-height: 130mm; }
  figure, tr { break-inside: avoid; }
  thead { display: table-header-group; }
}
"""


def report(
    plates: Sequence[DrawnPlate], failed: Sequence[FailedPlate], provenance: Mapping[str, str]
) -> str:
    """Return the text of the report; the files of the plates lie beside it."""
    return "\n".join([*_report_lines(plates, failed, provenance), ""])


def _report_lines(
    plates: Sequence[DrawnPlate], failed: Sequence[FailedPlate], provenance: Mapping[str, str]
) -> Iterator[str]:
    yield from (
        "<!DOCTYPE html>",
        '<html lang="en">',
        "<head>",
        '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{escape(_POLICY)}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{_TITLE}</title>",
        f"<style>{_STYLE}</style>",
        "</head>",
        "<body>",
        "<main>",
        f"<h1>{_TITLE}</h1>",
    )
    yield from _verdicts(plates)
    if failed:
        yield "<h2>Missing plates</h2>"
        yield from _list_lines("ul", "", map(str, failed))
    yield '<nav class="pictures" aria-label="Plates">'
    for plate in plates:
        title = escape(plate.title)
        yield f'<a href="#{plate.name}"><img src="{_thumbnail_url(plate)}" alt="">{title}</a>'
    yield "</nav>"
    yield '<p><a href="#made">Provenance</a></p>'
    for plate in plates:
        yield from _plate_lines(plate)
    yield from _all_claims(plates)
    yield from _provenance_lines(provenance)
    yield from ("</main>", "</body>", "</html>")


def _claims_of_kind(plates: Sequence[DrawnPlate], kind: ClaimKind) -> list[tuple[Claim, str]]:
    """Return the claims of a kind, each with the name of its plate."""
    pairs = [(claim, plate.name) for plate in plates for claim in plate.claims]
    return [(claim, name) for claim, name in pairs if claim.kind is kind]


def _verdicts(plates: Sequence[DrawnPlate]) -> Iterator[str]:
    """The outcomes of each kind of claim in a line."""
    rows = [(kind, _claims_of_kind(plates, kind)) for kind in _KINDS]
    if not any(claims for _, claims in rows):
        return
    yield '<dl class="verdicts">'
    for kind, claims in rows:
        if claims:
            heading, _ = _KINDS[kind]
            yield f'<dt><a href="#{kind.value}">{heading}</a></dt>'
            yield f"<dd>{escape(tally([claim for claim, _ in claims]))}</dd>"
    yield "</dl>"


def tally(claims: Sequence[Claim]) -> str:
    """Count the claims that hold, and the outcomes of the comparisons, as sentences."""
    tested = [claim for claim in claims if claim.kind is not ClaimKind.COMPARISON]
    failing = sum(not claim.holds for claim in tested)
    sentences: list[str] = []
    if tested and not failing:
        sentences.append(f"All {len(tested)} claims hold.")
    elif tested:
        passing = len(tested) - failing
        sentences.append(f"{passing} of {len(tested)} claims hold, {failing} do not.")
    if len(claims) > len(tested):
        counts = Counter(claim.outcome for claim in claims)
        sentences.append(
            f"Of {len(claims) - len(tested)} comparisons {counts[Outcome.AGREES]} agree, "
            f"{counts[Outcome.DIFFERS]} differ and {counts[Outcome.INCOMPARABLE]} cannot be made."
        )
    return " ".join(sentences) or "There are no claims."


def _all_claims(plates: Sequence[DrawnPlate]) -> Iterator[str]:
    for kind, (heading, meaning) in _KINDS.items():
        rows = [
            (claim, f'<a href="#{name}">{name.replace("_", "_<wbr>")}</a>')
            for claim, name in _claims_of_kind(plates, kind)
        ]
        if rows:
            yield f'<section id="{kind.value}">'
            yield f"<h2>{heading}</h2>"
            yield f"<p>{escape(meaning)} {escape(tally([claim for claim, _ in rows]))}</p>"
            yield from _claims_table_lines(rows)
            yield "</section>"


def _claims_table_lines(rows: Sequence[tuple[Claim, str]]) -> Iterator[str]:
    """A table of claims; each row has markup for a last cell, or all have none."""
    linked = any(link for _, link in rows)
    heads = ["Claim", "Measured", "Bound", "Outcome", "Remark", *(["Plate"] if linked else [])]
    cells = "".join(f'<th scope="col">{head}</th>' for head in heads)
    yield from ('<div class="scroll">', "<table>", f"<thead><tr>{cells}</tr></thead>", "<tbody>")
    for claim, link in rows:
        fails = ' class="fails"' if claim.outcome is Outcome.FAILS else ""
        yield (
            f"<tr{fails}>"
            f"<td>{escape(claim.sentence)}</td>"
            f'<td class="number">{escape(claim.measured_text)}</td>'
            f'<td class="number">{escape(claim.bound_text)}</td>'
            f'<td class="verdict">{claim.verdict}</td>'
            f"<td>{escape(claim.explanation)}</td>{f'<td>{link}</td>' if linked else ''}</tr>"
        )
    yield from ("</tbody>", "</table>", "</div>")


def _plate_lines(plate: DrawnPlate) -> Iterator[str]:
    yield f'<section class="plate" id="{plate.name}">'
    yield f"<h2>{escape(plate.title)}</h2>"
    yield "<figure>"
    yield f'<img src="{_picture_url(plate)}" alt="{escape(plate.title)}">'
    yield f"<figcaption>{escape(plate.caption)}</figcaption>"
    yield "</figure>"
    yield f"<p><strong>Sign convention:</strong> {escape(plate.sign)}</p>"
    if plate.claims:
        yield "<details><summary>Claims</summary>"
        yield from _claims_table_lines([(claim, "") for claim in plate.claims])
        yield "</details>"
    if plate.references:
        yield "<h3>References</h3>"
        yield from _list_lines("ol", "references", plate.references)
    links = ", ".join(f'<a href="{name}">{name}</a>' for name in plate.files)
    yield f'<p class="files">Files beside this one: {links}</p>'
    yield "</section>"


def _picture_url(plate: DrawnPlate) -> str:
    """The picture as a data URL, so that its ids cannot clash with others."""
    is_large = len(plate.svg) > LARGEST_SVG
    kind, picture = ("png", plate.png) if is_large else ("svg+xml", plate.svg)
    return f"data:image/{kind};base64,{b64encode(picture).decode()}"


def _thumbnail_url(plate: DrawnPlate) -> str:
    """The picture at a small size, as a data URL."""
    from PIL import Image  # it comes with matplotlib

    with Image.open(BytesIO(plate.png)) as picture:
        picture.thumbnail((_THUMBNAIL_WIDTH, 10 * _THUMBNAIL_WIDTH))
        stream = BytesIO()
        picture.convert("RGB").quantize(64).save(stream, "png", optimize=True)
    return f"data:image/png;base64,{b64encode(stream.getvalue()).decode()}"


def _provenance_lines(provenance: Mapping[str, str]) -> Iterator[str]:
    yield '<section id="made">'
    yield "<h2>Provenance</h2>"
    yield '<dl class="made">'
    for name, value in provenance.items():
        yield f"<dt>{escape(name)}</dt><dd><code>{escape(value)}</code></dd>"
    yield "</dl>"
    yield (
        "<p>Tables begin with three comment lines, then the headers: read them with "
        '<code>pandas.read_csv(file, comment="#")</code> or '
        '<code>numpy.loadtxt(file, delimiter=",", skiprows=4)</code>.</p>'
    )
    yield "</section>"


def _list_lines(tag: str, kind: str, items: Iterator[str] | Sequence[str]) -> Iterator[str]:
    yield f'<{tag} class="{kind}">' if kind else f"<{tag}>"
    yield from (f"<li>{escape(item)}</li>" for item in items)
    yield f"</{tag}>"


PICTURE_FORMAT = "svg"


def gallery_page(plates: Sequence[DrawnPlate], folder: str) -> str:
    """The text of the gallery page.

    Args:
        plates: plates in the order of the page.
        folder: folder of the pictures, relative to the page and of the same stem.
    """
    return "\n".join([*_gallery_lines(plates, folder), ""])


def _gallery_lines(plates: Sequence[DrawnPlate], folder: str) -> Iterator[str]:
    summary = tally([claim for plate in plates for claim in plate.claims])
    yield from (
        "# Gallery",
        "",
        "Curves of the joints and motions that follow from them, each with claims and the measured",
        f"values that confirm or refute them. {summary}",
        "",
        f"`mover plots --gallery {folder}.md`, run in this folder, writes this page;",
        "`mover plots -o DIR` writes the numbers drawn and a report of all claims.",
        "",
    )
    for plate in plates:
        yield f"- [{_escape_markdown(plate.title)}](#{plate.name})"
    for plate in plates:
        # The anchors of headings are made from the titles, not the names.
        title = _escape_markdown(plate.title)
        yield from ("", f'<a id="{plate.name}"></a>', "", f"## {title}", "")
        yield f"![{title}]({folder}/{plate.name}.{PICTURE_FORMAT})"
        yield from ("", _escape_markdown(plate.caption), "")
        yield from (f"*Sign:* {_escape_markdown(plate.sign)}", "")
        yield from claims_table(plate.claims)
        if plate.references:
            yield from ("", "References:", "")
            yield from (
                f"{k}. {_escape_markdown(text)}" for k, text in enumerate(plate.references, 1)
            )


def claims_table(claims: Sequence[Claim]) -> Iterator[str]:
    """The lines of a Markdown table of claims."""
    yield "| claim | measured | bound | outcome |"
    yield "|---|---|---|---|"
    for claim in claims:
        remark = f" ({claim.explanation})" if claim.explanation else ""
        cells = (claim.sentence + remark, claim.measured_text, claim.bound_text)
        fails = claim.outcome is Outcome.FAILS
        verdict = f"**{claim.verdict}**" if fails else claim.verdict
        yield f"| {' | '.join(map(_escape_markdown, cells))} | {verdict} |"


def _escape_markdown(text: str) -> str:
    """Escape markup in a text, and put it on one line."""
    return re.sub(r"([\\`*_\[\]<>|#~&$])", r"\\\1", " ".join(text.split()))
