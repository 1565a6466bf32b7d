"""Wrong values and files through the page's handlers: a message each, never a dead server.

Also so many hostile messages each to the door, scene and sockets of a server, see `hostile`.

`python -m tests.studio.fuzz --count 300 --seed 0`
"""

from __future__ import annotations

import argparse
import asyncio
import os
import random
import tempfile
from pathlib import Path

from nicegui import ElementFilter, ui

from cdpr_drake.errors import CdprError
from tests.studio.hostile import attacked
from tests.studio.pages import opened_page, problems, until

WORDS = [
    "", " ", "abc", "nan", "inf", "-inf", "1e999", "-1", "1e-300", "1e40", "0x10", "1,2", "1;2",
    "[1, 2]", "{a: 1}", "*x", "&x 1", "!!python/name:os.system", "'", '"', "\\", "\n", "\0", "%",
    "null", "~", "yes", "<script>alert(1)</script>", "../../etc/passwd", "x" * 10_000, "∞", "٣",
    "\ud800", "1 2 3 4 5 6 7 8", "true", "#", "- - -", "? x", "|", ">-", "1_0", "1.5.2",
]  # fmt: skip
"""What people and others type."""

SUFFIXES = (".yaml", ".yml", ".xml", ".sdf", ".urdf", ".wcrfx", ".json", ".csv", ".exe", "")


def wrong_file(chance: random.Random, text: str) -> dict[str, bytes]:
    """One to three files: damaged robots, other formats, noise."""
    files = {}
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        kind, content = chance.randrange(6), text.encode()
        if kind == 0:
            content = chance.randbytes(chance.randrange(2000))
        elif kind == 1:
            cut = chance.randrange(len(content))
            content = content[:cut]
        elif kind == 2:
            at = chance.randrange(len(content))
            content = content[:at] + chance.randbytes(3) + content[at + 3 :]
        elif kind == 3:
            content = b"<robot>" * chance.randrange(1, 3000)
        elif kind == 4:
            content = b"[" * chance.randrange(1, 30_000)
        else:
            content = b"a: &a [x, x]\nb: &b [*a, *a, *a, *a]\nc: [*b, *b, *b, *b]\n"
        name = chance.choice(("robot", "../robot", "a b", ".hidden", "x" * 200, "é", "a\0"))
        files[name + chance.choice(SUFFIXES)] = content
    return files


async def fuzz(count: int, seed: int, user, bench) -> dict[str, int]:
    """Tries wrong values and files; how many were refused in words, accepted, or changed nothing.

    Raises:
        AssertionError: Something was refused without a word, or the page does not answer any more.
    """
    chance, found = random.Random(seed), {"refused": 0, "accepted": 0, "unchanged": 0}
    start = bench.robot.text
    marks = _fields(user)
    for _ in range(count):
        if chance.random() < 0.3:
            found[_upload(bench, wrong_file(chance, start))] += 1
        else:
            found[await _type(user, bench, chance, marks)] += 1
        if bench.robot.text != start:
            bench.robot.change(start, bench.robot.path)
            marks = _fields(user)
    await _answers(bench)
    return found


def _fields(user) -> list[str]:
    """Marks of all fields that are there."""
    with user:
        marks = {mark for one in ElementFilter(kind=ui.input) for mark in one._markers}
    return sorted(mark for mark in marks if mark.startswith(("cell-", "coordinate-")))


async def _type(user, bench, chance: random.Random, marks: list[str]) -> str:
    mark, words, before = chance.choice(marks), chance.choice(WORDS), bench.robot.text
    coordinates, x = list(bench.coordinates), user.find(marker=mark)
    (element,) = x.elements
    shown, element.value = element.value, words
    x.trigger("keydown.enter")
    await asyncio.sleep(0)
    await bench.robot.settled()
    if bench.robot.text != before or coordinates != bench.coordinates:
        return "accepted"
    if words.strip() == str(shown):
        return "unchanged"
    said = [*problems(user), *([element.error] if getattr(element, "error", None) else [])]
    same = not words.strip() and not shown
    assert said or same or words in ("null", "~"), f"{mark}: {words[:60]!r} without a word"
    assert all(len(line) <= 600 for text in said for line in text.split("\n")), said
    user.notify.messages.clear()
    element.value = shown
    x.trigger("keydown.enter")
    await asyncio.sleep(0)
    return "refused" if said else "unchanged"


def _upload(bench, files: dict[str, bytes]) -> str:
    before, words = bench.robot.text, None
    try:
        bench.take_opened(bench.files.upload(files))
    except CdprError as problem:
        words = str(problem)
    assert words is None or (words and bench.robot.text == before)
    return "accepted" if words is None else "refused"


async def _answers(bench) -> None:
    """Whether the workbench still answers."""
    before = bench.answer
    bench.go_home()
    bench.ask()
    await until(lambda: bench.answer is not before)


def main() -> None:
    """Runs it from the command line."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--count", type=int, default=300)
    options.add_argument("--seed", type=int, default=0)
    asked = options.parse_args()
    os.environ["PYTEST_CURRENT_TEST"] = "fuzz"  # by which NiceGUI knows that nothing is served
    with tempfile.TemporaryDirectory() as folder:
        print(asyncio.run(_opened_and_tried(asked.count, asked.seed, Path(folder))))
        print(attacked(Path(folder), asked.count, asked.seed))


async def _opened_and_tried(count: int, seed: int, folder: Path) -> dict[str, int]:
    async with opened_page(folder) as (user, bench, _):
        await until(lambda: bench.answer is not None)
        return await fuzz(count, seed, user, bench)


if __name__ == "__main__":
    main()
