"""A run that another program follows and steers: it is shown samples and images, and says when to
pause, to step, how fast to go, and when to stop.

`cdpr simulate` is the program that runs; who started it, as the studio does, holds the other end of
a connection, see `messages`. A run is looked at between its steps and waits there: its numbers are
those of a run that nobody looks at.
"""

from cdpr_drake.analyses.steering.marks_picture import MarksPicture
from cdpr_drake.analyses.steering.messages import (
    LARGEST_MESSAGE,
    Message,
    open_connection,
    receive,
    send,
)
from cdpr_drake.analyses.steering.moments import shown_limits
from cdpr_drake.analyses.steering.pace import FASTEST_SPEED, SLOWEST_SPEED, Pace
from cdpr_drake.analyses.steering.steering import (
    IMAGE_RATE,
    SAMPLE_RATE,
    Steering,
    check_steered,
)

__all__ = [
    "FASTEST_SPEED", "IMAGE_RATE", "LARGEST_MESSAGE", "SAMPLE_RATE", "SLOWEST_SPEED",
    "MarksPicture", "Message", "Pace", "Steering", "check_steered", "open_connection", "receive",
    "send", "shown_limits",
]  # fmt: skip
