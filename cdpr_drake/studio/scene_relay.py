"""Relays Drake's Meshcat to the page: same address, same port, same guard as all else.

Meshcat knows neither tokens nor sessions, so that nobody but this relay reaches it: the scene is
behind a socket of the file system, for this user alone. The page's browser, perhaps on another
machine, asks for `/scene/` and gets the scene of its own session; what it says back is dropped
there, since Drake ends the process at a message that it cannot read.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress

import aiohttp
from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect

from cdpr_drake.studio.guard import SESSION
from cdpr_drake.studio.session import Workbench

SCENE = "/scene/"
PAGE = "meshcat.html"
"""Meshcat's page."""

STYLE = b"""<style>
  .dg.main > .close-button { position: static !important; float: right; height: 1.6rem;
    width: auto !important; margin: 0.5rem; padding: 0 0.7rem; border: 0; border-radius: 0.8rem;
    font: 0.75rem/1.6rem sans-serif; text-shadow: none; color: #24476b !important;
    background: #ffffffc0 !important; }
  .dg.main > .close-button:hover { background: #ffffff !important; }
</style>
"""
"""Of the button that opens Meshcat's controls, else a black bar over the scene."""

SCRIPT = b"""<script>
  new ResizeObserver(([pane]) => {
    const {width, height} = pane.contentRect;
    viewer.camera.zoom = Math.min(1, width / Math.max(height, 1) / 1.25);
    viewer.camera.updateProjectionMatrix();
    viewer.set_dirty();
  }).observe(document.getElementById('meshcat-pane'));
</script>
"""
"""A narrow scene shows as much of the robot across as a wide one."""

LARGEST_MESSAGE = 64_000_000
"""Of a scene [bytes]; meshes come in one message."""

TYPES = {".js": "text/javascript", ".html": "text/html", ".ico": "image/x-icon"}

BenchOf = Callable[[str], Workbench | None]
"""The workbench of a session by its id."""


def add_scene_relay(app: FastAPI, bench_of: BenchOf) -> None:
    """Adds the routes below `SCENE` to the server."""

    @app.get(SCENE + "{name:path}", include_in_schema=False)
    async def asset(request: Request, name: str) -> Response:
        bench = bench_of(request.scope.get(SESSION, ""))
        if bench is None:
            return Response("There is no session; reload the page.", status_code=404)
        page = name or PAGE
        async with (
            await _scene(bench) as session,
            session.get(f"http://scene/{page}") as answer,
        ):
            body, found = await answer.read(), answer.status
        if page == PAGE:
            body = body.replace(b"</head>", STYLE + b"</head>", 1)
            body = body.replace(b"</body>", SCRIPT + b"</body>", 1)
        ending = "." + page.rpartition(".")[2]
        return Response(
            body, status_code=found, media_type=TYPES.get(ending, "application/octet-stream")
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
                await _scene(bench) as session,
                session.ws_connect("http://scene/", max_msg_size=LARGEST_MESSAGE) as meshcat,
            ):
                await _relay(socket, meshcat)
        with suppress(RuntimeError, WebSocketDisconnect):  # the browser has gone already
            await socket.close()


async def _scene(bench: Workbench) -> aiohttp.ClientSession:
    """What asks the scene of a workbench."""
    door = await asyncio.wrap_future(bench.scene_address())
    return aiohttp.ClientSession(connector=aiohttp.UnixConnector(door))


async def _relay(socket: WebSocket, meshcat: aiohttp.ClientWebSocketResponse) -> None:
    """Hands messages on in both directions, until one side ends."""

    async def down() -> None:
        async for message in meshcat:
            if message.type == aiohttp.WSMsgType.BINARY:
                await socket.send_bytes(message.data)
            elif message.type == aiohttp.WSMsgType.TEXT:
                await socket.send_text(message.data)

    async def up() -> None:
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            if message.get("bytes") is not None:
                await meshcat.send_bytes(message["bytes"])
            elif message.get("text") is not None:
                await meshcat.send_str(message["text"])

    both = [asyncio.create_task(down()), asyncio.create_task(up())]
    try:
        await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in both:
            task.cancel()
        await asyncio.gather(*both, return_exceptions=True)
