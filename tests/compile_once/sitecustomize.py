"""Lets one process compile a kernel while all others that need it wait, and then load it.

And keeps sweeps of which nobody says in how many processes in the one that asks.

Python imports a module of this name when it starts. `conftest.py` puts its folder in front of
PYTHONPATH, so that this counts for all processes of a test session alike: workers, notebooks,
commands and what they start. Without it each would compile the same at the same time.
"""

import gc
import os
import sys
from contextlib import contextmanager, suppress
from importlib.abc import MetaPathFinder
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path

MARK = "CDPR_DRAKE_TEST_SESSION"
"""Environment variable: it is there in processes of a test session; without it nothing is done."""


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
    """Makes numba's dispatchers in `numba.core.dispatcher` compile one kernel in one process.

    By the package's own locks, in the folder where kernels are kept.
    """
    compile_here = module.Dispatcher.compile

    def compile_unsearched(self, sig):
        with _unsearched():
            return compile_here(self, sig)

    module.Dispatcher.compile = compile_unsearched
    with suppress(ImportError):  # in a process that has nothing of this package
        from cdpr_drake.kernel_cache.locks import share_compilation

        share_compilation()


def stay(module):
    """Without a word of how many, jobs are done in the process that asks.

    Tests keep all processors busy already, and a process that imports Drake and loads kernels for
    a few jobs costs more than these.
    """
    module.default_workers = lambda: 1


CHANGES = {
    "numba.core.dispatcher": share,
    "cdpr_drake.analyses.frame.jobs": stay,
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


if MARK in os.environ and "numba.core.dispatcher" not in sys.modules:
    sys.meta_path.insert(0, _WhenTheyCome())
if __name__ == "sitecustomize":
    _the_next_one()
