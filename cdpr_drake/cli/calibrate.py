"""`cdpr calibrate`: finds a robot's constants in a log of measurements."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import typer
from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.calibration_request import Sigmas
from cdpr_drake.analyses.front.calibration import calibrate as run_calibration
from cdpr_drake.analyses.front.simulated_fits import POSES, calibrate_in_simulation
from cdpr_drake.calibration.parameters import GROUPS
from cdpr_drake.cli.command_session import CommandSession
from cdpr_drake.cli.log_options import (
    STOPPING,
    LogOrCampaign,
    ResultsBelowRuns,
    RobotOrCampaign,
    TrackerLate,
    check_campaign,
    comma_words,
    results_below_runs,
    robot_and_log,
    tell_fit,
)
from cdpr_drake.cli.options import (
    FigureFormats,
    Overwrite,
    ResultsAsJson,
    named_options,
    named_values,
    parse_formats,
    parse_pose,
)
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.diagrams.load import load_scenario

OPTIONS = {
    "unknown": "--unknown", "priors": "--prior", "tags": "--tags", "tag_size": "--tag-size",
    "mount": "--mount", "image_size": "--image-size", "tracker_late": "--tracker-late",
    "zero": "--zero", "bounds": "--bound", "hold_out": "--hold-out",
}  # fmt: skip
"""Options by the arguments of `calibrate`."""

HOME = "home"
"""Of --zero: the robot's home pose."""


def help_words() -> str:
    """What `cdpr calibrate --help` says above the options."""
    return (
        "Finds a robot's constants in a log of what was measured at poses of its platform.\n\n"
        "A row of LOG is a pose. Columns: time_s; C1_length_m ... or C1_motor_angle_rad; x_m, y_m, "
        "z_m alone, or with qw, qx, qy, qz, or phi_deg, theta_deg, psi_deg, or rx_rad, ry_rad, "
        "rz_rad, or "
        "roll_deg, pitch_deg, yaw_deg, of a tracker; tag0_u1_px, tag0_v1_px to tag0_u4_px, "
        "tag0_v4_px, corners in the image of the camera on the platform; C1_tension_n; "
        "C1_swivel_rad; roll_deg, pitch_deg, yaw_deg without a position, of an inclinometer or IMU "
        "on the platform. Positions alone are of a tracker that tells no rotation. Cables go by "
        "name or number, units by ending, as mm, deg, ms, kn; empty "
        "cells were not measured; columns that are not used are named.\n\n"
        f"--unknown: {', '.join(GROUPS)}, or names such as C3.exit_point.z, also with \\* and ?. "
        "Tags without a place are unknown in any case. Writes robot.yaml, which scenarios take as "
        "perturbations.believed_robot, results.json and figures. The exit code is 2 where the log "
        "cannot tell what is asked, 6 where what was found does not fit what was measured: status "
        "misfit, with the reasons and the largest residuals."
    )


