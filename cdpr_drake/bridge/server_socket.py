"""The socket at which a server of the bridge listens."""

from __future__ import annotations

import ipaddress
import socket as sockets
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from cdpr_drake.bridge.messages import LARGEST, check_available
from cdpr_drake.errors import BridgeError, ClientEndedError

SLICE = 0.05
"""Time between looks whether the client is still there, or somebody asks to stop [s]."""

SLICE_MS = round(1e3 * SLICE)


class ServerSocket:
    """Receives messages of any client and sends replies.

    It learns at once when the client that it follows goes away, where the operating system does.
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
        self._socket.setsockopt(zmq.SNDTIMEO, 1000)
        self._monitor = self._socket.get_monitor_socket(
            zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_DISCONNECTED
        )
        self._last_connection: int | None = None
        self._wait = -1
        try:
            where = host if host == "*" else sockets.gethostbyname(host)
            self._socket.bind(f"tcp://{where}:{port or '*'}")
        except (OSError, UnicodeError, zmq.ZMQError) as problem:
            self.close()
            raise BridgeError(
                f"--host, --port: found {host}:{port}, {problem}; accepted: an interface of this "
                "machine and a free port"
            ) from problem
        self.address = self._socket.getsockopt_string(zmq.LAST_ENDPOINT)

    def close(self) -> None:
        """Lets go of the port."""
        self._socket.disable_monitor()
        self._monitor.close()
        self._socket.close()
        self._context.term()

    def follow(self) -> None:
        """From now on, the client of the message that came last must stay."""
        self._followed = self._last_connection

    _followed: int | None = None

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
            if self._should_stop():
                raise KeyboardInterrupt
            self._look_after_client()
            if time.monotonic() >= deadline:
                return None

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
        """As `_receive_bytes`, and keeps by which connection it came."""
        self._set_wait(deadline)
        try:
            frames = self._socket.recv_multipart(copy=False)
        except self._zmq.Again:
            return None
        self._last_connection = frames[-1].get(self._zmq.SRCFD)
        return [frame.bytes for frame in frames]

    def _look_after_client(self) -> None:
        """Raises when the client that is followed has gone."""
        while self._followed is not None and self._monitor.poll(0):
            event = parsed(self._monitor.recv_multipart())
            if event == (self._zmq.EVENT_DISCONNECTED, self._followed):
                raise ClientEndedError(
                    f"the client went away, or sent a message of more than {LARGEST} bytes"
                )

    def send(self, envelope: list[bytes], payload: bytes) -> None:
        """Sends a reply; one that nobody can receive any more is dropped."""
        send, more = self._socket.send, self._zmq.SNDMORE
        with suppress(self._zmq.Again):
            for frame in envelope:
                send(frame, more)
            send(payload)


def parsed(frames: list[Any]) -> tuple[int, int]:
    """Kind and value of an event of a socket's monitor."""
    from zmq.utils.monitor import parse_monitor_message

    event = parse_monitor_message(frames)
    return int(event["event"]), int(event["value"])


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches a host."""
    try:
        return ipaddress.ip_address(sockets.gethostbyname(host)).is_loopback
    except (OSError, UnicodeError, ValueError):
        return False
