"""Verb: a run whose loop is closed by an external process, over ZeroMQ."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from typing import Annotated, Any

from cyclopts import Parameter

from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    OutFolder,
    Overrides,
    ScenarioWord,
    Switch,
    number,
    one_of,
    whole,
)
from cdpr_drake.analyses.runs.run import Run
from cdpr_drake.analyses.runs.scenarios import scenario_with
from cdpr_drake.analyses.runs.simulate import simulate
from cdpr_drake.errors import ClientEndedError
from cdpr_drake.hosts import is_loopback
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.sections.remote.client import LOCAL_HOST, USUAL_PORT
from cdpr_drake.sections.remote.driver import Driver, SyncMode
from cdpr_drake.sections.remote.messages import PROTOCOL, check_available
from cdpr_drake.sections.remote.place import SERVO_PLACES, TENSION_PLACES, Remote
from cdpr_drake.sections.remote.server_socket import ServerSocket
from cdpr_drake.sections.remote.service import tension_service
from cdpr_drake.systems.scenarios.files import check_moves_robot
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario


@verb()
def serve(
    scenario: ScenarioWord, overrides: Overrides = (), *,
    place: Annotated[str | None, one_of((*TENSION_PLACES, *SERVO_PLACES))] = None,
    pace: Annotated[str | None, one_of([mode.value for mode in SyncMode])] = None,
    timeout: float | None = None, wait: Annotated[float, number(0)] = 60.0,
    host: str = LOCAL_HOST, port: Annotated[int, whole(0, 65535, "PORT")] = USUAL_PORT,
    folder: OutFolder = None, duration: float | None = None, overwrite: Switch = False,
    formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Run:  # fmt: skip
    """Runs a scenario with an external process in its loop, over ZeroMQ.

    The client may be in any language: cdpr_drake.sections.remote documents the messages and offers
    RemoteClient for Python. notebooks/plain_client.py is a client that does not use this package.

    Args:
        scenario: Scenario by name, or path of a YAML file.
        overrides: Key and value of the scenario, such as integration.engine=plant.
        place: Block that the client replaces: distributor, controller or trajectory of dynamic
            control, servo or twist of a visual servo.
        pace: Each step waits for the client, or real time.
        timeout: Silence of the client after which the run ends [s].
        wait: Longest time to wait for a client [s].
        host: Address of this machine to listen at, * for all; whoever reaches it may drive the run.
        port: Port, 0 for a free one.
        folder: Results folder; default: a new one below runs/; in Python nothing is kept.
        duration: Longest simulated time [s].
        overwrite: Replace earlier results in the folder.
        formats: Formats of the figures in the folder.
        follow: Who follows.

    Raises:
        ClientEndedError: No client came, or it left before the first step.
        ScenarioError: As `simulate`, or the scenario has no such place.
        OutputFolderError: As `simulate`.
    """
    check_available()
    check_moves_robot(scenario, "cdpr serve")
    base = scenario_with(scenario, overrides)
    if place is None and base.remote is None:
        place = (TENSION_PLACES if isinstance(base, TensionScenario) else SERVO_PLACES)[0]
    settings = {"place": place, "pace": pace, "timeout": timeout}
    items = [f"remote.{key}={value}" for key, value in settings.items() if value is not None]
    loaded = scenario_with(scenario, [*overrides, *items], duration=duration)
    with ExitStack() as closing:
        socket = ServerSocket(host, port, follow.stop)
        closing.callback(socket.close)
        if not is_loopback(host):
            follow.say(
                f"warning: {socket.address} is open to other machines: whoever reaches it may "
                "drive the run; there is no password, and nothing is encrypted"
            )
        drivers: list[Driver] = []

        def connect(remote: Remote) -> None:
            driver, pace = _driver(loaded, socket, remote), loaded.remote.pace.replace("_", " ")
            follow.say(
                f"{loaded.name}: waiting at {socket.address} for a client in the place "
                f"{remote.place}, {pace}"
            )
            driver.wait(wait)
            remote.commander = driver
            drivers.append(driver)

        def ended(run: Run) -> None:
            """Tells the client, and closes the port before results are written."""
            ending = run.ending()
            for driver in drivers:
                driver.end({key: ending[key] for key in ("outcome", "message", "sim_time_s")})
            closing.close()

        try:
            return simulate(
                loaded, folder=folder, overwrite=overwrite, formats=formats,
                follow=replace(follow, connect=connect, ended=ended),
            )  # fmt: skip
        except ClientEndedError as problem:  # before the first step
            raise ClientEndedError(f"{problem}; nothing was simulated") from problem


def _driver(scenario: Any, socket: ServerSocket, remote: Remote) -> Driver:
    """Speaks with the client: of the scenario first, then step by step."""
    robot, rate, settings = load_robot(scenario.robot), scenario.controller.rate, scenario.remote
    greeting = {
        "protocol": PROTOCOL, "scenario": scenario.name, "robot": robot.name,
        "cables": [cable.name for cable in robot.cables], "place": remote.place,
        "pace": settings.pace, "rate": rate, "duration": scenario.duration,
    }  # fmt: skip
    distribution: dict[str, Any] = {"limits": None, "method": "quadratic_program"}
    if isinstance(scenario, TensionScenario):
        distribution = {
            "limits": scenario.limits(), "method": scenario.distribution.method,
            "cables": scenario.believed_cables(robot),
        }  # fmt: skip
    return Driver(
        socket, greeting, remote.inputs, remote.outputs, pace=SyncMode(settings.pace),
        timeout=settings.timeout, period=1.0 / rate,
        services={"distribute": tension_service(robot, **distribution)},
    )  # fmt: skip
