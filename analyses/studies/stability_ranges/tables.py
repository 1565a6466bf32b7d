"""Tables of stability ranges."""

from __future__ import annotations

from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import Run, Runs, unit_of
from cdpr_drake.analyses.studies.stability_ranges.question import (
    PLANAR_ROBOT,
    PLANAR_VISION,
    SECTIONS,
    SINGLE,
    SPATIAL_CAMERA,
    SPATIAL_ROBOT,
    SPATIAL_VISION,
    column_of,
    found,
    limits_of,
)

NAMES = (
    "place, height, psi, phi, theta: where the platform may be; error: length of e; r_, d_theta_: "
    "errors of the platform (bp), the camera (pc), the object (s), exit and anchor points (A, B)"
)
"""What the limits' names mean."""

HEIGHT = {"high": "height"}
"""All heights of one combination are the same here."""


def range_tables(runs: Runs) -> list[Table]:
    """A table for every section."""
    tables = []
    for section, mine in sorted(runs.by("section"), key=lambda one: SECTIONS.index(one[0])):
        if section == SPATIAL_VISION:
            if mine.has(group="place"):
                tables.append(_objects(mine(group="place")))
            mine = Runs([run for run in mine if run["group"] != "place"], mine.planned)
        if len(mine):
            tables.append(_rows(section, mine))
    return tables


def _rows(section: str, runs: Runs) -> Table:
    def answers_of(run: Run) -> dict[str, float]:
        return {name.rpartition("_")[0]: value for name, value in run.measured.items()}

    answers = list(dict.fromkeys(name for run in runs for name in answers_of(run)))
    published = ("published",) if section in (SINGLE, PLANAR_VISION) else ()
    full = section in (PLANAR_ROBOT, SPATIAL_CAMERA, SPATIAL_ROBOT)
    others = ("other limits",) if full else ()
    table = new_table(
        f"{section} [m, deg]", ("given", "largest", *others), (*published, *answers, "unit")
    )
    table.caption = NAMES if full else None
    for _, mine in runs.by("group"):
        same = _common(mine) if others else set()
        given = set().union(*(limits_of(run) for run in mine)) - same
        for number, run in enumerate(mine):
            unit, mine_answers = unit_of(column_of(run)), answers_of(run)
            form = ".3f" if unit == "m^3" else ".3g"
            cells = [f"{mine_answers[n]:{form}}" if n in mine_answers else "" for n in answers]
            known = ["".join(run.printed.values())] * len(published)
            words = ["" if number else _words(run, same)] * len(others)
            table.add_row(_words(run, given), run["sought"], *words, *known, *cells, unit)
        table.add_section()
    return table


def _common(runs: Runs) -> set[str]:
    """Names of limits that are the same in all of several rows."""
    first, *others = map(limits_of, runs)
    return {n for n in first if others and all(one.get(n) == first[n] for one in others)}


def _words(run: Run, names: set[str]) -> str:
    """Limits in words; what is not there is zero, and the lowest height is the highest."""
    limits = limits_of(run)
    shown = [n for n in [*limits, *sorted(names - set(limits))] if n in names and n != "low"]
    return ", ".join(f"{HEIGHT.get(n, n)} {limits.get(n, 0.0):g}" for n in shown)


def _objects(runs: Runs) -> Table:
    errors = list(runs.counts("d_theta_s_deg"))
    table = new_table(
        f"{SPATIAL_VISION}: largest error of the object's place [m]",
        ("theta up to [deg]",),
        [f"its error {error:g}" for error in errors],
    )
    for turn, some in runs.by("theta_u_deg"):
        limits = {run["d_theta_s_deg"]: found(run) for run in some}
        cells = [f"{limits[error]:.3f}" if error in limits else "" for error in errors]
        table.add_row(f"{turn:g}", *cells)
    return table
