"""Relays Drake's Meshcat to the page: same address, same port, same door as all else.

Meshcat knows neither tokens nor sessions, so that nobody but this relay reaches it: the scene is
behind a socket of the file system, for this user alone. The page's browser, perhaps on another
machine, asks for `/scene/` and gets the scene of its own session; what it says back is dropped,
since Drake ends the process at a message that it cannot read.
"""

from __future__ import annotations

import asyncio
from contextlib import suppress
from pathlib import Path

import aiohttp
from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from starlette.requests import HTTPConnection

from cdpr_drake.studio.door import BENCH

SCENE = "/scene/"
PAGE = "meshcat.html"
"""Meshcat's page."""

STYLE, SCRIPT = ((Path(__file__).parent / name).read_bytes() for name in ("scene.css", "scene.js"))

LARGEST_MESSAGE = 64_000_000
"""Of a scene [bytes]; meshes come in one message."""

TYPES = {".js": "text/javascript", ".html": "text/html", ".ico": "image/x-icon"}


def add_scene_relay(app: FastAPI) -> None:
    """Adds the routes below `SCENE` to a server behind a `Door`."""

    @app.get(SCENE + "{name:path}", include_in_schema=False)
    async def asset(request: Request, name: str) -> Response:
        page = name or PAGE
        async with await _scene(request) as scene, scene.get(f"http://scene/{page}") as answer:
            body = await answer.read()
        if page == PAGE:
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
        with suppress(RuntimeError, WebSocketDisconnect):  # the browser has gone already
            await socket.close()


async def _scene(request: HTTPConnection) -> aiohttp.ClientSession:
    """What asks the scene of a request's session; who goes away does not end its making."""
    path = await asyncio.shield(asyncio.wrap_future(request.scope[BENCH].scene_address()))
    return aiohttp.ClientSession(connector=aiohttp.UnixConnector(path))
