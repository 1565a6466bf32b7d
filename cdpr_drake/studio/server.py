"""The studio's server: its options, and what starts it."""

from __future__ import annotations

import asyncio
import secrets
import socket
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path

from nicegui import app, background_tasks, ui
from nicegui.server import Server

from cdpr_drake.errors import CdprError
from cdpr_drake.hosts import is_loopback
from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.schema.yaml_files import load_yaml, too_many_bytes
from cdpr_drake.studio.calculator import Calculator
from cdpr_drake.studio.door import (
    EVERYWHERE,
    IS_TOKEN,
    TOKEN,
    TOKEN_WORDS,
    Door,
)
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.jobs import JobManager
from cdpr_drake.studio.page import make_page
from cdpr_drake.studio.scene_relay import add_scene_relay
from cdpr_drake.studio.session import USUAL_ROBOT, Workbench
from cdpr_drake.studio.sessions import Sessions
from cdpr_drake.studio.workbench.command_form import CommandForm

LONGEST_ABSENCE = 30.0
"""Time for which a page that says nothing is kept, as where a machine is busy [s]."""

POLL = 0.05
"""Between two looks whether the server listens [s]."""


def serve(
    opened: str | None = None,
    *,
    folder: Path,
    host: str = "127.0.0.1",
    port: int = 0,
    token: str | None = None,
    ready: Callable[[str], None] = lambda address: None,
    commands: Callable[[], Mapping[str, CommandForm]] = dict,
) -> None:
    """Serves the page until it is interrupted; prints its address.

    Args:
        opened: Robot or scenario by name, or the path of a file; None: the usual robot.
        folder: Working folder: no file outside of it is read or written by the page.
        host: Address of this machine to listen at, `*` for all.
        port: Port; 0: a free one.
        token: Who opens the page has to know it; None: a random one, that is printed; empty: nobody
            is asked, which is accepted where this machine alone reaches the page.
        ready: Called with the page's address, with the token, when the server starts.
        commands: Makes the forms of the commands that the page offers, by name.

    Raises:
        CdprError: What shall be opened or the token is not accepted, or the address cannot be
            listened at.
    """
    _check_token(token, host)
    robot, scenario = _opened(opened)
    work, jobs, calculator = WorkingFolder(folder), JobManager(), Calculator()

    def make() -> Workbench:
        return Workbench(work, robot, scenario, calculator=calculator, jobs=jobs, commands=commands)

    make()  # says now what is wrong with it
    sessions = Sessions(make)
    name = socket.gethostname() if host in EVERYWHERE else host
    bound = "0.0.0.0" if host in EVERYWHERE else host
    port = _free_port(bound, port)
    address = f"http://{f'[{name}]' if ':' in name else name}:{port}/"
    said = f"{address} , with the token that was set ;"
    if token is None:
        token = secrets.token_urlsafe(32)
        said = f"{address}?{TOKEN}={token} ;"
    elif not token:
        said = f"{address} , without a token: every program and user of this machine may open it ;"
    page = f"{address}?{TOKEN}={token}" if token else address

    async def announce() -> None:
        while not Server.instance.started:  # the port is open only then
            await asyncio.sleep(POLL)
        print(f"cdpr studio at {said} Ctrl-C ends", flush=True)
        ready(page)

    async def end() -> None:
        await jobs.close()
        calculator.close()

    app.on_startup(lambda: background_tasks.create(announce(), name="announce"))
    app.on_shutdown(end)
    add_scene_relay(app, sessions.bench_of)
    put_before_all(host, token, port, sessions)
    app.config.quasar_config["loadingBar"] = {"skipHijack": True}  # it has no name to be read aloud
    ui.run(
        make_page(sessions), host=bound, port=port, title="cdpr studio", show=False, reload=False,
        show_welcome_message=False, access_log=False, dark=None, reconnect_timeout=LONGEST_ABSENCE,
    )  # fmt: skip


def _check_token(token: str | None, host: str) -> None:
    """Refuses a token that is set.

    Raises:
        CdprError: It is not accepted, or there shall be none where other machines reach the page.
    """
    if token and not IS_TOKEN.fullmatch(token):
        raise CdprError(f"token: found {len(token)} characters; accepted: {TOKEN_WORDS}")
    if token == "" and not is_loopback(host):
        raise CdprError(
            f"--no-token: found it with --host {host}, which other machines reach; "
            "accepted: with an address of this machine alone, such as 127.0.0.1"
        )


def put_before_all(host: str, token: str, port: int, sessions: Sessions) -> None:
    """Puts the door before the whole application, also before what NiceGUI puts round it.

    That lets browsers keep its files for a year, whatever the answer was.
    """
    build = app.build_middleware_stack
    app.build_middleware_stack = lambda: Door(  # type: ignore[method-assign]
        build(), host, token, port, sessions.prepare
    )


def _opened(name: str | None) -> tuple[str, str]:
    """Robot, and scenario if it is one, of what the command was given.

    Raises:
        CdprError: It is a scenario that is not accepted.
    """
    if name is None or name in robot_names():
        return name or USUAL_ROBOT, ""
    # A second of the start, which who opens a robot of the package need not wait for.
    from cdpr_drake.systems.diagrams.load import load_scenario
    from cdpr_drake.systems.scenarios.files import check_moves_robot, scenario_names

    if name in scenario_names() or _is_scenario(Path(name)):
        check_moves_robot(name, "cdpr studio")
        return str(load_scenario(name).robot), name
    return name, ""


def _is_scenario(path: Path) -> bool:
    """Whether a file is a scenario, or a folder the results of one."""
    if path.is_dir():
        return (path / "scenario.yaml").is_file()
    if path.suffix.lower() not in (".yaml", ".yml") or too_many_bytes(path):
        return False
    try:
        content = load_yaml(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False  # the reader of robots says what is wrong
    return isinstance(content, dict) and "robot" in content


def _free_port(host: str, port: int) -> int:
    """The port, or a free one for 0.

    Raises:
        CdprError: Nothing can listen there.
    """
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with closing(socket.socket(family, socket.SOCK_STREAM)) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
            return int(probe.getsockname()[1])
    except (OSError, UnicodeError) as problem:
        why = getattr(problem, "strerror", None) or problem
        raise CdprError(
            f"--host, --port: {host} cannot listen at {port}: {why}; accepted: a name or address "
            "of this machine, * for all, and a port that is free"
        ) from problem
