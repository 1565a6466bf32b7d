"""A Meshcat that only a door of this program reaches: where a browser looks, and what it may say.

Drake's Meshcat asks nobody who he is, and a message that it cannot read, such as a camera of NaN,
ends its process. So its own port answers nobody (`_Seal`), and a `MeshcatDoor` connects to it
for those who may look: it hands the scene on and nothing back, since no scene here has buttons.
A web page of another site is refused by its Origin, one that came by another name by its Host.
"""

from __future__ import annotations

import atexit
import ctypes
import gc
import logging
import os
import socket
import stat
import struct
import sys
import tempfile
import threading
import weakref
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from pydrake.geometry import Meshcat, MeshcatParams, MeshcatVisualizer

from cdpr_drake.errors import MeshcatError

LOCAL = "localhost"
"""Where only this machine looks."""

EVERYWHERE = ("*", "0.0.0.0")
"""What stands for all addresses of this machine."""

PORTS = (1024, 65535)
"""Ports that Drake accepts."""

PAGE_PORTS = range(7000, 7100)
"""Of which the first free one is taken where none is named."""

_INSIDE = "127.0.0.1"
"""Address at which Meshcat itself listens, and from which the door connects."""

_PATIENCE = 10.0
"""Time for Meshcat to answer, and for a browser to ask [s]."""

_MOST_HEAD, _PIECE = 16_384, 65_536
"""Largest head of a request, and largest piece of an answer [byte]."""

_CLOSE, _PING, _PONG = 8, 9, 10
"""Kinds of frames of a WebSocket that say nothing to Drake."""


def open_meshcat(host: str | None = None, port: int | None = None) -> Meshcat:
    """A Meshcat, without a line in the log.

    Args:
        host: Name or address of this machine at which browsers look; * for all of them; None: this
            machine if there is a port, else nobody looks.
        port: Where they look; None: the first free one from 7000 to 7099.

    Raises:
        MeshcatError: The host is not this machine, or the port is taken or not accepted.
    """
    if port is not None and not PORTS[0] <= port <= PORTS[1]:
        raise MeshcatError(f"port: found {port}; accepted: {PORTS[0]} to {PORTS[1]}")
    listening = None if host is None and port is None else _listening(host or LOCAL, port)
    meshcat = _sealed_meshcat()
    if listening is not None:
        MeshcatDoor(meshcat, listening, _allowed_hosts(host or LOCAL, listening)).open()
        _scenes[meshcat.port()].page = host or LOCAL, listening.getsockname()[1]
    return meshcat


def private_door(meshcat: Meshcat) -> Path:
    """A socket of the file system, for this user alone, behind which the scene is.

    Who hands the scene on to browsers says who may look.
    """
    folder = tempfile.TemporaryDirectory(prefix="cdpr-scene-", ignore_cleanup_errors=True)
    path = Path(folder.name, "scene")
    listening = socket.socket(socket.AF_UNIX)
    listening.bind(str(path))
    listening.listen(64)
    MeshcatDoor(meshcat, listening, None).open()
    _scenes[meshcat.port()].folders.append(folder)
    return path


def page_address(meshcat: Meshcat, host: str | None = None) -> str:
    """What to open in a browser, also on another machine where `host` stands for all addresses.

    Args:
        meshcat: From `open_meshcat`, with a host or a port.
        host: Another name of this machine; None: the one with which it was opened.

    Raises:
        MeshcatError: It was opened without.
    """
    page = _scenes[meshcat.port()].page
    if page is None:
        raise MeshcatError("meshcat: found one without a page; open it with a host or a port")
    host = page[0] if host is None else host
    return f"http://{_at_port(socket.gethostname() if host in EVERYWHERE else host, page[1])}"


def _at_port(name: str, port: int) -> str:
    return f"[{name}]:{port}" if ":" in name else f"{name}:{port}"


