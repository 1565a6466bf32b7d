"""Calibration and identification shown in simulation, with the robot of a scenario."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cdpr_drake.analyses.calibration.identification_campaign import (
    CAMPAIGN_UNKNOWN,
    DynamicCampaign,
    run_dynamic_campaign,
)
from cdpr_drake.analyses.calibration.identification_campaign_files import write_dynamic_campaign
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.front.fitted_robots import FittedRobot, Keeping, kept_fit
from cdpr_drake.analyses.front.session import Say, Session
from cdpr_drake.errors import ScenarioError
from cdpr_drake.summaries import as_kind
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario


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
    return load_scenario(str(scenario)) if isinstance(scenario, str | Path) else scenario


def _refused(scenario: Any, accepted: str) -> ScenarioError:
    return ScenarioError(
        f"scenario: found {scenario.name}, a {scenario.kind}; accepted: {accepted}"
    )
