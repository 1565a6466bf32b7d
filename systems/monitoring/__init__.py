"""What watches a run without taking part: its end, broken cables, log, pictures, whole state."""

from cdpr_drake.systems.monitoring.breaking_load_watch import BreakingLoadWatch
from cdpr_drake.systems.monitoring.context_state import (
    has_arrays_only,
    restore_state,
    state_arrays,
)
from cdpr_drake.systems.monitoring.log_row import LogRow, RunLog, add_log
from cdpr_drake.systems.monitoring.meshcat_cables import CablePictures, MeshcatCables
from cdpr_drake.systems.monitoring.run_monitor import Outcome, RunMonitor, StopRules

__all__ = [
    "BreakingLoadWatch", "CablePictures", "LogRow", "MeshcatCables", "Outcome", "RunLog",
    "RunMonitor", "StopRules", "add_log", "has_arrays_only", "restore_state", "state_arrays",
]  # fmt: skip
