"""`cdpr plan` in this process."""

import json

import numpy as np
import pytest

from cdpr_drake.cli.app import main
from tests.messages import printed

WRITES = "cdpr_drake.analyses.frame.figures.figure_writers"


@pytest.fixture
def undrawn(monkeypatch):
    """Commands draw no figures."""
    monkeypatch.setattr(WRITES, lambda *_: {})


def run(capsys, *words):
    """Exit code, stdout and stderr, without line breaks, of words after `cdpr plan`."""
    with pytest.raises(SystemExit) as end:
        main(["plan", *words])
    out, err = printed(capsys)
    return end.value.code, out, err


def planned(folder, *words):
    """The summary of a plan that is written into a folder."""
    with pytest.raises(SystemExit) as end:
        main(["plan", *words, "--out", str(folder), "--json"])
    assert end.value.code == 0
    return summary(folder)


def summary(folder):
    return json.loads((folder / "summary.json").read_text())


def table(folder, name="motion.csv"):
    return np.genfromtxt(folder / name, delimiter=",", names=True)


def drawn(folder, *names):
    """Whether there are figures with something in them."""
    return all((folder / f"{name}.png").stat().st_size > 10_000 for name in names)
