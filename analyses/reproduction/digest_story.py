"""The digest of a report, before it is typeset: what stands in it, in order.

`digest_story` makes it of the same rows as the page. It is data alone, so that what the digest says
does not hang on what prints it, see `digest_pdf`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import IN_PART, NOT_CONFIRMED
from cdpr_drake.analyses.reproduction.numbers import RULE
from cdpr_drake.analyses.reproduction.older import OlderReport, change_words, changed_facts, either
from cdpr_drake.analyses.reproduction.overview import (
    CAUSE_WORDS,
    MET,
    OPEN,
    STANDS,
    ChapterOverview,
    PlacedFact,
    chapter_overviews,
    ended,
    first_rows,
    shortened,
)
from cdpr_drake.analyses.reproduction.rows import NOT_ASKED, ReportRow
from cdpr_drake.analyses.reproduction.scorecard import (
    OWN,
    Scorecard,
    chapter_words,
    facts_by_place,
    scorecard_figure,
)
from cdpr_drake.analyses.reproduction.states import FAILED, FINISHED, StudyState
from cdpr_drake.analyses.studies.framework.statement import FITTED
from cdpr_drake.analyses.studies.published.register import Register

NAMED, NAMED_OPEN = 7, 3
"""So many facts of a kind are named for each chapter; and of those without a verdict."""

LONGEST = {"says": 100, "printed": 48, "found": 75, "why": 115}
"""Letters of a cell, by what it holds; the page has all of it."""

TELLING = (
    ("tension-methods/gains_quadratic_program", "Position error and tensions by gain"),
    ("worked-examples/feasible_polygons", "Feasible polygons at home and near the border"),
    ("control-stability/table_a8", "Stable workspace over each bound, planar robot"),
    ("control-stability/table_a11", "Stable workspace over each bound, fully constrained robot"),
    ("case-2/figure_3_28", "Path in the image within and beyond the bounds of stability"),
    ("case-7/figure_4_6", "Servoing and tracking under perturbations"),
    ("case-9/figure_5_18", "Taut cables and stability while slack is taken up"),
    ("case-10/figure_5_26", "Error of the estimate with and without correction"),
)  # fmt: skip
"""Figures of studies, "study/file", that tell most of a source's results, and what they show."""


@dataclass(frozen=True)
class Title:
    """The title of the whole."""

    words: str


@dataclass(frozen=True)
class Heading:
    """The heading of a section, or of a part of it.

    Attributes:
        words: It.
        part: Whether of a part.
        new_page: Whether it begins a page.
    """

    words: str
    part: bool = False
    new_page: bool = False


@dataclass(frozen=True)
class Words:
    """A paragraph.

    Attributes:
        words: It.
        lead: Bold words before it.
        small: Whether it is of less weight.
    """

    words: str
    lead: str = ""
    small: bool = False


@dataclass(frozen=True)
class Grid:
    """A table.

    Attributes:
        heads: Of the columns.
        lines: Of cells.
        widths: Shares of the width.
        numbers: From which column on there are numbers.
        strong: Which lines are sums.
    """

    heads: tuple[str, ...]
    lines: tuple[tuple[str, ...], ...]
    widths: tuple[float, ...]
    numbers: int = 99
    strong: tuple[int, ...] = ()


@dataclass(frozen=True)
class Picture:
    """A picture of a file.

    Attributes:
        path: A PNG.
        words: What stands below it.
    """

    path: Path
    words: str


@dataclass(frozen=True)
class Drawing:
    """A figure that is drawn for the digest.

    Attributes:
        draw: Draws it.
        words: What stands below it.
    """

    draw: Callable[[], Figure]
    words: str


Block = Title | Heading | Words | Grid | Picture | Drawing


def digest_story(
    folder: Path,
    registers: Sequence[Register],
    rows: Sequence[ReportRow],
    states: Mapping[str, StudyState],
    quick: bool,
    older: OlderReport | None = None,
) -> list[Block]:
    """The digest of a report, in order; arguments as those of `write_report`."""
    return [
        *_head(states, quick),
        *_scorecard(registers, rows, quick, older),
        *_chapters(registers, rows),
        *_not_confirmed(rows),
        *_corrections(registers, rows),
        *_telling(folder, rows),
        *_tolerances(rows),
    ]