def _listening(host: str, port: int | None) -> socket.socket:
    """A socket for browsers."""
    name = "0.0.0.0" if host in EVERYWHERE else host
    try:
        family, _, _, _, address = socket.getaddrinfo(name, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.bind(address)
    except (OSError, UnicodeError) as problem:
        raise MeshcatError(
            f"host: found {host!r}: {getattr(problem, 'strerror', None) or problem}; accepted: a "
            "name or address of this machine, or * for all of them"
        ) from problem
    for candidate in PAGE_PORTS if port is None else (port,):
        with suppress(OSError):
            return socket.create_server((address[0], candidate), family=family, backlog=64)
    where = "any of the ports 7000 to 7099" if port is None else f"port {port}"
    raise MeshcatError(
        f"host, port: {host} cannot listen at {where}, taken perhaps; name another port"
    )


def _allowed_hosts(host: str, listening: socket.socket) -> frozenset[str] | None:
    """What a browser may call this machine; None: anything, where it listens to all."""
    if host in EVERYWHERE:
        return None
    port = listening.getsockname()[1]
    names = {host, listening.getsockname()[0]}
    if names & {LOCAL, _INSIDE, "::1"}:
        names |= {LOCAL, _INSIDE, "::1"}
    return frozenset(_at_port(name, port) for name in names)


def _sealed_meshcat() -> Meshcat:
    for _ in range(20):
        with socket.socket() as probe:
            probe.bind((_INSIDE, 0))
            port = probe.getsockname()[1]
        with suppress(RuntimeError), _quiet_drake():
            meshcat = Meshcat(MeshcatParams(host=_INSIDE, port=port, show_stats_plot=False))
            _end_scenes()
            _scenes[port] = _Scene(
                weakref.ref(meshcat), MeshcatVisualizer(meshcat), _thread(), _Seal(port)
            )
            return meshcat
    raise MeshcatError("host, port: found no port of this machine at which Meshcat can listen")


class _Seal:
    """What lets one connection of this process through to a port of this machine, and no other.

    The system drops what does not come from the socket that is just connecting, whose address and
    port nobody else can have. Only Linux has such filters; elsewhere every program of this machine
    reaches the port.
    """

    def __init__(self, port: int) -> None:
        """Lets nobody through."""
        self._port, self._lock = port, threading.Lock()
        self._listening = _own_listener(port) if sys.platform == "linux" else None
        self._attach(_NOBODY)

    def ask(self, words: bytes) -> tuple[socket.socket, bytes]:
        """Connects, asks, and gives the socket with the beginning of the answer.

        Raises:
            OSError: There is no answer.
        """
        outgoing = socket.socket()
        try:
            outgoing.settimeout(_PATIENCE)
            outgoing.bind((_INSIDE, 0))
            with self._lock:
                self._attach(_only(outgoing.getsockname()[1]))
                try:
                    outgoing.connect((_INSIDE, self._port))
                    outgoing.sendall(words)
                    answer = outgoing.recv(_PIECE)
                finally:
                    self._attach(_NOBODY)
            outgoing.settimeout(None)
        except OSError:
            outgoing.close()
            raise
        return outgoing, answer

    def _attach(self, program: list[tuple[int, int, int, int]]) -> None:
        if self._listening is None:
            return
        code = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *one) for one in program))
        self._listening.setsockopt(
            socket.SOL_SOCKET, _SO_ATTACH_FILTER,
            struct.pack("HxxxxxxQ", len(program), ctypes.addressof(code)),
        )  # fmt: skip

    def end(self) -> None:
        """Once Meshcat has gone."""
        if self._listening is not None:
            self._listening.close()


@dataclass
class _Scene:
    """A Meshcat of this process, and what ends with it.

    Drake ends the process if a Meshcat goes in another thread than the one that made it, and
    Python's collector runs in whichever thread it likes. So the last share of it is kept here, by
    a visualizer that nobody sees, until its own thread opens the next one; what waits there for
    the collector, such as a diagram that shows it, is collected by that thread before.
    """

    meshcat: weakref.ref[Meshcat]
    share: MeshcatVisualizer
    thread: tuple[int, int]
    seal: _Seal
    page: tuple[str, int] | None = None
    """Host and port where browsers look."""
    doors: list[socket.socket] = field(default_factory=list)
    folders: list[tempfile.TemporaryDirectory[str]] = field(default_factory=list)


_scenes: dict[int, _Scene] = {}
"""By the port of their Meshcat."""


def _thread() -> tuple[int, int]:
    """This process and thread: a process that is forked has a Meshcat without its threads."""
    return os.getpid(), threading.get_ident()


def _end_scenes() -> None:
    """Ends those of this thread that nobody has any more."""
    gone = [port for port, scene in list(_scenes.items())
            if scene.thread == _thread() and scene.meshcat() is None]  # fmt: skip
    if gone:
        gc.collect()
    for port in gone:
        scene = _scenes.pop(port)
        for door in scene.doors:
            with suppress(OSError):
                door.shutdown(socket.SHUT_RDWR)
            door.close()
        scene.seal.end()
        for folder in scene.folders:
            folder.cleanup()


@atexit.register
def _leave_scenes() -> None:
    """Leaves those of other threads to the end of the process, which takes them without Drake."""
    for scene in _scenes.values():
        if scene.thread != _thread():
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(scene.share))


_SO_ATTACH_FILTER = 26

_NOBODY = [(0x06, 0, 0, 0)]
"""A filter of Linux, see its socket(7) and bpf: return 0, which drops all."""


def _only(port: int) -> list[tuple[int, int, int, int]]:
    """A filter that takes packets from one port of `_INSIDE`."""
    return [
        (0x20, 0, 0, 0xFFF00000 + 12), (0x15, 0, 3, 0x7F000001),  # sender's address
        (0x28, 0, 0, 0), (0x15, 0, 1, port),
        (0x06, 0, 0, 0xFFFFFFFF), *_NOBODY,
    ]  # fmt: skip


