"""Whether scenarios end as their files say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cdpr_drake.analyses.reporting.statements import Statement, verdict
from cdpr_drake.analyses.studies.scenarios.task import COLUMNS
from cdpr_drake.arrays import Array
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.run_settings import ExpectedEnd

StudyData = Mapping[str, Mapping[str, Array]]

OVER = ("timeout", "completed")
"""Outcomes of runs that last as long as they may."""


@dataclass(frozen=True)
class Ending:
    """How a scenario ended, beside what it expects.

    Attributes:
        name: The scenario.
        expected: What its file expects; None: nothing.
        numbers: `COLUMNS`, by name.
        message: Why it ended so, where there is more to say.
        whole: Whether it might run as long as its file says.
    """

    name: str
    expected: ExpectedEnd | None
    numbers: dict[str, float]
    message: str
    whole: bool

    @property
    def outcome(self) -> str:
        """As `summary.json` names it."""
        return Outcome(int(self.numbers["outcome"])).name.lower()

    @property
    def is_cut(self) -> bool:
        """Whether the run was cut before anything had ended it."""
        return not self.whole and self.outcome in OVER

    def shares(self) -> tuple[float, float]:
        """Distance and angle at the end, per what is expected at most; NaN where nothing is."""
        wanted = self.expected
        at_most = (None, None) if wanted is None else (wanted.position, wanted.rotation_deg)
        distance, angle = self.numbers["distance_m"], float(np.degrees(self.numbers["angle_rad"]))
        one, other = (
            np.nan if most is None else error / most
            for error, most in zip((distance, angle), at_most, strict=True)
        )
        return one, other

    def ends_as_expected(self) -> bool:
        """Whether the outcome is the expected one; of a run that was cut, whether it is that or
        nothing had ended it before it was cut."""
        if self.expected is None:
            return False
        return self.outcome == self.expected.outcome or self.is_cut

    def is_judged_by_errors(self) -> bool:
        """Whether errors at the end can be held against the file: not those of a run that was cut
        before it ended, nor where the file says none."""
        if self.expected is None or self.is_cut:
            return False
        return self.expected.position is not None or self.expected.rotation_deg is not None

    def is_close_enough(self) -> bool:
        """Whether the errors that the file bounds are within that; one that is not known is not."""
        wanted = self.expected
        if wanted is None:
            return False
        told = zip(self.shares(), (wanted.position, wanted.rotation_deg), strict=True)
        return all(share <= 1.0 for share, most in told if most is not None)

    def largest_share(self) -> float:
        """The larger of `shares` of what the file bounds; infinite where an error is not known."""
        wanted = self.expected
        assert wanted is not None
        told = zip(self.shares(), (wanted.position, wanted.rotation_deg), strict=True)
        return max(np.nan_to_num(share, nan=np.inf) for share, most in told if most is not None)


def endings(found: StudyData) -> list[Ending]:
    """How the scenarios that are finished ended, in their order."""
    told = []
    for name, arrays in found.items():
        numbers = dict(zip(COLUMNS, arrays["runs"][0].tolist(), strict=True))
        scenario = load_scenario(name)
        whole = numbers["duration_s"] >= scenario.duration
        message = str(arrays["messages"][0])
        told.append(Ending(name, scenario.expected, numbers, message, whole))
    return told


def _scenarios_expect_an_end(found: StudyData) -> Statement:
    """Whether every file says how it ends."""
    told = _known(found)
    without = [one.name for one in told if one.expected is None]
    return Statement(
        "Every scenario that ships says how it ends.",
        "outcome, distance and angle",
        f"{len(told) - len(without)} of {len(told)}"
        + (f"; not {', '.join(without)}" * bool(without)),
        verdict(not without, len(without) < len(told)),
    )


def _scenarios_end_as_expected(found: StudyData) -> Statement:
    """Whether every scenario ends with the outcome that its file expects."""
    told = _known(found)
    wrong = [one for one in told if not one.ends_as_expected()]
    cut = sum(one.is_cut for one in told)
    rendered = sum(one.numbers["rendered"] == 1.0 for one in told)
    words = f"{len(told) - len(wrong)} of {len(told)}, {rendered} with rendered images"
    if cut:
        words += f", {cut} cut short before anything ended them"
    if wrong:
        words += f"; not {', '.join(_told_end(one) for one in wrong)}"
    return Statement(
        "Every scenario that ships ends as its file says.",
        "",
        words,
        verdict(not wrong, len(wrong) < len(told)),
    )


def _told_end(one: Ending) -> str:
    wanted = "nothing" if one.expected is None else one.expected.outcome
    more = f": {one.message}" if one.message else ""
    return f"{one.name} ({one.outcome}, {wanted} expected{more})"


def _scenarios_end_close_enough(found: StudyData) -> Statement:
    """Whether true errors at the end are within what files expect."""
    told = [one for one in _known(found) if one.is_judged_by_errors()]
    if not told:
        raise KeyError("all runs were cut")
    wrong = [one for one in told if not one.is_close_enough()]
    largest = max(told, key=Ending.largest_share)
    words = (
        f"{len(told) - len(wrong)} of {len(told)}; the largest share of it "
        f"{largest.largest_share():.2g}, {largest.name}"
    )
    if wrong:
        words += f"; not {', '.join(one.name for one in wrong)}"
    return Statement(
        "True errors at the end are within what the files expect.",
        "",
        words,
        verdict(not wrong, len(wrong) < len(told)),
    )


def _known(found: StudyData) -> list[Ending]:
    """Endings of what is finished.

    Raises:
        KeyError: Nothing is.
    """
    told = endings(found)
    if not told:
        raise KeyError("no scenario is finished")
    return told


CHECKS = (_scenarios_expect_an_end, _scenarios_end_as_expected, _scenarios_end_close_enough)
"""What judges the statements."""
