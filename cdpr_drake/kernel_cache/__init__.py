"""Compiled kernels: the folder that keeps them, locks, the list, compilation in the background.

numba compiles one kernel after the other in a process, whatever processors there are. So commands
that need many start processes that begin with what comes last, while the command goes on. All
processes that share a cache folder share locks in it, one for each kernel: one compiles, whoever
needs it meanwhile waits and loads it. What commands need stands in `kernels.tsv`, which
`python -m tests.record_kernels` writes.

Nothing is started or hooked at import, and nothing heavy is imported; only dispatchers of this
package's own kernels are touched.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
