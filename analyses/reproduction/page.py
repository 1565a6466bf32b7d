"""The report of a reproduction: one page that holds its figures, opens offline and prints.

`write_report` writes it. Figures are inside the page, as small as they can be without a loss that
is seen (`embedded`); `STYLE` is how it looks, on a screen and on paper.
"""

import base64
import json
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

import cv2
import numpy as np

from cdpr_drake.analyses.reporting.log_files import write_whole
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import (
    CONFIRMED,
    IN_PART,
    NOT_CONFIRMED,
    NOT_IN_QUICK,
    NOT_JUDGED,
    NOT_TESTABLE,
)
from cdpr_drake.analyses.reproduction.numbers import RULE
from cdpr_drake.analyses.reproduction.rows import CITED, MISSING, NOT_ASKED, SHOWN, Fact, ReportRow
from cdpr_drake.analyses.reproduction.scorecard import OWN, Scorecard, chapter_words
from cdpr_drake.analyses.reproduction.states import StudyState, study_folder
from cdpr_drake.analyses.studies.framework.statement import (
    CHOICE,
    HARDWARE,
    MET_CONSTRUCTION,
    MET_FITTED,
    SOURCE,
)
from cdpr_drake.analyses.studies.published.recipe_choices import CHOICES
from cdpr_drake.analyses.studies.published.register import Register

REPORT = "report.html"

RECIPES = "stability-recipes"
"""Study whose tables stand in the section on the recipe."""

QUICK = (
    "This is the quick form: few runs, one seed, coarse grids. Its verdicts say that the machinery "
    "works and which way a result points; those of the full form count."
)


def write_report(
    folder: Path,
    registers: Sequence[Register],
    rows: Sequence[ReportRow],
    states: Mapping[str, StudyState],
    quick: bool,
) -> Path:
    """Writes the page into a reproduction's folder; it appears whole or not at all.

    Args:
        folder: The reproduction's.
        registers: What was published, in the order of the page.
        rows: Every item beside what was found, see `report_rows`.
        states: How far the studies are.
        quick: Whether they were run in their quick form.

    Returns:
        Path of the page.
    """
    parts = [_head(quick), _scorecard(rows, registers), _contents(registers, rows)]
    parts.append(_chapters(rows, registers))
    parts += [_lacks(rows), _studies(folder, states)]
    for register in registers:
        parts.append(_source(folder, register, [r for r in rows if r.source == register.name]))
    parts += [_recipe(states), _rules(rows), _details(folder, states)]
    words = "\n".join(["<!doctype html>", '<html lang="en">', *parts, "</main></body></html>\n"])
    path = folder / REPORT
    write_whole(path, words)
    return path


def _head(quick: bool) -> str:
    versions = ", ".join(f"{name} {value}" for name, value in package_versions().items())
    note = f'<p class="quick">{escape(QUICK)}</p>' if quick else ""
    return (
        '<head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>What was published, repeated</title><style>{STYLE}</style></head>\n"
        "<body><main><h1>What was published, repeated</h1>"
        '<p class="lead">Every figure, table, number and statement with a result of two theses on '
        "cable-driven parallel robots, beside what this software finds. Code "
        f"{escape(code_version())}; {escape(versions)}.</p>{note}"
    )


def _scorecard(rows: Sequence[ReportRow], registers: Sequence[Register]) -> str:
    """Facts by chapter, and folded below them the items that rest on them."""
    card = Scorecard.of(rows)
    facts = _counted(card.facts, card.shown_facts(), registers, "facts")
    items = _counted(card.chapters, card.shown(), registers, "items")
    return (
        '<h2 id="scorecard" style="break-before: auto">Scorecard</h2>'
        f'{facts}<p class="lead">A fact is one check of a study, or one printed number, and is '
        "counted once, where it comes first; what no source states, but we ask for, is apart. Of "
        f"the facts of the sources {card.independent} are confirmed by runs that could have said "
        f"otherwise. {escape(MET_FITTED)}: parameters were chosen with the number in sight; "
        f"{escape(MET_CONSTRUCTION)}: nothing else could have come out.</p>"
        "<details><summary>Figures, tables, numbers and sentences, of which several may rest on "
        f"one fact</summary>{items}</details>"
        f'<p class="lead">{escape(RULE)} Statements are judged by their studies, which say how. '
        f"{escape(SHOWN)}: a figure that is drawn here, and of which nothing is judged; "
        f"{escape(CITED)}: told of the work of others.</p>"
    )


