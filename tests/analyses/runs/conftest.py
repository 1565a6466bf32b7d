"""Fixtures of commands."""

from tests.cli.conftest import here, without_pictures

__all__ = ["here", "without_pictures"]
