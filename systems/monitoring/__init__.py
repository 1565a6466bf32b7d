"""What watches a run without taking part: end of the run, broken cables, log, pictures."""

from cdpr_drake.systems.monitoring.breaking_load_watch import BreakingLoadWatch
from cdpr_drake.systems.monitoring.log_row import LogRow, RunLog, add_log
from cdpr_drake.systems.monitoring.meshcat_cables import CablePictures, MeshcatCables
from cdpr_drake.systems.monitoring.run_monitor import NOT_YET, Outcome, RunMonitor, StopRules

__all__ = [
    "NOT_YET", "BreakingLoadWatch", "CablePictures", "LogRow", "MeshcatCables", "Outcome", "RunLog",
    "RunMonitor", "StopRules", "add_log",
]  # fmt: skip
