"""Starts processes that compile what a command will need, while it goes on."""

from __future__ import annotations

import atexit
import os
import sys
import threading
from collections.abc import Collection
from pathlib import Path
from typing import Any

from cdpr_drake.errors import CdprError
from cdpr_drake.kernel_cache.kernel_list import is_complete
from cdpr_drake.kernel_cache.locks import shared_locks

HELPERS = "CDPR_COMPILE_HELPERS"
"""Environment variable: how many processes compile beside a command at most; 0: none."""

MOST = 3
"""More would wait for each other: kernels call kernels."""

LONGEST_END = 5.0
"""A process that compiles is killed if it has not ended by itself after so long [s]."""


def compile_in_background(groups: Collection[str], most: int = MOST) -> int:
    """Starts processes that compile the kernels of some groups into the cache folder.

    Nothing is started where all are there, where this process may use one processor only, or where
    nothing can be kept. The processes are silent, and end with this one, also where it is killed.

    Args:
        groups: Names out of `group_names`.
        most: The most processes; there are never more than processors beside this process's own.

    Returns:
        How many were started.

    Raises:
        CdprError: The environment variable `HELPERS` is no number.
    """
    words = os.environ.get(HELPERS) or str(most)
    if not words.isdecimal():
        raise CdprError(f"{HELPERS}: found {words!r}; accepted: a whole number from 0 on")
    count = min(int(words), _processors() - 1)
    if count < 1 or not groups or not sys.executable or is_complete(groups):
        return 0
    if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0" or shared_locks() is None:
        return 0
    for started in range(count):
        try:
            _start(groups)
        except OSError:  # the system has no more processes: the command compiles by itself
            return started
    return count


def helpers_started() -> int:
    """How many processes this one has started to compile beside it."""
    return len(_started)


_started: list[Any] = []


def _processors() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _start(groups: Collection[str]) -> None:
    import subprocess

    above = str(Path(__file__).parent.parent.parent)
    path = os.environ.get("PYTHONPATH")
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([above, *([path] if path else [])]),
        "OPENBLAS_NUM_THREADS": "1",
        HELPERS: "0",
    }
    # -P: nothing in the working folder is imported by accident.
    command = [sys.executable, "-P", "-m", "cdpr_drake.kernel_cache", *groups]
    process = subprocess.Popen(
        command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
        stderr=None if os.environ.get("CDPR_TRACEBACK") else subprocess.DEVNULL,
    )  # fmt: skip
    _started.append(process)
    threading.Thread(target=process.wait, daemon=True).start()  # nothing is left when it ends
    atexit.register(_end, process)


def _end(process: Any) -> None:
    """Ends a process by the pipe that it holds on to; it may be writing a kernel."""
    import subprocess

    process.stdin.close()
    try:
        process.wait(LONGEST_END)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
