"""Statements: what a source says, how it is checked, and what came of it.

A check is a function of a study's runs that returns a `Finding`: what was found, and of each part
of the sentence whether it holds. `statement` adds what the source says. The verdict follows:

- all parts hold: confirmed; met (fitted) where parameters were chosen with the number in sight;
  met (by construction) where nothing else could have come out,
- some hold: in part, with how many of how many,
- none holds: not confirmed,
- it has no part that runs can decide: not testable.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich.table import Table

from cdpr_drake.analyses.reporting.statements import (
    CONFIRMED,
    IN_PART,
    NOT_CONFIRMED,
    NOT_IN_QUICK,
    NOT_JUDGED,
    NOT_TESTABLE,
    Statement,
    new_table,
)
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.errors import accepted_names

TEST, FITTED, CONSTRUCTION, OURS = "test", "fitted", "construction", "ours"
"""What a statement rests on: runs that could have said otherwise; parameters that were chosen with
the number in sight; a definition; nothing that a source says, but what we ask for."""

MET_FITTED, MET_CONSTRUCTION = "met (fitted)", "met (by construction)"
"""Verdicts of statements all of whose parts hold, by what they rest on."""

GOOD = {
    TEST: CONFIRMED, OURS: CONFIRMED, FITTED: MET_FITTED, CONSTRUCTION: MET_CONSTRUCTION,
}  # fmt: skip
"""Verdict where all parts hold, by what the statement rests on."""

SOURCE, HARDWARE, CHOICE = "source", "hardware", "ours"
"""Why a statement does not hold: the source contradicts itself or leaves out what is needed; its
prototype has what is not in a model; a choice of ours, which an experiment has to try."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """What a check found.

    Attributes:
        found: In words.
        held: Of each part of the sentence, whether it holds; none: runs cannot decide it.
        some: Whether it holds in part, where that is not whether any part does.
        why: What is known of the difference.
        cause: SOURCE, HARDWARE or CHOICE, where the statement's own does not fit.
        says: The sentence, where it depends on the runs.
        printed: The source's numbers, where these do.
    """

    found: str
    held: Sequence[bool]
    some: bool | None = None
    why: str = ""
    cause: str = ""
    says: str = ""
    printed: str = ""


@dataclass(frozen=True, kw_only=True)
class Judged(Statement):
    """A statement with its verdict.

    Attributes:
        source: Where it stands; empty: where the study's source does.
        rule: What has to be within which bounds for a part to hold.
        basis: TEST, FITTED, CONSTRUCTION or OURS.
        held: How many parts hold.
        of: How many there are.
        same_as: "study/check" that judges the same fact; empty: none.
        cause: Where it does not hold, or in part, SOURCE, HARDWARE or CHOICE; empty: not known.
    """

    source: str = ""
    rule: str = ""
    basis: str = TEST
    held: int = 0
    of: int = 0
    same_as: str = ""
    cause: str = ""

    @property
    def verdict_words(self) -> str:
        """The verdict, with how many parts hold where some do."""
        counted = self.verdict == IN_PART and self.of > 1
        return f"{self.verdict} ({self.held} of {self.of})" if counted else self.verdict


@dataclass(frozen=True, kw_only=True)
class Check:
    """A statement of a source and what checks it.

    Attributes:
        name: By which tables of what was published find it.
        says: The sentence.
        printed: Its numbers.
        find: Finds what holds.
        source: Where it stands.
        rule: What has to be within which bounds for a part to hold.
        basis: TEST, FITTED, CONSTRUCTION or OURS.
        same_as: "study/check" that judges the same fact.
        cause: Why it does not hold, where it does not: SOURCE, HARDWARE or CHOICE.
        why: What is known of the difference, where it does not hold and the finding does not say.
    """

    name: str
    says: str
    printed: str
    find: Callable[[Runs], Finding]
    source: str = ""
    rule: str = ""
    basis: str = TEST
    same_as: str = ""
    cause: str = ""
    why: str = ""

    def __post_init__(self) -> None:
        """Raises ValueError for a basis or cause that is unknown."""
        _check_known("basis", self.basis, tuple(GOOD))
        check_cause(self.cause)

    def judge(self, runs: Runs) -> Judged:
        """What the runs say of it.

        Raises:
            MissingRuns: Runs that it needs are not there.
        """
        found = self.find(runs)
        return self._judged(found, self._verdict(found))

    def _verdict(self, found: Finding) -> str:
        held = [bool(one) for one in found.held]
        if not held:
            return NOT_TESTABLE
        some = any(held) if found.some is None else found.some
        return GOOD[self.basis] if all(held) else IN_PART if some else NOT_CONFIRMED

    def unjudged(self, verdict: str, found: str = "") -> Judged:
        """It without what runs say of it."""
        return self._judged(Finding(found=found, held=()), verdict)

    def _judged(self, found: Finding, verdict: str) -> Judged:
        failed = verdict in (IN_PART, NOT_CONFIRMED)
        return Judged(
            words=found.says or self.says, printed=found.printed or self.printed,
            found=found.found, verdict=verdict, why=found.why or (self.why if failed else ""),
            name=self.name, source=self.source,
            rule=self.rule, basis=self.basis, held=sum(map(bool, found.held)), of=len(found.held),
            same_as=self.same_as, cause=(found.cause or self.cause) if failed else "",
        )  # fmt: skip


def check_cause(cause: str) -> None:
    """Raises ValueError for a cause that is unknown; empty is none."""
    _check_known("cause", cause, ("", SOURCE, HARDWARE, CHOICE))


def _check_known(what: str, value: str, accepted: Sequence[str]) -> None:
    if value not in accepted:
        known = accepted_names(repr(value), map(repr, accepted))
        raise ValueError(f"{what}: found {value!r}; {known}")


def statement(
    says: str,
    printed: str = "",
    *,
    source: str = "",
    rule: str = "",
    basis: str = TEST,
    same_as: str = "",
    cause: str = "",
    why: str = "",
    name: str = "",
) -> Callable[[Callable[[Runs], Finding]], Check]:
    """Makes a function that looks at runs the check of a sentence.

    Args:
        says: The sentence.
        printed: Its numbers.
        source: Where it stands; empty: where the study's source does.
        rule: What has to be within which bounds for a part to hold.
        basis: TEST, FITTED, CONSTRUCTION or OURS.
        same_as: "study/check" that judges the same fact.
        cause: Why it does not hold, where it does not: SOURCE, HARDWARE or CHOICE.
        why: What is known of the difference, where it does not hold and the finding does not say.
        name: Of the check; empty: the function's, without a leading underscore.
    """

    def made(find: Callable[[Runs], Finding]) -> Check:
        known = name or find.__name__.lstrip("_")
        return Check(
            name=known, says=says, printed=printed, find=find, source=source, rule=rule,
            basis=basis, same_as=same_as, cause=cause, why=why,
        )  # fmt: skip

    return made


def judged(
    checks: Iterable[Check], runs: Runs, *, quick: bool = False, complete: bool = True
) -> list[Judged]:
    """What runs say of statements.

    Args:
        checks: The statements.
        runs: Of whole cases.
        quick: Whether the study has its quick form, in which runs that a check needs may lack.
        complete: Whether all runs are there; else statements whose runs lack are left out.

    Returns:
        Them in order. Where a check ends in an error, such as a column that nobody has, it is not
        judged, and the error is told; so it is where runs lack in a whole full form.
    """
    found = []
    for check in checks:
        try:
            found.append(check.judge(runs))
        except MissingRuns as missing:
            if not complete:
                continue
            lacking = f"runs are missing: {missing}"
            found.append(
                check.unjudged(NOT_IN_QUICK) if quick else check.unjudged(NOT_JUDGED, lacking)
            )
        except Exception as problem:
            words = (str(problem) or type(problem).__name__).splitlines()[0][:200]
            found.append(check.unjudged(NOT_JUDGED, f"judging failed: {words}"))
    return found


def scorecard(statements: Sequence[Judged]) -> dict[str, Any]:
    """How many distinct facts hold: each judged once, what we ask for apart.

    Returns:
        `verdicts` and `ours`: counts by verdict; `independent`: confirmed by runs that could have
        said otherwise; `repeated`: statements of facts that are judged elsewhere too.
    """
    distinct = [one for one in statements if not one.same_as]
    printed = [one for one in distinct if one.basis != OURS]
    counted: Mapping[str, int] = Counter(one.verdict for one in printed)
    return {
        "verdicts": dict(counted),
        "ours": dict(Counter(one.verdict for one in distinct if one.basis == OURS)),
        "independent": sum(one.verdict == CONFIRMED for one in printed if one.basis == TEST),
        "repeated": len(statements) - len(distinct),
    }


def judged_table(title: str, statements: Sequence[Judged]) -> Table:
    """What sources say, printed and found side by side."""
    table = new_table(title, ("statement", "printed", "found", "verdict", "rule, why"), ())
    for one in statements:
        notes = "; ".join(part for part in (one.rule, one.why) if part)
        table.add_row(one.words, one.printed, one.found, one.verdict_words, notes)
        table.add_section()
    return table
