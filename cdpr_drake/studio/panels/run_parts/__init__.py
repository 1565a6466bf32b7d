"""Parts of the run panel: the scenario's form, plots that move, and what is looked at."""

from cdpr_drake.studio.panels.run_parts.moving_plots import MovingPlots
from cdpr_drake.studio.panels.run_parts.run_watch import RunWatch
from cdpr_drake.studio.panels.run_parts.scenario_form import ScenarioForm
from cdpr_drake.studio.panels.run_parts.steering_bar import SteeringBar
from cdpr_drake.studio.panels.run_parts.style import RUN_STYLE

__all__ = ["RUN_STYLE", "MovingPlots", "RunWatch", "ScenarioForm", "SteeringBar"]
