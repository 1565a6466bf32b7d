"""What a campaign leaves: logs, robots, the excitation as a scenario, a table and a figure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydrake.common.yaml import yaml_dump_typed
from rich.table import Table

from cdpr_drake.analyses.calibration.identification_campaign import DynamicCampaign
from cdpr_drake.analyses.calibration.identification_report import identification_fit
from cdpr_drake.analyses.calibration.log_fit import ROBOT, LogFit
from cdpr_drake.analyses.frame.figures import bars, new_figure
from cdpr_drake.analyses.reporting.exported_logs import write_columns
from cdpr_drake.analyses.reporting.log_files import write_scenario, write_whole
from cdpr_drake.analyses.reporting.provenance import BELIEVED_FILE
from cdpr_drake.analyses.reporting.tables import new_table
from cdpr_drake.analyses.runs.log import column_names
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.systems.scenarios.tension_control_scenario import Stretch, TensionScenario
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

TRUE_FILE = "true_robot.yaml"
"""The robot as it is, in a campaign's folder."""


def write_dynamic_campaign(campaign: DynamicCampaign, folder: Path) -> LogFit:
    """Writes what its fit does, and logs, robots and scenario; what is told of it.

    `excitation.csv` and `validation.csv` are logs as `cdpr identify` reads them;
    `scenario.yaml` has the true robot follow the excitation, believed to be the one that was found.
    """
    fit = identification_fit(campaign.identification, campaign.as_dict(), campaign.truth)
    fit.write(folder)
    for name, robot in ((TRUE_FILE, campaign.true), (BELIEVED_FILE, campaign.believed)):
        write_whole(folder / name, yaml_dump_typed(robot))
    names = [cable.name for cable in campaign.true.cables]
    for name, log in campaign.logs.items():
        table = np.column_stack(list(log.values()))
        columns = dict(zip(column_names(log, {"cables": names}), table.T, strict=True))
        write_columns(folder / f"{name}.csv", columns)
    write_scenario(folder / "scenario.yaml", excitation_scenario(campaign))
    tracking: Callable[[], Figure] = partial(_tracking_figure, campaign)
    return replace(
        fit, tables=(*fit.tables, _tracking_table(campaign)),
        drawings={**fit.drawings, "tracking": tracking},
    )  # fmt: skip


def excitation_scenario(campaign: DynamicCampaign) -> TensionScenario:
    """The excitation as a scenario of the true robot, which is believed to be what was found."""
    motion = campaign.excitation.trajectory
    own = campaign.scenario
    return replace(
        own, name="excitation", title=f"Excitation for the robot of {own.name}",
        robot=TRUE_FILE, duration=motion.end_time + 0.2,
        trajectory=_settings(own, motion),
        perturbations=replace(own.perturbations, believed_robot=ROBOT),
    )  # fmt: skip


def _settings(scenario: TensionScenario, motion: PoseTrajectory) -> Any:
    """A motion through poses as the section of a scenario."""
    poses = [
        Pose(
            position=np.array(X.translation()),
            angles_deg=np.degrees(angles_from_rotation(X.rotation())),
        )
        for X in motion.poses
    ]
    stretches = [
        Stretch(pose=pose, duration=duration)
        for pose, duration in zip(poses[1:], motion.durations, strict=True)
    ]
    return replace(
        scenario.trajectory,
        start=poses[0],
        pause=motion.start_time,
        stretches=stretches,
        file=None,
    )


def _tracking_table(campaign: DynamicCampaign) -> Table:
    """How far the platform is from where it should be, by what is believed in."""
    table = new_table(
        f"Tracking of {campaign.scenario.name}, not fitted", ("robot believed in",),
        ("largest [mm]", "mean [mm]", "largest [deg]", "mean [deg]"),
    )  # fmt: skip
    for who, row in campaign.tracking.items():
        numbers = [1e3 * row["largest_m"], 1e3 * row["mean_m"]]
        numbers += [float(np.degrees(row[f"{which}_rad"])) for which in ("largest", "mean")]
        table.add_row(who, *(f"{value:.3f}" for value in numbers))
    return table


def _tracking_figure(campaign: DynamicCampaign) -> Figure:
    """Mean and largest errors of tracking, by what is believed in."""
    figure, axes = new_figure(
        1, 2, (12.0, 5.0), f"Tracking of {campaign.scenario.name}, a motion that was not fitted"
    )
    whos = list(campaign.tracking)
    for ax, (key, scale, words) in zip(
        axes, (("m", 1e3, "distance [mm]"), ("rad", 180.0 / np.pi, "angle [deg]")), strict=True
    ):
        heights = {
            which: [scale * campaign.tracking[who][f"{which}_{key}"] for who in whos]
            for which in ("mean", "largest")
        }
        bars(ax, whos, heights)
        ax.set_yscale("log")
        ax.set(ylabel=words, xlabel="robot believed in")
    axes[0].legend()
    return figure