def _counted(
    chapters: Mapping[tuple[str, str], Counter[str]],
    verdicts: Sequence[str],
    registers: Sequence[Register],
    what: str,
) -> str:
    """A table of counts, sources and what is ours apart."""
    lines: list[str] = []
    own: list[str] = []
    every: Counter[str] = Counter()
    for register in registers:
        mine = {
            chapter: some for (name, chapter), some in chapters.items() if name == register.name
        }
        total = sum(mine.values(), Counter[str]())
        if not total:
            continue
        some_lines = lines if register.name != OWN else own
        for chapter, some in mine.items():
            some_lines.append(_counts(chapter_words(register, chapter), some, verdicts))
        some_lines.append(_counts(register.title, total, verdicts, "total"))
        every += total if register.name != OWN else Counter()
    lines = [*lines, _counts("All of the sources", every, verdicts, "total"), *own]
    heads = "".join(f'<th class="n">{escape(verdict)}</th>' for verdict in verdicts)
    return (
        f'<table class="scorecard"><thead><tr><th></th><th class="n">{what}</th>{heads}</tr>'
        f"</thead><tbody>{''.join(lines)}</tbody></table>"
    )


CAUSES = {
    SOURCE: "because of the source, which contradicts itself or leaves out what is needed",
    HARDWARE: "because of the prototype, which has what is in no model",
    CHOICE: "because of a choice of ours",
    "": "for a reason that is not known, or not sorted yet",
}
"""Words for why facts do not hold."""

NAMED = 6
"""So many facts of a kind are named in the overview of a chapter; the table has all."""


def _chapters(rows: Sequence[ReportRow], registers: Sequence[Register]) -> str:
    """Of each chapter what stands, what is corrected, what failed and why."""
    parts = ['<h2 id="chapters">Chapter by chapter</h2>']
    for register in registers:
        if register.name == OWN:
            continue
        mine = [row for row in rows if row.source == register.name]
        for chapter in sorted({*(row.chapter for row in mine), *register.corrected}):
            some = [row for row in mine if row.chapter == chapter]
            lines = _overview(some, register.corrected.get(chapter, ()))
            if lines:
                items = "".join(f"<li>{line}</li>" for line in lines)
                words = f"{register.title.partition(',')[0]}: {chapter_words(register, chapter)}"
                parts.append(f'<h3>{escape(words)}</h3><ul class="plain">{items}</ul>')
    return "".join(parts)


def _overview(rows: Sequence[ReportRow], corrected: Sequence[str]) -> list[str]:
    """Lines on a chapter: its facts by what came of them, each once."""
    facts: dict[str, tuple[Fact, ReportRow]] = {}
    for row in sorted(rows, key=lambda row: row.label not in ("statement", "number")):
        for fact in row.facts:
            if len(row.facts) == 1 or fact.key not in facts:
                facts.setdefault(fact.key, (fact, row))
    found = list(facts.values())

    def named(verdicts: Collection[str], cause: str | None = None) -> tuple[int, str]:
        some = [
            (fact, row) for fact, row in found
            if fact.verdict in verdicts and cause in (None, fact.cause)
        ]  # fmt: skip
        words = "; ".join(_in_short(fact, row) for fact, row in some[:NAMED])
        more = f"; and {len(some) - NAMED} more" if len(some) > NAMED else ""
        return len(some), escape(words + more)

    lines = []
    for title, verdicts in (
        ("Stands", (CONFIRMED,)), ("Met, but not put to a test", (MET_FITTED, MET_CONSTRUCTION)),
    ):  # fmt: skip
        count, words = named(verdicts)
        if count:
            lines.append(f"<b>{title}, {count}</b>: {words}.")
    if corrected:
        lines.append(f"<b>Corrected, {len(corrected)}</b>: {escape('; '.join(corrected))}.")
    for cause, why in CAUSES.items():
        for title, verdict in (("Fails", NOT_CONFIRMED), ("Holds in part", IN_PART)):
            count, words = named((verdict,), cause)
            if count:
                lines.append(f"<b>{title}, {count}</b>, {why}: {words}.")
    return lines


