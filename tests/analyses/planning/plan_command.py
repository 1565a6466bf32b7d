"""`cdpr plan` in this process."""

import json

import pytest

from cdpr_drake.cli.app import main
from tests.messages import printed


def run(capsys, *words):
    """Exit code, stdout and stderr of a command line after `cdpr plan`."""
    with pytest.raises(SystemExit) as end:
        main(["plan", *words])
    out, err = printed(capsys)
    return end.value.code, out, err


WRITES = "cdpr_drake.analyses.planning.plans.figure_writers"
"""What a test of a command without its figures makes do nothing."""


def undrawn(*_):
    """No figures."""
    return {}


def planned(folder, *words, pictures=True):
    """The summary of a plan that is written into a folder, with figures or without."""
    with pytest.MonkeyPatch.context() as patch:
        if not pictures:
            patch.setattr(WRITES, undrawn)
        with pytest.raises(SystemExit) as end:
            main(["plan", *words, "--out", str(folder), "--json"])
    assert end.value.code == 0
    return json.loads((folder / "summary.json").read_text())


def drawn(folder, *names):
    """Whether there are figures with something in them."""
    return all((folder / f"{name}.png").stat().st_size > 10_000 for name in names)
