"""`cdpr calibrate`: finds a robot's constants in a log of measurements."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

from cdpr_drake.analyses.calibration.calibration_request import Sigmas
from cdpr_drake.analyses.frame.words import (
    Formats,
    OutFolder,
    PoseWord,
    RobotWord,
    comma_words,
    named_values,
    pose,
    whole,
    words,
)
from cdpr_drake.analyses.front.calibration import calibrate as run_calibration
from cdpr_drake.analyses.front.simulated_fits import POSES, calibrate_in_simulation
from cdpr_drake.calibration.parameters import GROUPS
from cdpr_drake.cli.calibrate_camera import whole_pair
from cdpr_drake.cli.log_options import check_campaign, fit_answer, results_below_runs, robot_and_log
from cdpr_drake.cli.option_names import named_options
from cdpr_drake.cli.sessions import Answer, fit_session, refuse
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario

HOME = "home"
"""Of --zero: the robot's home pose."""

LEAST_IMAGE = 16
"""Edge of an image [px]."""


def _image_size(word: str) -> tuple[int, int]:
    size = whole_pair(word)
    if min(size) < LEAST_IMAGE:
        raise ValueError(word)
    return size


Zero = Annotated[
    Any,
    words(lambda word: word if word == HOME else pose(word),
          "home, x,y,z [m] or x,y,z,phi,theta,psi [m, deg]", "home|X,Y,Z[,PHI,THETA,PSI]"),
]  # fmt: skip
ImageSize = Annotated[Any, words(_image_size, "width x height, as 640x480 [px]", "WIDTHxHEIGHT")]
Values = dict[str, float] | None


