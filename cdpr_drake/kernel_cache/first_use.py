"""Says once that kernels are being compiled, where a program calls the library.

Commands say it themselves, before they import Drake; a program that imports the package would
otherwise be silent for half a minute at its first call.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import FrameType
from typing import Any

PACKAGE = "cdpr_drake"

GROUPS = {
    "solve_tensions": "tension",
    "solve_static": "static",
    "compute_workspace": "workspace",
    "assess_stability": "stability",
    "plan_path": "plan",
    "plan_free_motion": "plan",
    "simulate": "acrobot_pbvs_taut",
}
"""Groups of listed kernels (`kernel_list`) that verbs need."""

_listener: Any = None


def announce_first_use() -> None:
    """Lets the logger of this module warn once, when this process compiles a kernel that is kept.

    Nothing is imported for it: where numba is not there yet, nothing is done, and it may be called
    again. Python prints the line on stderr unless the program configures logging.
    """
    global _listener
    if _listener is not None or "numba.core.event" not in sys.modules:
        return
    event = sys.modules["numba.core.event"]

    class Listener(event.Listener):  # type: ignore[name-defined]
        said = False

        def on_start(self, event: Any) -> None:
            if not self.said and _is_kept_kernel(event.data):
                Listener.said = True
                logging = import_module("logging")  # which the import of the package goes without
                logging.getLogger(__name__).warning("%s", first_use_words(sys._getframe()))

        def on_end(self, event: Any) -> None:
            pass

    _listener = Listener()
    event.register("numba:compile", _listener)


def first_use_words(frame: FrameType) -> str:
    """What is said: the outermost call of this package, and how many kernels are missing for it.

    Args:
        frame: Of the call that compiles.
    """
    name = "compiled kernels"
    at: FrameType | None = frame.f_back
    while at is not None:
        if str(at.f_globals.get("__name__", "")).startswith(f"{PACKAGE}."):
            name = at.f_code.co_qualname.removesuffix(".__init__")
        at = at.f_back
    group, count = GROUPS.get(name), 0
    if group is not None:
        from cdpr_drake.kernel_cache.kernel_list import missing_kernels

        count = missing_kernels([group])
    many = f"up to {count} kernels" if count else "kernels"
    return f"first use of {name}: compiling {many}, which are kept"


def _is_kept_kernel(data: Any) -> bool:
    """Whether what is compiled is a kernel of this package that goes into the cache folder."""
    dispatcher = (data or {}).get("dispatcher")
    function = getattr(dispatcher, "py_func", None)
    kept = getattr(getattr(dispatcher, "_cache", None), "cache_path", None)
    return str(getattr(function, "__module__", "")).startswith(f"{PACKAGE}.") and kept is not None