def _in_short(fact: Fact, row: ReportRow) -> str:
    """A fact in a few words: those of its row where that rests on it alone."""
    if len(row.facts) > 1:
        return fact.key.partition("/")[2].replace("_", " ")
    words = row.words.rstrip(".")
    return words if len(words) <= SHORT else f"{words[:SHORT].rpartition(' ')[0]} ..."


SHORT = 110
"""Longest words of a fact in the overview of a chapter."""


def _counts(words: str, counts: Counter[str], verdicts: Sequence[str], kind: str = "") -> str:
    cells = "".join(f'<td class="n">{counts[verdict] or ""}</td>' for verdict in verdicts)
    return (
        f'<tr class="{kind}"><td>{escape(words)}</td>'
        f'<td class="n">{counts.total()}</td>{cells}</tr>'
    )


def _contents(registers: Sequence[Register], rows: Sequence[ReportRow]) -> str:
    there = {row.source for row in rows}
    links = [
        ("chapters", "Chapter by chapter"),
        ("lacks", "What is missing, or not judged"),
        ("studies", "Studies"),
    ]
    links += [(register.name, register.title) for register in registers if register.name in there]
    links += [
        ("recipe", "The recipe of the stability tables"),
        ("rules", "Tolerances"),
        ("details", "Tables of the studies"),
    ]
    items = "".join(f'<li><a href="#{name}">{escape(title)}</a></li>' for name, title in links)
    return f"<nav><ol>{items}</ol></nav>"


def _lacks(rows: Sequence[ReportRow]) -> str:
    """Items without a run, or with a part of one, by section, and those without a verdict."""
    missing = [row for row in rows if row.verdict == MISSING]
    partly = [row for row in rows if row.verdict != MISSING and row.lacks]
    open_ = [row for row in rows if row.verdict in (NOT_JUDGED, NOT_TESTABLE)]
    short = sum(row.verdict == NOT_IN_QUICK for row in rows)
    parts = ['<h2 id="lacks">What is missing, or not judged</h2>']
    for title, some in (
        ("Without a run", missing),
        ("With a run of a part", partly),
        ("With runs that no verdict follows from", open_),
    ):
        items = (
            "".join(
                f"<li>{escape(row.section)}, {escape(row.label)}: {escape(row.words)} "
                f"<em>{escape(row.lacks or row.why or row.found)}</em></li>"
                for row in some
            )
            or "<li>Nothing.</li>"
        )
        parts.append(f'<h3>{title}: {len(some)}</h3><ul class="plain">{items}</ul>')
    if short:
        parts.append(f'<p class="lead">{short} items are judged in the full form only.</p>')
    return "".join(parts)


def _studies(folder: Path, states: Mapping[str, StudyState]) -> str:
    lines = "".join(
        f"<tr><td>{escape(name)}</td><td>{escape(state.status)}</td>"
        f'<td class="n">{state.seconds:.0f}</td><td>{escape(state.note)}</td>'
        f"<td>{escape(state.error)}</td><td>{_results_link(folder, name)}</td></tr>"
        for name, state in states.items()
    )
    total = sum(state.seconds for state in states.values())
    return (
        '<h2 id="studies">Studies</h2><table><thead><tr><th>study</th><th>status</th>'
        '<th class="n">time [s]</th><th>earlier results</th><th>error</th><th>raw results</th>'
        f'</tr></thead><tbody>{lines}<tr class="total"><td>all</td><td></td><td class="n">'
        f"{total:.0f}</td><td></td><td></td><td></td></tr></tbody></table>"
        '<p class="lead">Parameters, seeds and versions of each study are in its results.json.</p>'
    )


def _results_link(folder: Path, study: str) -> str:
    """A study's numbers, or its folder where it has none yet, as a link below the page's folder."""
    own = study_folder(folder, study)
    results = own / "results.json"
    return _link((results if results.is_file() else own).relative_to(folder).as_posix())


