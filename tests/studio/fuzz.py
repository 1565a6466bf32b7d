"""Wrong values and files through the page's handlers: a message each, never a dead server.

Also so many hostile messages each to the door, scene and sockets of a server: nobody gets in.

`python -m tests.studio.fuzz --count 300 --seed 0`
"""

import argparse
import asyncio
import json
import os
import random
import re
import tempfile
from collections import Counter
from contextlib import suppress
from pathlib import Path
from urllib.parse import urlsplit

import aiohttp
from nicegui import ElementFilter, ui

from cdpr_drake.errors import CdprError
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

NAMES = "robot", "../robot", "a b", ".hidden", "x" * 200, "é", "a\0"
SUFFIXES = (".yaml", ".yml", ".xml", ".sdf", ".urdf", ".wcrfx", ".json", ".csv", ".exe", "")


def wrong_files(chance, text):
    """One to three files: damaged robots, other formats, noise."""
    content, files = text.encode(), {}
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        at = chance.randrange(len(content))
        files[chance.choice(NAMES) + chance.choice(SUFFIXES)] = chance.choice((
            chance.randbytes(chance.randrange(2000)),
            content[:at],
            content[:at] + chance.randbytes(3) + content[at + 3 :],
            b"<robot>" * chance.randrange(1, 3000),
            b"[" * chance.randrange(1, 30_000),
            b"a: &a [x, x]\nb: &b [*a, *a, *a, *a]\nc: [*b, *b, *b, *b]\n",
        ))  # fmt: skip
    return files


async def fuzz(count, seed, user, bench):
    """Tries wrong values and files; how many were refused in words, accepted, or changed nothing.

    Raises:
        AssertionError: Something was refused without a word, or the page does not answer any more.
    """
    chance, found = random.Random(seed), dict.fromkeys(("refused", "accepted", "unchanged"), 0)
    start, marks = bench.robot.text, _fields(user)
    for _ in range(count):
        if chance.random() < 0.3:
            found[_upload(bench, wrong_files(chance, start))] += 1
        else:
            found[await _type(user, bench, chance.choice(marks), chance.choice(WORDS))] += 1
        if bench.robot.text != start:
            bench.robot.change(start, bench.robot.path)
            marks = _fields(user)
    before = bench.answer
    bench.go_home()
    bench.ask()
    await until(lambda: bench.answer is not before)
    return found


def _fields(user):
    """Marks of all fields that are there."""
    with user:
        marks = {mark for one in ElementFilter(kind=ui.input) for mark in one._markers}
    return sorted(mark for mark in marks if mark.startswith(("cell-", "coordinate-")))


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


def _upload(bench, files):
    before, words = bench.robot.text, None
    try:
        bench.take_opened(bench.files.upload(files))
    except CdprError as problem:
        words = str(problem)
    assert words is None or (words and bench.robot.text == before)
    return "accepted" if words is None else "refused"


SOCKET = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
HANDSHAKE = "&client_id={}&implicit_handshake=true&tab_id=x&document_id=y&next_message_id=0"
"""Of NiceGUI's page, and how it says which one it is."""


def junk(chance, most=60):
    """Some bytes."""
    return chance.randbytes(chance.randrange(1, most))


def without_cookie(chance, token, port):
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


