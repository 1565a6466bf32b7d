"""The studio's server: its options, and what starts it."""

from __future__ import annotations

import asyncio
import secrets
import socket
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

from nicegui import app, background_tasks, ui
from nicegui.server import Server

from cdpr_drake.errors import CdprError
from cdpr_drake.hosts import is_loopback
from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.schema.yaml_files import load_yaml, too_many_bytes
from cdpr_drake.studio.calculator import Calculator
from cdpr_drake.studio.entrance import Entrance, is_token, token_words
from cdpr_drake.studio.guard import EVERYWHERE, SESSION, TOKEN, Guard, Receive, Scope, Send
from cdpr_drake.studio.page import make_page
from cdpr_drake.studio.scene_relay import add_scene_relay
from cdpr_drake.studio.session import USUAL_ROBOT, Workbench
from cdpr_drake.studio.sessions import Sessions
from cdpr_drake.studio.workbench.command_form import CommandForm
from cdpr_drake.studio.workbench.job_manager import JobManager
from cdpr_drake.studio.workbench.working_folder import WorkingFolder

LOOPBACK = "127.0.0.1"
USUAL_PORT = 8642


@dataclass(frozen=True, kw_only=True)
class StudioOptions:
    """How the studio is started.

    Attributes:
        opened: Robot or scenario by name, or the path of a file; None: the usual robot.
        folder: Working folder: no file outside of it is read or written by the page.
        host: Address of this machine to listen at, `*` for all.
        port: Port; 0: a free one.
        token: Who opens the page has to know it; None: a random one, that is printed; empty: nobody
            is asked, which is accepted where this machine alone reaches the page.
        ready: Called with the page's address, with the token, when the server starts.
        commands: Makes the forms of the commands that the page offers, by name.
    """

    opened: str | None = None
    folder: Path = field(default_factory=Path.cwd)
    host: str = LOOPBACK
    port: int = USUAL_PORT
    token: str | None = None
    ready: Callable[[str], None] | None = None
    commands: Callable[[], Mapping[str, CommandForm]] = dict


LONGEST_ABSENCE = 30.0
"""Time for which a page that says nothing is kept, as where a machine is busy [s]."""

POLL = 0.05
"""Between two looks whether the server listens [s]."""


def serve(options: StudioOptions) -> None:
    """Serves the page until it is interrupted; prints its address.

    Raises:
        CdprError: What shall be opened or the token is not accepted, or the address cannot be
            listened at.
    """
    token = _token(options)
    folder = WorkingFolder(options.folder)
    robot, scenario = _opened(options.opened)
    jobs, calculator = JobManager(), Calculator()

    def make() -> Workbench:
        return Workbench(
            folder, robot, scenario, calculator=calculator, jobs=jobs, commands=options.commands
        )

    make()  # says now what is wrong with it
    sessions = Sessions(make)
    host = "0.0.0.0" if options.host in EVERYWHERE else options.host
    port = _free_port(host, options.port)
    add_scene_relay(app, sessions.bench_of)
    name = socket.gethostname() if options.host in EVERYWHERE else options.host
    address = f"http://{f'[{name}]' if ':' in name else name}:{port}/"
    opened = f"{address}?{TOKEN}={token}" if token else address
    said = f"{opened} ;" if options.token is None else f"{address} , {_who_may(token)} ;"

    async def announce() -> None:
        while not Server.instance.started:  # the port is open only then
            await asyncio.sleep(POLL)
        print(f"cdpr studio at {said} Ctrl-C ends", flush=True)
        if options.ready is not None:
            options.ready(opened)

    async def end() -> None:
        await asyncio.to_thread(jobs.close)
        calculator.close()

    app.on_startup(lambda: background_tasks.create(announce(), name="announce"))
    app.on_shutdown(end)
    _put_before_all(options.host, Entrance(token, port), sessions)
    app.config.quasar_config["loadingBar"] = {"skipHijack": True}  # it has no name to be read aloud
    ui.run(
        make_page(sessions), host=host, port=port, title="cdpr studio", show=False, reload=False,
        show_welcome_message=False, access_log=False, dark=None, reconnect_timeout=LONGEST_ABSENCE,
        storage_secret=secrets.token_urlsafe(32),
        session_middleware_kwargs={
            "session_cookie": f"cdpr_studio_session_{port}", "same_site": "strict"
        },
    )  # fmt: skip


def _token(options: StudioOptions) -> str:
    """The token; empty: none is asked for.

    Raises:
        CdprError: It is not accepted.
    """
    if options.token is None:
        return secrets.token_urlsafe(32)
    if options.token and not is_token(options.token):
        raise CdprError(f"token: found {len(options.token)} characters; accepted: {token_words()}")
    if not options.token and not is_loopback(options.host):
        raise CdprError(
            f"--no-token: found it with --host {options.host}, which other machines reach; "
            "accepted: with an address of this machine alone, such as 127.0.0.1"
        )
    return options.token


def _who_may(token: str) -> str:
    """Words for a token that is not printed."""
    if token:
        return "with the token that was set"
    return "without a token: every program and user of this machine may open it"


def _put_before_all(host: str, entrance: Entrance, sessions: Sessions) -> None:
    """Puts the guard before the whole application, also before what keeps sessions in memory.

    NiceGUI adds what it needs round everything that `add_middleware` was told before. Behind the
    guard the workbench of a new session is made in another thread, as that reads a robot's file.
    """
    build = app.build_middleware_stack

    def guarded() -> Guard:
        inside = build()

        async def prepared(scope: Scope, receive: Receive, send: Send) -> None:
            session = scope.get(SESSION)
            if session and sessions.bench_of(session) is None:
                await asyncio.to_thread(sessions.prepare, session)
            await inside(scope, receive, send)

        return Guard(prepared, host, entrance)

    app.build_middleware_stack = guarded  # type: ignore[method-assign]


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
