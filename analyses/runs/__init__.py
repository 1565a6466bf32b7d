"""One run of a scenario: simulation, summary, figures, files."""

from cdpr_drake.analyses.runs.hardware_figures import motor_figure, reading_figure
from cdpr_drake.analyses.runs.perception_figures import looking_figures
from cdpr_drake.analyses.runs.run_stability import (
    StabilityAlong,
    stability_along,
    stability_at,
)
from cdpr_drake.analyses.runs.scenario_kinds import SCENARIO_KINDS, ScenarioKind
from cdpr_drake.analyses.runs.stability_files import (
    StabilityOfFolder,
    draw_steps,
    stability_figure,
    stability_of_folder,
)
from cdpr_drake.analyses.runs.summary import camera_path, image_path, summarize
from cdpr_drake.analyses.runs.tension_control_run import (
    TensionRun,
    make_control,
    run_tension_scenario,
)
from cdpr_drake.analyses.runs.traces import estimate_jump, run_traces
from cdpr_drake.analyses.runs.visual_servo_run import RunResult, run_scenario
from cdpr_drake.analyses.simulation import Connect, Progress, RunSession, advance, check_connected

__all__ = [
    "SCENARIO_KINDS", "Connect", "Progress", "RunResult", "RunSession", "ScenarioKind",
    "StabilityAlong", "StabilityOfFolder", "TensionRun", "advance", "camera_path",
    "check_connected", "draw_steps", "estimate_jump", "image_path", "looking_figures",
    "make_control", "motor_figure", "reading_figure", "run_scenario", "run_tension_scenario",
    "run_traces", "stability_along", "stability_at", "stability_figure", "stability_of_folder",
    "summarize",
]  # fmt: skip
