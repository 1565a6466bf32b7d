"""Runs that are killed half way and then go on."""

import pytest

from cdpr_drake.analyses.runs.log import PARTS
from cdpr_drake.analyses.simulation.session import RunSession


class EndedError(Exception):
    """The program ends."""


def assert_it_goes_on_to_the_same_bytes(kind, wanted, folder, until=0.25):
    """A run that was killed once its simulated time was over `until` [s], beside a whole one.

    Args:
        kind: The kind of the scenario, of `KINDS`.
        wanted: The scenario.
        folder: Where it may keep its log.
        until: See above.
    """

    def end(progress):
        if progress.sim_time > until:
            raise EndedError

    whole = kind.run(wanted)
    with pytest.raises(EndedError):
        kind.run(wanted, RunSession(end, log_folder=folder / PARTS))
    again = kind.run(wanted, RunSession(log_folder=folder / PARTS, resume=True))
    assert again.sim_time == whole.sim_time
    for quantity, values in whole.log.items():
        assert again.log[quantity].tobytes() == values.tobytes(), quantity
