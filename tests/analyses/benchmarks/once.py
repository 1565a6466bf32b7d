"""Benchmarks without their repeats, for tests that ask what rows say and not how long it took."""

import sys

from cdpr_drake.analyses.planning.cable_streams import cable_stream
from cdpr_drake.analyses.reporting.timing import processor_seconds, seconds_per_call

ROOM = "cdpr_drake.analyses.benchmarks."

FEW = 2
"""Calls in a row are no more than these."""

SMALLER = {
    "identification.POSES": 14, "identification.ROWS": 2000, "planning.STATIONS": 60,
    "moving_obstacles.SHAPE": (4, 4, 4), "moving_obstacles.STEPS": 8,
    "planning.cable_stream": lambda run, rate: cable_stream(run, 0.1 * rate),
    "package.STARTS": {"import cdpr_drake": "import cdpr_drake"},
    "package.BASELINE": "import pydrake",
}  # fmt: skip
"""What is timed, by where its size stands."""


def once(works, repeats):
    """Calls each work once, as `interleaved` does several times."""
    assert repeats >= 1
    return [work() for work in works]


def few_calls(work, calls):
    """As `seconds_per_call`, with few of them."""
    return seconds_per_call(work, min(calls, FEW))


def few_timed(work, calls=1):
    """As `processor_seconds`, with few of them."""
    return processor_seconds(work, min(calls, FEW))


REPLACED = {"interleaved": once, "seconds_per_call": few_calls, "processor_seconds": few_timed}


def without_repeats(patch):
    """All modules of benchmarks that are imported do small works once, until a patch ends."""
    replaced = 0
    for name in [name for name in sys.modules if name.startswith(ROOM)]:
        for word, other in REPLACED.items():
            if hasattr(sys.modules[name], word):
                patch.setattr(sys.modules[name], word, other)
                replaced += 1
    assert replaced
    for name, size in SMALLER.items():
        module, _, word = f"{ROOM}{name}".rpartition(".")
        if module in sys.modules:
            patch.setattr(sys.modules[module], word, size)
