"""A Meshcat that a browser can open: where it listens, and one line where it cannot."""

from __future__ import annotations

import logging
import socket
from collections.abc import Iterator
from contextlib import contextmanager

from pydrake.geometry import Meshcat, MeshcatParams

from cdpr_drake.errors import MeshcatError

LOCAL = "localhost"
"""Where only this machine looks."""

EVERYWHERE = ("*", "0.0.0.0")
"""What stands for all addresses of this machine."""

PORTS = (1024, 65535)
"""Ports that Drake accepts."""


def open_meshcat(host: str = LOCAL, port: int | None = None) -> Meshcat:
    """A Meshcat that listens, without a line in the log.

    Args:
        host: Name or address of this machine at which it listens; * for all of them.
        port: Port; None: the first free one from 7000 to 7099.

    Raises:
        MeshcatError: The host is not this machine, or the port is taken or not accepted.
    """
    if port is not None and not PORTS[0] <= port <= PORTS[1]:
        raise MeshcatError(f"port: found {port}; accepted: {PORTS[0]} to {PORTS[1]}")
    if host not in EVERYWHERE:
        _check_host(host)
    try:
        with _quiet_drake():
            return Meshcat(MeshcatParams(host=host, port=port, show_stats_plot=False))
    except RuntimeError as problem:
        where = "any of the ports 7000 to 7099" if port is None else f"port {port}"
        raise MeshcatError(
            f"host, port: {host} cannot listen at {where}, taken perhaps; name another port"
        ) from problem


def page_address(meshcat: Meshcat, host: str = LOCAL) -> str:
    """What to open in a browser, also on another machine where `host` stands for all addresses."""
    address = str(meshcat.web_url())
    if host in EVERYWHERE:
        return f"http://{socket.gethostname()}:{meshcat.port()}"
    return address


def _check_host(host: str) -> None:
    """Drake would try a name that is not there at a hundred ports."""
    try:
        family, _, _, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.bind(address)
    except (OSError, UnicodeError) as problem:
        raise MeshcatError(
            f"host: found {host!r}: {getattr(problem, 'strerror', None) or problem}; accepted: a "
            "name or address of this machine, or * for all of them"
        ) from problem


@contextmanager
def _quiet_drake() -> Iterator[None]:
    """Drake would say where Meshcat listens, in the output of a notebook's cell, too."""
    log = logging.getLogger("drake")
    before = log.level
    log.setLevel(max(before, logging.WARNING))
    try:
        yield
    finally:
        log.setLevel(before)
