"""What watches a run without taking part: end of the run, broken cables, tensions, logs, films."""

from cdpr_drake.systems.monitoring.breaking_load_watch import BreakingLoadWatch
from cdpr_drake.systems.monitoring.log_row import LogRow, RunLog, add_log
from cdpr_drake.systems.monitoring.meshcat_cables import CablePictures, MeshcatCables
from cdpr_drake.systems.monitoring.run_monitor import Outcome, RunMonitor, StopRules
from cdpr_drake.systems.monitoring.tension_range import TensionExtremes, TensionRange

__all__ = [
    "BreakingLoadWatch", "CablePictures", "LogRow", "MeshcatCables", "Outcome", "RunLog",
    "RunMonitor", "StopRules", "TensionExtremes", "TensionRange", "add_log",
]  # fmt: skip
