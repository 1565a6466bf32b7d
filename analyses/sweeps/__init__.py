"""Long computations in pieces: in processes or on a cluster, stored as they come."""

from cdpr_drake.analyses.sweeps.folder import (
    SweepFolder,
    differences,
    load_arrays,
    store_arrays,
)
from cdpr_drake.analyses.sweeps.sweep import STARTING, run_study_sweep, run_sweep
from cdpr_drake.analyses.sweeps.worker_pool import StandingPool, default_workers, run_jobs
from cdpr_drake.analyses.sweeps.workers import (
    SweepTask,
    check_scheduler,
    run_jobs_on,
    run_jobs_somewhere,
)

__all__ = [
    "STARTING", "StandingPool", "SweepFolder", "SweepTask", "check_scheduler", "default_workers",
    "differences", "load_arrays", "run_jobs", "run_jobs_on", "run_jobs_somewhere",
    "run_study_sweep", "run_sweep", "store_arrays",
]  # fmt: skip
