"""The server's side of an exchange: what a run asks at each instant, and who else asks the run."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from cdpr_drake.arrays import Array
from cdpr_drake.errors import BridgeError, CdprError, ClientEndedError, accepted_names
from cdpr_drake.sections.remote.messages import JSON, MSGPACK, decode, encode, listed, shown, vector
from cdpr_drake.sections.remote.server_socket import GONE, ServerSocket

GRACE = 5.0
"""Time for which a client that is busy while the run ends is waited for, to tell it [s]."""

MOST_AT_ONCE = 100
"""Messages that a run in real time takes at one instant once it is late."""


class SyncMode(StrEnum):
    """How a run waits for its client."""

    LOCK_STEP = "lock_step"
    REAL_TIME = "real_time"


@dataclass(frozen=True)
class Port:
    """A named vector that is exchanged.

    Attributes:
        name: Name.
        size: How many numbers.
        unit: Their unit.
        meaning: What they are, in words.
    """

    name: str
    size: int
    unit: str
    meaning: str

    def facts(self) -> dict[str, Any]:
        """For a description."""
        return {"size": self.size, "unit": self.unit, "meaning": self.meaning}


Read = Callable[[str], Array]
"""What stands at an output, by its name."""

Service = Callable[[Mapping[str, Any]], dict[str, Any]]
"""Answers a request; raises CdprError where it makes no sense."""


class Driver:
    """A client that stands in the place of a block.

    Blocks and loops call `exchange` at each of their instants, and get its commands.
    """

    def __init__(
        self,
        socket: ServerSocket,
        description: Mapping[str, Any],
        inputs: Sequence[Port],
        outputs: Sequence[Port],
        *,
        pace: SyncMode,
        timeout: float,
        period: float,
        services: Mapping[str, Service],
    ) -> None:
        """Of a run that has not begun.

        Args:
            socket: Where clients come.
            description: What "describe" is answered with, besides the ports.
            inputs: What the client commands.
            outputs: What it can see.
            pace: How the run waits.
            timeout: Longest silence of the client [s].
            period: Time between instants of control [s], after which a real-time step is late.
            services: What answers other requests, by their names.
        """
        self._socket, self._services = socket, dict(services)
        self._inputs = {port.name: port for port in inputs}
        self._outputs = {port.name: port for port in outputs}
        self._description = {
            **description,
            "inputs": {port.name: port.facts() for port in inputs},
            "outputs": {port.name: port.facts() for port in outputs},
        }
        self._pace, self._timeout, self._period = pace, timeout, period
        self._who: bytes | None = None
        self._wanted: list[str] = []
        self._packed = False  # whether vectors are bytes
        self._codec = JSON
        self._pending: list[bytes] | None = None  # who waits for a reply
        self._held: dict[str, Array] | None = None
        self._over = False  # whether nobody is there to be told
        self._heard = time.monotonic()
        self._clock: float | None = None  # when time 0 was, in real time
        self._counts = {"exchanges": 0, "services": 0, "held_steps": 0, "late_steps": 0}

    def report(self) -> dict[str, Any]:
        """What was exchanged, for a summary."""
        return {"codec": self._codec, **self._counts}

    def wait(self, longest: float) -> None:
        """Waits for a client that starts the run.

        Raises:
            ClientEndedError: None comes within the longest time [s].
        """
        deadline = time.monotonic() + longest
        if not self._listen_until(lambda: self._who is not None, lambda: deadline):
            raise ClientEndedError(f"no client came within {longest:g} s")
        self._heard = time.monotonic()

    def exchange(self, now: float, read: Read) -> dict[str, Array]:
        """The commands at a time [s], by the names of the inputs.

        Args:
            now: Time of the run [s].
            read: What stands at the outputs now.

        Raises:
            ClientEndedError: The client is gone, silent, or sends what makes no sense.
        """
        try:
            if self._pace == SyncMode.REAL_TIME and self._held is not None:
                return self._held_commands(now, read)
            return self._next_commands(now, read)
        except ClientEndedError:
            self._over = True
            raise

    def _next_commands(self, now: float, read: Read) -> dict[str, Array]:
        """Tells how the run stands, and waits for what is commanded then."""
        self._tell(now, read)
        self._held = None
        if not self._listen_until(
            lambda: self._held is not None, lambda: self._heard + self._timeout
        ):
            raise ClientEndedError(f"the client was silent for {self._timeout:g} s")
        assert self._held is not None
        if self._clock is None:
            self._clock = time.monotonic() - now
        return self._held

    def _held_commands(self, now: float, read: Read) -> dict[str, Array]:
        """Waits for the time to come, takes what came until then, and holds it."""
        assert self._clock is not None
        due, before = self._clock + now, self._counts["exchanges"]
        taken = 0
        while self._listen(due):  # at least once: what is there is taken
            taken += 1
            if taken >= MOST_AT_ONCE and time.monotonic() >= due:
                break
        if time.monotonic() > due + self._period:
            self._counts["late_steps"] += 1
        if self._counts["exchanges"] == before:
            self._counts["held_steps"] += 1
            if time.monotonic() > self._heard + self._timeout:
                raise ClientEndedError(f"the client was silent for {self._timeout:g} s")
        if self._pending is not None:
            self._tell(now, read)
        assert self._held is not None
        return self._held

    def end(self, facts: Mapping[str, Any]) -> None:
        """Tells the client how the run ended; one that is busy is waited for, `GRACE` at most,
        also where a request to stop has ended the run."""
        deadline = time.monotonic() + GRACE
        self._socket.ignore_stop()
        try:
            if self._who is not None and not self._over:
                self._listen_until(lambda: self._pending is not None, lambda: deadline)
        except (ClientEndedError, KeyboardInterrupt):
            self._over = True
        if self._pending is not None:
            self._reply(self._pending, {"ok": True, "end": dict(facts)}, self._codec)
            self._pending = None

    def _tell(self, now: float, read: Read) -> None:
        assert self._pending is not None
        codec, packed = self._codec, self._packed
        outputs = {name: listed(read(name), codec, packed) for name in self._wanted}
        to, self._pending = self._pending, None
        if not self._reply(to, {"ok": True, "time": now, "outputs": outputs}, codec):
            raise ClientEndedError(GONE)
        self._heard = time.monotonic()  # until now it was the client that waited

    def _reply(self, to: list[bytes], message: Mapping[str, Any], codec: str) -> bool:
        """Sends a reply; False: who asked has gone."""
        return self._socket.send(to, encode(message, codec))

    def _listen_until(self, done: Callable[[], bool], deadline: Callable[[], float]) -> bool:
        """Takes messages until something holds; False once it is late, however many others send.

        Raises:
            ClientEndedError: See `exchange`.
        """
        while not done():
            if not self._listen(deadline()):
                return False
            if not done():
                self._socket.look()
                if time.monotonic() >= deadline():
                    return False
        return True

    def _listen(self, deadline: float) -> bool:
        """Takes one message, or what is none; False when nothing came until a monotonic time [s].

        Raises:
            ClientEndedError: See `exchange`.
        """
        got = self._socket.receive(deadline)
        if got is None:
            return False
        envelope, payload = got
        drives = envelope[0] == self._who
        codec = self._codec
        try:
            message, codec = decode(payload)
            if drives:
                self._heard, self._codec = time.monotonic(), codec
                if message.get("do") == "step":
                    self._held = self._commands(message.get("inputs"))
                    self._counts["exchanges"] += 1
                    self._pending = envelope
                    return True
            self._answer(envelope, message, codec)
        except CdprError as problem:
            if isinstance(problem, ClientEndedError):
                raise
            self._reply(envelope, {"ok": False, "error": str(problem)}, codec)
            if drives and not isinstance(problem, _RefusedServiceError):
                raise ClientEndedError(
                    f"the client's message was not accepted: {problem}"
                ) from problem
        return True

    def _commands(self, found: object) -> dict[str, Array]:
        ports = self._inputs
        if not isinstance(found, dict) or found.keys() != ports.keys():
            names = shown(sorted(map(str, found))) if isinstance(found, dict) else shown(found)
            raise BridgeError(f"inputs: found {names}; {accepted_names(names, ports)}")
        return {name: vector(name, found[name], port.size) for name, port in ports.items()}

    def _answer(self, envelope: list[bytes], message: Mapping[str, Any], codec: str) -> None:
        """Replies to what is not a step of the driver."""
        asked = message.get("do")
        if asked == "describe":
            self._reply(envelope, {"ok": True, **self._description}, codec)
        elif isinstance(asked, str) and asked in self._services:
            try:
                found = self._services[asked](message)
            except CdprError as problem:
                raise _RefusedServiceError(str(problem)) from problem
            self._counts["services"] += 1
            found = {
                name: listed(value, codec) if hasattr(value, "tolist") else value
                for name, value in found.items()
            }
            self._reply(envelope, {"ok": True, **found}, codec)
        elif asked == "start" and self._who is None:
            self._wanted = self._asked_for(message.get("outputs"))
            self._packed = message.get("packed") is True and codec == MSGPACK
            self._who, self._pending, self._codec = envelope[0], envelope, codec
            self._socket.follow()
        elif asked == "stop" and self._who in (None, envelope[0]):
            if self._who is None:  # nobody drives yet: the run does not begin
                end = {"outcome": "client_ended", "message": SAID_STOP, "sim_time_s": 0.0}
                self._reply(envelope, {"ok": True, "end": end}, codec)
            self._pending = envelope
            raise ClientEndedError(SAID_STOP)
        else:
            words = ["describe", "start", "step", "stop", *self._services]
            if asked in words:
                raise BridgeError(
                    f"do: found {asked} from a client that does not drive this run, or drives it "
                    "already"
                )
            raise BridgeError(f"do: found {shown(asked)}; {accepted_names(shown(asked), words)}")

    def _asked_for(self, names: object) -> list[str]:
        if names is None:
            return list(self._outputs)
        if not isinstance(names, list) or not all(
            isinstance(name, str) and name in self._outputs for name in names
        ):
            raise BridgeError(
                f"outputs: found {shown(names)}; accepted: a list of {', '.join(self._outputs)}"
            )
        return list(dict.fromkeys(names))


SAID_STOP = "the client said stop"


class _RefusedServiceError(BridgeError):
    """A request beside the run that makes no sense; the run goes on."""
