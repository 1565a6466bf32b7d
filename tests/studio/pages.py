"""The studio's page without a browser: NiceGUI's simulated user, and no plugin of pytest."""

import asyncio
import re
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from io import BytesIO
from zipfile import ZipFile

from nicegui import ElementFilter, ui
from nicegui.testing.user_simulation import user_simulation

from cdpr_drake.cli.studio import verbs
from cdpr_drake.studio.document import with_value
from cdpr_drake.studio.files import WorkingFolder
from cdpr_drake.studio.page import make_page
from cdpr_drake.studio.session import Workbench

LONGEST = 1200.0
"""Nothing here takes as long, unless it hangs [s]."""


@asynccontextmanager
async def simulated(root):
    """A user who has opened what a function makes."""
    failed = None  # NiceGUI's timers go on forever where an exception passes through it
    async with user_simulation(root) as user:
        await user.open("/")
        try:
            yield user
        except BaseException as problem:
            failed = problem
    if failed is not None:
        raise failed


@asynccontextmanager
async def opened_page(folder, robot="acrobot_large"):
    """A user who has opened the page, their workbench and client."""
    calculator = ThreadPoolExecutor(1)
    folder = WorkingFolder(folder)
    bench = Workbench(folder, robot, calculator=calculator, commands=verbs)
    try:
        async with simulated(make_page(lambda _: bench)) as user:
            await until(lambda: not shown(user, "panel-loading"))
            yield user, bench, user.client
    finally:
        calculator.shutdown(cancel_futures=True)


async def settled(bench):
    """Waits until what was asked last is answered and told."""
    await until(lambda: not bench.is_computing and bench._telling is None)


async def until(condition, seconds=300.0):
    """Waits until something holds; kernels may have to be compiled first."""
    for _ in range(int(seconds / 0.02)):
        if condition():
            return
        await asyncio.sleep(0.02)
    raise AssertionError("it never came to hold")


def field(user, name):
    """The only element with a mark."""
    (element,) = user.find(marker=name).elements
    return element


def shown(user, name):
    """Whether an element with a mark is to be seen."""
    try:
        return bool(user.find(marker=name).elements)
    except AssertionError:
        return False


def in_scene(bench, path):
    """Whether the scene has something, once what was drawn before is there."""
    return bench.calculator.submit(lambda: bench.scene().meshcat.HasPath(path)).result(60.0)


def unfold(user):
    """Unfolds all groups of the robot's form, whose fields come then."""
    with user:
        for fold in ElementFilter(kind=ui.expansion):
            if any(mark.startswith("cell-group-") for mark in fold._markers):
                fold.value = True


def type_into(user, name, words):
    """Types words into a field, and presses Enter."""
    found = user.find(marker=name)
    (element,) = found.elements
    element.value = words
    found.trigger("keydown.enter")


async def do(user, *steps):
    """Does one step after the other, each as soon as the page lets it.

    `mark` clicks an element, `mark=words` types into it, `mark: words` waits until it has words.
    """
    for step in steps:
        name, kind, words = re.fullmatch(r"([\w.-]+)(=|: ?|)(.*)", step, re.DOTALL).groups()
        if kind.startswith(":"):
            await until(lambda name=name, words=words: says(user, name, words), LONGEST)
            continue
        await until(lambda name=name: takes(user, name), LONGEST)
        if kind:
            type_into(user, name, words)
        else:
            user.find(marker=name).click()


def seen(user, name):
    """The elements with a mark that are to be seen."""
    return user.find(marker=name).elements if shown(user, name) else ()


def takes(user, name):
    """Whether there are such elements, none of them disabled."""
    elements = seen(user, name)
    return bool(elements) and all(getattr(one, "enabled", True) for one in elements)


def says(user, name, words):
    """Whether one of them has some words: as text, HTML, value, refusal or option."""
    keys = "text", "content", "value", "error", "options"
    return any(words in str(getattr(one, key, "")) for one in seen(user, name) for key in keys)


def problems(user):
    """What the page says is wrong, beside fields and over the page."""
    with user:
        labels = ElementFilter(kind=ui.label)
        said = [label.text for label in labels if "problem" in " ".join(label.classes)]
    return [words for words in [*said, *user.notify.messages] if words]


def put(document, place, value):
    """Changes one value of a document."""
    document.change(with_value(document.text, place, value))


@asynccontextmanager
async def another_tab(user):
    """The user does what is inside in another tab, and is back in this one then."""
    first = user.client
    second = await user.open("/")
    await until(lambda: not shown(user, "panel-loading"))
    try:
        yield
    finally:
        second.delete()
        user.client = first


async def archive(user):
    """Names and bytes of what is in the zip archive that the user gets."""
    sent = await user.download.next(timeout=LONGEST)
    with ZipFile(BytesIO(sent.content)) as file:
        return {name: file.read(name) for name in file.namelist()}
