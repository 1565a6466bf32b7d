"""Settings that all tests share."""

import gc
import hashlib
import os
from pathlib import Path

import pytest
from hypothesis import settings

# Kernels compile at their first call, so time says nothing; and a run that fails, fails again.
# Examples at random: `pytest --hypothesis-profile=random`.
settings.register_profile("random", deadline=None, max_examples=500)
settings.register_profile("same", deadline=None, derandomize=True)
settings.load_profile("same")


def _kernel_cache() -> Path:
    """A folder of its own for every state of the kernels' sources.

    numba keeps a compiled kernel as long as the kernel's own file is the same, also where another
    one that it calls has changed: tests would pass on what is no longer there.
    """
    root = Path(__file__).parent.parent
    sources = sorted(path for path in root.glob("cdpr_drake/*/**/*.py"))
    kernels = [path.read_bytes() for path in sources if b"njit" in path.read_bytes()]
    return root / ".numba_cache" / hashlib.sha256(b"".join(kernels)).hexdigest()[:12]


os.environ.setdefault("NUMBA_CACHE_DIR", str(_kernel_cache()))


def pytest_collection_modifyitems(items):
    """Notebooks first: they take longest, and with several workers nobody should wait for them."""
    items.sort(key=lambda item: item.path.name != "test_notebooks.py")


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """What is collected stays to the end: the collector of garbage need not look at it, ever."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
