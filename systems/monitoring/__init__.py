"""What watches a run without taking part: its end, broken cables, stability, log, state."""

from cdpr_drake.systems.monitoring.breaking_load_watch import BreakingLoadWatch
from cdpr_drake.systems.monitoring.context_state import (
    has_arrays_only,
    restore_state,
    state_arrays,
)
from cdpr_drake.systems.monitoring.log_row import LogRow, RunLog, add_log
from cdpr_drake.systems.monitoring.meshcat_cables import CablePictures, MeshcatCables
from cdpr_drake.systems.monitoring.run_monitor import Outcome, RunMonitor, StopRules
from cdpr_drake.systems.monitoring.stability_settings import StabilitySettings
from cdpr_drake.systems.monitoring.stability_watch import ServoCriterion, StabilityWatch

__all__ = [
    "BreakingLoadWatch", "CablePictures", "LogRow", "MeshcatCables", "Outcome", "RunLog",
    "RunMonitor", "ServoCriterion", "StabilitySettings", "StabilityWatch", "StopRules", "add_log",
    "has_arrays_only", "restore_state", "state_arrays",
]  # fmt: skip