def _link(path: str) -> str:
    """A link to a file below the page's folder."""
    return f'<a href="{escape(quote(path))}"><code>{escape(path)}</code></a>'


def _source(folder: Path, register: Register, rows: Sequence[ReportRow]) -> str:
    if not rows:
        return ""
    parts = [f'<h2 id="{register.name}">{escape(register.title)}</h2>']
    titles = {section.number: section.title for section in register.sections}
    drawn: set[str] = set()
    parts.append(_without(register))
    asked = [row for row in rows if row.verdict != NOT_ASKED]
    if len(asked) < len(rows):
        words = f"Left out here: {len(rows) - len(asked)} items of studies that were not asked for."
        parts.append(f'<p class="lead">{words}</p>')
    for number in dict.fromkeys(row.section for row in asked):
        mine = [row for row in asked if row.section == number]
        title = f"{number} {titles[number]}" if number in titles else number
        parts.append(f"<h3>{escape(title)}</h3>{_table(mine)}")
        for row in mine:
            for path in row.figures:
                if path in drawn:
                    continue
                drawn.add(path)
                parts.append(_figure(folder, path, [o for o in asked if path in o.figures]))
    return "\n".join(parts)


def _without(register: Register) -> str:
    """What of a source's figures and tables is not repeated, and why."""
    parts = []
    if register.not_drawn:
        items = "".join(
            f"<li>{escape(one.label)}: {escape(one.says)}. <em>{escape(one.why)}</em></li>"
            for one in register.not_drawn
        )
        parts.append(
            f'<p class="lead">Figures that are not drawn:</p><ul class="plain">{items}</ul>'
        )
    if register.no_result:
        words = ", ".join(register.no_result)
        parts.append(f'<p class="lead">Without a result, so not repeated: {escape(words)}.</p>')
    return "".join(parts)


def _table(rows: Sequence[ReportRow]) -> str:
    lines = []
    for row in rows:
        kind = re.sub("[^a-z]+", "-", row.verdict).strip("-")
        links = ", ".join(escape(study) for study in row.studies)
        why = "; ".join(part for part in (row.why, row.lacks and f"missing: {row.lacks}") if part)
        label = escape(row.label)
        if row.figures:
            label = f'<a href="#{escape(_anchor(row.figures[0]))}">{label}</a>'
        label = f"{label}<br><small>{links}</small>" if links else label
        verdict = escape(row.verdict) + ("<br><small>counted above</small>" if row.repeats else "")
        lines.append(
            f"<tr><td>{label}</td><td>{escape(row.words)}</td><td>{escape(row.printed)}</td>"
            f'<td>{escape(row.found)}</td><td><div class="v {kind}">{verdict}</div>'
            f"</td><td>{escape(why)}</td></tr>"
        )
    widths = "".join(
        f'<col class="{name}">' for name in ("label", "words", "printed", "found", "verdict", "why")
    )
    return (
        f'<table class="items"><colgroup>{widths}</colgroup><thead><tr><th>published</th>'
        "<th>what it says</th><th>printed</th><th>ours</th><th>verdict</th><th>why</th></tr>"
        f"</thead><tbody>{''.join(lines)}</tbody></table>"
    )


def _figure(folder: Path, path: str, rows: Sequence[ReportRow]) -> str:
    """A figure of ours under the numbers of the published ones, with what differs from each."""
    source = embedded(folder / path)
    if source is None:
        return ""
    labels = ", ".join(dict.fromkeys(row.label for row in rows))
    alike: dict[str, list[str]] = {}
    for row in rows:
        if row.differs:
            alike.setdefault(row.differs, []).append(row.label)
    differs = ""
    for words, of in alike.items():
        which = f" from {', '.join(of)}" if len(alike) > 1 else ""
        differs += f"<br>{escape(f'Differs{which}: {words}.')}"
    pdf = Path(path).with_suffix(".pdf").as_posix()
    more = f", {_link(pdf)}" if (folder / pdf).is_file() else ""
    return (
        f'<figure id="{escape(_anchor(path))}"><img loading="lazy" decoding="async" '
        f'alt="{escape(labels)}, ours" src="{source}">'
        f"<figcaption><b>{escape(labels)}</b>, ours ({_link(path)}{more}){differs}</figcaption>"
        "</figure>"
    )