def _head(states: Mapping[str, StudyState], quick: bool) -> list[Block]:
    ended = Counter(state.status for state in states.values())
    form = (
        "Quick form: few runs, one seed, coarse grids; its verdicts say which way a result points"
        if quick
        else "Full form"
    )
    others = "".join(f", {count} {status}" for status, count in ended.items() if status != FINISHED)
    versions = ", ".join(f"{name} {value}" for name, value in package_versions().items())
    blocks: list[Block] = [
        Title("What was published, repeated: a digest"),
        Words(
            "Every figure, table, number and statement with a result of two theses on cable-driven "
            "parallel robots, beside what this software finds. The whole, with every item, is in "
            "report.html beside this file."
        ),
        Words(f"{form}. Studies: {ended[FINISHED]} finished{others}. Code {code_version()}."),
        Words(f"{versions}.", small=True),
    ]
    failed = [state for state in states.values() if state.status == FAILED]
    blocks += [Words(f"{one.study}: {one.error}", lead="Study failed: ") for one in failed]
    return blocks


def _scorecard(
    registers: Sequence[Register],
    rows: Sequence[ReportRow],
    quick: bool,
    older: OlderReport | None,
) -> list[Block]:
    card = Scorecard.of(rows)
    total = card.total_facts()
    left = f", {total[NOT_ASKED]} of which were not asked for," if total[NOT_ASKED] else ""
    blocks: list[Block] = [
        Heading("Scorecard"),
        Words(
            f"Of {total.total()} facts of the sources{left} {card.independent} are confirmed by "
            "runs that could have said otherwise. A fact is one check of a study or one printed "
            "number, counted once; what no source states, but we ask for, is apart. Met (fitted): "
            "parameters were chosen with the number in sight; met (by construction): nothing else "
            "could have come out."
        ),
        _counts(registers, card, older),
    ]
    if older is not None:
        blocks.append(Words(f"In brackets: the count before. {change_words(rows, older)}"))
        changed = changed_facts(rows, older)
        if changed:
            lines = tuple(
                (shortened(one.placed.words, LONGEST["says"]), one.before, one.placed.fact.verdict)
                for one in changed
            )
            blocks.append(Grid(("what it says", "before", "now"), lines, (0.64, 0.18, 0.18)))
    drawn = _of_sources(card)
    if drawn.facts:
        blocks.append(Drawing(
            lambda: scorecard_figure(drawn, registers, quick), "Facts by chapter, and verdicts."
        ))  # fmt: skip
    return blocks


def _of_sources(card: Scorecard) -> Scorecard:
    """Counts without what is ours, and chapters of which nothing was asked for."""
    facts = {
        place: some for place, some in card.facts.items()
        if place[0] != OWN and set(+some) != {NOT_ASKED}
    }  # fmt: skip
    return Scorecard(card.chapters, facts, card.independent)


def _counts(registers: Sequence[Register], card: Scorecard, older: OlderReport | None) -> Grid:
    """Facts by chapter; those of an older report in brackets where they differ."""
    before = older.card.facts if older is not None and older.card.facts else None
    verdicts = either(card.shown_facts(), () if older is None else older.card.shown_facts())

    def line(
        words: str, counts: Mapping[str, int], was: Mapping[str, int] | None
    ) -> tuple[str, ...]:
        cells = []
        for now, then in (
            (sum(counts.values()), None if was is None else sum(was.values())),
            *((counts.get(one, 0), None if was is None else was.get(one, 0)) for one in verdicts),
        ):
            differs = then is not None and then != now
            cells.append(f"{now} ({then})" if differs else str(now or ""))
        return (words, *cells)

    lines, strong = [], []
    for register in registers:
        places = [place for place in card.facts if place[0] == register.name]
        if not places:
            continue
        for place in () if register.name == OWN else places:
            if set(+card.facts[place]) != {NOT_ASKED}:
                was = None if before is None else before.get(place)
                lines.append(line(chapter_words(register, place[1]), card.facts[place], was))
        strong.append(len(lines))
        sums = None if older is None or before is None else older.card.total_facts(register.name)
        name = register.name.replace("_", " ")
        words = f"{name[:1].upper()}{name[1:]}, all"
        lines.append(line(words, card.total_facts(register.name), sums))
    strong.append(len(lines))
    sums = None if older is None or before is None else older.card.total_facts()
    lines.append(line("All of the sources", card.total_facts(), sums))
    heads = ("facts", *verdicts)
    longest = [3 + max(map(len, head.split())) for head in heads]  # what cannot be broken
    widths = [0.82 * letters / sum(longest) for letters in longest]
    return Grid(("", *heads), tuple(lines), (0.18, *widths), numbers=1, strong=tuple(strong))


