"""Calibration and identification shown in simulation, with the robot of a scenario."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cdpr_drake.analyses.calibration.calibration_campaign import (
    Campaign,
    calibrated_scenario,
    run_campaign,
    servo_again,
)
from cdpr_drake.analyses.calibration.calibration_report import calibration_fit
from cdpr_drake.analyses.calibration.identification_campaign import (
    CAMPAIGN_UNKNOWN,
    DynamicCampaign,
    run_dynamic_campaign,
)
from cdpr_drake.analyses.calibration.identification_campaign_files import write_dynamic_campaign
from cdpr_drake.analyses.calibration.log_fit import ROBOT
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.front.calibration import proposed_poses
from cdpr_drake.analyses.front.fitted_robots import FittedRobot, Keeping, kept_fit
from cdpr_drake.analyses.front.session import Say, Session
from cdpr_drake.analyses.planning.path_files import path_poses
from cdpr_drake.analyses.reporting.provenance import BELIEVED_FILE, write_run_inputs
from cdpr_drake.analyses.reporting.tables import new_table
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.summaries import as_kind
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

POSES = 30
"""Poses to go to where nobody says."""


@dataclass(frozen=True, eq=False, repr=False)
class SimulatedCalibration(FittedRobot, Campaign):
    """A `Campaign`, and how the servo ends with what it found.

    Attributes:
        servo: By what is believed in, the outcome, its time [s], and the largest distance of the
            camera from the straight line [m].
    """

    servo: Mapping[str, Mapping[str, float | str]]

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        errors, result = self.errors(), self.calibration.result
        rows = [
            (
                f"{points.replace('_', ' ')}s",
                f"{1e3 * errors[f'{points}s_before_m']:.3g} mm off before, "
                f"{1e3 * errors[f'{points}s_after_m']:.3g} mm after",
            )
            for points in ("exit_point", "anchor_point")
        ]
        return f"Calibration of {self.scenario.name} in simulation: {result.status}", [
            ("poses", f"{len(self.poses)}"),
            *rows,
            *(
                (f"servo, {who}", f"{row['outcome']}, {1e3 * float(row['off_line_m']):.3g} mm off")
                for who, row in self.servo.items()
            ),
            *(("remark", words) for words in self.remarks[:1]),
        ]


@dataclass(frozen=True, eq=False, repr=False)
class SimulatedIdentification(FittedRobot, DynamicCampaign):
    """A `DynamicCampaign`, and what it left."""

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        result = self.identification.result
        return f"Identification of {self.scenario.name} in simulation: {result.status}", [
            ("residuals", f"{result.spread:.3g} times what sigmas say, {result.degrees} degrees"),
            *(
                (
                    f"tracking, {who}",
                    f"{1e3 * row['mean_m']:.3g} mm in the mean, {1e3 * row['largest_m']:.3g} mm",
                )
                for who, row in self.tracking.items()
            ),
        ]


@verb()
def calibrate_in_simulation(
    scenario: Scenario | str | Path,
    poses: int | Path | str | Sequence[object] = POSES,
    *,
    propose: int | None = None,
    folder: Path | str | None = None,
    overwrite: bool = False,
    formats: Sequence[str] = DEFAULT_FORMATS,
    session: Session | None = None,
) -> SimulatedCalibration:
    """The robot that a visual servo believes in wrongly goes to poses, and is calibrated there.

    Winches, tension sensors and the camera record where it rests; the servo then runs again with
    what was found.

    Args:
        scenario: A visual servo with the camera on the platform and tags in the world, or its name
            or path.
        poses: Number of poses, those expected to tell most; or where to go: a file or poses, as
            `plan_path` takes them [m].
        propose: Number of poses to propose that would tell most next; None: none.
        folder: Where results.json, the robot, the scenario that believes in it and figures are
            written; None: nowhere.
        overwrite: Whether results in the folder may be replaced.
        formats: Endings of the files of figures.
        session: Who follows it; None: nobody.

    Raises:
        ScenarioError: The scenario is unknown, or no visual servo.
        CalibrationError: Its camera or target is not accepted, or the robot rests at too few poses.
        OutputFolderError: The folder holds other things, or cannot be written.
    """
    loaded = _loaded(scenario)
    if not isinstance(loaded, Scenario):
        raise _refused(loaded, "a visual servo")
    count, goals = POSES, None
    if isinstance(poses, int):
        count = poses
    else:
        goals = path_poses(load_robot(loaded.robot), poses).poses

    def work(folder: Path | None, say: Say) -> SimulatedCalibration:
        # The servo reads the robot that was found from its file.
        with TemporaryDirectory() if folder is None else nullcontext(folder) as place:
            return _calibrated(run_campaign(loaded, count, say, goals), Path(place), propose, say)

    keeping = Keeping(folder, overwrite, formats)
    return kept_fit(keeping, session or Session(), f"Campaign of {loaded.name}", work)


def _calibrated(run: Campaign, folder: Path, propose: int | None, say: Say) -> SimulatedCalibration:
    """What a campaign found, written, with the servo that believes in it."""
    scenario, found = run.scenario, run.calibration
    calibration_fit(found).write(folder)
    servo = servo_again(run, str(folder / ROBOT), say)
    more, proposed = proposed_poses(found, propose, folder, say)
    told = {"campaign": run.errors() | {"remarks": list(run.remarks)}, "servo": servo}
    table = new_table(
        f"Servo {scenario.name}", ("robot believed in", "outcome"), ("off line [mm]",)
    )
    for who, row in servo.items():
        table.add_row(who, str(row["outcome"]), f"{1e3 * float(row['off_line_m']):.2f}")
    fit = calibration_fit(found, more | told, (*proposed, table))
    fit.write(folder)
    # As in every folder of a run: what is simulated, what is believed, and the scenario.
    believed = (folder / ROBOT).rename(folder / BELIEVED_FILE)
    write_run_inputs(folder, calibrated_scenario(run, str(believed)), load_robot(scenario.robot))
    return as_kind(SimulatedCalibration, run, fit=fit, servo=servo)


@verb()
def identify_in_simulation(
    scenario: TensionScenario | str | Path,
    unknown: str | Sequence[str] = CAMPAIGN_UNKNOWN,
    *,
    folder: Path | str | None = None,
    overwrite: bool = False,
    formats: Sequence[str] = DEFAULT_FORMATS,
    session: Session | None = None,
) -> SimulatedIdentification:
    """The robot of a scenario with an unknown payload follows an excitation, and is identified.

    It then follows the scenario's own motion with what was found.

    Args:
        scenario: Dynamic control of a robot whose winches have motors, or its name or path.
        unknown: Groups of `identification.parameters.GROUPS`.
        folder: Where identification.json, logs, robots, the excitation as a scenario and figures
            are written; None: nowhere.
        overwrite: Whether results in the folder may be replaced.
        formats: Endings of the files of figures.
        session: Who follows it; None: nobody.

    Raises:
        ScenarioError: The scenario is unknown, or of another kind.
        IdentificationError: The robot is of no such kind.
        RobotFileError: Its file does not say enough of the motors.
        OutputFolderError: The folder holds other things, or cannot be written.
    """
    loaded = _loaded(scenario)
    if not isinstance(loaded, TensionScenario):
        raise _refused(loaded, "a scenario of tension_control")
    groups = (unknown,) if isinstance(unknown, str) else tuple(unknown)

    def work(folder: Path | None, say: Say) -> SimulatedIdentification:
        run = run_dynamic_campaign(loaded, groups, say)
        with TemporaryDirectory() if folder is None else nullcontext(folder) as place:
            fit = write_dynamic_campaign(run, Path(place))
        return as_kind(SimulatedIdentification, run, fit=fit)

    keeping = Keeping(folder, overwrite, formats)
    return kept_fit(keeping, session or Session(), f"Campaign of {loaded.name}", work)


def _loaded(scenario: Any) -> Any:
    return load_scenario(scenario) if isinstance(scenario, str | Path) else scenario


def _refused(scenario: Any, accepted: str) -> ScenarioError:
    return ScenarioError(
        f"scenario: found {scenario.name}, a {scenario.kind}; accepted: {accepted}"
    )
