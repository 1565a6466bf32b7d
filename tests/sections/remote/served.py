"""Runs whose loop a client in another thread or process closes."""

import threading
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.sections.remote.client import RemoteClient
from cdpr_drake.sections.remote.driver import Driver, SyncMode
from cdpr_drake.sections.remote.server_socket import ServerSocket
from cdpr_drake.sections.remote.service import tension_service
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario

LONG = 1800.0
"""Longer than anything takes on a machine that is busy [s]."""


@dataclass
class Server:
    """A socket for one run."""

    socket: ServerSocket
    timeout: float = LONG
    drivers: list[Driver] = field(default_factory=list)

    def run(self, scenario, folder=None, **options):
        """Runs a scenario with whoever comes, and tells him the end."""
        robot = load_robot(scenario.robot)
        service = tension_service(robot, limits=None, method="quadratic_program")

        def connect(remote):
            driver = Driver(
                self.socket, {"scenario": scenario.name}, remote.inputs, remote.outputs,
                pace=SyncMode(scenario.remote.pace), timeout=self.timeout,
                period=1.0 / scenario.controller.rate, services={"distribute": service},
            )  # fmt: skip
            driver.wait(LONG)
            remote.commander = driver
            self.drivers.append(driver)

        kind = TensionRun if isinstance(scenario, TensionScenario) else ServoRun
        run = kind(scenario).simulate(folder, Follow(connect=connect, **options))
        self.drivers[-1].end(
            {
                "outcome": run.outcome.name.lower(),
                "message": run.message,
                "sim_time_s": run.sim_time,
            }
        )
        return run


@contextmanager
def server(timeout=LONG, should_stop=lambda: False):
    """A server at a free port of this machine."""
    socket = ServerSocket("127.0.0.1", 0, should_stop)
    try:
        yield Server(socket, timeout)
    finally:
        socket.close()


@contextmanager
def beside(work, *arguments):
    """Does something in another thread; what it returned or raised is in the list."""
    found: list[Any] = []

    def do():
        try:
            found.append(work(*arguments))
        except Exception as problem:
            found.append(problem)

    thread = threading.Thread(target=do)
    thread.start()
    yield found
    thread.join()


def driven(scenario, control, codec="msgpack", outputs=None, **options):
    """The run, and the end as the client saw it."""
    with server() as one:

        def drive():
            with RemoteClient(one.socket.address, codec=codec, timeout=LONG) as client:
                return dict(client.run(control, outputs))

        with beside(drive) as found:
            run = one.run(scenario, **options)
        return run, found[0]


def scenario(*overrides, name="acrobot_computed_torque"):
    """A short run."""
    return load_scenario(name, ["duration=0.05", *overrides])


def assert_same_log(one, other):
    """Byte for byte."""
    assert list(one.log) == list(other.log)
    for name in one.log:
        assert np.asarray(one.log[name]).tobytes() == np.asarray(other.log[name]).tobytes(), name
