"""Tables of workspaces: volumes of the figures, shares of kinds."""

from __future__ import annotations

from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.summary import note_coarse
from cdpr_drake.analyses.studies.workspaces.items import ALL, ALL_BUT_CLOSURE, EVERY, FIGURE
from cdpr_drake.analyses.workspaces.conditions import OF_POSES


def figure_table(runs: Runs) -> Table:
    """Volumes of the static workspaces."""
    table = new_table(
        "Static feasible workspace (servoing thesis, figures 1.17 and 1.18), platform unturned",
        ("robot", "upper limit"),
        ("limits [N]", "volume [m^3]", "of the frame [%]", "points"),
    )
    table.caption = "The upper limit is not printed: the robot file's, half and twice of it."
    for run in runs(group=FIGURE):
        own = run["upper_share"] == 1.0
        table.add_row(
            run["robot"],
            "of the robot file" if own else f"{run['upper_share']:g} of that",
            f"{run['lower_limit_n']:g} to {run['upper_limit_n']:g}",
            f"{run['volume_m3']:.4g}",
            f"{100.0 * run['frame_share']:.1f}",
            " x ".join(map(str, run["points"])),
        )
    return note_coarse(table, runs, "volumes of the full form differ.")


def kind_table(runs: Runs) -> Table:
    """Shares of every kind."""
    kinds = runs(group=EVERY)
    table = new_table(
        "Share of the frame's poses where each kind holds [%]",
        ("kind",),
        kinds.list("robot"),
    )
    shares = kinds.list("pose_shares")
    for name in (*OF_POSES, ALL_BUT_CLOSURE, ALL):
        cells = [f"{100.0 * mine[name]:.1f}" if name in mine else "-" for mine in shares]
        table.add_row(name, *cells)
    left_out = [
        f"- {run['robot']}, {kind}: {why}" for run in kinds for kind, why in run["left_out"].items()
    ]
    table.caption = "\n".join(left_out) or None
    return note_coarse(table, runs, "shares of the full form differ.")
