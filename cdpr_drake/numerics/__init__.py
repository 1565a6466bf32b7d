"""Small numerical tools that other packages share; they know nothing of robots.

Eigenpairs, least squares, small linear programs and copies for kernels; kernels by address, in
threads, and on other scalars; stable steps of explicit integrators; interval arithmetic; what data
cannot tell, in words; clocks that differ. Functions whose module ends in `_kernel` are compiled by
numba, write into what the caller gives and allocate nothing, unless they say so.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
