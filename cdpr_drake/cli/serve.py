"""`cdpr serve`: runs a scenario whose loop a process outside closes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_drake.analyses.front.simulation import simulate
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.simulation.scenario_kinds import SCENARIO_KINDS
from cdpr_drake.cli.completion import scenario_words, words_among
from cdpr_drake.cli.options import LISTENING, FigureFormats, Overwrite, named_options, parse_formats
from cdpr_drake.cli.process import StopRequest
from cdpr_drake.cli.run_endings import CLIENT_ENDED
from cdpr_drake.cli.simulate import STOPPING, SimulationSession, tell_run
from cdpr_drake.cli.terminal import message_console
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
    scenario: Annotated[
        str,
        typer.Argument(
            help="Scenario by name, or path of a YAML file.", autocompletion=scenario_words
        ),
    ],
    place: Annotated[
        str | None,
        typer.Option(
            help="Block that the client replaces: distributor, controller or trajectory of dynamic "
            "control, servo or twist of a visual servo.",
            autocompletion=words_among((*TENSION_PLACES, *SERVO_PLACES)),
        ),
    ] = None,
    pace: Annotated[
        str | None,
        typer.Option(
            help="lock_step or real_time.",
            autocompletion=words_among([each.value for each in SyncMode]),
        ),
    ] = None,
    timeout: Annotated[
        float | None, typer.Option(help="Silence of the client after which the run ends [s].")
    ] = None,
    wait: Annotated[
        float, typer.Option(help="Longest time to wait for a client [s].", min=0.0)
    ] = 60.0,
    host: Annotated[
        str,
        typer.Option(
            help="Address of this machine to listen at, * for all; whoever reaches it may drive "
            "the run."
        ),
    ] = LOCAL_HOST,
    port: Annotated[
        int, typer.Option(help="Port, 0 for a free one.", min=0, max=65535)
    ] = USUAL_PORT,
    out: Annotated[
        Path | None, typer.Option(help="Results folder; default: a new one below runs/.")
    ] = None,
    duration: Annotated[float | None, typer.Option(help="Longest simulated time [s].")] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="key=value of the scenario, such as integration.engine=plant."),
    ] = None,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> int:
    """Runs a scenario with an external process in its loop, over ZeroMQ.

    The client may be in any language: cdpr_drake.systems.remote documents the messages and offers
    RemoteClient for Python. notebooks/plain_client.py is a client that does not use this package.
    """
    check_available()
    kind = SCENARIO_KINDS[scenario_kind(scenario)]
    check_moves_robot(scenario, "cdpr serve")
    overrides, formats = list(settings or []), parse_formats(figure_format)
    for key, value in (
        ("remote.place", place), ("duration", duration), ("remote.pace", pace),
        ("remote.timeout", timeout),
    ):  # fmt: skip
        if value is not None:
            overrides.append(f"{key}={value}")
    if place is None and load_scenario(scenario, list(settings or [])).remote is None:
        usual = SERVO_PLACES if kind.has_camera else TENSION_PLACES
        overrides.append(f"remote.place={usual[0]}")
    loaded = load_scenario(scenario, overrides)
    folder = out if out is not None else free_folder(Path("runs") / loaded.name)
    session = SimulationSession(STOPPING, folder)
    try:
        with _Client(loaded, host, port, wait, session.request) as client, session:
            session.outside = client
            found = simulate(
                loaded, folder=folder, overwrite=overwrite, formats=formats, session=session
            )
            code = tell_run(found, session, as_json)
        session.say_kept()
        return code
    except ClientEndedError as problem:  # before the first step
        message_console().print(f"cdpr: {problem}; nothing was simulated")
        return CLIENT_ENDED


class _Client:
    """Waits for a client, and tells it how the run ended."""

    def __init__(self, scenario: Any, host: str, port: int, wait: float, stop: StopRequest) -> None:
        self._scenario, self._wait = scenario, wait
        self._driver: Driver | None = None
        with named_options(LISTENING):
            self._socket = Socket(host, port, stop)
        if not is_loopback(host):
            message_console().print(
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
        message_console().print(
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
