"""Settings that all tests share."""

import collections
import gc
import hashlib
import os
import runpy
from pathlib import Path

import pytest
from hypothesis import settings

from tests.chromium import chromium

# Kernels compile at their first call, so time says nothing; and a run that fails, fails again.
# Examples at random: `pytest --hypothesis-profile=random`.
settings.register_profile("random", deadline=None, max_examples=500)
settings.register_profile("same", deadline=None, derandomize=True)
settings.load_profile("same")

# One thread for linear algebra, before NumPy is loaded: ours is small, and OpenBLAS's other threads
# wait busily after every call, on the processor that the next worker needs.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _kernel_cache() -> Path:
    """A folder of its own for every state of the kernels' sources.

    numba keeps a compiled kernel as long as the kernel's own file is the same, also where another
    one that it calls has changed: tests would pass on what is no longer there.
    """
    root = Path(__file__).parent.parent
    sources = sorted(path for path in root.glob("cdpr_drake/*/**/*.py"))
    kernels = [path.read_bytes() for path in sources if b"njit" in path.read_bytes()]
    kept = Path(os.environ.get("CDPR_TEST_KERNELS", root / ".numba_cache"))
    return kept / hashlib.sha256(b"".join(kernels)).hexdigest()[:12]


os.environ.setdefault("NUMBA_CACHE_DIR", str(_kernel_cache()))

HERE = Path(__file__).parent
COMPILE_ONCE = HERE / "compile_once"
if "CDPR_DRAKE_TEST_SESSION" not in os.environ:  # else this process has it from another one
    os.environ["CDPR_DRAKE_TEST_SESSION"] = "yes"
    os.environ["CDPR_COMPILE_HELPERS"] = "0"  # tests keep all processors busy already
    kept = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join([str(COMPILE_ONCE), *([kept] if kept else [])])
    runpy.run_path(str(COMPILE_ONCE / "sitecustomize.py"))


@pytest.fixture(scope="session")
def started_browser(tmp_path_factory):
    """One for all tests of pages, see `tests.chromium.cleared`."""
    with chromium(tmp_path_factory.mktemp("profile")) as page:
        yield page


SLOW = ("analyses", "bridge", "docs", "studio", "cli")
"""Folders of tests that take long."""


def pytest_collection_modifyitems(items):
    """Long tests early, so that nobody waits for them in the end: notebooks first, others halfway.

    There the second of two workers begins, see below.
    """
    parts = {name: [] for name in ("test_notebooks.py", *SLOW, "")}
    for item in items:
        folder = item.path.relative_to(HERE).parts[0] if item.path.is_relative_to(HERE) else ""
        parts[folder if folder in parts else ""].append(item)
    notebooks, *slow, short = parts.values()
    slow = [item for folder in slow for item in folder]
    before = max(len(items) // 2 - len(notebooks), 0)
    items[:] = [*notebooks, *short[:before], *slow, *short[before:]]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Each worker its share of the tests in order, and then of what another one has left.

    xdist's own choice deals out in small pieces, so that what a module's tests share is made in
    several workers, and in large ones at the start, which nobody can take over.
    """
    if config.getvalue("dist") != "load":
        return None  # somebody asked for another one
    from xdist.scheduler import WorkStealingScheduling

    return WorkStealingScheduling(config, log)


def pytest_addoption(parser):
    parser.addoption("--folders", action="store_true", help="tests and processor time by folder")


def _processor_time():
    """Of this process and those that it has waited for [s]."""
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """Reports say what tests have cost, with fixtures and processes that were made for them."""
    report = yield
    if call.when == "setup":
        item.began = _ended[0]
    if call.when == "teardown":
        _ended[0] = _processor_time()
        report.processor_time = _ended[0] - item.began
    return report


_ended = [_processor_time()]
"""Processor time at the end of the last test [s]."""

_folders = collections.defaultdict(list)
"""Processor times of the tests of each folder [s]."""


def pytest_collection_finish():
    _ended[0] = _processor_time()


def pytest_runtest_logreport(report):
    if report.when == "teardown":
        folder = report.nodeid.partition("::")[0].rpartition("/")[0]
        _folders[folder].append(report.processor_time)


def pytest_terminal_summary(terminalreporter):
    """What the session has cost: this process, and all that it has waited for, as its workers.

    A machine that others use as well makes a session longer, but hardly dearer.
    """
    if terminalreporter.config.getoption("--folders"):
        terminalreporter.write_line("\n  lines  tests  processor seconds")
        for folder, costs in sorted(_folders.items(), key=lambda one: -sum(one[1])):
            files = (HERE.parent / folder).glob("*.py")
            lines = sum(len(path.read_bytes().splitlines()) for path in files)
            terminalreporter.write_line(f"{lines:7} {len(costs):6} {sum(costs):8.1f}  {folder}")
    minutes, seconds = divmod(round(_processor_time()), 60)
    terminalreporter.write_line(f"processor time of all processes: {minutes} min {seconds:02} s")


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """What is collected stays to the end: the collector of garbage need not look at it, ever."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
