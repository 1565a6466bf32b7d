"""`cdpr serve`, with clients in another process and in another thread."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import closing
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake.cli.process import INTERRUPTED
from cdpr_drake.errors import ClientEndedError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.sections.remote.client import RemoteClient
from tests.cli.commands import ended, refuse
from tests.cli.conftest import only
from tests.messages import printed

PLAIN_CLIENT = Path(str(files("cdpr_drake").joinpath("notebooks/plain_client.py")))

MOST_LINES = 45
"""Of the client without the package."""

LONG = 1800.0
"""Longer than anything takes on a machine that is busy, compilation included [s]."""

BUSY = 0.5
"""Time that a client takes for a step [s]; a server that stops has to wait for it."""

FOLLOWED, UPRIGHT = 1e-3, 2e-3
"""Distance and angle that a PD law with a feedforward keeps from a quintic [m, rad]."""

SCENARIO = ["acrobot_computed_torque", "--set", "integration.engine=compiled"]


def free_port():
    with closing(socket.socket()) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def test_a_client_without_the_package(capsys, tmp_path):
    assert len(PLAIN_CLIENT.read_text().splitlines()) <= MOST_LINES
    assert "import cdpr" not in PLAIN_CLIENT.read_text().partition('"""\n\n')[2]
    port, out = free_port(), tmp_path / "out"
    command = [sys.executable, str(PLAIN_CLIENT), f"tcp://127.0.0.1:{port}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as client:
        more = ("--place", "controller", "--port", port, "--duration", "1", "--out", out)
        with only("error.png"):
            code = ended("serve", *SCENARIO, *more, "--json")
        said = client.communicate()[0]
    assert code == 0
    assert "'outcome': 'completed'" in said
    shown = printed(capsys)
    summary = json.loads(shown.out)
    assert f"waiting at tcp://127.0.0.1:{port}" in shown.err
    assert summary["position_error_m"]["max"] < FOLLOWED
    assert summary["rotation_error_rad"]["max"] < UPRIGHT
    exchanges = summary["remote"].pop("exchanges")
    assert exchanges in (1000, 1001)  # a row of the log at the very end needs one more
    assert summary["remote"] == {
        "place": "controller", "codec": "json", "services": 0, "held_steps": 0, "late_steps": 0
    }  # fmt: skip
    assert summary["infeasible_steps"] == 0
    assert (out / "error.png").exists()
    again = ("simulate", out, "--out", tmp_path / "again")
    assert "cdpr serve" in refuse(capsys, *again)  # nobody is there to close the loop again
    assert not (tmp_path / "again").exists()


@pytest.mark.parametrize("ending", ["nonsense", "signal"])
def test_what_was_simulated_is_written(capsys, tmp_path, ending):
    port, out = free_port(), tmp_path / "out"
    ends = []

    def drive():
        with RemoteClient(f"tcp://127.0.0.1:{port}", timeout=LONG) as client:
            home = pose_row(load_robot("acrobot_large").home.transform())
            _, feasible = client.distribute(home, np.zeros(6), method="quadratic_program")
            assert not feasible  # with the scenario's limits; the robot's are from 0 N on
            now = client.start([])
            while now.time < 0.1:
                now = client.step(tensions=np.full(8, 5.0))
            if ending == "nonsense":
                with pytest.raises(Exception, match="8 finite numbers"):
                    client.step(tensions=np.full(8, np.nan))
                return
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(BUSY)
            while now.end is None:
                now = client.step(tensions=np.full(8, 5.0))
            ends.append(now.end["outcome"])

    thread = threading.Thread(target=drive)
    thread.start()
    with only("nothing"):
        code = ended("serve", *SCENARIO, "--port", str(port), "--out", str(out), "--duration", "3")
    thread.join()
    err = printed(capsys).err
    summary = json.loads((out / "summary.json").read_text())
    rows = len((out / "log.csv").read_text().splitlines())
    assert rows >= 11
    if ending == "signal":
        assert code == INTERRUPTED
        assert summary["outcome"] == "interrupted"
        assert ends == ["interrupted"]
        return
    assert code == ClientEndedError.exit_code
    assert summary["outcome"] == "client_ended"
    assert summary["sim_time_s"] == pytest.approx(0.1)
    (line,) = [line for line in err.splitlines() if line.startswith("cdpr:")]
    assert "tensions: found [nan" in line
    assert len(line) < 500


def test_nobody_comes_a_door_that_is_open_and_a_signal_while_it_waits(capsys, tmp_path):
    out, port = tmp_path / "out", free_port()
    code = ended("serve", *SCENARIO, "--port", 0, "--host", "0.0.0.0", "--wait", 0, "--out", out)
    err = printed(capsys).err
    assert code == ClientEndedError.exit_code
    assert "open to other machines" in err
    assert err.splitlines()[-1] == "cdpr: no client came within 0 s; nothing was simulated"
    assert not out.exists()

    def ask_and_stop():
        with RemoteClient(f"tcp://127.0.0.1:{port}", timeout=LONG) as client:
            client.describe()  # it waits by then
            os.kill(os.getpid(), signal.SIGTERM)

    thread = threading.Thread(target=ask_and_stop)
    thread.start()
    assert ended("serve", *SCENARIO, "--port", port, "--out", out) == INTERRUPTED
    thread.join()
    assert "open to other machines" not in printed(capsys).err
    assert not out.exists()
