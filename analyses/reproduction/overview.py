"""Of each chapter what stands, what is corrected, what fails and why; the page and the digest."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED
from cdpr_drake.analyses.reproduction.rows import NOT_ASKED, Fact, ReportRow
from cdpr_drake.analyses.reproduction.scorecard import OWN, chapter_words, facts_by_place
from cdpr_drake.analyses.studies.framework.statement import (
    CHOICE,
    CONSTRUCTION,
    FITTED,
    HARDWARE,
    MET_CONSTRUCTION,
    MET_FITTED,
    SOURCE,
)
from cdpr_drake.analyses.studies.published.register import Register

CAUSES = {
    SOURCE: "because of the source, which contradicts itself or leaves out what is needed",
    HARDWARE: "because of the prototype, which has what is in no model",
    CHOICE: "because of a choice of ours",
    "": "for a reason that is not known, or not sorted yet",
}
"""Words for why facts do not hold."""

CAUSE_WORDS = {SOURCE: "the thesis", HARDWARE: "hardware", CHOICE: "ours", "": "not known"}
"""The same in a table."""

STANDS, MET = "Stands", "Met, but not put to a test"
FAILS, PARTLY, OPEN = "Fails", "Holds in part", "Without a verdict"
"""Titles of groups of facts."""

SHORT = 110
"""Longest words of a fact in the overview of a chapter."""


@dataclass(frozen=True)
class PlacedFact:
    """A fact, and where it comes first.

    Attributes:
        fact: What was found.
        row: The first that rests on it.
    """

    fact: Fact
    row: ReportRow

    @property
    def words(self) -> str:
        """What it says; where nothing was found, what its row does, or the name of its check."""
        alone = self.row.words if len(self.row.facts) == 1 else ""
        words = self.fact.says or alone or self.fact.key.partition("/")[2].replace("_", " ")
        return words.rstrip(".")

    @property
    def in_short(self) -> str:
        """The same in a few words."""
        return shortened(self.words, SHORT)


@dataclass(frozen=True)
class FactGroup:
    """Facts of a chapter of which the same came.

    Attributes:
        title: What came of them.
        why: Why, where they do not hold.
        facts: They.
    """

    title: str
    why: str
    facts: tuple[PlacedFact, ...]

    def named(self, most: int) -> str:
        """The facts in short, so many of them at most."""
        words = "; ".join(fact.in_short for fact in self.facts[:most])
        left = len(self.facts) - most
        return f"{words}; and {left} more" if left > 0 else words


@dataclass(frozen=True)
class ChapterOverview:
    """What came of a chapter.

    Attributes:
        register: Of its source.
        chapter: Its number.
        groups: Its facts; each is in one, and in the chapter where it comes first.
        corrected: What does not hold as printed.
    """

    register: Register
    chapter: str
    groups: tuple[FactGroup, ...]
    corrected: tuple[str, ...]

    @property
    def title(self) -> str:
        """Source and chapter."""
        source = self.register.name.replace("_", " ")
        return f"{source[:1].upper()}{source[1:]}, {chapter_words(self.register, self.chapter)}"


def chapter_overviews(
    rows: Sequence[ReportRow], registers: Sequence[Register]
) -> list[ChapterOverview]:
    """Overviews of the chapters of all sources that have facts, or what is corrected.

    Facts of studies that were not asked for are left out, and chapters that have no others.
    """
    placed, first = facts_by_place(rows), first_rows(rows)
    overviews = []
    for register in registers:
        if register.name == OWN:
            continue
        there = {chapter for source, chapter in placed if source == register.name}
        read = {row.chapter for row in rows if row.source == register.name}
        for chapter in sorted(there | read | {*register.corrected}):
            facts = placed.get((register.name, chapter), ())
            asked = [fact for fact in facts if fact.verdict != NOT_ASKED]
            groups = _groups([PlacedFact(fact, first[fact.key]) for fact in asked])
            corrected = register.corrected.get(chapter, ())
            if groups or (corrected and not facts):
                overviews.append(ChapterOverview(register, chapter, groups, corrected))
    return overviews


def first_rows(rows: Sequence[ReportRow]) -> dict[str, ReportRow]:
    """Of each fact, by its key, the first row that rests on it."""
    first: dict[str, ReportRow] = {}
    for row in rows:
        for fact in row.facts:
            first.setdefault(fact.key, row)
    return first


def _groups(facts: Sequence[PlacedFact]) -> tuple[FactGroup, ...]:
    """Facts by what came of them, and why."""

    def group(
        title: str, verdicts: Collection[str], cause: str | None = None, why: str = ""
    ) -> FactGroup:
        some = [
            one for one in facts
            if one.fact.verdict in verdicts and cause in (None, one.fact.cause)
        ]  # fmt: skip
        return FactGroup(title, why, tuple(some))

    groups = [
        group(STANDS, (CONFIRMED,)),
        group(MET, (MET_FITTED, MET_CONSTRUCTION)),
    ]
    for cause, why in CAUSES.items():
        groups.append(group(FAILS, (NOT_CONFIRMED,), cause, why))
        groups.append(group(PARTLY, (IN_PART,), cause, why))
    judged = {one.fact.key for some in groups for one in some.facts}
    left = tuple(one for one in facts if one.fact.key not in judged)
    groups.append(FactGroup(OPEN, _counted_words(Counter(o.fact.verdict for o in left)), left))
    return tuple(some for some in groups if some.facts)


def _counted_words(counts: Counter[str]) -> str:
    """Such as "2 not testable, 1 missing"; only the word where there is one kind."""
    if len(counts) == 1:
        return next(iter(counts))
    return ", ".join(f"{count} {verdict}" for verdict, count in counts.items())


def marks(row: ReportRow) -> list[str]:
    """Words beside a row's verdict: what it rests on, where no test, and what it repeats."""
    words = []
    for basis, verdict, word in (
        (FITTED, MET_FITTED, "fitted"), (CONSTRUCTION, MET_CONSTRUCTION, "by construction"),
    ):  # fmt: skip
        some = sum(fact.basis == basis for fact in row.facts)
        if some and row.verdict != verdict:
            words.append(word if some == len(row.facts) else f"{word}: {some} of {len(row.facts)}")
    return [*words, "counted above"] if row.repeats else words


def ended(words: str) -> str:
    """Words with a full stop, where they do not end in dots already."""
    return words if words.endswith(".") else f"{words}."


def shortened(words: str, most: int) -> str:
    """Words, cut between two of them where they are longer than so many letters."""
    return words if len(words) <= most else f"{words[:most].rpartition(' ')[0]} ..."
