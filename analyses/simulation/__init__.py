"""A simulation on its way: advanced in pieces, its log put on disk, its state kept to go on from.

Whatever ends the program loses a few seconds of a run: the log grows on disk, and beside it stands
a checkpoint, the state of the whole diagram, see `systems.monitoring.state_arrays`. A run that is
continued from it comes to the same numbers as one that was never ended, bit for bit.
"""

from cdpr_drake.analyses.simulation.checkpoints import (
    Checkpoint,
    read_checkpoint,
    run_arguments,
    write_checkpoint,
)
from cdpr_drake.analyses.simulation.log_keeper import LogKeeper
from cdpr_drake.analyses.simulation.loop import (
    LONGEST_WARM_UP,
    LoopEnd,
    advance,
    fixed_step_simulator,
    go_on,
)
from cdpr_drake.analyses.simulation.outside import Connect, check_connected, resting
from cdpr_drake.analyses.simulation.run_end import (
    LEFT_UNFINISHED,
    EndedRun,
    ended,
    left_unfinished,
)
from cdpr_drake.analyses.simulation.session import UNWATCHED, Progress, RunSession

__all__ = [
    "LEFT_UNFINISHED", "LONGEST_WARM_UP", "UNWATCHED", "Checkpoint", "Connect", "EndedRun",
    "LogKeeper", "LoopEnd", "Progress", "RunSession", "advance", "check_connected", "ended",
    "fixed_step_simulator", "go_on", "left_unfinished", "read_checkpoint", "resting",
    "run_arguments", "write_checkpoint",
]  # fmt: skip
