"""The report of a reproduction: one page that holds its figures, opens offline and prints.

`write_report` writes it. Figures are inside the page, as small as they can be without a loss that
is seen (`embedded`).
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

from cdpr_drake.analyses.reporting.log_files import write_whole
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import NOT_IN_QUICK, NOT_JUDGED, NOT_TESTABLE
from cdpr_drake.analyses.reproduction.numbers import RULE
from cdpr_drake.analyses.reproduction.older import (
    OlderReport,
    change_words,
    changed_facts,
    either,
)
from cdpr_drake.analyses.reproduction.overview import (
    MET,
    STANDS,
    ChapterOverview,
    chapter_overviews,
    ended,
    marks,
)
from cdpr_drake.analyses.reproduction.page_style import STYLE
from cdpr_drake.analyses.reproduction.pictures import embedded
from cdpr_drake.analyses.reproduction.rows import CITED, MISSING, NOT_ASKED, SHOWN, ReportRow
from cdpr_drake.analyses.reproduction.scorecard import OWN, Scorecard, chapter_words
from cdpr_drake.analyses.reproduction.states import StudyState, study_folder
from cdpr_drake.analyses.studies.framework.statement import MET_CONSTRUCTION, MET_FITTED
from cdpr_drake.analyses.studies.published.recipe_choices import CHOICES
from cdpr_drake.analyses.studies.published.register import Register
from cdpr_drake.schema.json_text import load_json

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
    older: OlderReport | None = None,
) -> Path:
    """Writes the page into a reproduction's folder; it appears whole or not at all.

    Args:
        folder: The reproduction's.
        registers: What was published, in the order of the page.
        rows: Every item beside what was found, see `report_rows`.
        states: How far the studies are.
        quick: Whether they were run in their quick form.
        older: A report that this one is shown beside; None: none.

    Returns:
        Path of the page.
    """
    parts = [_head(quick), _scorecard(rows, registers, older), _contents(registers, rows, older)]
    parts.append(_chapters(rows, registers))
    if older is not None:
        parts.append(_changes(rows, older))
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


def _scorecard(
    rows: Sequence[ReportRow], registers: Sequence[Register], older: OlderReport | None
) -> str:
    """Facts by chapter, and folded below them the items that rest on them."""
    card, before = Scorecard.of(rows), None if older is None else older.card
    verdicts = either(card.shown_facts(), before.shown_facts() if before else ())
    facts = _counted(card.facts, verdicts, registers, "facts", before.facts if before else {})
    verdicts = either(card.shown(), before.shown() if before else ())
    items = _counted(card.chapters, verdicts, registers, "items", before.chapters if before else {})
    beside = ""
    if older is not None:
        none = "" if older.card.facts else " It counted items, not yet facts."
        beside = (
            f'<p class="lead">Small: what {escape(older.words)}, had where that is another '
            f"number.{none}</p>"
        )
    return (
        '<h2 id="scorecard" style="break-before: auto">Scorecard</h2>'
        f'{facts}{beside}<p class="lead">A fact is one check of a study, or one printed number, '
        "and is counted once, where it comes first; what no source states, but we ask for, is "
        f"apart. Of the facts of the sources {card.independent} are confirmed by runs that could "
        f"have said otherwise. {escape(MET_FITTED)}: parameters were chosen with the number in "
        f"sight; {escape(MET_CONSTRUCTION)}: nothing else could have come out.</p>"
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
    before: Mapping[tuple[str, str], Counter[str]],
) -> str:
    """A table of counts, those of ours folded below it, beside those of an older report.

    Chapters without any item that was asked for are left out, but for the sums.
    """
    lines: list[str] = []
    own: list[str] = []
    every: Counter[str] = Counter()
    every_before: Counter[str] = Counter()
    for register in registers:
        mine = {
            chapter: some for (name, chapter), some in chapters.items() if name == register.name
        }
        total = sum(mine.values(), Counter[str]())
        if not total:
            continue
        some_lines = lines if register.name != OWN else own
        was = sum(
            (some for (name, _), some in before.items() if name == register.name), Counter[str]()
        )
        for chapter, some in mine.items():
            if set(+some) != {NOT_ASKED}:
                some_before = before.get((register.name, chapter)) if before else None
                words = chapter_words(register, chapter)
                some_lines.append(_counts(words, some, verdicts, some_before))
        some_lines.append(
            _counts(register.title, total, verdicts, was if before else None, "total")
        )
        every += total if register.name != OWN else Counter()
        every_before += was if register.name != OWN else Counter()
    sum_before = every_before if before else None
    lines.append(_counts("All of the sources", every, verdicts, sum_before, "total"))
    lines += own[-1:]
    heads = "".join(f'<th class="n">{escape(verdict)}</th>' for verdict in verdicts)

    def table(some: Sequence[str]) -> str:
        return (
            '<div class="wide"><table class="scorecard"><thead><tr><th></th>'
            f'<th class="n">{what}</th>{heads}</tr></thead><tbody>{"".join(some)}</tbody></table>'
            "</div>"
        )

    if len(own) < 2:
        return table(lines)
    ours = f"<details><summary>Ours by study</summary>{table(own)}</details>"
    return table(lines) + ours


NAMED = 6
"""So many facts of a kind are named in the overview of a chapter; the table has all."""


def _chapters(rows: Sequence[ReportRow], registers: Sequence[Register]) -> str:
    """Of each chapter what stands, what is corrected, what failed and why."""
    parts = ['<h2 id="chapters">Chapter by chapter</h2>']
    for overview in chapter_overviews(rows, registers):
        items = "".join(f"<li>{line}</li>" for line in _overview(overview))
        parts.append(f'<h3>{escape(overview.title)}</h3><ul class="plain">{items}</ul>')
    return "".join(parts)


def _overview(overview: ChapterOverview) -> list[str]:
    """Lines on a chapter."""
    lines = [
        f"<b>{group.title}, {len(group.facts)}</b>{group.why and ', '}{escape(group.why)}: "
        f"{escape(ended(group.named(NAMED)))}"
        for group in overview.groups
    ]
    if overview.corrected:
        words = escape("; ".join(overview.corrected))
        met = sum(group.title in (STANDS, MET) for group in overview.groups)
        lines.insert(met, f"<b>Corrected, {len(overview.corrected)}</b>: {words}.")
    return lines


def _counts(
    words: str,
    counts: Counter[str],
    verdicts: Sequence[str],
    before: Counter[str] | None,
    kind: str = "",
) -> str:
    """A line of counts, each beside that of an older report where it differs."""

    def cell(now: int, was: int | None) -> str:
        differs = was is not None and was != now
        small = f" <small>was {was}</small>" if differs else ""
        return f'<td class="n">{now or ("0" if differs else "")}{small}</td>'

    cells = "".join(
        cell(counts[verdict], None if before is None else before[verdict]) for verdict in verdicts
    )
    total = cell(counts.total(), None if before is None else before.total())
    return f'<tr class="{kind}"><td>{escape(words)}</td>{total}{cells}</tr>'


def _changes(rows: Sequence[ReportRow], older: OlderReport) -> str:
    """Facts of which now comes something else than in an older report."""
    changed = changed_facts(rows, older)
    lines = "".join(
        f"<tr><td>{escape(one.placed.fact.key)}</td><td>{escape(one.placed.words)}</td>"
        f"<td>{escape(one.before)}</td><td>{escape(one.placed.fact.verdict)}</td></tr>"
        for one in changed
    )
    table = (
        '<div class="wide"><table><thead><tr><th>fact</th><th>what it says</th><th>before</th>'
        f"<th>now</th></tr></thead><tbody>{lines}</tbody></table></div>"
    )
    return (
        '<h2 id="changes">Beside an older report</h2><p class="lead">'
        f"{escape(change_words(rows, older))}</p>{table if changed else ''}"
    )


def _contents(
    registers: Sequence[Register], rows: Sequence[ReportRow], older: OlderReport | None
) -> str:
    there = {row.source for row in rows}
    links = [
        ("chapters", "Chapter by chapter"),
        *([] if older is None else [("changes", "Beside an older report")]),
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
    asked = [row for row in rows if row.verdict != NOT_ASKED]
    if asked:
        parts.append(_without(register))
    if len(asked) < len(rows):
        parts.append(_not_asked([row for row in rows if row.verdict == NOT_ASKED]))
    for number in dict.fromkeys(row.section for row in asked):
        mine = [row for row in asked if row.section == number]
        title = f"{number} {titles[number]}" if number in titles else number
        later = [row for row in mine if row.verdict == NOT_IN_QUICK]
        if len(later) <= FOLDED_FROM:
            parts.append(f"<h3>{escape(title)}</h3>{_table(mine)}")
        else:
            now = [row for row in mine if row.verdict != NOT_IN_QUICK]
            words = f"{len(later)} items that are judged in the full form only"
            parts.append(
                f"<h3>{escape(title)}</h3>{_table(now) if now else ''}"
                f"<details><summary>{words}</summary>{_table(later)}</details>"
            )
        for row in mine:
            for path in row.figures:
                if path in drawn:
                    continue
                drawn.add(path)
                parts.append(_figure(folder, path, [o for o in asked if path in o.figures]))
    return "\n".join(parts)


FOLDED_FROM = 3
"""More items of a section that the quick form cannot judge are folded."""


def _not_asked(rows: Sequence[ReportRow]) -> str:
    """Items of studies that were not asked for, folded: how many of each, and their labels."""
    by_study: dict[str, list[ReportRow]] = {}
    for row in rows:
        by_study.setdefault(", ".join(row.studies), []).append(row)
    lines = ""
    for studies, some in by_study.items():
        labels = ", ".join(
            label if count == 1 else f"{count} {label}s"
            for label, count in Counter(row.label for row in some).items()
        )
        lines += f"<li><b>{escape(studies)}</b>, {len(some)}: {escape(labels)}</li>"
    return (
        f"<details><summary>Not asked for: {len(rows)} items of {len(by_study)} studies</summary>"
        f'<ul class="plain">{lines}</ul></details>'
    )


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
        marked = "".join(f'<span class="mark">{escape(word)}</span>' for word in marks(row))
        links = ", ".join(escape(study) for study in row.studies)
        why = "; ".join(part for part in (row.why, row.lacks and f"missing: {row.lacks}") if part)
        label = escape(row.label)
        if row.figures:
            label = f'<a href="#{escape(_anchor(row.figures[0]))}">{label}</a>'
        label = f"{label}<br><small>{links}</small>" if links else label
        cells = (
            label, escape(row.words), escape(row.printed), escape(row.found),
            f'<div class="v {kind}">{escape(row.verdict)}</div>{marked}', escape(why),
        )  # fmt: skip
        lines.append(
            f'<tr class="repeats">{_cells(cells)}</tr>'
            if row.repeats
            else f"<tr>{_cells(cells)}</tr>"
        )
    widths = "".join(
        f'<col class="{name}">' for name in ("label", "words", "printed", "found", "verdict", "why")
    )
    return (
        f'<table class="items"><colgroup>{widths}</colgroup><thead><tr>'
        f"{''.join(f'<th>{head}</th>' for head in HEADS)}</tr></thead>"
        f"<tbody>{''.join(lines)}</tbody></table>"
    )


HEADS = ("published", "what it says", "printed", "ours", "verdict", "why")
"""Columns of items."""


def _cells(cells: Sequence[str]) -> str:
    """Cells of an item; on a narrow screen they stand below each other, each under its heading."""
    return "".join(
        f'<td data-head="{head}">{cell}</td>' if cell else "<td></td>"
        for head, cell in zip(HEADS, cells, strict=True)
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
    """What was chosen, and every recipe on every table, rows in sight and others apart; folded
    where the study was not asked for."""
    lines = "".join(
        f"<tr><td>{escape(c.what)}</td><td>{escape(c.text)}</td><td>{escape(c.chosen)}</td>"
        f"<td>{escape(c.rows)}</td></tr>"
        for c in CHOICES
    )
    chosen = (
        '<p class="lead">What the thesis '
        "does not say was chosen, with printed rows in sight; such rows cannot confirm it. The "
        "statement on each table has its mean difference over the rows that were in sight and over "
        "the others. No row is left out of a mean.</p><table><thead><tr><th>what</th>"
        "<th>what the text says</th><th>what is chosen</th><th>with which rows in sight</th></tr>"
        f"</thead><tbody>{lines}</tbody></table>"
    )
    title = '<h2 id="recipe">The recipe of the stability tables</h2>'
    if RECIPES not in states:
        return (
            f"{title}<details><summary>The study {RECIPES} was not asked for; what was chosen"
            f"</summary>{chosen}</details>"
        )
    tables = "".join(map(_words, _plain_tables(states[RECIPES])))
    return f"{title}{chosen}<h3>Every recipe on every table</h3>{tables}"


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
    return load_json(path.read_text(encoding="utf-8")) if path.is_file() else {}


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
