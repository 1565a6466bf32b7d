"""`cdpr serve`: runs a scenario whose loop a process outside closes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.words import (
    Formats,
    OutFolder,
    Overrides,
    ScenarioWord,
    number,
    one_of,
    whole,
)
from cdpr_drake.analyses.front.simulation import simulate
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.simulation.scenario_kinds import SCENARIO_KINDS
from cdpr_drake.cli.process import CLIENT_ENDED
from cdpr_drake.cli.sessions import Answer
from cdpr_drake.cli.simulate import RunSession, run_answer
from cdpr_drake.errors import ClientEndedError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.remote.messages import PROTOCOL, check_available
from cdpr_drake.systems.remote.remote_client import LOCAL_HOST, USUAL_PORT
from cdpr_drake.systems.remote.remote_driver import Driver, SyncMode
from cdpr_drake.systems.remote.remote_place import SERVO_PLACES, TENSION_PLACES, Remote
from cdpr_drake.systems.remote.server_socket import ServerSocket as Socket
from cdpr_drake.systems.remote.server_socket import is_loopback
from cdpr_drake.systems.remote.service import tension_service
from cdpr_drake.systems.scenarios.files import check_moves_robot, scenario_kind
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario


def serve(
    scenario: ScenarioWord, /, *,
    place: Annotated[str | None, one_of((*TENSION_PLACES, *SERVO_PLACES))] = None,
    pace: Annotated[str | None, one_of([each.value for each in SyncMode])] = None,
    timeout: float | None = None, wait: Annotated[float, number(0)] = 60.0,
    host: str = LOCAL_HOST, port: Annotated[int, whole(0, 65535, "PORT")] = USUAL_PORT,
    out: OutFolder = None, duration: float | None = None, overrides: Overrides = (),
    overwrite: bool = False, formats: Formats = ("png",),
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Answer | int:  # fmt: skip
    """Runs a scenario with an external process in its loop, over ZeroMQ.

    The client may be in any language: cdpr_drake.systems.remote documents the messages and offers
    RemoteClient for Python. notebooks/plain_client.py is a client that does not use this package.

    Args:
        scenario: Scenario by name, or path of a YAML file.
        place: Block that the client replaces: distributor, controller or trajectory of dynamic
            control, servo or twist of a visual servo.
        pace: Each step waits for the client, or real time.
        timeout: Silence of the client after which the run ends [s].
        wait: Longest time to wait for a client [s].
        host: Address of this machine to listen at, * for all; whoever reaches it may drive the run.
        port: Port, 0 for a free one.
        out: Results folder; default: a new one below runs/.
        duration: Longest simulated time [s].
        overrides: Key and value of the scenario, such as integration.engine=plant.
        overwrite: Replace results in the folder.
        formats: Files of each figure: png, pdf, svg, or several, as png,pdf.
        follow: Who follows.
    """
    check_available()
    kind = SCENARIO_KINDS[scenario_kind(scenario)]
    check_moves_robot(scenario, "cdpr serve")
    items = list(overrides)
    for key, value in (
        ("remote.place", place), ("duration", duration), ("remote.pace", pace),
        ("remote.timeout", timeout),
    ):  # fmt: skip
        if value is not None:
            items.append(f"{key}={value}")
    if place is None and load_scenario(scenario, list(overrides)).remote is None:
        usual = SERVO_PLACES if kind.has_camera else TENSION_PLACES
        items.append(f"remote.place={usual[0]}")
    loaded = load_scenario(scenario, items)
    folder = out if out is not None else free_folder(Path("runs") / loaded.name)
    session = RunSession(follow, folder)
    try:
        with _Client(loaded, host, port, wait, follow) as client:
            session.outside = client
            run = simulate(
                loaded, folder=folder, overwrite=overwrite, formats=formats, session=session
            )
        return run_answer(run, session, duration)
    except ClientEndedError as problem:  # before the first step
        follow.say(f"cdpr: {problem}; nothing was simulated")
        return CLIENT_ENDED


class _Client:
    """Waits for a client, and tells it how the run ended."""

    def __init__(self, scenario: Any, host: str, port: int, wait: float, follow: Follow) -> None:
        self._scenario, self._wait, self._say = scenario, wait, follow.say
        self._driver: Driver | None = None
        self._socket = Socket(host, port, follow.stop)
        if not is_loopback(host):
            self._say(
                f"warning: {self._socket.address} is open to other machines: whoever reaches it "
                "may drive the run; there is no password, and nothing is encrypted"
            )

    def __enter__(self) -> _Client:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def connect(self, remote: Remote) -> None:
        """Waits for a client that starts the run."""
        scenario, robot = self._scenario, load_robot(self._scenario.robot)
        driver = Driver(
            self._socket,
            {
                "protocol": PROTOCOL,
                "scenario": scenario.name,
                "robot": robot.name,
                "cables": [cable.name for cable in robot.cables],
                "place": remote.place,
                "pace": scenario.remote.pace,
                "rate": scenario.controller.rate,
                "duration": scenario.duration,
            },
            remote.inputs,
            remote.outputs,
            pace=SyncMode(scenario.remote.pace),
            timeout=scenario.remote.timeout,
            period=1.0 / scenario.controller.rate,
            services={"distribute": self._distribution(robot)},
        )
        self._say(
            f"{scenario.name}: waiting at {self._socket.address} for a client in the place "
            f"{remote.place}, {scenario.remote.pace.replace('_', ' ')}"
        )
        driver.wait(self._wait)
        self._driver = remote.commander = driver

    def _distribution(self, robot: Any) -> Any:
        """Tensions as the scenario would distribute them."""
        scenario = self._scenario
        if isinstance(scenario, TensionScenario):
            method = scenario.distribution.method
            cables = scenario.believed_cables(robot)
            return tension_service(robot, limits=scenario.limits(), method=method, cables=cables)
        return tension_service(robot, limits=None, method="quadratic_program")

    def tell_end(self, result: Any) -> None:
        """Tells the client, and lets go of the port before results are written."""
        if self._driver is not None:
            self._driver.end(
                {
                    "outcome": result.outcome.name.lower(),
                    "message": result.message,
                    "sim_time_s": result.sim_time,
                }
            )
