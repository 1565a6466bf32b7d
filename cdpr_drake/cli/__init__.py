"""The `cdpr` command. Each subcommand lives in a file of its own; nothing imports this package."""

from cdpr_drake.cli.app import main

__all__ = ["main"]
