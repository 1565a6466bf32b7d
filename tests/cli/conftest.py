"""What tests of commands share."""

from contextlib import contextmanager

import pytest

from cdpr_drake.analyses.reporting import write_pictures
from cdpr_drake.cli import plan, simulate


@contextmanager
def only(*endings):
    """Lets runs and plans write their data and, of all that follows, files with these endings."""

    def write(folder, pictures, *more):
        kept = {name: draw for name, draw in pictures.items() if name.endswith(endings)}
        return write_pictures(folder, kept, *more)

    with pytest.MonkeyPatch.context() as patch:
        for module in (simulate, plan):
            patch.setattr(module, "write_pictures", write)
        yield


@pytest.fixture
def without_pictures():
    """For runs whose figures nobody looks at: to draw them takes longer than to simulate."""
    with only(".mat", ".parquet"):
        yield


@pytest.fixture
def replay_only():
    """The replay stands for all pictures."""
    with only("replay.html"):
        yield
