"""Wrong values through the page's fields: a message each, never a dead server.

Also wrong messages to the scene and the sockets of a server, by who has a cookie:
`python -m tests.studio.fuzz [COUNT [SEED]]` tries so many of each.
"""

import asyncio
import json
import os
import random
import re
import sys
import tempfile
from collections import Counter
from contextlib import suppress
from pathlib import Path

import aiohttp
from nicegui import ElementFilter, ui

from cdpr_drake.studio.page import SCENE
from cdpr_drake.studio.panel import PANELS
from tests.studio.pages import field, opened_page, problems, type_into, until
from tests.studio.served import served

WORDS = [
    "", " ", "abc", "nan", "inf", "-inf", "1e999", "-1", "1e-300", "1e40", "0x10", "1,2", "1;2",
    "[1, 2]", "{a: 1}", "*x", "&x 1", "!!python/name:os.system", "'", '"', "\\", "\n", "\0", "%",
    "null", "~", "yes", "<script>alert(1)</script>", "../../etc/passwd", "x" * 10_000, "∞", "٣",
    "\ud800", "1 2 3 4 5 6 7 8", "true", "#", "- - -", "? x", "|", ">-", "1_0", "1.5.2",
]  # fmt: skip
"""What people and others type."""


async def fuzz(count, seed, user, bench):
    """Types wrong values; how many were refused in words, accepted, or changed nothing.

    Raises:
        AssertionError: Something was refused without a word, or the page does not answer any more.
    """
    chance, found, start = random.Random(seed), Counter(), bench.robot.text
    with user:
        marks = {mark for one in ElementFilter(kind=ui.input) for mark in one._markers}
    fields = sorted(mark for mark in marks if mark.startswith(("cell-", "coordinate-")))
    for _ in range(count):
        found[await _type(user, bench, chance.choice(fields), chance.choice(WORDS))] += 1
        if bench.robot.text != start:
            bench.robot.change(start, bench.robot.path)
    before = bench.answer
    bench.go_home()
    bench.ask()
    await until(lambda: bench.answer is not before)
    return found


async def _type(user, bench, mark, words):
    before, element = (bench.robot.text, list(bench.coordinates)), field(user, mark)
    shown = element.value
    type_into(user, mark, words)
    await asyncio.sleep(0)
    await bench.robot.settled()
    if before != (bench.robot.text, list(bench.coordinates)):
        return "accepted"
    if words.strip() == str(shown or "").strip():
        return "unchanged"
    said = [*problems(user), *filter(None, [getattr(element, "error", None)])]
    assert said or words in ("null", "~"), f"{mark}: {words[:60]!r} without a word"
    assert all(len(line) <= 600 for text in said for line in text.split("\n")), said
    user.notify.messages.clear()
    type_into(user, mark, shown)
    await asyncio.sleep(0)
    return "refused" if said else "unchanged"


SOCKET = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"


def message(chance, client):
    """One of NiceGUI's page that is wrong: of what is not there, huge, nested, no JSON."""
    wrong = (None, -1, 1e308, "x" * 10_000, [], {}, [[[]]], {"a": {"b": [None]}}, "\ud800", True)
    keys = ("client_id", "id", "listener_id", "args", "request_id", "result", "next_message_id",
            "level", "tab_id", "document_id", "element_id", "args_id")  # fmt: skip
    names = ("event", "javascript_response", "ack", "log", "handshake", "x")
    body = {key: chance.choice(wrong) for key in keys}
    right = {"client_id": client, "id": chance.choice((0, 4, 10**9)), "args": [None]}
    body |= {key: value for key, value in right.items() if chance.random() < 0.6}
    words = [chance.choice((*names, *wrong)), chance.choice((body, body, chance.choice(wrong)))]
    text = f"42{json.dumps(words)}"
    return chance.choice((
        text, text, text, text, text[: chance.randrange(len(text))], "42" + "[" * 5000, "4", "",
        "451-" + text[2:], "41", "2", "3probe", "9" * 50, "42" + "x" * 100_000, "\0\x7f",
    ))  # fmt: skip


async def attack(address, count, seed):
    """Sends so many wrong messages each to scene and socket, of pages that are opened for it.

    Raises:
        AssertionError: A new page does not come then.
    """
    chance, (home, _, query) = random.Random(seed), address.partition("/?")
    jar = aiohttp.CookieJar(unsafe=True)
    async with aiohttp.ClientSession(home, cookie_jar=jar, raise_for_status=True) as web:
        await (await web.get(f"/?{query}")).read()
        for _ in range(0, count, 50):
            for path in (f"{SCENE}?", SOCKET):
                socket, client = await open_page(web, path)
                async with socket:
                    with suppress(ConnectionError, aiohttp.ClientError):  # it has been closed
                        for _ in range(50):
                            await socket.send_str(message(chance, client))
        socket, _ = await open_page(web, SOCKET)
        last = f'"name":"{list(PANELS)[-1]}"'  # said to a page whose panels have all been placed
        async with socket:
            async for said in socket:
                if last in str(said.data):
                    return
                if said.data == "2":  # it is asked whether it is there
                    await socket.send_str("3")
    raise AssertionError("a new page gets no panels")


async def open_page(web, path):
    """The socket of a new page below a path, and the name that NiceGUI gives the page."""
    text = await (await web.get("/")).text()
    client = re.search(r"client_id['\"]?: ?['\"]([0-9a-f-]{36})", text)[1]
    shake = f"&client_id={client}&implicit_handshake=true&tab_id=x&document_id=y&next_message_id=0"
    socket = await web.ws_connect(path + shake, max_msg_size=0)
    await socket.send_str("40")
    return socket, client


def main(count=300, seed=0):
    """Tries all, and prints what came of it."""

    async def try_page(folder):
        async with opened_page(folder) as (user, bench, _):
            await until(lambda: bench.answer is not None)
            return await fuzz(count, seed, user, bench)

    os.environ["PYTEST_CURRENT_TEST"] = "fuzz"  # by which NiceGUI knows that nothing is served
    with tempfile.TemporaryDirectory() as folder:
        print(asyncio.run(try_page(Path(folder))))
        with served(folder) as (address, process):
            asyncio.run(attack(address, count, seed))
            assert process.poll() is None, "the server has ended"


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
