"""`cdpr identify`: finds a robot's dynamics in a log of a motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cdpr_drake.analyses.calibration.identification_campaign import CAMPAIGN_UNKNOWN
from cdpr_drake.analyses.calibration.identification_task import UNKNOWN
from cdpr_drake.analyses.frame.words import (
    Formats,
    OutFolder,
    RobotWord,
    comma_words,
    named_values,
)
from cdpr_drake.analyses.front.calibration import identify as run_identification
from cdpr_drake.analyses.front.simulated_fits import identify_in_simulation
from cdpr_drake.cli.log_options import check_campaign, fit_answer, results_below_runs, robot_and_log
from cdpr_drake.cli.option_names import named_options
from cdpr_drake.cli.sessions import Answer, fit_session, refuse
from cdpr_drake.identification.parameters import GROUPS
from cdpr_drake.identification.result import MISFIT_FACTOR
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario

Values = dict[str, float] | None


def identify(
    robot: RobotWord = None, log: Path | None = None, /, *, validate: Path | None = None,
    unknown: Annotated[Any, comma_words()] = None, common: Annotated[Any, comma_words()] = (),
    priors: Annotated[Values, named_values(name="--prior")] = None,
    bandwidth: float | None = None, sigma_lengths: float = 5e-5, pulleys: bool = True,
    tracker_late: float | None = None, campaign: str | None = None,
    keep_outliers: bool = False, out: OutFolder = None, overwrite: bool = False,
    formats: Formats = ("png",),
) -> Answer:  # fmt: skip
    """Finds a robot's dynamics in a log of a motion.

    A row of LOG is an instant, as in the log.csv of cdpr simulate. Columns: time_s; the pose by a
    tracker, x_m, y_m, z_m with qw, qx, qy, qz or angles; C1_tension_n ...; for stiffness and
    damping what winches count, C1_length_m or C1_motor_angle_rad; for friction also
    C1_motor_torque_nm. Cables go by name or number, units by ending; of true and measured values
    the measured ones are read.

    --unknown: GROUPS. Writes robot.yaml, which scenarios take as perturbations.believed_robot,
    identification.json and figures. The exit code is 2 where the log cannot tell what is asked, 6
    where residuals are more than FACTOR times what noise says: status misfit, with the largest by
    time and equation.

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
    identification = run_identification(
        loaded, file, UNKNOWN if unknown is None else unknown, validate=validate,
        tracker_late=tracker_late, folder=folder, session=session, common=common,
        priors=priors or {}, bandwidth=bandwidth, sigma_lengths=sigma_lengths, pulleys=pulleys,
        outliers=not keep_outliers, **output,
    )  # fmt: skip
    return fit_answer(identification, session)


identify.__doc__ = (
    (identify.__doc__ or "").replace("GROUPS", ", ".join(GROUPS))
    .replace("FACTOR", f"{MISFIT_FACTOR:g}")
)  # fmt: skip
