"""The studio's server: its options, and what starts it."""

from __future__ import annotations

import asyncio
import re
import secrets
import socket
from collections.abc import AsyncIterable, Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from pathlib import Path

import aiohttp
from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from nicegui import app, background_tasks, ui
from nicegui.server import Server
from starlette.requests import HTTPConnection

from cdpr_drake.errors import CdprError, ScenarioError
from cdpr_drake.hosts import is_loopback
from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.studio.door import BENCH, TOKEN, Door, Sessions
from cdpr_drake.studio.files import WorkingFolder
from cdpr_drake.studio.jobs import JobManager
from cdpr_drake.studio.page import SCENE, make_page
from cdpr_drake.studio.session import USUAL_ROBOT, Workbench
from cdpr_drake.studio.verb_form import Verb

IS_TOKEN = re.compile(r"[A-Za-z0-9._~-]{16,200}")
"""What is accepted as a token, which has to stand in an address as it is."""

LARGEST_MESSAGE = 64_000_000
"""Of a scene [bytes]; meshes come in one message."""

MOST_BEHIND = 8_000_000
"""By which a browser that had the scene may be behind its changes [bytes]."""

STYLE, SCRIPT = ((Path(__file__).parent / name).read_bytes() for name in ("scene.css", "scene.js"))
TYPES = {".js": "text/javascript", ".html": "text/html", ".ico": "image/x-icon"}

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
    commands: Callable[[], Mapping[str, Verb]] = dict,
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
    if token and not IS_TOKEN.fullmatch(token):
        raise CdprError(
            f"token: found {len(token)} characters; accepted: 16 to 200 of the characters "
            "A-Z a-z 0-9 . _ ~ -"
        )
    if token == "" and not is_loopback(host):
        raise CdprError(
            f"--no-token: found it with --host {host}, which other machines reach; "
            "accepted: with an address of this machine alone, such as 127.0.0.1"
        )
    robot, scenario = _opened(opened)
    work, jobs, calculator = WorkingFolder(folder), JobManager(), ThreadPoolExecutor(1)

    def make() -> Workbench:
        return Workbench(work, robot, scenario, calculator=calculator, jobs=jobs, commands=commands)

    make()  # says now what is wrong with it
    is_everywhere = host in ("*", "0.0.0.0", "::")
    name, bound = (socket.gethostname(), "0.0.0.0") if is_everywhere else (host, host)
    port = _free_port(bound, port)
    address = f"http://{f'[{name}]' if ':' in name else name}:{port}/"
    secret = secrets.token_urlsafe(32) if token is None else token
    page = said = f"{address}?{TOKEN}={secret}" if secret else address
    if token == "":
        said += " , without a token: every program and user of this machine may open it"
    elif token is not None:
        said = f"{address} , with the token that was set"

    async def announce() -> None:
        while not Server.instance.started:  # the port is open only then
            await asyncio.sleep(POLL)
        print(f"cdpr studio at {said} ; Ctrl-C ends", flush=True)
        ready(page)

    async def end() -> None:
        await jobs.close()
        calculator.shutdown(cancel_futures=True)

    app.on_startup(lambda: background_tasks.create(announce(), name="announce"))
    app.on_shutdown(end)
    _relay_scene(app)
    # Also before what NiceGUI puts round it, which lets browsers keep its files, whatever they are.
    build, sessions = app.build_middleware_stack, Sessions(make)
    app.build_middleware_stack = lambda: Door(  # type: ignore[method-assign]
        build(), host, secret or "", port, sessions.bench
    )
    app.config.quasar_config["loadingBar"] = {"skipHijack": True}  # it has no name to be read aloud
    ui.run(
        make_page(), host=bound, port=port, title="cdpr studio", language="en-US", dark=None,
        show=False, reload=False, show_welcome_message=False, access_log=False,
        reconnect_timeout=LONGEST_ABSENCE,
    )  # fmt: skip


def _opened(name: str | None) -> tuple[str, str]:
    """Robot, and scenario if it is one, of what the command was given.

    Raises:
        CdprError: It is a scenario that is not accepted.
    """
    if name is None or name in robot_names():
        return name or USUAL_ROBOT, ""
    # A second of the start, which who opens a robot of the package need not wait for.
    from cdpr_drake.systems.diagrams.load import load_scenario
    from cdpr_drake.systems.scenarios import files

    try:
        file = files.scenario_file(name)
    except ScenarioError:  # the reader of robots says what is wrong
        return name, ""
    if name not in files.scenario_names() and files.top_word(file, "robot") is None:
        return name, ""
    files.check_moves_robot(name, "cdpr studio")
    return str(load_scenario(name).robot), name


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


def _relay_scene(app: FastAPI) -> None:
    """Adds the routes below `SCENE`, which relay Drake's Meshcat behind the door.

    Meshcat knows neither tokens nor sessions, so that nobody but this relay reaches it: the scene
    is behind a socket of the file system, for this user alone. What a browser says is dropped,
    since Drake ends the process at a message that it cannot read.
    """

    @app.get(SCENE + "{name:path}", include_in_schema=False)
    async def asset(request: Request, name: str) -> Response:
        page = name or "meshcat.html"
        async with await _scene(request) as scene, scene.get(f"http://scene/{page}") as answer:
            body = await answer.read()
        if page == "meshcat.html":
            body = body.replace(b"</head>", b"<style>" + STYLE + b"</style></head>", 1)
            body = body.replace(b"</body>", b"<script>" + SCRIPT + b"</script></body>", 1)
        kind = TYPES.get(Path(page).suffix, "application/octet-stream")
        return Response(body, answer.status, media_type=kind)

    @app.websocket(SCENE)
    async def messages(socket: WebSocket) -> None:
        await socket.accept()

        async def down() -> None:
            async with (
                await _scene(socket) as scene,
                scene.ws_connect("http://scene/", max_msg_size=LARGEST_MESSAGE) as meshcat,
            ):
                binary = aiohttp.WSMsgType.BINARY
                scenes = (message.data async for message in meshcat if message.type == binary)
                await hand_on(scenes, socket.send_bytes)

        async def up() -> None:
            while (await socket.receive())["type"] != "websocket.disconnect":
                pass

        both = [asyncio.create_task(down()), asyncio.create_task(up())]
        try:
            await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in both:
                task.cancel()
            await asyncio.gather(*both, return_exceptions=True)
        with suppress(RuntimeError, WebSocketDisconnect):  # the browser has gone already
            await socket.close()


async def hand_on(
    messages: AsyncIterable[bytes], send: Callable[[bytes], Awaitable[object]]
) -> None:
    """Hands on messages, which are taken at once: Meshcat keeps all that is not, without a limit.

    It ends with them, or where who gets them is too far behind: a browser then connects anew, and
    gets the scene whole, once.
    """
    waiting: asyncio.Queue[bytes] = asyncio.Queue()
    behind, most = 0, LARGEST_MESSAGE

    async def give() -> None:
        nonlocal behind, most
        while True:
            message = await waiting.get()
            await send(message)
            behind -= len(message)
            if behind == 0:  # it has the scene
                most = MOST_BEHIND

    async with asyncio.TaskGroup() as group:
        giving = group.create_task(give())
        async for message in messages:
            waiting.put_nowait(message)
            behind += len(message)
            if behind > most:
                break
        giving.cancel()


async def _scene(request: HTTPConnection) -> aiohttp.ClientSession:
    """What asks the scene of a request's session; who goes away does not end its making."""
    path = await asyncio.shield(asyncio.wrap_future(request.scope[BENCH].scene_address))
    return aiohttp.ClientSession(connector=aiohttp.UnixConnector(path))
