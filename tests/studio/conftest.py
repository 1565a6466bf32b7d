"""What tests of the studio share."""

import gc
from contextlib import redirect_stdout
from io import StringIO

import pytest

from cdpr_drake.analyses.front.logs import replay_log
from cdpr_drake.cli.app import main
from tests.studio.served import served

RUN_SETTINGS = ("camera.kind=projected", "duration=0.2")
"""Of a short run of acrobot_pbvs."""


@pytest.fixture(scope="module", autouse=True)
def _not_searched_for_garbage():
    """What is there before: NiceGUI's tests have all else searched before and after each page."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def alone(tmp_path_factory):
    """Folder that the command writes for a short run that nobody looks at."""
    folder = tmp_path_factory.mktemp("alone") / "runs" / "short"
    options = [f"--set={item}" for item in RUN_SETTINGS]
    with pytest.raises(SystemExit) as end:
        main(["simulate", "acrobot_pbvs", *options, f"--out={folder}", "--json"])
    assert end.value.code == 0
    return folder


@pytest.fixture(scope="session")
def computed(tmp_path_factory):
    """A workspace of two kinds and a measure, as the command leaves it."""
    folder = tmp_path_factory.mktemp("work") / "workspaces" / "small"
    printed = StringIO()
    with redirect_stdout(printed), pytest.raises(SystemExit):
        main(["workspace", "acrobot_small", "--grid", "5,5,5", "--kind", "static,wrench-feasible",
              "--force", "1", "--measure", "capacity-margin", "--out", str(folder)])  # fmt: skip
    (folder / "printed.txt").write_text(printed.getvalue())
    return folder


@pytest.fixture(scope="session")
def beside(alone, tmp_path_factory):
    """The log of that run beside the model, as the command leaves it."""
    folder = tmp_path_factory.mktemp("work") / "logs" / "small"
    replay_log(alone / "log.csv", "acrobot_small", folder=folder)
    return folder


@pytest.fixture(scope="package")
def studio(tmp_path_factory):
    """Working folder and address of one studio for several browser sessions."""
    folder = tmp_path_factory.mktemp("work")
    with served(folder) as (address, _):
        yield folder, address
