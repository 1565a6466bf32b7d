"""Relays Drake's Meshcat to the page: same address, same port, same door as all else.

Meshcat knows neither tokens nor sessions, so that nobody but this relay reaches it: the scene is
behind a socket of the file system, for this user alone. The page's browser, perhaps on another
machine, asks for `/scene/` and gets the scene of its own session; what it says back is dropped,
since Drake ends the process at a message that it cannot read.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import aiohttp
from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect

from cdpr_drake.studio.door import SESSION
from cdpr_drake.studio.session import Workbench

SCENE = "/scene/"
PAGE = "meshcat.html"
"""Meshcat's page."""

STYLE, SCRIPT = ((Path(__file__).parent / name).read_bytes() for name in ("scene.css", "scene.js"))

LARGEST_MESSAGE = 64_000_000
"""Of a scene [bytes]; meshes come in one message."""

TYPES = {".js": "text/javascript", ".html": "text/html", ".ico": "image/x-icon"}


def add_scene_relay(app: FastAPI, bench_of: Callable[[str], Workbench | None]) -> None:
    """Adds the routes below `SCENE` to the server; `bench_of` says the workbench of a session."""

    @app.get(SCENE + "{name:path}", include_in_schema=False)
    async def asset(request: Request, name: str) -> Response:
        bench = bench_of(request.scope.get(SESSION, ""))
        if bench is None:
            return Response("There is no session; reload the page.", status_code=404)
        page = name or PAGE
        async with await _scene(bench) as scene, scene.get(f"http://scene/{page}") as answer:
            body = await answer.read()
        if page == PAGE:
            body = body.replace(b"</head>", b"<style>" + STYLE + b"</style></head>", 1)
            body = body.replace(b"</body>", b"<script>" + SCRIPT + b"</script></body>", 1)
        return Response(
            body, answer.status, media_type=TYPES.get(Path(page).suffix, "application/octet-stream")
        )

    @app.websocket(SCENE)
    async def messages(socket: WebSocket) -> None:
        bench = bench_of(socket.scope.get(SESSION, ""))
        if bench is None:
            await socket.close(1008)
            return
        await socket.accept()
        with suppress(aiohttp.ClientError, WebSocketDisconnect, RuntimeError):
            async with (
                await _scene(bench) as scene,
                scene.ws_connect("http://scene/", max_msg_size=LARGEST_MESSAGE) as meshcat,
            ):
                await _relay(socket, meshcat)
        with suppress(RuntimeError, WebSocketDisconnect):  # the browser has gone already
            await socket.close()


async def _scene(bench: Workbench) -> aiohttp.ClientSession:
    """What asks the scene of a workbench."""
    door = await asyncio.wrap_future(bench.scene_address())
    return aiohttp.ClientSession(connector=aiohttp.UnixConnector(door))


async def _relay(socket: WebSocket, meshcat: aiohttp.ClientWebSocketResponse) -> None:
    """Hands on what the scene says, until one side ends; drops what the browser says."""

    async def down() -> None:
        async for message in meshcat:
            if message.type == aiohttp.WSMsgType.BINARY:
                await socket.send_bytes(message.data)

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
