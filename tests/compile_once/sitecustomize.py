"""Lets one process compile a kernel while all others that need it wait, and then load it.

And keeps sweeps of which nobody says in how many processes in the one that asks.

Python imports a module of this name when it starts. `conftest.py` puts its folder in front of
PYTHONPATH, so that this counts for all processes of a test session alike: workers, notebooks,
commands and what they start. Without it each would compile the same at the same time.
"""

import fcntl
import gc
import hashlib
import os
import sys
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path

FOLDER = "CDPR_DRAKE_TEST_LOCKS"
"""Environment variable: where the locks are; without it nothing is shared."""

_held = set()


@contextmanager
def _alone(dispatcher):
    """While no other process compiles the kernel; nested calls of kernels go from caller to called.

    So nobody waits for one that waits for it, as long as no two kernels call each other.
    """
    cache = dispatcher._cache
    folder = getattr(cache, "cache_path", None)  # none where a kernel is not cached
    if folder is None:
        yield
        return
    name = hashlib.sha256(f"{folder}/{cache._impl.filename_base}".encode()).hexdigest()[:24]
    if name in _held:
        yield
        return
    with (Path(os.environ[FOLDER]) / name).open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # which the system takes away from those that die
        _held.add(name)
        try:
            yield
        finally:
            _held.discard(name)


@contextmanager
def _unsearched():
    """The compiler makes many objects and little garbage; each search for it walks through all."""
    paused = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if paused:
            gc.enable()


def share(module):
    """Makes numba's dispatchers in `numba.core.dispatcher` compile one kernel in one process."""
    compile_here, lock = module.Dispatcher.compile, module.global_compiler_lock

    def compile_once(self, sig):
        with lock, _alone(self), _unsearched():  # numba's own first, which is that of threads
            return compile_here(self, sig)

    module.Dispatcher.compile = compile_once


def stay(module):
    """Without a word of how many, jobs are done in the process that asks.

    Tests keep all processors busy already, and a process that imports Drake and loads kernels for
    a few jobs costs more than these.
    """
    module.default_workers = lambda: 1


CHANGES = {
    "numba.core.dispatcher": share,
    "cdpr_drake.analyses.sweeps.worker_pool": stay,
}
"""Modules, and what is done to them once they are imported."""


class _WhenTheyCome(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name not in CHANGES:
            return None
        spec = PathFinder.find_spec(name, path)
        really = spec.loader.exec_module

        def exec_module(module):
            really(module)
            CHANGES[name](module)

        spec.loader.exec_module = exec_module
        return spec


def _the_next_one():
    """Whoever else has a module of this name, such as an editor, shall not miss it."""
    here = str(Path(__file__).parent)
    spec = PathFinder.find_spec("sitecustomize", [p for p in sys.path if p != here])
    if spec is not None and spec.origin != __file__:
        spec.loader.exec_module(module_from_spec(spec))


if FOLDER in os.environ:
    os.makedirs(os.environ[FOLDER], exist_ok=True)
    if "numba.core.dispatcher" not in sys.modules:
        sys.meta_path.insert(0, _WhenTheyCome())
if __name__ == "sitecustomize":
    _the_next_one()
