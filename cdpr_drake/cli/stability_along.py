"""`cdpr stability --along`: the stability criterion along a run that was made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from rich.table import Table

from cdpr_drake.analyses.runs import stability_of_folder
from cdpr_drake.cli.endings import say_failed
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
from cdpr_drake.errors import CdprError, OutputFolderError


def show_stability_along(
    run: Path, threshold: float | None, out: Path | None, formats: Sequence[str], as_json: bool
) -> int:
    """Judges a run's log; writes and prints what was found.

    Args:
        run: Folder of the run.
        threshold: Tension from which a cable counts as taut [N]; None: one that is not slack.
        out: Where to write; None: into the run's folder.
        formats: Of the figure.
        as_json: Whether to print JSON.
    """
    if threshold is not None and not (math.isfinite(threshold) and threshold >= 0.0):
        raise CdprError(f"--threshold: found {threshold:g}; accepted: >= 0 [N]")
    folder = run if out is None else out
    with working(message_console(), f"{run}: reading the log") as say:
        found = stability_of_folder(run, threshold)
        say("Writing results")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            failed = found.write(folder, formats)
        except OSError as problem:
            raise OutputFolderError(f"{folder}: cannot be written: {problem}") from problem
    numbers = found.as_dict()
    code = say_failed(message_console(), failed, folder, None)
    if as_json:
        print_json(numbers)
        return code
    margin, taut = numbers["least_stability_margin"], numbers["taut_cables"]
    table = Table(title=f"{run}: stability along the run", show_header=False)
    for label, words in (
        ("cables that pull", f"at least {taut['min']}, {taut['end']} at the end"),
        ("rank of the Jacobian", f"at least {numbers['least_jacobian_rank']}"),
        ("rank below " + str(numbers["freedom"]), f"{numbers['underactuated_s']:.2f} s"),
        ("least eigenvalue of sym(Pi)", "unknown" if margin is None else f"{margin:.3f}"),
        ("not stable", f"{numbers['unstable_s']:.2f} s"),
        ("results", str(folder)),
    ):
        table.add_row(label, words)
    wide_console().print(table)
    return code
