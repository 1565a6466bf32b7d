"""Jobs: work that the studio's server has, in processes of their own.

A job belongs to the server, not to a page: whoever closes or reloads a page, or opens another,
finds it as it is. A process of its own, since Drake and numba hold Python's lock, and since what
kills a run must not kill the server. Nothing here knows of pages.

`CommandJob` is any `cdpr` subcommand, `RunJob` a `cdpr simulate` that is followed and steered, see
`analyses.steering`. `JobManager` lets a few of them run at a time. Threads of any kind may call
everything here.
"""

from cdpr_drake.studio.jobs.command_job import CommandJob
from cdpr_drake.studio.jobs.job import Event, Job, JobError, JobState, Listener
from cdpr_drake.studio.jobs.manager import JobManager
from cdpr_drake.studio.jobs.run_job import RunJob
from cdpr_drake.studio.jobs.samples import Samples

__all__ = [
    "CommandJob", "Event", "Job", "JobError", "JobManager", "JobState", "Listener", "RunJob",
    "Samples",
]  # fmt: skip
