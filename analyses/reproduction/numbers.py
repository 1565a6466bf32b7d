"""Printed numbers of configurations beside those of their runs, by one rule for all."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from cdpr_drake.analyses.reporting.statements import (
    CONFIRMED,
    IN_PART,
    NOT_CONFIRMED,
    NOT_JUDGED,
    NOT_TESTABLE,
    verdict,
)
from cdpr_drake.analyses.studies.framework.case_definition import PublishedNumber

CLOSE, FACTOR = 0.1, 2.0
"""A number agrees within this share of the printed one, and in part within this factor."""

RULE = (
    f"A printed number is confirmed where it lies within the range of our runs or within "
    f"{100 * CLOSE:g} % of their mean, in part within a factor of {FACTOR:g} of the mean; a bound "
    "is confirmed where all runs keep it, in part where their mean does; an outcome where all runs "
    "end so, in part where some do."
)
"""The rule, in words."""

_UPPER = re.compile(r"(?:at most |below |<=? ?)([\d.]+)|([\d.]+) or less")
_LOWER = re.compile(r"(?:at least |over |>=? ?)([\d.]+)")
_VALUE = re.compile(r"(?:about )?([\d.]+)")

_FAILS = ("fails",)
"""Words for any outcome but success."""


def judge_number(number: PublishedNumber, ours: Mapping[str, Any]) -> tuple[str, str, str]:
    """Judges one printed number.

    Args:
        number: What is printed.
        ours: What was found of its configuration, see `CaseResult.as_dict`.

    Returns:
        Our number in words, with its spread over the runs; verdict; by how much it differs, and
        where it is not confirmed, what is known of why.
    """
    words, found, how = _judged(number, ours)
    reason = number.why if found in (IN_PART, NOT_CONFIRMED) else ""
    return words, found, "; ".join(part for part in (how, reason) if part)


def _judged(number: PublishedNumber, ours: Mapping[str, Any]) -> tuple[str, str, str]:
    if number.metric == "outcome":
        return _outcome(number.printed, str(ours["outcomes"]), int(ours["runs"]))
    found = ours.get(number.metric) or {}
    values = [found.get(key) for key in ("mean", "min", "max")]
    if any(value is None for value in values):
        return "-", NOT_TESTABLE, "no such number in these runs"
    mean, least, most = (number.factor * float(value) for value in values if value is not None)
    form = number.format
    runs = int(ours["runs"])
    words = f"{mean:{form}}"
    if runs > 1:
        words += f" ({least:{form}} to {most:{form}}, {runs} runs)"
    if bound := _UPPER.fullmatch(number.printed):
        limit = float(bound.group(1) or bound.group(2))
        how = f"our largest over the printed bound {most / limit:.2f}"
        return words, verdict(most <= limit, mean <= limit), how
    if bound := _LOWER.fullmatch(number.printed):
        limit = float(bound.group(1))
        how = f"our least over the printed bound {least / limit:.2f}"
        return words, verdict(least >= limit, mean >= limit), how
    if value := _VALUE.fullmatch(number.printed):
        printed = float(value.group(1))
        near = least <= printed <= most or abs(mean - printed) <= CLOSE * printed
        some = printed / FACTOR <= mean <= FACTOR * printed
        return words, verdict(near, some), f"ours over printed {mean / printed:.2f}"
    return words, NOT_JUDGED, "printed in words"


def _outcome(printed: str, outcomes: str, runs: int) -> tuple[str, str, str]:
    """Judges an outcome; what is printed beyond it is not judged, and said."""
    wanted = re.split(r"[ ,]", printed, maxsplit=1)[0]
    counts = {
        name: int(count) for count, name in (part.split(" ", 1) for part in outcomes.split(", "))
    }
    if printed in _FAILS:
        good = runs - counts.get("converged", 0)
    elif wanted in ("converged", "target_lost"):
        good = counts.get(wanted, 0)
    else:
        return outcomes, NOT_JUDGED, "printed in words; see the statements of the section"
    found = CONFIRMED if good == runs else IN_PART if good else NOT_CONFIRMED
    if wanted != printed and printed not in _FAILS:
        return outcomes, IN_PART if good else NOT_CONFIRMED, "only the outcome is judged"
    return outcomes, found, f"{good} of {runs} runs ended so"
