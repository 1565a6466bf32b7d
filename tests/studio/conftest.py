"""What tests of the studio share."""

import pytest

from cdpr_drake.cli import main

RUN_SETTINGS = ("camera.kind=projected", "duration=0.2")
"""Of a short run of acrobot_pbvs."""


@pytest.fixture(scope="session")
def alone(tmp_path_factory):
    """Folder that the command writes for a short run that nobody looks at."""
    folder = tmp_path_factory.mktemp("alone") / "runs" / "short"
    options = [f"--set={item}" for item in RUN_SETTINGS]
    with pytest.raises(SystemExit) as end:
        main(["simulate", "acrobot_pbvs", *options, f"--out={folder}", "--json"])
    assert end.value.code == 0
    return folder