def _anchor(path: str) -> str:
    """Where on the page a figure is."""
    return "figure-" + path.removesuffix(".png").replace("/", "-")


def _recipe(states: Mapping[str, StudyState]) -> str:
    """What was chosen, and every recipe on every table, rows in sight and others apart."""
    lines = "".join(
        f"<tr><td>{escape(c.what)}</td><td>{escape(c.text)}</td><td>{escape(c.chosen)}</td>"
        f"<td>{escape(c.rows)}</td></tr>"
        for c in CHOICES
    )
    return (
        '<h2 id="recipe">The recipe of the stability tables</h2><p class="lead">What the thesis '
        "does not say was chosen, with printed rows in sight; such rows cannot confirm it. The "
        "statement on each table has its mean difference over the rows that were in sight and over "
        "the others. No row is left out of a mean.</p><table><thead><tr><th>what</th>"
        "<th>what the text says</th><th>what is chosen</th><th>with which rows in sight</th></tr>"
        f"</thead><tbody>{lines}</tbody></table>"
        "<h3>Every recipe on every table</h3>"
        + ("".join(map(_words, _plain_tables(states[RECIPES]))) if RECIPES in states else
           f'<p class="lead">The study {RECIPES} was not asked for.</p>')
    )  # fmt: skip


def _rules(rows: Sequence[ReportRow]) -> str:
    """What had to be within which bounds, of every fact that says so."""
    facts = {fact.key: fact for row in rows for fact in row.facts if fact.rule}
    lines = "".join(
        f"<tr><td>{escape(key)}</td><td>{escape(fact.rule)}</td><td>{escape(fact.verdict)}</td></tr>"
        for key, fact in sorted(facts.items())
    )
    return (
        '<h2 id="rules">Tolerances</h2><p class="lead">What a statement had to keep to hold, and '
        "why that much. Of printed numbers one rule holds for all: it stands below the scorecard."
        "</p><table><thead><tr><th>study and check</th><th>rule</th><th>verdict</th></tr></thead>"
        f"<tbody>{lines}</tbody></table>"
    )


def _plain_tables(state: StudyState) -> list[Mapping[str, Any]]:
    """A study's tables without statements, which stand by section."""
    return [table for table in state.tables if "verdict" not in table["columns"]]


def _details(folder: Path, states: Mapping[str, StudyState]) -> str:
    parts = ['<h2 id="details">Tables of the studies</h2>']
    for name, state in states.items():
        if name == RECIPES:
            continue
        parts.append(f"<h3>{escape(name)}</h3>")
        assumptions = _results(folder, name).get("assumptions", ())
        if assumptions:
            items = "".join(f"<li>{escape(words)}</li>" for words in assumptions)
            parts.append(f'<h4>Assumptions</h4><ul class="plain">{items}</ul>')
        parts += map(_words, _plain_tables(state))
    return "\n".join(parts)


def _results(folder: Path, study: str) -> dict[str, Any]:
    path = study_folder(folder, study) / "results.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def _words(table: Mapping[str, Any]) -> str:
    heads = "".join(f"<th>{escape(head)}</th>" for head in table["columns"])
    lines = "".join(
        f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in table["rows"]
    )
    caption = f"<p>{escape(table['caption'])}</p>" if table["caption"] else ""
    return (
        f'<div class="wide"><table><caption>{escape(table["title"])}</caption><thead><tr>{heads}'
        f"</tr></thead><tbody>{lines}</tbody></table>{caption}</div>"
    )


WIDEST = 1500
"""Wider pictures are made so wide [px]."""


def embedded(path: Path) -> str | None:
    """A PNG file as the address of a picture that a page holds itself; None if it is none.

    Pictures wider than `WIDEST` are made smaller, which a page does not show anyway.
    """
    try:
        content = path.read_bytes()
    except OSError:
        return None
    picture = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        return None
    height, width = picture.shape[:2]
    if width > WIDEST:
        size = (WIDEST, round(height * WIDEST / width))
        picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        smaller = cv2.imencode(".png", picture, [cv2.IMWRITE_PNG_COMPRESSION, 9])[1].tobytes()
        content = min(content, smaller, key=len)
    return "data:image/png;base64," + base64.b64encode(content).decode("ascii")