def calibrate(
    robot: RobotOrCampaign = None,
    log: LogOrCampaign = None,
    unknown: Annotated[
        str | None,
        typer.Option(
            help="Groups and names of parameters, with commas; else exit_points,anchor_points, of "
            "a point mass exit_points, of a robot with fewer cables than degrees of freedom and no "
            "tracker the zeros of its sensors."
        ),
    ] = None,
    prior: Annotated[
        str | None,
        typer.Option(help="Standard deviations known beforehand, as exit_points=0.01 [m, rad, -]."),
    ] = None,
    sigma: Annotated[
        str | None,
        typer.Option(
            help="Standard deviations of measurements, as lengths=0.001,corners=0.2: "
            + ", ".join(
                f.name + ("" if f.default is None else f" ({f.default:g})") for f in fields(Sigmas)
            )
            + " [m, rad, px, N, N m; shares -]."
        ),
    ] = None,
    tag_size: Annotated[float | None, typer.Option(help="Edge of all tags [m].")] = None,
    tags: Annotated[
        Path | None,
        typer.Option(
            help="Table of tags: tag, size_m; where known x_m ... psi_deg in W, sigma_m, sigma_deg."
        ),
    ] = None,
    mount: Annotated[
        str | None, typer.Option(help="Mounting of the camera; else the first on the platform.")
    ] = None,
    image_size: Annotated[
        str | None, typer.Option(help="Width x height of images [px], as 640x480.")
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(help="Approximate pose of the first row: x,y,z[,phi,theta,psi] [m, deg]."),
    ] = None,
    rest: Annotated[
        bool | None,
        typer.Option("--rest/--no-rest", help="Whether the platform rested in all rows."),
    ] = None,
    tracker_late: TrackerLate = None,
    zero: Annotated[
        str | None,
        typer.Option(
            help="Pose at which lengths or motor angles were zero: home, or "
            "x,y,z[,phi,theta,psi] [m, deg]; else they count from anywhere."
        ),
    ] = None,
    bound: Annotated[
        str | None,
        typer.Option(help="Largest change of parameters, as tracker.[xyz]=0.001 [m, rad, -]."),
    ] = None,
    hold_out: Annotated[
        str | None,
        typer.Option(
            help="Tracked rows to predict and not to fit: a number of rows, rows as "
            "100-160,200, or each, which repeats the calibration without each one of them."
        ),
    ] = None,
    keep_outliers: Annotated[bool, typer.Option(help="Count every measurement as it is.")] = False,
    campaign: Annotated[
        str | None,
        typer.Option(
            help="Scenario, instead of robot and log: its believed robot goes to the poses that "
            "tell most, is calibrated from what is recorded there, and servoes again."
        ),
    ] = None,
    poses: Annotated[int, typer.Option(help="Poses of a campaign.", min=6, max=200)] = POSES,
    poses_from: Annotated[
        Path | None,
        typer.Option(
            help="File of poses for a campaign, as of cdpr plan --path, such as next_poses.csv."
        ),
    ] = None,
    next_count: Annotated[
        int | None,
        typer.Option(
            "--next",
            min=1,
            max=200,
            metavar="N",
            help="Also propose the N poses that would tell most next, in next_poses.csv, which "
            "cdpr plan --path and --poses-from take.",
        ),
    ] = None,
    out: ResultsBelowRuns = None,
    as_json: ResultsAsJson = False,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
) -> int:
    """Finds a robot's constants in a log of what was measured at poses of its platform."""
    kept: dict[str, Any] = {
        "propose": next_count, "overwrite": overwrite, "formats": parse_formats(figure_format),
    }  # fmt: skip
    if campaign is not None:
        check_campaign(robot, log)
        scenario = load_scenario(campaign)
        folder = results_below_runs(out, f"campaign-{scenario.name}")
        session = CommandSession(STOPPING, folder)
        with named_options({"scenario": "--campaign"}):
            simulated = calibrate_in_simulation(
                scenario, poses_from or poses, folder=folder, session=session, **kept
            )
        return tell_fit(simulated, session, as_json)
    if poses_from is not None:
        raise CdprError("--poses-from: found without --campaign; accepted: with --campaign")
    name, file = robot_and_log("calibrate", robot, log)
    loaded = load_robot(name, "cdpr calibrate")
    folder = results_below_runs(out, f"calibrate-{loaded.name}")
    session = CommandSession(STOPPING, folder)
    with named_options(OPTIONS):
        found = run_calibration(
            loaded, file, None if unknown is None else comma_words(unknown),
            sigmas=named_values("--sigma", sigma, [f.name for f in fields(Sigmas)]), tags=tags,
            tag_size=tag_size, tracker_late=tracker_late, folder=folder, session=session,
            priors=named_values("--prior", prior), mount=mount, image_size=_size(image_size),
            start=None if start is None else parse_pose(start), rest=rest,
            outliers=not keep_outliers, zero=_zero(loaded, zero), hold_out=hold_out,
            bounds=named_values("--bound", bound), **kept,
        )  # fmt: skip
    return tell_fit(found, session, as_json)


def _zero(robot: Robot, words: str | None) -> RigidTransform | None:
    if words is None:
        return None
    return robot.home.transform() if words == HOME else parse_pose(words, "--zero")


def _size(words: str | None) -> tuple[int, int] | None:
    if words is None:
        return None
    parts = words.lower().split("x")
    if len(parts) != 2 or not all(p.strip().isdigit() and int(p) >= 16 for p in parts):
        raise CdprError(f"--image-size: found {words!r}; accepted: width x height, as 640x480 [px]")
    return int(parts[0]), int(parts[1])
