"""What this processor can do, as the system says it, and not as the program under test does."""

from pathlib import Path

import pytest

_INFO = Path("/proc/cpuinfo")

FUSES_PRODUCTS = _INFO.is_file() and " fma " in _INFO.read_text()
"""Whether sums of products are rounded once, as Drake's and the kernels' are where they can be."""

needs_fused_products = pytest.mark.skipif(
    not FUSES_PRODUCTS, reason="the processor does not fuse products: loops step in Python"
)