def _own_listener(port: int) -> socket.socket | None:
    """The socket of this process that listens at a port of `_INSIDE`."""
    for name in os.listdir("/proc/self/fd"):
        try:
            if not stat.S_ISSOCK(os.fstat(int(name)).st_mode):
                continue  # a copy of what is no socket would stay open
            copy = socket.socket(fileno=os.dup(int(name)))
        except OSError:  # closed meanwhile
            continue
        with suppress(OSError):
            listens = copy.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN)
            if listens and copy.getsockname() == (_INSIDE, port):
                return copy
        copy.close()
    return None


class MeshcatDoor:
    """Where browsers reach a Meshcat: they get the scene, and what they say ends here."""

    def __init__(
        self, meshcat: Meshcat, listening: socket.socket, hosts: frozenset[str] | None
    ) -> None:
        """With the socket at which browsers ask, and what they may call this machine."""
        scene = _scenes[meshcat.port()]
        scene.doors.append(listening)
        self._seal, self._listening, self._hosts = scene.seal, listening, hosts

    def open(self) -> None:
        """Lets browsers in from now on."""
        threading.Thread(target=self._serve, name="Meshcat's door", daemon=True).start()

    def _serve(self) -> None:
        with suppress(OSError):  # closed
            while True:
                browser, _ = self._listening.accept()
                threading.Thread(target=self._answer, args=(browser,), daemon=True).start()

    def _answer(self, browser: socket.socket) -> None:
        with closing(browser), suppress(OSError, ValueError):
            browser.settimeout(_PATIENCE)
            head = _head(browser)
            fields = _fields(head)
            refusal = self._refusal(head, fields)
            if refusal:
                browser.sendall(f"HTTP/1.1 {refusal}\r\nConnection: close\r\n\r\n".encode())
                return
            socket_wanted = fields.get("upgrade", "").lower() == "websocket"
            meshcat, answer = self._seal.ask(head if socket_wanted else _closing(head))
            browser.settimeout(None)
            with closing(meshcat):
                browser.sendall(answer)
                other = threading.Thread(
                    target=_listen, args=(browser, meshcat, socket_wanted), daemon=True
                )
                other.start()
                while piece := meshcat.recv(_PIECE):
                    browser.sendall(piece)

    def _refusal(self, head: bytes, fields: dict[str, str]) -> str:
        """Status of what is not answered; empty: it is."""
        if not head.startswith(b"GET "):
            return "405 Method Not Allowed"
        host, origin = fields.get("host", ""), fields.get("origin")
        if self._hosts is not None and host not in self._hosts:
            return "403 Forbidden"
        return "" if origin in (None, f"http://{host}") else "403 Forbidden"


def _head(browser: socket.socket) -> bytes:
    """What a browser asks; raises ValueError where it is too long, or ends before."""
    head = b""
    while b"\r\n\r\n" not in head:
        piece = browser.recv(_PIECE)
        if not piece or len(head) > _MOST_HEAD:
            raise ValueError("no head of a request")
        head += piece
    return head[: head.index(b"\r\n\r\n") + 4]


def _fields(head: bytes) -> dict[str, str]:
    lines = head.decode("latin-1").split("\r\n")[1:]
    pairs = (line.partition(":") for line in lines if ":" in line)
    return {name.strip().lower(): value.strip() for name, _, value in pairs}


def _closing(head: bytes) -> bytes:
    """The same question, whose answer ends the connection."""
    lines = [line for line in head[:-4].split(b"\r\n")
             if not line.lower().startswith(b"connection:")]  # fmt: skip
    return b"\r\n".join([*lines, b"Connection: close", b"", b""])


def _listen(browser: socket.socket, meshcat: socket.socket, frames: bool) -> None:
    """Hands on what keeps a WebSocket alive or closes it; drops all else that a browser says."""
    with suppress(OSError, ValueError):
        if frames:
            for kind, frame in _frames(browser):
                if kind in (_CLOSE, _PING, _PONG):
                    meshcat.sendall(frame)
        else:
            while browser.recv(_PIECE):
                pass
    for each in (meshcat, browser) if frames else ():
        with suppress(OSError):
            each.shutdown(socket.SHUT_RDWR)


def _frames(browser: socket.socket) -> Iterator[tuple[int, bytes]]:
    """Frames of a WebSocket by their kinds, as RFC 6455 has them; of those with data, no content.

    Raises:
        ValueError: The browser has gone, or breaks the rules for those without data.
    """
    while True:
        head = _exactly(browser, 2)
        kind, size = head[0] & 0x0F, head[1] & 0x7F
        more = {126: 2, 127: 8}.get(size, 0)
        if more and kind >= _CLOSE:
            raise ValueError("a long frame without data")
        if more:
            size = int.from_bytes(_exactly(browser, more), "big")
        size += 4 if head[1] & 0x80 else 0  # the mask
        if kind >= _CLOSE:
            yield kind, head + _exactly(browser, size)
            continue
        while size:
            size -= len(_exactly(browser, min(size, _PIECE)))
        yield kind, b""


def _exactly(browser: socket.socket, size: int) -> bytes:
    content = b""
    while len(content) < size:
        piece = browser.recv(size - len(content))
        if not piece:
            raise ValueError("the browser has gone")
        content += piece
    return content


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
