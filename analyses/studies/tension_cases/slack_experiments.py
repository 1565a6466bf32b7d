"""The ten experiments E1 to E10 of case studies IX and X: more and more slack at the start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cdpr_drake.analyses.studies.framework.case_definition import Configuration
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs

SLACKS_CM = (0, 2, 4, 6, 8)
"""Surplus of two cables at the start of E1 and E2, E3 and E4, ... [cm]."""

PLAIN = tuple(f"E{2 * k + 1}" for k in range(len(SLACKS_CM)))
CORRECTED = tuple(f"E{2 * k + 2}" for k in range(len(SLACKS_CM)))
"""Names of the experiments without and with correction, by slack."""

OFF = "tension_management=null"

FACTOR = 1.5
"""A number within this factor of a published one agrees with it: gains of the servo, stiffness and
what the controller believes wrongly, which decide the rest, are known to some tens of per cent."""


def near(found: float, published: float) -> bool:
    """Whether a number is within `FACTOR` of a published one."""
    return published / FACTOR <= found <= FACTOR * published


def slack_change(centimetres: float, cables: Sequence[int], count: int = 8) -> str:
    """Pays out some cables, by their numbers from 1, at the start."""
    lengths = [centimetres / 100.0 if k + 1 in cables else 0 for k in range(count)]
    return f"perturbations.slack=[{', '.join(str(x) for x in lengths)}]"


def experiments(
    cables: Sequence[int], correction: str, published: Mapping[str, Mapping[str, str]]
) -> tuple[Configuration, ...]:
    """E1 to E10.

    Args:
        cables: Numbers, from 1, of those that are slack.
        correction: Change of the scenario that takes up slack.
        published: What the thesis prints, by experiment and metric.
    """
    found = []
    for name, other, slack in zip(PLAIN, CORRECTED, SLACKS_CM, strict=True):
        for who, words, change in ((name, "", OFF), (other, ", corrected", correction)):
            found.append(
                Configuration(
                    who,
                    f"{who}: {slack} cm{words}",
                    (slack_change(slack, cables), change),
                    "experiments",
                    published=published.get(who, {}),
                )
            )
    return tuple(found)


def means(runs: Runs, names: Sequence[str], metric: str) -> dict[str, float]:
    """A metric's means over the runs of those configurations that were run, in their order.

    Raises:
        MissingRuns: None of them was.
    """
    return {name: runs.mean(metric, configuration=name) for name in there(runs, names)}


def several(runs: Runs, names: Sequence[str], metric: str) -> dict[str, float]:
    """As `means`, for what is said of how experiments compare.

    Raises:
        MissingRuns: One alone was run, or none.
    """
    found = means(runs, names, metric)
    if len(found) < 2:
        raise MissingRuns(f"one experiment alone says nothing of others: {', '.join(found)}")
    return found


def there(runs: Runs, names: Sequence[str]) -> list[str]:
    """Those of some configurations that were run; a short form has some of them only.

    Raises:
        MissingRuns: None of them was.
    """
    found = [name for name in names if runs.has(configuration=name)]
    if not found:
        raise MissingRuns(f"none of {', '.join(names)}")
    return found


def listed(values: Mapping[str, float], unit: str, digits: int = 0, factor: float = 1.0) -> str:
    """Words such as `E3 34, E5 59 mm`."""
    return ", ".join(f"{name} {factor * v:.{digits}f}" for name, v in values.items()) + f" {unit}"
