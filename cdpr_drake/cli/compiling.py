"""Whether kernels are being compiled, which on the first use takes longer than all else."""

from __future__ import annotations

import gc
import os
import sys
import time
from pathlib import Path
from typing import Any

from cdpr_drake.cli.process import expected_kernels
from cdpr_drake.kernel_cache.background import helpers_started
from cdpr_drake.kernel_cache.locks import compilation_waits

LINGER = 1.0
"""Between two kernels that are compiled there may pass so much time [s]."""


def _is_first_use() -> bool:
    """Whether no kernel was ever compiled and kept for these sources."""
    folder = Path(os.environ.get("NUMBA_CACHE_DIR", ""))
    return not any(folder.rglob("*.nbi"))


FIRST_USE = helpers_started() > 0 or _is_first_use()
"""As it was when the program began; processes that it starts compile, too."""


class _Compilations:
    """Counts what numba compiles in this process, but for its own functions, once numba is there.

    Meanwhile garbage is not searched for: the compiler makes many objects and little garbage, and
    each search walks through all of Drake and numba, an eighth of the time.
    """

    def __init__(self) -> None:
        self.count, self._depth, self._last, self._listens = 0, 0, -LINGER, False
        self._paused = False

    def listen(self) -> None:
        """Begins to count, if numba is imported; it is not for this."""
        if self._listens or "numba.core.event" not in sys.modules:
            return
        event = sys.modules["numba.core.event"]
        outer = self

        class Listener(event.Listener):  # type: ignore[name-defined]
            def on_start(self, event: Any) -> None:
                outer.count += not _is_of_numba(event.data)
                outer._depth += 1
                if gc.isenabled():
                    gc.disable()
                    outer._paused = True

            def on_end(self, event: Any) -> None:
                outer._depth = max(outer._depth - 1, 0)  # what began before this could listen
                outer._last = time.monotonic()
                if outer._depth == 0 and outer._paused:
                    gc.enable()
                    outer._paused = False

        event.register("numba:compile", Listener())
        self._listens = True

    def under_way(self) -> bool:
        return self._depth > 0 or compilation_waits() or time.monotonic() - self._last < LINGER


def _is_of_numba(data: Any) -> bool:
    """Whether an event of the compiler is about one of numba's functions, as `np.empty`."""
    compiled = (data or {}).get("dispatcher")
    module = getattr(getattr(compiled, "py_func", None), "__module__", None)
    return str(module).startswith("numba.")


_compilations = _Compilations()


def pause_for_compilation() -> None:
    """Lets no garbage be searched for from now on while kernels are compiled."""
    _compilations.listen()


def compiling() -> str:
    """Words for what is compiled now; empty where nothing is."""
    _compilations.listen()
    if not _compilations.under_way():
        return ""
    count, listed = _compilations.count, expected_kernels()
    if 0 < count <= listed:
        return f"compiling, first use, {count} of up to {listed} kernels"
    return f"compiling, first use, {count} kernels so far"
