"""`cdpr identify`: finds a robot's dynamics in a log of a motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_drake.analyses.calibration.free_motion_model import ASKED_GROUPS, FREE_GROUPS
from cdpr_drake.analyses.calibration.identification_campaign import CAMPAIGN_UNKNOWN
from cdpr_drake.analyses.calibration.identification_task import UNKNOWN
from cdpr_drake.analyses.front.calibration import identify as run_identification
from cdpr_drake.analyses.front.free_motion import identify_free_motion
from cdpr_drake.analyses.front.simulated_fits import identify_in_simulation
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
from cdpr_drake.identification.parameters import GROUPS
from cdpr_drake.identification.result import MISFIT_FACTOR
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario

HALVES = "halves"
"""Of --free: the first half of the log is fitted, the second predicted."""

OPTIONS = {
    "unknown": "--unknown", "common": "--common", "priors": "--prior", "bandwidth": "--bandwidth",
    "sigma_lengths": "--sigma-lengths", "tracker_late": "--tracker-late", "scenario": "--campaign",
    "lead": "--lead", "held_out": "--hold-out", "start": "--start", "sigmas": "--sigma",
}  # fmt: skip
"""Options by the arguments of `identify`."""


def help_words() -> str:
    """What `cdpr identify --help` says above the options."""
    return (
        "Finds a robot's dynamics in a log of a motion.\n\n"
        "A row of LOG is an instant, as in the log.csv of cdpr simulate. Columns: time_s; the pose "
        "by a tracker, x_m, y_m, z_m with qw, qx, qy, qz or angles; C1_tension_n ...; for "
        "stiffness and damping what winches count, C1_length_m or C1_motor_angle_rad; for friction "
        "also C1_motor_torque_nm. Cables go by name or number, units by ending; of true and "
        "measured values the measured ones are read.\n\n"
        "--free is for a platform that swings on winches that stand still, such as one with fewer "
        "cables than degrees of freedom that was pushed: its whole motion is predicted. Columns: "
        "time_s; poses, or roll, pitch and yaw; C1_tension_n ..., without which the mass is not "
        "told. --hold-out stretches are predicted, and not fitted.\n\n"
        f"--unknown: {', '.join(GROUPS)}; with --free {', '.join(FREE_GROUPS)}, and where they are "
        f"named {', '.join(ASKED_GROUPS)}. Writes robot.yaml, which scenarios take as "
        "perturbations.believed_robot, identification.json and figures. The exit code is 2 where "
        f"the log cannot tell what is asked, 6 where residuals are more than {MISFIT_FACTOR:g} "
        "times what noise says: status misfit, with the largest by time and equation."
    )


def identify(
    robot: RobotOrCampaign = None,
    log: LogOrCampaign = None,
    validate: Annotated[
        Path | None,
        typer.Option(help="Log of another motion, to predict and not to fit."),
    ] = None,
    unknown: Annotated[
        str | None,
        typer.Option(
            help="Groups of parameters, with commas; else mass,center_of_mass,inertia, of a "
            "campaign also stiffness,friction,static_friction."
        ),
    ] = None,
    common: Annotated[
        str,
        typer.Option(help="Groups with one value for all cables or winches, separated by commas."),
    ] = "",
    prior: Annotated[
        str | None,
        typer.Option(help="Standard deviations known beforehand, as mass=0.1,inertia=0.01."),
    ] = None,
    bandwidth: Annotated[
        float | None,
        typer.Option(help="Bandwidth of the smoothing [Hz]; default 8, less for slow logs."),
    ] = None,
    sigma_lengths: Annotated[
        float,
        typer.Option(
            help="Standard deviation of the lengths that winches count, errors "
            "of the geometry included [m]."
        ),
    ] = 5e-5,
    pulleys: Annotated[
        bool, typer.Option("--pulleys/--no-pulleys", help="Whether cables run over pulleys.")
    ] = True,
    tracker_late: TrackerLate = None,
    campaign: Annotated[
        str | None,
        typer.Option(
            help="Scenario of dynamic control, instead of robot and log: its robot with an "
            "unknown payload follows the excitation that tells most, is identified, and "
            "follows the scenario's own motion again."
        ),
    ] = None,
    free: Annotated[
        str | None,
        typer.Option(help="Stretches of free motion to fit, as 44.6:49.2,32:36 [s], or halves."),
    ] = None,
    hold_out: Annotated[
        str | None,
        typer.Option(help="Stretches of free motion to predict and not to fit, as 20:24 [s]."),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(help="Pose about which the platform swings; default: it is searched for."),
    ] = None,
    lead: Annotated[
        float,
        typer.Option(
            help="First part of a held-out stretch, from which its initial state is estimated [s]."
        ),
    ] = 1.0,
    sigma: Annotated[
        str | None,
        typer.Option(
            help="Standard deviations in a free motion, as turn=0.0175,position=0.003,tension=5 "
            "[rad, m, N]."
        ),
    ] = None,
    tracker_frame: Annotated[
        bool,
        typer.Option(
            help="With --free: poses are measured in an unknown frame, which is identified too."
        ),
    ] = False,
    keep_outliers: Annotated[bool, typer.Option(help="Count every equation as it is.")] = False,
    out: ResultsBelowRuns = None,
    as_json: ResultsAsJson = False,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
) -> int:
    """Finds a robot's dynamics in a log of a motion."""
    kept: dict[str, Any] = {"overwrite": overwrite, "formats": parse_formats(figure_format)}
    asked = None if unknown is None else comma_words(unknown)
    if campaign is not None:
        check_campaign(robot, log)
        scenario = load_scenario(campaign)
        folder = results_below_runs(out, f"identify-{scenario.name}")
        session = CommandSession(STOPPING, folder)
        with named_options(OPTIONS):
            simulated = identify_in_simulation(
                scenario, CAMPAIGN_UNKNOWN if asked is None else asked, folder=folder,
                session=session, **kept,
            )  # fmt: skip
        return tell_fit(simulated, session, as_json)
    name, file = robot_and_log("identify", robot, log)
    loaded = load_robot(name, "cdpr identify")
    folder = results_below_runs(out, f"identify-{loaded.name}")
    session = CommandSession(STOPPING, folder)
    if free is not None:
        with named_options(OPTIONS):
            swung = identify_free_motion(
                loaded, file, asked, stretches=_spans("--free", free),
                held_out=_spans("--hold-out", hold_out), lead=lead, folder=folder,
                start=None if start is None else parse_pose(start, "--start"),
                sigmas=named_values("--sigma", sigma), priors=named_values("--prior", prior),
                tracker=tracker_frame, session=session,
                **kept,
            )  # fmt: skip
        return tell_fit(swung, session, as_json)
    with named_options(OPTIONS):
        found = run_identification(
            loaded, file, UNKNOWN if asked is None else asked, validate=validate,
            tracker_late=tracker_late, folder=folder, session=session, common=comma_words(common),
            priors=named_values("--prior", prior), bandwidth=bandwidth,
            sigma_lengths=sigma_lengths, pulleys=pulleys, outliers=not keep_outliers, **kept,
        )  # fmt: skip
    return tell_fit(found, session, as_json)


def _spans(option: str, words: str | None) -> tuple[tuple[float, float], ...]:
    """Stretches of a log, from first:last with commas.

    Raises:
        CdprError: One is not so.
    """
    if words is None or (option == "--free" and words == HALVES):
        return ()
    found = []
    for item in comma_words(words):
        parts = item.split(":")
        try:
            first, last = (float(part) for part in parts)
        except ValueError:
            first = last = 0.0
        if not -1e12 < first < last < 1e12:
            raise CdprError(
                f"{option}: found {item!r}; accepted: first:last, the first below the last, as "
                "20:24.5 [s]"
            )
        found.append((first, last))
    return tuple(found)
