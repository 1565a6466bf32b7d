"""Options and folders that `cdpr design` has in common with workspaces."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Annotated, Any

import typer

ForceToResist = Annotated[
    float | None, typer.Option(help="Largest force to resist along each axis [N].")
]
MomentToResist = Annotated[
    float | None, typer.Option(help="Largest moment to resist about each axis [N m].")
]


def default_folder(command: str, name: str, arguments: dict[str, Any]) -> Path:
    """A folder below the command's that the same arguments find again."""
    digest = hashlib.sha256(json.dumps(arguments, sort_keys=True).encode()).hexdigest()
    return Path(command) / f"{name}-{digest[:8]}"