def _chapters(registers: Sequence[Register], rows: Sequence[ReportRow]) -> list[Block]:
    blocks: list[Block] = [Heading("Chapter by chapter", new_page=True)]
    for overview in chapter_overviews(rows, registers):
        blocks += [Heading(overview.title, part=True), *_chapter(overview)]
    return blocks


def _chapter(overview: ChapterOverview) -> list[Block]:
    """What stands, is corrected, fails and why."""
    blocks: list[Block] = []
    for group in overview.groups:
        words = group.named(NAMED_OPEN if group.title == OPEN else NAMED)
        why = f", {group.why}" if group.why else ""
        lead = f"{group.title}, {len(group.facts)}"
        blocks.append(Words(f"{why}: {ended(words)}", lead))
    if overview.corrected:
        met = sum(group.title in (STANDS, MET) for group in overview.groups)
        words = "; ".join(overview.corrected)
        blocks.insert(met, Words(f": {ended(words)}", f"Corrected, {len(overview.corrected)}"))
    return blocks


def _not_confirmed(rows: Sequence[ReportRow]) -> list[Block]:
    """Facts of the sources that are not confirmed, or in part, each with what is known of why."""
    first = first_rows(rows)
    facts = [
        PlacedFact(fact, first[fact.key])
        for (source, _), some in facts_by_place(rows).items()
        if source != OWN
        for fact in some
    ]
    blocks: list[Block] = []
    none = [one for one in facts if one.fact.verdict == NOT_CONFIRMED]
    part = [one for one in facts if one.fact.verdict == IN_PART]
    heads = ("section", "what it says", "printed", "ours", "cause", "why")
    widths = (0.11, 0.24, 0.12, 0.18, 0.08, 0.27)
    for title, some, grid in (
        ("Not confirmed", none, Grid(heads, tuple(map(_line, none)), widths)),
        ("Confirmed in part", part, Grid(PART_HEADS, tuple(map(_part_line, part)), PART_WIDTHS)),
    ):
        blocks += [Heading(f"{title}: {len(some)}"), grid if some else Words("None.")]
    return blocks


PART_HEADS, PART_WIDTHS = ("section", "what it says", "cause"), (0.11, 0.77, 0.12)
"""Of what holds in part, a line each: its numbers and reasons are on the page."""


def _part_line(placed: PlacedFact) -> tuple[str, ...]:
    section, words, _, _, cause, _ = _line(placed)
    return section, words, cause


def _line(placed: PlacedFact) -> tuple[str, ...]:
    fact = placed.fact
    return (
        f"{placed.row.source.partition('_')[0]} {placed.row.section}",
        shortened(placed.words, LONGEST["says"]) + (" (fitted)" if fact.basis == FITTED else ""),
        shortened(fact.printed, LONGEST["printed"]),
        shortened(fact.found, LONGEST["found"]),
        CAUSE_WORDS[fact.cause],
        shortened(fact.why, LONGEST["why"]),
    )


def _corrections(registers: Sequence[Register], rows: Sequence[ReportRow]) -> list[Block]:
    """What does not hold as printed, of the sources of which something was asked for."""
    note = "What does not hold as printed. What is used instead stands in the "
    note += "documentation, under What was corrected in the sources."
    asked = {row.source for row in rows if row.verdict != NOT_ASKED}
    lines = tuple(
        (register.name.replace("_", " "), chapter_words(register, chapter), "; ".join(some))
        for register in registers
        if register.name in asked
        for chapter, some in register.corrected.items()
    )
    table = Grid(("source", "chapter", "what does not hold"), lines, (0.2, 0.15, 0.65))
    return [Heading("Corrections"), Words(note), table] if lines else []


def _telling(folder: Path, rows: Sequence[ReportRow]) -> list[Block]:
    """Pictures of the figures that tell most, as far as they are drawn."""
    there = {path: row for row in reversed(rows) for path in row.figures}
    blocks: list[Block] = []
    for key, words in TELLING:
        study, _, name = key.partition("/")
        path = next((one for one in there if one.endswith(f"/{study}/{name}.png")), None)
        if path is not None:
            blocks.append(Picture(folder / path, f"{there[path].label}, ours: {words}."))
    return [Heading("Figures that tell most"), *blocks] if blocks else []


def _tolerances(rows: Sequence[ReportRow]) -> list[Block]:
    """The rule for printed numbers, and how many rules of statements the page has."""
    rules = {
        fact.rule
        for (source, _), some in facts_by_place(rows).items()
        for fact in some
        if source != OWN and fact.rule
    }
    told = f"{RULE} Rules of statements, {len(rules)}, are one table of the page."
    return [Heading("Tolerances"), Words(told)]
