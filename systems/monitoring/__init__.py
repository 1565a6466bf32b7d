"""What watches a run without taking part: its end, tensions, stability, log, pictures, state."""

from cdpr_drake.systems.monitoring.breaking_load_watch import BreakingLoadWatch
from cdpr_drake.systems.monitoring.context_state import (
    has_arrays_only,
    restore_state,
    state_arrays,
)
from cdpr_drake.systems.monitoring.log_row import LogRow, RunLog, add_log
from cdpr_drake.systems.monitoring.meshcat_cables import CablePictures, MeshcatCables
from cdpr_drake.systems.monitoring.run_monitor import NOT_YET, Outcome, RunMonitor, StopRules
from cdpr_drake.systems.monitoring.stability_settings import StabilitySettings
from cdpr_drake.systems.monitoring.stability_watch import ServoCriterion, StabilityWatch
from cdpr_drake.systems.monitoring.tension_range import TensionExtremes, TensionRange

__all__ = [
    "NOT_YET", "BreakingLoadWatch", "CablePictures", "LogRow", "MeshcatCables", "Outcome",
    "RunLog", "RunMonitor", "ServoCriterion", "StabilitySettings", "StabilityWatch",
    "StopRules", "TensionExtremes", "TensionRange", "add_log", "has_arrays_only",
    "restore_state", "state_arrays",
]  # fmt: skip
