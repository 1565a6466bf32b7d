"""Printed numbers of configurations beside those of their runs, by one rule for all."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

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


def judge_number(
    number: PublishedNumber, runs: Sequence[Mapping[str, Any]]
) -> tuple[str, str, str]:
    """Judges one printed number.

    Args:
        number: What is printed.
        runs: Rows of its configuration, of which there is one at least; see `Runs.table`.

    Returns:
        Our number in words, with its spread over the runs; verdict; by how much it differs, and
        where it is not confirmed, what is known of why.
    """
    words, found, how = _judged(number, runs)
    reason = number.why if found in (IN_PART, NOT_CONFIRMED) else ""
    return words, found, "; ".join(part for part in (how, reason) if part)


def _judged(number: PublishedNumber, runs: Sequence[Mapping[str, Any]]) -> tuple[str, str, str]:
    found = [run.get(number.metric) for run in runs]
    if number.metric == "outcome":
        return _outcome(number.printed, Counter(found))
    values = [float(value) for value in found if value is not None]
    if len(values) < len(runs):
        return "-", NOT_TESTABLE, "no such number in these runs"
    mean, least, most = (number.factor * float(of(values)) for of in (np.mean, np.min, np.max))
    form = number.format
    words = f"{mean:{form}}"
    if len(runs) > 1:
        words += f" ({least:{form}} to {most:{form}}, {len(runs)} runs)"
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


def _outcome(printed: str, counts: Counter[Any]) -> tuple[str, str, str]:
    """Judges an outcome; what is printed beyond it is not judged, and said."""
    wanted = re.split(r"[ ,]", printed, maxsplit=1)[0]
    runs, outcomes = counts.total(), ", ".join(f"{n} {name}" for name, n in counts.items())
    if printed in _FAILS:
        good = runs - counts["converged"]
    elif wanted in ("converged", "target_lost"):
        good = counts[wanted]
    else:
        return outcomes, NOT_JUDGED, "printed in words; see the statements of the section"
    found = CONFIRMED if good == runs else IN_PART if good else NOT_CONFIRMED
    if wanted != printed and printed not in _FAILS:
        return outcomes, IN_PART if good else NOT_CONFIRMED, "only the outcome is judged"
    return outcomes, found, f"{good} of {runs} runs ended so"
