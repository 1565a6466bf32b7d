"""The version of this package."""

from importlib.metadata import version

__version__ = version("cdpr_drake")
"""As pip knows it."""
