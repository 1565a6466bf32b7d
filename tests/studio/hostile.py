"""Hostile messages to a studio's door, scene and sockets: nobody gets in, nothing goes down.

Called by `python -m tests.studio.fuzz --count 3000`.
"""

from __future__ import annotations

import asyncio
import json
import random
import re
from collections import Counter
from pathlib import Path
from urllib.parse import urlsplit

import aiohttp

from cdpr_drake.studio.page import SCENE
from cdpr_drake.studio.panel import PANELS
from tests.studio.served import served

SOCKET = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
LAST = f'"name":"{list(PANELS)[-1]}"'
"""Is said to a page whose panels have all been placed."""

HANDSHAKE = "&client_id={}&implicit_handshake=true&tab_id=x&document_id=y&next_message_id=0"
"""Of NiceGUI's page, and how it says which one it is."""


def junk(chance: random.Random, most: int = 60) -> bytes:
    """Some bytes."""
    return chance.randbytes(chance.randrange(1, most))


def without_cookie(chance: random.Random, token: str, port: int) -> bytes:
    """A request as it comes over the wire, with hosts, pages, cookies and tokens that are wrong."""
    home = f"127.0.0.1:{port}".encode()
    word = chance.choice((token[:-1].encode(), token.upper().encode(), b"%ff%00", b"a&token=" * 9))
    lines = [b"Host: " + chance.choice((home, home, home, b"evil.com", b"", junk(chance)))]
    for name in (b"Origin", b"Cookie", b"Upgrade", b"Connection", b"Content-Length", junk(chance)):
        for _ in range(chance.choice((0, 0, 1, 2))):
            value = chance.choice((
                b"http://" + home, b"null", b"websocket", b"upgrade", b"-1", b"a;" * 100,
                f"cdpr_studio_{port}={token}.x".encode(), junk(chance),
            ))  # fmt: skip
            lines.append(name + b": " + value)
    query = chance.choice((b"", b"?cookie=set", b"?token=" + word))
    path = chance.choice((b"/", SCENE.encode(), b"/_nicegui/x", b"//x", b"*", SOCKET.encode()))
    method = chance.choice((b"GET", b"GET", b"POST", b"HEAD", b"OPTIONS", junk(chance, 4)))
    return b" ".join((method, path + query, b"HTTP/1.1\r\n")) + b"\r\n".join([*lines, b"", b""])


async def ask(port: int, request: bytes) -> str:
    """Sends a request as it is; the status of the answer, or that there is none."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        writer.write(request)
        writer.write_eof()
        line = await asyncio.wait_for(reader.readline(), 20.0)
        return line.split(b" ")[1].decode() if line.count(b" ") > 1 else "none"
    except (TimeoutError, OSError):
        return "none"
    finally:
        writer.close()


def event(chance: random.Random, client: str) -> str | bytes:
    """A message of NiceGUI's page that is wrong: of what is not there, huge, nested, no JSON."""
    wrong = (None, -1, 1e308, "x" * 10_000, [], {}, [[[]]], {"a": {"b": [None]}}, "\ud800", True)

    def value() -> object:
        return chance.choice(wrong)

    name = chance.choice(("event", "javascript_response", "ack", "log", "handshake", "x", value()))
    body: object = {
        "client_id": chance.choice((client, client, "x", value())),
        "id": chance.choice((0, 4, 10**9, value())), "listener_id": chance.choice(("x", value())),
        "args": chance.choice(([value()], value())), "request_id": value(), "result": value(),
        "next_message_id": value(), "level": value(), "tab_id": value(), "document_id": value(),
        "element_id": value(), "args_id": value(),
    }  # fmt: skip
    body = chance.choice((body, body, body, value()))
    text = f"42{json.dumps([name, body])}"
    return chance.choice((
        text, text, text, text, text[: chance.randrange(len(text))], "42" + "[" * 5000, "4", "",
        "451-" + text[2:], "41", "2", "3probe", "9" * 50, junk(chance), "42" + "x" * 100_000,
    ))  # fmt: skip


async def attack(address: str, count: int, seed: int) -> Counter[str]:
    """Sends so many messages of each of three kinds; what came of them.

    Raises:
        AssertionError: Somebody got in, or another page does not go on.
    """
    chance, found, parts = random.Random(seed), Counter[str](), urlsplit(address)
    token, port = parts.query.partition("=")[2], int(parts.port or 0)
    for _ in range(count):
        status = await ask(port, without_cookie(chance, token, port))
        found[f"door {status}"] += 1
        assert status in ("none", "400", "403"), status
    jar = aiohttp.CookieJar(unsafe=True)
    home = f"http://127.0.0.1:{port}"
    async with aiohttp.ClientSession(home, cookie_jar=jar, raise_for_status=True) as web:
        await (await web.get(f"/?{parts.query}")).read()
        other = asyncio.create_task(follow(web, "never said"))
        for path in (SCENE + "?", SOCKET):
            while (left := count - found[path]) > 0:
                client = await page(web)
                async with web.ws_connect(f"{path}{HANDSHAKE.format(client)}") as socket:
                    await socket.send_str("40")
                    for _ in range(min(left, 50)):
                        found[path] += 1
                        message = event(chance, client)
                        try:
                            await (
                                socket.send_bytes(message)
                                if isinstance(message, bytes)
                                else socket.send_str(message)
                            )
                        except (ConnectionError, aiohttp.ClientError):
                            found[f"{path} closed"] += 1
                            break
        assert not other.done(), "another page has lost its socket"
        other.cancel()
        assert await follow(web, LAST), "a new page gets no panels"
    return found


async def page(web: aiohttp.ClientSession) -> str:
    """Asks for a page; the name that NiceGUI gives it."""
    text = await (await web.get("/")).text()
    name = re.search(r"client_id['\"]?: ?['\"]([0-9a-f-]{36})", text)
    assert name is not None
    return name[1]


async def follow(web: aiohttp.ClientSession, end: str) -> bool:
    """Follows a page that does nothing wrong until it is told some words; False: it is closed."""
    async with web.ws_connect(SOCKET + HANDSHAKE.format(await page(web)), max_msg_size=0) as socket:
        await socket.send_str("40")
        async for message in socket:
            if end in str(message.data):
                return True
            if message.data == "2":  # it is asked whether it is there
                await socket.send_str("3")
    return False


def attacked(folder: Path, count: int, seed: int) -> Counter[str]:
    """Starts a studio in a folder and attacks it, see `attack`; it is still there afterwards."""
    with served(folder) as (address, process):
        found = asyncio.run(attack(address, count, seed))
        assert process.poll() is None, "the server has ended"
    return found
