"""How many facts and published items have which verdict, by source and chapter.

A fact is one check of a study, or one printed number. Several figures, tables and sentences may
rest on one: they are items, and the fact is counted once, where it comes first.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.reporting.statements import (
    CONFIRMED,
    IN_PART,
    NOT_CONFIRMED,
    NOT_IN_QUICK,
    NOT_JUDGED,
    NOT_TESTABLE,
)
from cdpr_drake.analyses.reproduction.rows import (
    CITED,
    FAILED,
    MISSING,
    NOT_ASKED,
    NOT_FINISHED,
    SHOWN,
    Fact,
    ReportRow,
)
from cdpr_drake.analyses.studies.framework.statement import (
    MET_CONSTRUCTION,
    MET_FITTED,
    OURS,
    TEST,
)
from cdpr_drake.analyses.studies.published.register import Register
from cdpr_drake.analyses.visualization.figure_style import bar_style, new_figure
from cdpr_drake.palette import Look

LOOKS = {
    CONFIRMED: Look("#009e73"), MET_FITTED: Look("#7fcfb9", hatch="|||"),
    MET_CONSTRUCTION: Look("#7fcfb9", hatch="ooo"), IN_PART: Look("#f0c050", hatch="///"),
    NOT_CONFIRMED: Look("#b3312c", hatch="xxx"), NOT_TESTABLE: Look("#e8e8e8", hatch="\\\\\\"),
    SHOWN: Look("#8ccbee"), NOT_JUDGED: Look("#e8e8e8", hatch="+++"),
    CITED: Look("#cfe6f5", hatch="..."), NOT_IN_QUICK: Look("#e8e8e8", hatch="---"),
    MISSING: Look("#ffffff", hatch="xxx"), FAILED: Look("#303030"),
    NOT_FINISHED: Look("#ffffff", hatch="///"), NOT_ASKED: Look("#ffffff"),
}  # fmt: skip
"""How bars of verdicts look: judged ones in the colours of the report, others pale, without any
result white, each apart from the others in grey print."""

GAP, ROOM = 0.6, 0.035
"""Between sources, in rows; and the share of the longest bar that has room for a number."""

LONGEST, LEGEND_COLUMNS = 32, 6
"""Letters of a line of a row's name; verdicts beside each other in the legend."""

VERDICTS = (
    CONFIRMED, MET_FITTED, MET_CONSTRUCTION, IN_PART, NOT_CONFIRMED, NOT_TESTABLE, SHOWN,
    NOT_JUDGED, CITED, NOT_IN_QUICK, MISSING, FAILED, NOT_FINISHED, NOT_ASKED,
)  # fmt: skip
"""All verdicts, in the order of the columns."""

OWN = "ours"
"""Register of what no source states."""


@dataclass(frozen=True)
class Scorecard:
    """Counts of verdicts.

    Attributes:
        chapters: Of items, by source and chapter, in their order.
        facts: Of facts, by source and chapter where they come first; what no source states, but we
            ask for, is under the source `OWN`.
        independent: Facts of the sources that were confirmed by runs that could have said
            otherwise.
    """

    chapters: dict[tuple[str, str], Counter[str]]
    facts: dict[tuple[str, str], Counter[str]]
    independent: int

    @classmethod
    def of(cls, rows: Sequence[ReportRow]) -> Scorecard:
        """Counts rows, and what they rest on."""
        chapters: dict[tuple[str, str], Counter[str]] = {}
        facts: dict[tuple[str, str], Counter[str]] = {}
        independent = 0
        for row in rows:
            chapters.setdefault((row.source, row.chapter), Counter())[row.verdict] += 1
        for place, some in facts_by_place(rows).items():
            facts[place] = Counter(fact.verdict for fact in some)
            if place[0] != OWN:
                independent += sum(f.basis == TEST and f.verdict == CONFIRMED for f in some)
        return cls(chapters, facts, independent)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Scorecard:
        """Of what `as_dict` gave, also of reports that did not count facts yet.

        Raises:
            KeyError, TypeError, ValueError: It is none.
        """
        facts = content.get("facts", {"chapters": (), "independent": 0})
        return cls(
            _from_lines(content["chapters"]), _from_lines(facts["chapters"]),
            int(facts["independent"]),
        )  # fmt: skip

    def total(self, source: str | None = None) -> Counter[str]:
        """Counts of the items of a source, or of all."""
        return _sum(self.chapters, source)

    def total_facts(self, source: str | None = None) -> Counter[str]:
        """Counts of the facts of a source; of all but `OWN` without."""
        if source is not None:
            return _sum(self.facts, source)
        return _sum({key: some for key, some in self.facts.items() if key[0] != OWN}, None)

    def shown(self) -> tuple[str, ...]:
        """The verdicts of items that occur."""
        return tuple(verdict for verdict in VERDICTS if self.total()[verdict])

    def shown_facts(self) -> tuple[str, ...]:
        """The verdicts of facts that occur."""
        every = _sum(self.facts, None)
        return tuple(verdict for verdict in VERDICTS if every[verdict])

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "facts": {
                "sources": dict(self.total_facts()),
                "independent": self.independent,
                "ours": dict(self.total_facts(OWN)),
                "chapters": [
                    {"source": source, "chapter": chapter, **counts}
                    for (source, chapter), counts in self.facts.items()
                ],
            },
            "all": dict(self.total()),
            "chapters": [
                {"source": source, "chapter": chapter, **counts}
                for (source, chapter), counts in self.chapters.items()
            ],
        }


