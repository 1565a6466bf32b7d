"""Where compiled kernels are kept, who compiles them, and processes that do so beside a command.

numba compiles one kernel after the other in a process, whatever processors there are. So commands
that need many start processes that begin with what comes last, while the command goes on. All
processes that share a cache folder share locks in it, one for each kernel: one compiles, whoever
needs it meanwhile waits and loads it. What commands need stands in `kernels.tsv`, which
`python -m tests.record_kernels` writes.

Nothing is started or hooked at import, and nothing heavy is imported; only dispatchers of this
package's own kernels are touched.
"""

from cdpr_drake.kernel_cache.beside import HELPERS, compile_beside, helpers_started
from cdpr_drake.kernel_cache.folder import use_kernel_cache
from cdpr_drake.kernel_cache.helper import compile_listed, compile_needed
from cdpr_drake.kernel_cache.kernel_list import (
    ListedKernel,
    group_names,
    is_complete,
    needed_kernels,
    note_complete,
)
from cdpr_drake.kernel_cache.locks import (
    CompilationLocks,
    compilation_waits,
    share_compilation,
    shared_locks,
)
from cdpr_drake.kernel_cache.signatures import signature_of, signature_words

__all__ = [
    "HELPERS",
    "CompilationLocks",
    "ListedKernel",
    "compilation_waits",
    "compile_beside",
    "compile_listed",
    "compile_needed",
    "group_names",
    "helpers_started",
    "is_complete",
    "needed_kernels",
    "note_complete",
    "share_compilation",
    "shared_locks",
    "signature_of",
    "signature_words",
    "use_kernel_cache",
]