def calibrate(
    robot: RobotWord = None, log: Path | None = None, /, *,
    unknown: Annotated[Any, comma_words()] = None,
    priors: Annotated[Values, named_values(name="--prior")] = None,
    sigmas: Annotated[Values, named_values([f.name for f in fields(Sigmas)], "--sigma")] = None,
    tag_size: float | None = None, tags: Path | None = None, mount: str | None = None,
    image_size: ImageSize = None, start: PoseWord = None, rest: bool | None = None,
    tracker_late: float | None = None, zero: Zero = None,
    bounds: Annotated[Values, named_values(name="--bound")] = None, hold_out: str | None = None,
    keep_outliers: bool = False, campaign: str | None = None,
    poses: Annotated[int, whole(6, 200)] = POSES, poses_from: Path | None = None,
    propose: Annotated[int | None, whole(1, 200, "COUNT", "--next")] = None,
    out: OutFolder = None, overwrite: bool = False, formats: Formats = ("png",),
) -> Answer:  # fmt: skip
    """Finds a robot's constants in a log of what was measured at poses of its platform.

    A row of LOG is a pose. Columns: time_s; C1_length_m ... or C1_motor_angle_rad; x_m, y_m, z_m
    alone, or with qw, qx, qy, qz, or phi_deg, theta_deg, psi_deg, or rx_rad, ry_rad, rz_rad, or
    roll_deg, pitch_deg, yaw_deg, of a tracker; tag0_u1_px, tag0_v1_px to tag0_u4_px, tag0_v4_px,
    corners in the image of the camera on the platform; C1_tension_n; C1_swivel_rad; roll_deg,
    pitch_deg, yaw_deg without a position, of an inclinometer or IMU on the platform. Positions
    alone are of a tracker that tells no rotation. Cables go by name or number, units by ending, as
    mm, deg, ms, kn; empty cells were not measured; columns that are not used are named.

    --unknown: GROUPS, or names such as C3.exit_point.z, also with \\* and ?. Tags without a place
    are unknown in any case. Writes robot.yaml, which scenarios take as
    perturbations.believed_robot, results.json and figures. The exit code is 2 where the log cannot
    tell what is asked, 6 where what was found does not fit what was measured: status misfit, with
    the reasons and the largest residuals.

    Args:
        robot: Robot by name, or path of a robot file.
        log: Log, text with columns.
        unknown: Groups and names of parameters, with commas; else exit_points,anchor_points, of a
            point mass exit_points, of a robot with fewer cables than degrees of freedom and no
            tracker the zeros of its sensors.
        priors: Standard deviations known beforehand, as exit_points=0.01 [m, rad, -].
        sigmas: Standard deviations of measurements, as lengths=0.001,corners=0.2: SIGMAS [m, rad,
            px, N, N m; shares -].
        tag_size: Edge of all tags [m].
        tags: Table of tags: tag, size_m; where known x_m ... psi_deg in W, sigma_m, sigma_deg.
        mount: Mounting of the camera; else the first on the platform.
        image_size: Width x height of images [px], as 640x480.
        start: Approximate pose of the first row: x,y,z[,phi,theta,psi] [m, deg].
        rest: The platform rested in all rows, or did not; else the log tells. Of a log with times
            means over rows at rest are taken.
        tracker_late: By how much the tracker's poses are late [s].
        zero: Pose at which lengths or motor angles were zero: home, or x,y,z[,phi,theta,psi] [m,
            deg]; else they count from anywhere.
        bounds: Largest change of parameters, as tracker.[xyz]=0.001 [m, rad, -].
        hold_out: Tracked rows to predict and not to fit: a number of rows, rows as 100-160,200, or
            each, which repeats the calibration without each one of them.
        keep_outliers: Count every measurement as it is.
        campaign: Scenario, instead of robot and log: its believed robot goes to the poses that tell
            most, is calibrated from what is recorded there, and servoes again.
        poses: Poses of a campaign.
        poses_from: File of poses for a campaign, as of cdpr plan --path, such as next_poses.csv.
        propose: Also propose so many poses that would tell most next, in next_poses.csv, which cdpr
            plan --path and --poses-from take.
        out: Results folder; default: a new one below runs/.
        overwrite: Replace results in the folder.
        formats: Files of each figure: png, pdf, svg, or several, as png,pdf.
    """
    values = dict(locals())
    output: dict[str, Any] = {"propose": propose, "overwrite": overwrite, "formats": formats}
    of_campaign = ("campaign", "poses", "poses_from")
    if campaign is not None:
        check_campaign(robot, log)
        refuse(calibrate, values, "with --campaign; accepted: with a log",
               accepted=("out", *output, *of_campaign))  # fmt: skip
        scenario = load_scenario(campaign)
        folder = results_below_runs(out, f"campaign-{scenario.name}")
        session = fit_session()
        with named_options({"scenario": "--campaign"}):
            simulated = calibrate_in_simulation(
                scenario, poses_from or poses, folder=folder, session=session, **output
            )
        return fit_answer(simulated, session)
    refuse(calibrate, values, "without --campaign; accepted: with it", names=of_campaign)
    name, file = robot_and_log("calibrate", robot, log)
    loaded = load_robot(name, "cdpr calibrate")
    folder = results_below_runs(out, f"calibrate-{loaded.name}")
    session = fit_session()
    calibration = run_calibration(
        loaded, file, unknown, sigmas=sigmas or {}, tags=tags, tag_size=tag_size,
        tracker_late=tracker_late, folder=folder, session=session, priors=priors or {},
        mount=mount, image_size=image_size, start=start, rest=rest, outliers=not keep_outliers,
        zero=loaded.home.transform() if zero == HOME else zero, hold_out=hold_out,
        bounds=bounds or {}, **output,
    )  # fmt: skip
    return fit_answer(calibration, session)


_SIGMAS = ", ".join(
    f.name + ("" if f.default is None else f" ({f.default:g})") for f in fields(Sigmas)
)
calibrate.__doc__ = (
    (calibrate.__doc__ or "").replace("GROUPS", ", ".join(GROUPS)).replace("SIGMAS", _SIGMAS)
)
