"""The kinds of scenarios that `cdpr simulate` runs: how each is read, run, written and shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from matplotlib.figure import Figure
from pydrake.geometry import Meshcat

from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.reporting.log_files import LogNames
from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.analyses.reporting.provenance import write_run_inputs
from cdpr_drake.analyses.simulation.mechanism_figures import (
    mechanism_error_figure,
    mechanism_pictures,
)
from cdpr_drake.analyses.simulation.mechanism_run import (
    check_mechanism_run,
    mechanism_end_error,
    mechanism_facts,
    mechanism_log_names,
    run_mechanism_scenario,
    summarize_mechanism_run,
    unfinished_mechanism_run,
    write_mechanism_data,
    write_mechanism_inputs,
)
from cdpr_drake.analyses.simulation.pick_and_place_figures import (
    live_view,
    phase_figure,
    pick_and_place_pictures,
    placed_log_names,
    write_pick_and_place_data,
)
from cdpr_drake.analyses.simulation.pick_and_place_run import (
    run_pick_and_place,
    unfinished_pick_and_place,
)
from cdpr_drake.analyses.simulation.pick_and_place_summary import (
    pick_and_place_facts,
    placed_error,
    summarize_pick_and_place,
)
from cdpr_drake.analyses.simulation.run_figures import error_figure as servo_error_figure
from cdpr_drake.analyses.simulation.run_files import run_pictures, servo_log_names, write_run_data
from cdpr_drake.analyses.simulation.run_summary import final_errors, summarize
from cdpr_drake.analyses.simulation.session import DEFAULT_SESSION, RunSession
from cdpr_drake.analyses.simulation.start_checks import (
    check_length,
    check_start,
    contact_warnings,
    goal_warnings,
    limit_warnings,
    servo_limit_warnings,
    sheave_warnings,
    step_warnings,
)
from cdpr_drake.analyses.simulation.tension_control_run import error_figure as tension_error_figure
from cdpr_drake.analyses.simulation.tension_control_run import (
    make_control,
    run_tension_scenario,
    summarize_tension_run,
    tension_end_error,
    tension_log_names,
    tension_pictures,
    unfinished_tension_run,
    write_tension_data,
)
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario, unfinished_run
from cdpr_drake.analyses.simulation.worlds import world_facts
from cdpr_drake.analyses.visualization.live_view import Prepare, live_servo, live_tension_control
from cdpr_drake.models.rendered_camera import probe_rendering
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.cameras.camera_settings import RENDERED
from cdpr_drake.systems.diagrams.calibration_findings import calibration_facts
from cdpr_drake.systems.diagrams.servo_models import LoopServo
from cdpr_drake.systems.diagrams.torque_control import loop_warnings
from cdpr_drake.systems.diagrams.visual_servo import VisualServo, build_visual_servo
from cdpr_drake.systems.loops.loop_choice import check_loop, uses_compiled_loop
from cdpr_drake.systems.loops.servo_loop import ServoLoop
from cdpr_drake.systems.pick_and_place.pick_and_place import build_pick_and_place
from cdpr_drake.systems.remote.remote_place import DISTRIBUTOR
from cdpr_drake.systems.robots.settings import model_words
from cdpr_drake.systems.scenarios.files import (
    MECHANISM,
    PICK_AND_PLACE,
    TENSION_CONTROL,
    VISUAL_SERVO,
)
from cdpr_drake.systems.scenarios.pick_and_place_scenario import PickAndPlaceScenario
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario


class Run(Protocol):
    """Simulates a scenario, see `run_scenario`."""

    def __call__(self, scenario: Any, session: RunSession = DEFAULT_SESSION) -> Any:
        """Returns the result."""


@dataclass(frozen=True)
class ScenarioKind:
    """One kind of scenario.

    Attributes:
        has_camera: Whether it has a camera, to be chosen.
        is_servo: Whether it is a visual servo, which can be filmed and repeated over seeds.
        check: Builds it and throws it away, to find what is wrong before anything is simulated;
            returns warnings.
        run: Simulates it, with a folder to be made where the log grows; what comes last gets
            simulator and diagram before they start.
        unfinished: The result of a run whose program ended before, from scenario and log.
        live: Makes what lets Meshcat follow a run, for `run`; None: nothing does.
        inputs: Writes robot or mechanism, and scenario, as they are run, into an existing folder.
        numbers: The summary of a result, for JSON.
        log_names: Names for the columns of a result's log.
        data: Writes the data of a result into a folder; returns the summary.
        pictures: What draws it, with a film if asked, its figures in the formats given.
        figure: The figure of a result that says most of it.
        facts: Label and words for the table at the end, from the summary.
        end_error: True distance [m] and angle [rad] that a result ends with, of which a scenario
            says how large it expects them, see `ExpectedEnd`.
    """

    has_camera: bool
    is_servo: bool
    check: Callable[[Any], list[str]]
    run: Run
    unfinished: Callable[[Any, Log], Any]
    live: Callable[[Any, Meshcat], Prepare] | None
    inputs: Callable[[Path, Any], None]
    numbers: Callable[[Any], dict[str, Any]]
    log_names: Callable[[Any], LogNames]
    data: Callable[[Path, Any], dict[str, Any]]
    pictures: Callable[[Any, bool, Sequence[str]], Pictures]
    figure: Callable[[Any], Figure]
    facts: Callable[[dict[str, Any]], list[tuple[str, str]]]
    end_error: Callable[[Any], tuple[float, float]]


def _check_servo(scenario: Scenario) -> list[str]:
    if scenario.camera.kind == RENDERED or scenario.sensors.depth is not None:
        probe_rendering()
    servo: VisualServo | LoopServo
    if uses_compiled_loop(scenario):
        servo = ServoLoop(check_loop(scenario)).servo()
    else:
        servo = build_visual_servo(scenario)
        servo.make_context()
    check_start(servo)
    check_length(scenario.name, scenario.duration, servo.max_step)
    loop = loop_warnings(scenario, servo.robot)
    steps = [*step_warnings(servo), *contact_warnings(scenario, servo.robot)]
    steps += [f"{scenario.name}: {w}" for w in servo_limit_warnings(scenario, servo.robot)]
    return [*steps, *loop, *sheave_warnings(scenario, servo.robot), *goal_warnings(servo)]


def _check_tension(scenario: TensionScenario) -> list[str]:
    control = make_control(scenario)
    control.make_context()
    check_length(scenario.name, scenario.duration, scenario.integration.max_step)
    limits = limit_warnings("distribution.limits", scenario.distribution.limits, control.robot)
    return [
        *contact_warnings(scenario, control.robot), *sheave_warnings(scenario, control.robot),
        *(f"{scenario.name}: {words}" for words in limits),
    ]  # fmt: skip


def _check_pick_and_place(scenario: PickAndPlaceScenario) -> list[str]:
    if scenario.camera.kind == RENDERED:
        probe_rendering()
    built = build_pick_and_place(scenario)
    built.make_context()
    check_length(scenario.name, scenario.duration, built.max_step)
    return []


def _robot_inputs(folder: Path, scenario: Any) -> None:
    write_run_inputs(folder, scenario, load_robot(scenario.robot))


def _servo_facts(summary: dict[str, Any]) -> list[tuple[str, str]]:
    def error(kind: str) -> str:
        distance, angle = summary[f"{kind}_error_m"], summary[f"{kind}_error_rad"]
        return f"{1e3 * distance:.3f} mm, {np.degrees(angle):.3f} deg"

    final = summary["final_position_error_m"], summary["final_rotation_error_rad"]
    deviation, camera = summary["image_deviation_px"]["max"], summary["camera_deviation_m"]["max"]
    image = "target never found" if deviation is None else f"{deviation:.2f} px in the image"
    line = "the target moves" if camera is None else f"{image}, {1e3 * camera:.1f} mm in space"
    tension = summary["tension_n"]
    plan, turn = summary["plan_deviation_m"]["max"], summary["plan_deviation_rad"]["max"]
    way = ("from the straight line", line)
    if plan is not None:
        way = ("from the plan", f"{1e3 * plan:.2f} mm, {np.degrees(turn):.3f} deg")
    facts = [
        ("model", model_words(summary["simulated"])),
        ("final error", f"{1e3 * final[0]:.3f} mm, {np.degrees(final[1]):.3f} deg"),
        ("pose estimate, error", error("final_pose_estimate")),
        way,
        (
            "tensions",
            f"{tension['min']:.2f} to {tension['max']:.2f} N, "
            f"{summary['slack_cable_seconds']:.1f} cable seconds slack",
        ),
    ]
    images = summary["images"]
    if images is not None:
        facts.append(("images", f"{images['taken']}, of which {images['whole']} whole"))
    facts += [*calibration_facts(summary["calibration"]), *world_facts(summary)]
    torque = summary["torque_control"]
    if torque is not None:
        when, off = torque["taut_after_s"], torque["largest_excess_n"]
        words = "never all taut" if when is None else f"all taut after {when:.2f} s"
        if off is not None:
            limits = "within the limits" if off == 0.0 else f"{off:.2f} N beyond the limits"
            words += f", from then on {limits}"
        share = 100.0 * torque["relaxed_share"]
        facts.append(("by torque", f"{words}; wrench infeasible in {share:.1f} % of steps"))
    return facts


def _tension_facts(summary: dict[str, Any]) -> list[tuple[str, str]]:
    position, rotation = summary["position_error_m"], summary["rotation_error_rad"]
    tension, remote = summary["tension_n"], summary.get("remote")
    by = "the client" if remote and remote["place"] == DISTRIBUTOR else summary["method"]
    none = tension["min"] is None  # the run ended before the first control step
    told = "none yet" if none else f"{tension['min']:.2f} to {tension['max']:.2f} N"
    return [
        ("model", model_words(summary["simulated"])),
        (
            "largest error",
            f"{1e3 * position['max']:.4f} mm, {np.degrees(rotation['max']):.5f} deg",
        ),
        ("tensions", f"{told} by {by}"),
        ("infeasible steps", str(summary["infeasible_steps"])),
        *world_facts(summary),
    ]


SCENARIO_KINDS: dict[str, ScenarioKind] = {
    VISUAL_SERVO: ScenarioKind(
        has_camera=True,
        is_servo=True,
        check=_check_servo,
        run=run_scenario,
        unfinished=unfinished_run,
        live=live_servo,
        inputs=_robot_inputs,
        numbers=summarize,
        log_names=servo_log_names,
        data=write_run_data,
        pictures=run_pictures,
        figure=servo_error_figure,
        facts=_servo_facts,
        end_error=final_errors,
    ),
    TENSION_CONTROL: ScenarioKind(
        has_camera=False,
        is_servo=False,
        check=_check_tension,
        run=run_tension_scenario,
        unfinished=unfinished_tension_run,
        live=live_tension_control,
        inputs=_robot_inputs,
        numbers=summarize_tension_run,
        log_names=tension_log_names,
        data=write_tension_data,
        pictures=lambda run, video, formats: tension_pictures(run, formats),
        figure=tension_error_figure,
        facts=_tension_facts,
        end_error=tension_end_error,
    ),
    PICK_AND_PLACE: ScenarioKind(
        has_camera=True,
        is_servo=False,
        check=_check_pick_and_place,
        run=run_pick_and_place,
        unfinished=unfinished_pick_and_place,
        live=live_view,
        inputs=_robot_inputs,
        numbers=summarize_pick_and_place,
        log_names=placed_log_names,
        data=write_pick_and_place_data,
        pictures=lambda run, video, formats: pick_and_place_pictures(run, formats),
        figure=phase_figure,
        facts=pick_and_place_facts,
        end_error=placed_error,
    ),
    MECHANISM: ScenarioKind(
        has_camera=False,
        is_servo=False,
        check=check_mechanism_run,
        run=run_mechanism_scenario,
        unfinished=unfinished_mechanism_run,
        live=None,
        inputs=write_mechanism_inputs,
        numbers=summarize_mechanism_run,
        log_names=mechanism_log_names,
        data=write_mechanism_data,
        pictures=lambda run, video, formats: mechanism_pictures(run, formats),
        figure=mechanism_error_figure,
        facts=mechanism_facts,
        end_error=mechanism_end_error,
    ),
}
"""By the name that a scenario file gives as `kind`."""
