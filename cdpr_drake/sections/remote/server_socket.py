"""The socket at which `cdpr serve` listens for clients."""

from __future__ import annotations

import socket as sockets
import time
from collections.abc import Callable
from typing import Any

from cdpr_drake.errors import BridgeError, ClientEndedError
from cdpr_drake.sections.remote.messages import JSON, LARGEST, check_available, encode

SLICE = 0.05
"""Time between looks whether the client is still there, or somebody asks to stop [s]."""

SLICE_MS = round(1e3 * SLICE)

GONE = f"the client went away, or sent a message of more than {LARGEST} bytes"

TOO_OLD = "connection: found a protocol older than ZMTP 3; accepted: ZeroMQ 4 or newer"
"""What is said to who cannot be told from others, as plain bytes of a web page are: what begins
with anything but ZMTP's signature is taken for the first version of it."""


class ServerSocket:
    """Receives messages of any client and sends replies.

    It learns at once when the client that it follows goes away, where the operating system does.
    Clients speak ZMTP 3, as ZeroMQ 4 does; what comes by an older protocol is refused.
    """

    def __init__(self, host: str, port: int, should_stop: Callable[[], bool]) -> None:
        """Binds.

        Args:
            host: Name or address of an interface of this machine, * for all.
            port: Port, 0 for a free one.
            should_stop: Asked while it waits; True ends the wait by KeyboardInterrupt.

        Raises:
            BridgeError: A package is missing, or it cannot listen there.
        """
        check_available()
        import zmq

        self._zmq, self._should_stop = zmq, should_stop
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.ROUTER)
        self._socket.setsockopt(zmq.LINGER, 200)
        self._socket.setsockopt(zmq.MAXMSGSIZE, LARGEST)
        self._socket.setsockopt(zmq.ROUTER_MANDATORY, 1)  # so that `send` knows who is there
        self._monitor = self._socket.get_monitor_socket(zmq.EVENT_ACCEPTED | zmq.EVENT_DISCONNECTED)
        self._last_connection: int | None = None
        self._followed: int | None = None
        self._gone: set[int] = set()  # connections that ended, until their number comes again
        self._lost = False  # whether the client that is followed went away
        self._wait = -1
        try:
            where = host if host == "*" else sockets.gethostbyname(host)
            self._socket.bind(f"tcp://{where}:{port or '*'}")
        except (OSError, UnicodeError, zmq.ZMQError) as problem:
            self.close()
            raise BridgeError(
                f"host, port: found {host}:{port}, {problem}; accepted: an interface of this "
                "machine and a free port"
            ) from problem
        self.address = self._socket.getsockopt_string(zmq.LAST_ENDPOINT)

    def close(self) -> None:
        """Lets go of the port."""
        self._socket.disable_monitor()
        self._monitor.close()
        self._socket.close()
        self._context.term()

    def ignore_stop(self) -> None:
        """From now on a request to stop ends no wait."""
        self._should_stop = lambda: False

    def follow(self) -> None:
        """From now on, the client of the message that came last must stay."""
        # Earlier and later connections may have the same number. Events tell of earlier ones; of
        # a client that has gone already and left its number `send` knows, once ZeroMQ has looked.
        self._take_events()
        self._socket.getsockopt(self._zmq.EVENTS)
        self._followed = self._last_connection
        self._lost = self._followed in self._gone

    def receive(self, deadline: float) -> tuple[list[bytes], bytes] | None:
        """A message with the envelope for its reply, or None if none came until a monotonic time.

        Raises:
            ClientEndedError: The client that is followed went away.
        """
        # Once it is late, what is there is taken all the same.
        while True:
            if self._followed is None:
                got = self._receive_frames(deadline)
            else:
                got = self._receive_bytes(deadline)
            if got is not None:
                return got[:-1], got[-1]
            self.look()
            if time.monotonic() >= deadline:
                return None

    def look(self) -> None:
        """Looks whether somebody asks to stop, and whether the client that is followed is there.

        Raises:
            KeyboardInterrupt: Somebody asks to stop.
            ClientEndedError: The client that is followed went away.
        """
        if self._should_stop():
            raise KeyboardInterrupt
        self._take_events()
        if self._lost:
            raise ClientEndedError(GONE)

    def _set_wait(self, deadline: float) -> None:
        left = deadline - time.monotonic()
        wait = SLICE_MS if left > SLICE else max(0, int(1e3 * left))
        if wait != self._wait:
            self._socket.setsockopt(self._zmq.RCVTIMEO, wait)
            self._wait = wait

    def _receive_bytes(self, deadline: float) -> list[bytes] | None:
        """As `Socket.recv_multipart`, in a fraction of its time."""
        self._set_wait(deadline)
        receive, get, more = self._socket.recv, self._socket.get, self._zmq.RCVMORE
        try:
            frames = [receive()]
        except self._zmq.Again:
            return None
        while get(more):
            frames.append(receive())
        return frames

    def _receive_frames(self, deadline: float) -> list[bytes] | None:
        """As `_receive_bytes`, and keeps by which connection it came; refuses older protocols."""
        self._set_wait(deadline)
        try:
            frames = self._socket.recv_multipart(copy=False)
        except self._zmq.Again:
            return None
        found = [frame.bytes for frame in frames]
        try:
            self._last_connection = frames[-1].get(self._zmq.SRCFD)
        except self._zmq.ZMQError:  # before ZMTP 3 a message has no such property
            self.send(found[:-1], encode({"ok": False, "error": TOO_OLD}, JSON))
            return None
        return found

    def _take_events(self) -> None:
        """Notes who came and went; what nobody reads would in the end block all connections."""
        while self._monitor.poll(0):
            kind, connection = parsed(self._monitor.recv_multipart())
            ended = kind == self._zmq.EVENT_DISCONNECTED
            (self._gone.add if ended else self._gone.discard)(connection)
            self._lost |= ended and connection == self._followed

    def send(self, envelope: list[bytes], payload: bytes) -> bool:
        """Sends a reply; False: who asked has gone.

        A reply to who does not read, and has a thousand waiting already, is dropped.
        """
        send, zmq = self._socket.send, self._zmq
        try:
            for frame in envelope:
                send(frame, zmq.SNDMORE | zmq.NOBLOCK)
            send(payload, zmq.NOBLOCK)
        except zmq.Again:
            return True
        except zmq.ZMQError as problem:
            if problem.errno != zmq.EHOSTUNREACH:
                raise
            return False
        return True


def parsed(frames: list[Any]) -> tuple[int, int]:
    """Kind and value of an event of a socket's monitor."""
    from zmq.utils.monitor import parse_monitor_message

    event = parse_monitor_message(frames)
    return int(event["event"]), int(event["value"])