async def ask(port, request):
    """Sends a request as it is; the status of the answer, or that there is none."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    line = b""
    with suppress(TimeoutError, OSError):
        writer.write(request)
        writer.write_eof()
        line = await asyncio.wait_for(reader.readline(), 20.0)
    writer.close()
    return line.split(b" ")[1].decode() if line.count(b" ") > 1 else "none"


def event(chance, client):
    """A message of NiceGUI's page that is wrong: of what is not there, huge, nested, no JSON."""
    wrong = (None, -1, 1e308, "x" * 10_000, [], {}, [[[]]], {"a": {"b": [None]}}, "\ud800", True)
    keys = ("client_id", "id", "listener_id", "args", "request_id", "result", "next_message_id",
            "level", "tab_id", "document_id", "element_id", "args_id")  # fmt: skip
    names = ("event", "javascript_response", "ack", "log", "handshake", "x")
    body = {key: chance.choice(wrong) for key in keys}
    known = {"client_id": client, "id": chance.choice((0, 4, 10**9)), "args": [None]}
    body |= {key: value for key, value in known.items() if chance.random() < 0.6}
    body = chance.choice((body, body, body, chance.choice(wrong)))
    text = f"42{json.dumps([chance.choice((*names, chance.choice(wrong))), body])}"
    return chance.choice((
        text, text, text, text, text[: chance.randrange(len(text))], "42" + "[" * 5000, "4", "",
        "451-" + text[2:], "41", "2", "3probe", "9" * 50, junk(chance), "42" + "x" * 100_000,
    ))  # fmt: skip


async def attack(address, count, seed):
    """Sends so many messages of each of three kinds; what came of them.

    Raises:
        AssertionError: Somebody got in, or another page does not go on.
    """
    chance, found, parts = random.Random(seed), Counter(), urlsplit(address)
    token = parts.query.partition("=")[2]
    for _ in range(count):
        status = await ask(parts.port, without_cookie(chance, token, parts.port))
        found[f"door {status}"] += 1
        assert status in ("none", "400", "403"), status
    home, jar = f"http://127.0.0.1:{parts.port}", aiohttp.CookieJar(unsafe=True)
    async with aiohttp.ClientSession(home, cookie_jar=jar, raise_for_status=True) as web:
        await (await web.get(f"/?{parts.query}")).read()
        other = asyncio.create_task(follow(web, "never said"))
        for path in (SCENE + "?", SOCKET):
            while found[path] < count:
                await send_events(web, path, chance, found, min(count - found[path], 50))
        assert not other.done(), "another page has lost its socket"
        other.cancel()
        last = f'"name":"{list(PANELS)[-1]}"'  # said to a page whose panels have all been placed
        assert await follow(web, last), "a new page gets no panels"
    return found


async def send_events(web, path, chance, found, count):
    """Sends wrong messages of a new page until its socket is closed."""
    client = await page(web)
    async with web.ws_connect(path + HANDSHAKE.format(client)) as socket:
        await socket.send_str("40")
        for _ in range(count):
            found[path] += 1
            message = event(chance, client)
            send = socket.send_str if isinstance(message, str) else socket.send_bytes
            try:
                await send(message)
            except (ConnectionError, aiohttp.ClientError):
                found[f"{path} closed"] += 1
                return


async def page(web):
    """Asks for a page; the name that NiceGUI gives it."""
    text = await (await web.get("/")).text()
    return re.search(r"client_id['\"]?: ?['\"]([0-9a-f-]{36})", text)[1]


async def follow(web, end):
    """Follows a page that does nothing wrong until it is told some words; False: it is closed."""
    async with web.ws_connect(SOCKET + HANDSHAKE.format(await page(web)), max_msg_size=0) as socket:
        await socket.send_str("40")
        async for message in socket:
            if end in str(message.data):
                return True
            if message.data == "2":  # it is asked whether it is there
                await socket.send_str("3")
    return False


async def _tried(count, seed, folder):
    async with opened_page(folder) as (user, bench, _):
        await until(lambda: bench.answer is not None)
        return await fuzz(count, seed, user, bench)


def main():
    """Runs it from the command line."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--count", type=int, default=300)
    options.add_argument("--seed", type=int, default=0)
    asked = options.parse_args()
    os.environ["PYTEST_CURRENT_TEST"] = "fuzz"  # by which NiceGUI knows that nothing is served
    with tempfile.TemporaryDirectory() as folder:
        print(asyncio.run(_tried(asked.count, asked.seed, Path(folder))))
        with served(folder) as (address, process):
            found = asyncio.run(attack(address, asked.count, asked.seed))
            assert process.poll() is None, "the server has ended"
        print(found)


if __name__ == "__main__":
    main()
