"""A client of `cdpr serve`, for controllers in Python; it imports neither Drake nor numba."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from cdpr_drake.arrays import Array
from cdpr_drake.errors import BridgeError
from cdpr_drake.sections.remote.messages import (
    LARGEST,
    MSGPACK,
    NUMBER,
    check_available,
    decode,
    encode,
)

LOCAL_HOST, USUAL_PORT = "127.0.0.1", 5757
ADDRESS = f"tcp://{LOCAL_HOST}:{USUAL_PORT}"
"""Where `cdpr serve` listens unless it is told otherwise."""


class Instant(NamedTuple):
    """What the run shows at one time.

    Attributes:
        time: Time [s]; at the end, what was simulated.
        outputs: The ports that were asked for, by name, each shape (size,); empty at the end.
        end: Outcome, message and simulated time, once the run has ended; else None.
    """

    time: float
    outputs: Mapping[str, Array]
    end: Mapping[str, Any] | None = None


class RemoteClient:
    """Drives a run of `cdpr serve`, or asks it for tensions.

        with RemoteClient() as client:
            client.run(lambda now: {"tensions": my_tensions(now.time, now.outputs["X_WP"])})

    Each call sends one message and waits for its reply. Messages: see `cdpr_drake.sections.remote`.
    """

    def __init__(
        self, address: str = ADDRESS, *, codec: str = MSGPACK, timeout: float = 60.0
    ) -> None:
        """Connects; a server may come later.

        Args:
            address: Of the server.
            codec: `MSGPACK`, or `JSON`, which takes longer.
            timeout: Longest time to wait for a reply [s].

        Raises:
            BridgeError: A package is missing, or the address is not accepted.
        """
        check_available()
        import zmq

        self._codec, self._address, self._timeout = codec, address, timeout
        self._packed = codec == MSGPACK
        self._context = zmq.Context()
        self._lost, self._too_late = False, zmq.Again
        self._socket = self._context.socket(zmq.DEALER)  # as REQ, a frame less each way
        self._socket.setsockopt(zmq.LINGER, 0)
        self._socket.setsockopt(zmq.MAXMSGSIZE, LARGEST)
        self._socket.setsockopt(zmq.RCVTIMEO, round(1e3 * timeout))
        try:
            self._socket.connect(address)
        except zmq.ZMQError as problem:
            self.close()
            raise BridgeError(
                f"address: found {address!r}, {problem}; accepted: such as {ADDRESS}"
            ) from problem

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Closes."""
        self.close()

    def close(self) -> None:
        """Goes away; a run that this client drives ends."""
        self._socket.close()
        self._context.term()

    def ask(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """The reply to a message.

        Raises:
            BridgeError: There is none in time, or the server does not accept the message.
        """
        if self._lost:  # a reply that comes late would be taken for that to the next message
            raise BridgeError(
                f"{self._address}: found no reply before; accepted: a new RemoteClient"
            )
        try:
            self._socket.send(encode(message, self._codec))
            reply, _ = decode(self._socket.recv())
        except self._too_late as problem:
            self._lost = True
            raise BridgeError(
                f"{self._address}: found no reply in {self._timeout:g} s; accepted: a server "
                "there, cdpr serve"
            ) from problem
        if not reply.get("ok"):
            raise BridgeError(f"{self._address}: {reply.get('error')}")
        return reply

    def describe(self) -> dict[str, Any]:
        """Scenario, robot, place, pace, and the ports with sizes, units and meanings."""
        return self.ask({"do": "describe"})

    def start(self, outputs: Sequence[str] | None = None) -> Instant:
        """Begins to drive the run; the first instant, with the named outputs, or all."""
        wanted: dict[str, Any] = {} if outputs is None else {"outputs": list(outputs)}
        if self._packed:
            wanted["packed"] = True
        return _instant(self.ask({"do": "start", **wanted}))

    def step(self, **inputs: ArrayLike) -> Instant:
        """Gives the commands of this instant by the names of their ports; the next instant."""
        if self._packed:
            values: dict[str, Any] = {
                name: np.asarray(value, NUMBER).tobytes() for name, value in inputs.items()
            }
        else:
            values = {name: np.asarray(value, float).tolist() for name, value in inputs.items()}
        return _instant(self.ask({"do": "step", "inputs": values}))

    def run(
        self,
        control: Callable[[Instant], Mapping[str, ArrayLike]],
        outputs: Sequence[str] | None = None,
    ) -> Mapping[str, Any]:
        """Drives the run to its end, which is returned; `control` makes commands of instants."""
        now = self.start(outputs)
        while now.end is None:
            now = self.step(**control(now))
        return now.end

    def stop(self) -> Instant:
        """Ends the run."""
        return _instant(self.ask({"do": "stop"}))

    def distribute(
        self,
        pose: ArrayLike,
        wrench: ArrayLike | None = None,
        *,
        limits: tuple[float, float] | None = None,
        method: str | None = None,
    ) -> tuple[Array, bool]:
        """Tensions that put a wrench on the platform, and whether they are feasible.

        Args:
            pose: X_WP as (qw, qx, qy, qz, x, y, z), shape (7,) [-, m].
            wrench: F_P_W about Po, shape (6,) [N m, N]; None: what holds the platform at rest.
            limits: Smallest and largest tension [N]; None: the scenario's.
            method: Name of a method; None: the scenario's.

        Returns:
            Tensions, shape (m,) [N], and whether they balance the wrench within the limits.
        """
        message: dict[str, Any] = {"do": "distribute", "pose": np.asarray(pose, float).tolist()}
        if wrench is not None:
            message["wrench"] = np.asarray(wrench, float).tolist()
        if limits is not None:
            message["limits"] = [float(limits[0]), float(limits[1])]
        if method is not None:
            message["method"] = method
        reply = self.ask(message)
        return np.array(reply["tensions"], dtype=float), bool(reply["feasible"])


def _instant(reply: Mapping[str, Any]) -> Instant:
    end = reply.get("end")
    if end is not None:
        return Instant(float(end["sim_time_s"]), {}, end)
    outputs = {
        name: np.frombuffer(values, NUMBER)
        if type(values) is bytes
        else np.array(values, dtype=float)  # None becomes nan
        for name, values in reply["outputs"].items()
    }
    return Instant(reply["time"], outputs)
