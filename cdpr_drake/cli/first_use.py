"""Which kernels a command will need, so that other processes compile them while it starts."""

from __future__ import annotations

from collections.abc import Sequence

from cdpr_drake.kernel_cache import compile_beside

DEFAULT = "acrobot_pbvs_taut"
"""The group of what `cdpr simulate` runs unasked; other scenarios need about the same."""

COMPILED = "acrobot_pbvs, compiled engine"

GROUPS = (DEFAULT, COMPILED)
"""All groups of the list."""

SIMULATIONS = ("simulate", "serve", "studio")

QUIET = ("--help", "--finish")
"""Words with which nothing is simulated."""


def compile_ahead(words: Sequence[str]) -> int:
    """Starts processes that compile what a command line will need, before it imports Drake.

    Args:
        words: The command line after `cdpr`.

    Returns:
        How many were started: 0 where all is there, and for commands that need little.
    """
    command = next((word for word in words if not word.startswith("-")), "")
    if command not in SIMULATIONS or any(word in QUIET for word in words):
        return 0
    compiled = "--seeds" in words or any(word.startswith("integration.") for word in words)
    return compile_beside([DEFAULT, COMPILED] if compiled else [DEFAULT])
