"""`cdpr identify`: finds a robot's dynamics in a log of a motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cdpr_drake.analyses.calibration.free_motion_model import ASKED_GROUPS, FREE_GROUPS
from cdpr_drake.analyses.calibration.identification_campaign import CAMPAIGN_UNKNOWN
from cdpr_drake.analyses.calibration.identification_task import UNKNOWN
from cdpr_drake.analyses.frame.words import (
    Formats,
    OutFolder,
    PoseWord,
    RobotWord,
    comma_words,
    named_values,
    words,
)
from cdpr_drake.analyses.front.calibration import identify as run_identification
from cdpr_drake.analyses.front.free_motion import identify_free_motion
from cdpr_drake.analyses.front.simulated_fits import identify_in_simulation
from cdpr_drake.cli.log_options import check_campaign, fit_answer, results_below_runs, robot_and_log
from cdpr_drake.cli.option_names import named_options
from cdpr_drake.cli.sessions import Answer, fit_session, refuse
from cdpr_drake.identification.parameters import GROUPS
from cdpr_drake.identification.result import MISFIT_FACTOR
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario

HALVES = "halves"
"""Of --free: the first half of the log is fitted, the second predicted."""

FARTHEST = 1e12
"""Largest time of a log [s]."""


def _spans(word: str) -> tuple[tuple[float, float], ...]:
    """Stretches of a log, of first:last with commas."""
    spans = []
    for item in filter(None, map(str.strip, word.split(","))):
        first, last = map(float, item.split(":"))
        if not -FARTHEST < first < last < FARTHEST:
            raise ValueError(word)
        spans.append((first, last))
    return tuple(spans)


STRETCHES = "first:last, the first below the last, as 20:24.5 [s], or several with commas"
Spans = Annotated[Any, words(_spans, STRETCHES, "FIRST:LAST,...")]
Halves = Annotated[
    Any,
    words(lambda word: () if word == HALVES else _spans(word), f"{STRETCHES}, or halves",
          "FIRST:LAST,...|halves"),
]  # fmt: skip
Values = dict[str, float] | None


def identify(
    robot: RobotWord = None, log: Path | None = None, /, *, validate: Path | None = None,
    unknown: Annotated[Any, comma_words()] = None, common: Annotated[Any, comma_words()] = (),
    priors: Annotated[Values, named_values(name="--prior")] = None,
    bandwidth: float | None = None, sigma_lengths: float = 5e-5, pulleys: bool = True,
    tracker_late: float | None = None, campaign: str | None = None, free: Halves = None,
    hold_out: Spans = None, start: PoseWord = None, lead: float = 1.0,
    sigmas: Annotated[Values, named_values(name="--sigma")] = None, tracker_frame: bool = False,
    keep_outliers: bool = False, out: OutFolder = None, overwrite: bool = False,
    formats: Formats = ("png",),
) -> Answer:  # fmt: skip
    """Finds a robot's dynamics in a log of a motion.

    A row of LOG is an instant, as in the log.csv of cdpr simulate. Columns: time_s; the pose by a
    tracker, x_m, y_m, z_m with qw, qx, qy, qz or angles; C1_tension_n ...; for stiffness and
    damping what winches count, C1_length_m or C1_motor_angle_rad; for friction also
    C1_motor_torque_nm. Cables go by name or number, units by ending; of true and measured values
    the measured ones are read.

    --free is for a platform that swings on winches that stand still, such as one with fewer cables
    than degrees of freedom that was pushed: its whole motion is predicted. Columns: time_s; poses,
    or roll, pitch and yaw; C1_tension_n ..., without which the mass is not told. --hold-out
    stretches are predicted, and not fitted.

    --unknown: GROUPS; with --free FREE, and where they are named ASKED. Writes robot.yaml, which
    scenarios take as perturbations.believed_robot, identification.json and figures. The exit code
    is 2 where the log cannot tell what is asked, 6 where residuals are more than FACTOR times what
    noise says: status misfit, with the largest by time and equation.

    Args:
        robot: Robot by name, or path of a robot file.
        log: Log, text with columns.
        validate: Log of another motion, to predict and not to fit.
        unknown: Groups of parameters, with commas; else mass,center_of_mass,inertia, of a campaign
            also stiffness,friction,static_friction.
        common: Groups with one value for all cables or winches, separated by commas.
        priors: Standard deviations known beforehand, as mass=0.1,inertia=0.01.
        bandwidth: Bandwidth of the smoothing [Hz]; default: 8, less for slow logs.
        sigma_lengths: Standard deviation of the lengths that winches count, errors of the geometry
            included [m].
        pulleys: Cables run over pulleys.
        tracker_late: By how much the tracker's poses are late [s].
        campaign: Scenario of dynamic control, instead of robot and log: its robot with an unknown
            payload follows the excitation that tells most, is identified, and follows the
            scenario's own motion again.
        free: Stretches of free motion to fit, as 44.6:49.2,32:36 [s], or halves.
        hold_out: Stretches of free motion to predict and not to fit, as 20:24 [s].
        start: With --free: pose about which the platform swings; default: it is searched for.
        lead: With --free: first part of a held-out stretch, from which its initial state is
            estimated [s].
        sigmas: Standard deviations in a free motion, as turn=0.0175,position=0.003,tension=5 [rad,
            m, N].
        tracker_frame: With --free: poses are measured in an unknown frame, which is identified too.
        keep_outliers: Count every equation as it is.
        out: Results folder; default: a new one below runs/.
        overwrite: Replace results in the folder.
        formats: Files of each figure: png, pdf, svg, or several, as png,pdf.
    """
    values = dict(locals())
    output: dict[str, Any] = {"overwrite": overwrite, "formats": formats}
    if campaign is not None:
        check_campaign(robot, log)
        refuse(identify, values, "with --campaign; accepted: with a log",
               accepted=("campaign", "unknown", "out", *output))  # fmt: skip
        scenario = load_scenario(campaign)
        folder = results_below_runs(out, f"identify-{scenario.name}")
        session = fit_session()
        with named_options({"scenario": "--campaign"}):
            simulated = identify_in_simulation(
                scenario, CAMPAIGN_UNKNOWN if unknown is None else unknown, folder=folder,
                session=session, **output,
            )  # fmt: skip
        return fit_answer(simulated, session)
    name, file = robot_and_log("identify", robot, log)
    loaded = load_robot(name, "cdpr identify")
    folder = results_below_runs(out, f"identify-{loaded.name}")
    session = fit_session()
    of_swing = ("hold_out", "start", "lead", "sigmas", "tracker_frame")
    if free is not None:
        refuse(identify, values, "with --free; accepted: without it",
               accepted=("robot", "log", "free", "unknown", "priors", "out", *of_swing,
                         *output))  # fmt: skip
        swing = identify_free_motion(
            loaded, file, unknown, stretches=free, held_out=hold_out or (), lead=lead,
            folder=folder, start=start, sigmas=sigmas or {}, priors=priors or {},
            tracker=tracker_frame, session=session, **output,
        )  # fmt: skip
        return fit_answer(swing, session)
    refuse(identify, values, "without --free; accepted: with it", names=of_swing)
    identification = run_identification(
        loaded, file, UNKNOWN if unknown is None else unknown, validate=validate,
        tracker_late=tracker_late, folder=folder, session=session, common=common,
        priors=priors or {}, bandwidth=bandwidth, sigma_lengths=sigma_lengths, pulleys=pulleys,
        outliers=not keep_outliers, **output,
    )  # fmt: skip
    return fit_answer(identification, session)


identify.__doc__ = (
    (identify.__doc__ or "").replace("GROUPS", ", ".join(GROUPS))
    .replace("FREE", ", ".join(FREE_GROUPS)).replace("ASKED", ", ".join(ASKED_GROUPS))
    .replace("FACTOR", f"{MISFIT_FACTOR:g}")
)  # fmt: skip