def facts_by_place(rows: Sequence[ReportRow]) -> dict[tuple[str, str], list[Fact]]:
    """Every fact once, by source and chapter where it comes first; ours under the study's name."""
    facts: dict[tuple[str, str], list[Fact]] = {}
    seen: set[str] = set()
    for row in rows:
        for fact in row.facts:
            if fact.key in seen:
                continue
            seen.add(fact.key)
            own = row.source == OWN or fact.basis == OURS
            place = (OWN, fact.key.partition("/")[0]) if own else (row.source, row.chapter)
            facts.setdefault(place, []).append(fact)
    return facts


def _from_lines(lines: Sequence[Mapping[str, Any]]) -> dict[tuple[str, str], Counter[str]]:
    counts: dict[tuple[str, str], Counter[str]] = {}
    for line in lines:
        verdicts = {key: int(n) for key, n in line.items() if key not in ("source", "chapter")}
        counts[str(line["source"]), str(line["chapter"])] = Counter(verdicts)
    return counts


def _sum(counts: Mapping[tuple[str, str], Counter[str]], source: str | None) -> Counter[str]:
    return sum((some for (name, _), some in counts.items() if source in (None, name)), Counter())


def chapter_words(register: Register, chapter: str) -> str:
    """A line's name in the scorecard: a chapter's number, or what ours is about."""
    if register.name == OWN:
        titles = {section.chapter: section.title for section in register.sections}
        return titles.get(chapter, f"Study {chapter}")
    if len(chapter) == 1 and chapter.isalpha():
        return f"Appendix {chapter}"
    return f"Chapter {chapter}" if chapter[0].isdigit() else chapter


def scorecard_figure(card: Scorecard, registers: Sequence[Register], quick: bool) -> Figure:
    """Facts by verdict as bars, a row for each chapter, with numbers where there is room.

    Args:
        card: The counts.
        registers: What was published, whose titles name the rows.
        quick: Whether studies were run in their short forms.
    """
    lines = [
        (register, chapter, card.facts[register.name, chapter])
        for register in registers
        for source, chapter in card.facts
        if source == register.name
    ]
    starts = [k for k in range(len(lines)) if k and lines[k][0] is not lines[k - 1][0]]
    rows = np.array([k + GAP * sum(k >= start for start in starts) for k in range(len(lines))])
    title = "Facts by chapter, and what came of each"
    figure, axes = new_figure(
        1, 1, (12.0, 2.2 + 0.42 * len(lines)), f"{title}, quick form" if quick else title
    )
    widest = max(counts.total() for _, _, counts in lines)
    for verdict in card.shown_facts():
        before = VERDICTS[: VERDICTS.index(verdict)]
        widths = np.array([counts[verdict] for _, _, counts in lines])
        begins = np.array([sum(counts[one] for one in before) for _, _, counts in lines])
        look = bar_style(LOOKS[verdict])
        axes.barh(rows, widths, left=begins, label=verdict, zorder=2, **look)
        for row, begin, width in zip(rows, begins, widths, strict=True):
            if width > ROOM * widest:
                axes.text(
                    begin + 0.5 * width, row, str(width), ha="center", va="center", fontsize=9,
                    zorder=3, bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none"},
                )  # fmt: skip
    for row, (_, _, counts) in zip(rows, lines, strict=True):
        axes.text(
            counts.total() + 0.01 * widest, row, str(counts.total()), va="center", weight="bold"
        )
    axes.set_yticks(
        rows, ["\n".join(wrap(_row_words(*line[:2]), LONGEST)) for line in lines], fontsize=10
    )
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.set(
        xlabel="number of facts, each counted once; bold: all of the chapter",
        xlim=(0.0, 1.06 * widest),
    )
    figure.legend(loc="outside lower center", ncols=LEGEND_COLUMNS)
    return figure


def _row_words(register: Register, chapter: str) -> str:
    words = chapter_words(register, chapter)
    return words if register.name == OWN else f"{register.name.replace('_', ' ')}, {words}"
