"""The studio's page without a browser: NiceGUI's simulated user, and no plugin of pytest."""

import asyncio
from contextlib import asynccontextmanager

from nicegui import ElementFilter, ui
from nicegui.testing.user_simulation import user_simulation

from cdpr_drake.cli.command_forms import command_forms
from cdpr_drake.studio.page import make_page
from cdpr_drake.studio.sessions import Sessions
from cdpr_drake.studio.workbench.calculator import Calculator
from cdpr_drake.studio.workbench.session import Workbench
from cdpr_drake.studio.workbench.working_folder import WorkingFolder


@asynccontextmanager
async def opened_page(folder, robot="acrobot_large"):
    """A user who has opened the page, and their workbench."""
    calculator = Calculator()
    sessions = Sessions(lambda: _bench(folder, robot, calculator))
    failed = None  # NiceGUI's timers go on forever where an exception passes through it
    try:
        async with user_simulation(make_page(sessions, lambda _: "one")) as user:
            client = await user.open("/")
            await until(lambda: not _loading(user))
            try:
                yield user, next(iter(sessions.benches())), client
            except BaseException as problem:
                failed = problem
    finally:
        calculator.close()
    if failed is not None:
        raise failed


def _loading(user):
    """Whether panels are still to come."""
    with user:
        return bool(list(ElementFilter(marker="panel-loading")))


def _bench(folder, robot, calculator):
    return Workbench(WorkingFolder(folder), robot, calculator=calculator, commands=command_forms)


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


def type_into(user, name, words):
    """Types words into a field, and presses Enter."""
    found = user.find(marker=name)
    (element,) = found.elements
    element.value = words
    found.trigger("keydown.enter")


def problems(user):
    """What the page says is wrong, beside fields and over the page."""
    with user:
        labels = ElementFilter(kind=ui.label)
        said = [label.text for label in labels if "problem" in " ".join(label.classes)]
    return [words for words in [*said, *user.notify.messages] if words]