STYLE = """
:root { --line: #c9ccd1; --soft: #f4f5f7; --ink: #1b1d21; --grey: #5b616b; }
* { box-sizing: border-box; }
body { font: 15px/1.45 system-ui, "Segoe UI", "Noto Sans", sans-serif; color: var(--ink);
  margin: 0 auto; max-width: 1240px; padding: 24px 28px 80px; background: #fff; }
h1 { font-size: 28px; margin: 0 0 4px; } h2 { font-size: 22px; margin: 44px 0 8px;
  border-bottom: 2px solid var(--ink); padding-bottom: 4px; }
h3 { font-size: 17px; margin: 28px 0 6px; } h4 { font-size: 15px; margin: 18px 0 4px; }
p { margin: 6px 0; } .lead { color: var(--grey); max-width: 900px; }
a { color: #0055a4; }
table { border-collapse: collapse; width: 100%; margin: 8px 0 14px; font-size: 13px; }
th, td { text-align: left; vertical-align: top; padding: 5px 8px;
  border-bottom: 1px solid var(--line); overflow-wrap: anywhere; }
th { background: var(--soft); font-weight: 600; border-bottom: 1px solid #8b9099; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr.total td { font-weight: 600; border-top: 2px solid #8b9099; }
.items { table-layout: fixed; }
.items col.label { width: 8%; } .items col.words { width: 20%; } .items col.printed { width: 13%; }
.items col.found { width: 21%; } .items col.verdict { width: 10%; } .items col.why { width: 28%; }
.v { font-weight: 600; white-space: normal; padding-left: 10px; border-left: 6px solid #8b9099; }
.v.confirmed { border-left-color: #009e73; }
.v.met-fitted, .v.met-by-construction { border-left: 6px double #009e73; }
.v.in-part { border-left: 6px double #c98500; }
.v.not-confirmed, .v.study-failed { border-left: 6px dashed #b3312c; }
.v.missing { border-left: 6px dotted #b3312c; }
.quick { background: #fff6dd; border: 1px solid #d9b44a; padding: 8px 12px; max-width: 900px; }
figure { margin: 12px 0 18px; break-inside: avoid; } figure img { max-width: 100%;
  max-height: 620px; border: 1px solid var(--line); display: block; }
figcaption { color: var(--grey); font-size: 13px; margin-top: 4px; }
pre { background: var(--soft); padding: 8px 10px; overflow-x: auto; font-size: 12px;
  white-space: pre-wrap; }
.wide { overflow-x: auto; } .wide table { font-size: 12px; width: auto; min-width: 50%; }
nav ol { columns: 2; font-size: 14px; padding-left: 20px; } ul.plain { padding-left: 18px; }
caption { caption-side: top; text-align: left; font-weight: 600; padding: 4px 0; }
@page { size: A4 landscape; margin: 12mm; }
@media print {
  body { max-width: none; padding: 0; font-size: 9.5pt; }
  .lead, .quick { max-width: none; } h1 { font-size: 18pt; } h2 { font-size: 14pt; }
  th, td { padding: 3px 6px; } table { font-size: 8.5pt; margin: 4px 0 8px; }
  thead { display: table-header-group; }
  tr, figure, .quick { break-inside: avoid; } h2 { break-before: page; margin-top: 0; }
  h2, h3, h4 { break-after: avoid; } nav { display: none; } a { color: inherit;
  text-decoration: none; } figure img { max-height: 150mm; } .wide { overflow: visible; }
  .wide table { width: 100%; font-size: 7.5pt; }
  .scorecard { font-size: 7pt; margin: 2px 0; } .scorecard th, .scorecard td { padding: 0 6px; }
  .scorecard + .lead { font-size: 7pt; } #scorecard { margin-top: 6px; }
}
"""
"""Verdicts differ by word and by kind of line, not by colour alone."""
