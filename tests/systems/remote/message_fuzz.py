"""Sends random messages to a server in every state of the protocol; it has to wait on.

`python -m tests.systems.remote.message_fuzz --count 10000 --seed 0`

States: nobody drives; another client drives, in lock step or in real time; the sender drives, has
just started or has stepped; the run is over. What is sent: bytes, valid msgpack and JSON of wrong
types, valid messages in the wrong state, deep, huge, not finite, of wrong sizes, several frames,
connections that speak no ZeroMQ or an old one, and clients that go away at once. Whoever does not
drive gets one reply to each message, and nothing else happens; a driver that sends nonsense ends
the run by `ClientEndedError`, and the next one begins.
"""

from __future__ import annotations

import argparse
import json
import random
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import msgpack
import numpy as np
import zmq

from cdpr_drake.errors import BridgeError, ClientEndedError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.remote.messages import LARGEST, decode
from cdpr_drake.systems.remote.remote_client import RemoteClient
from cdpr_drake.systems.remote.remote_driver import Driver, Port, SyncMode
from cdpr_drake.systems.remote.server_socket import ServerSocket
from cdpr_drake.systems.remote.service import tension_service

LONG = 1800.0
"""Longer than anything takes on a machine that is busy [s]."""

LONGEST_ERROR = 1000
"""Characters of an error: what was sent is shown in part only."""

INPUTS = [Port("tensions", 8, "N", "commanded"), Port("motion", 3, "m", "another one")]
OUTPUTS = [Port("X_WP", 7, "-, m", "pose")]
STATES = ("waiting", "beside a driver", "driving, started", "driving, stepped")
HOLD = {"tensions": [4.0] * 8, "motion": [0.0] * 3}
WORDS = ["do", "start", "step", "stop", "describe", "distribute", "inputs", "outputs", "pose", "ok",
         "wrench", "limits", "method", "tensions", "motion", "X_WP", "quadratic_program", "packed",
         "", "\ud800", "x" * 5000, "\0", "é"]  # fmt: skip
NUMBERS = [0, 1, -1, 2**63, -(2**63), 0.0, -0.0, 1e308, -1e308, 5e-324, float("nan"), float("inf"),
           -float("inf"), 0.5, 1e-9]  # fmt: skip
RAW = [b"\x01\x00\x02\x00{", b"\x00" * 5, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
       b"\x01\x00\x11\x00" + b'{"do": "start"}\n', b"\xff" + bytes(8) + b"\x7f\x03\x00NULL",
       b"\xff" + bytes(8) + b"\x7f\x01\x05", b""]  # fmt: skip
"""Bytes on the wire that are no message of ZMTP 3; the first five ended the server once."""


class FuzzedServer:
    """A server in a thread, whose runs begin anew when they are ended; `stop` ends it."""

    def __init__(self, pace: SyncMode) -> None:
        """Listens at a free port of this machine."""
        self._stopped = threading.Event()
        self._pace, self.ends = pace, Counter[str]()
        self.problem: BaseException | None = None
        robot = load_robot("acrobot_large")
        self._service = tension_service(robot, limits=None, method="quadratic_program")
        self.runs = 0  # that began
        self._socket = ServerSocket("127.0.0.1", 0, self._stopped.is_set)
        self.address = self._socket.address
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Ends it; raises what it ended by before."""
        self._stopped.set()
        self._thread.join(LONG)
        if self.problem is not None:
            raise self.problem

    def _serve(self) -> None:
        try:
            while True:
                self.runs += 1
                self._run()
                self._socket.close()  # as each run of `cdpr serve` has a socket of its own
                port = int(self.address.rpartition(":")[2])
                self._socket = ServerSocket("127.0.0.1", port, self._stopped.is_set)
        except KeyboardInterrupt:
            self._socket.close()
        except BaseException as problem:
            self.problem = problem
            self._socket.close()

    def _run(self) -> None:
        driver = Driver(
            self._socket, {"scenario": "fuzz"}, INPUTS, OUTPUTS, pace=self._pace, timeout=LONG,
            period=1e-3, services={"distribute": self._service},
        )  # fmt: skip
        now, X_WP = 0.0, np.array([1.0, 0, 0, 0, 0, 0, 0.1])
        try:
            driver.wait(LONG)  # which somebody may end by `stop`
            while True:
                given = driver.exchange(now, lambda _: X_WP)
                assert {name: len(row) for name, row in given.items()} == {
                    "tensions": 8, "motion": 3
                }  # fmt: skip
                assert all(np.all(np.isfinite(row)) for row in given.values())
                now += 1e-3
        except ClientEndedError as problem:
            said = str(problem)
            assert "\n" not in said
            assert len(said) < LONGEST_ERROR, said
            self.ends[said.partition(":")[0]] += 1
            driver.end({"outcome": "client_ended", "message": said, "sim_time_s": now})


def anything(chance: random.Random, depth: int = 0) -> Any:
    """A value of any type that JSON or msgpack knows."""
    kind = chance.randrange(9 if depth < 4 else 5)
    if kind == 0:
        return chance.choice(NUMBERS)
    if kind == 1:
        return chance.choice(WORDS)
    if kind == 2:
        return chance.choice([None, True, False])
    if kind == 3:
        return chance.randbytes(chance.choice([0, 1, 7, 8, 24, 56, 64]))
    if kind == 4:
        return msgpack.ExtType(chance.randrange(128), chance.randbytes(chance.randrange(20)))
    if kind in (5, 6):
        return [anything(chance, depth + 1) for _ in range(chance.choice([0, 1, 3, 6, 7, 8]))]
    return {chance.choice(WORDS): anything(chance, depth + 1) for _ in range(chance.randrange(5))}


def request(chance: random.Random) -> dict[str, Any]:
    """A message that is valid, or was before one thing of it changed."""
    row = [chance.choice(NUMBERS) if chance.random() < 0.1 else chance.uniform(-1, 1)] * 6
    found: dict[str, Any] = chance.choice([
        {"do": "describe"},
        {"do": "start", "outputs": ["X_WP"], "packed": chance.random() < 0.5},
        {"do": "step", "inputs": dict(HOLD)},
        {"do": "step", "inputs": {"tensions": np.full(8, 5.0).tobytes(), "motion": bytes(24)}},
        {"do": "stop"},
        {"do": "distribute", "pose": [1, 0, 0, 0, 0, 0, 0.1]},
        {"do": "distribute", "pose": [1, 0, 0, 0, 0, 0, 0.1], "wrench": row},
        {"do": "distribute", "pose": [1, 0, 0, 0, *row[:3]], "limits": row[:2],
         "method": chance.choice(WORDS)},
    ])  # fmt: skip
    while chance.random() < 0.6:
        part = found
        while chance.random() < 0.5:
            inner = [value for value in part.values() if isinstance(value, dict)]
            part = chance.choice(inner) if inner else part
        if part and chance.random() < 0.7:
            part[chance.choice(list(part))] = anything(chance)
        else:
            part[chance.choice(WORDS)] = anything(chance)
    return found


def payload(chance: random.Random) -> bytes:
    """One frame, of any kind."""
    kind = chance.randrange(10)
    if kind == 0:
        return chance.randbytes(chance.choice([0, 1, 2, 3, 5, 8, 50, 1000]))
    if kind == 1:
        return chance.choice([
            b"[" * 100_000, b'{"a":' * 50_000, b"\x91" * 100_000, b"\x81\xa1a" * 30_000,
            b"{" + b" " * (LARGEST - 1), b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff",
            b"\xc6\xff\xff\xff\xff", b'{"do":' + b"9" * 5000 + b"}", b"\xd7\xff" + b"\xff" * 8,
        ])  # fmt: skip
    made: Any = anything(chance) if kind == 2 else request(chance)
    with suppress(TypeError, ValueError, OverflowError, RecursionError):
        if chance.random() < 0.5:
            written = json.dumps(made).encode("utf-8", "surrogatepass")
        else:
            written = msgpack.packb(made, unicode_errors="surrogatepass")
        if kind == 3 and written:
            at = chance.randrange(len(written))
            return written[:at] + chance.randbytes(1) + written[at + 1 :]
        if kind == 4:
            return written[: chance.randrange(len(written) + 1)]
        return written
    return repr(made).encode("utf-8", "replace")


class Sender:
    """Sends to one server, and checks what comes back."""

    def __init__(self, pace: SyncMode, seed: int) -> None:
        """With a server of its own."""
        self.server, self.chance = FuzzedServer(pace), random.Random(seed)
        self.counts: Counter[str] = Counter()
        self._context = zmq.Context()
        self._socket: Any = None
        self._good: Any = None  # who drives beside

    def close(self) -> None:
        """Ends the server too; raises what it ended by."""
        self._drop()
        if self._good is not None:
            self._good.close()
        self._context.term()
        self.server.stop()

    def send(self) -> None:
        """One random thing in one random state; raises AssertionError where it is not answered."""
        way = self.chance.choices(("message", "frames", "raw", "vanish", "huge"), (80, 8, 5, 5, 2))[
            0
        ]
        state = self.chance.choice(STATES[:2] if way == "raw" else STATES)
        self.counts[f"{state}, {way}"] += 1
        before = self._settled(beside=state == "beside a driver")
        if way == "raw":
            self._send_raw()
        elif state.startswith("driving"):
            self._drop()
            self._socket = self._started()
            if state.endswith("stepped"):
                self._socket.send(json.dumps({"do": "step", "inputs": HOLD}).encode())
                self._reply(before)
            self._send_message(way, before)
            self._drop()  # which ends the run, if that has not
            self._wait(lambda: self.server.runs > before)
        else:
            self._send_message(way, before)
        self._still_there()

    def _settled(self, beside: bool) -> int:
        """How many runs have begun, once there is a driver beside this sender, or none."""
        if beside and self._good is None:
            self._good = self._started()
        elif not beside and self._good is not None:
            before = self.server.runs
            self._good.close()
            self._good = None
            self._wait(lambda: self.server.runs > before)
        return self.server.runs

    def _wait(self, holds: Callable[[], bool]) -> None:
        end = time.monotonic() + LONG
        while not holds():
            if self.server.problem is not None:
                raise self.server.problem
            assert time.monotonic() < end, "the server hangs"
            time.sleep(1e-3)

    def _send_raw(self) -> None:
        host, port = self.server.address.removeprefix("tcp://").split(":")
        known = self.chance.choice(RAW)
        with suppress(OSError), socket.create_connection((host, int(port)), timeout=LONG) as one:
            one.sendall(known or self.chance.randbytes(self.chance.randrange(1, 200)))

    def _send_message(self, way: str, before: int) -> None:
        frames = [payload(self.chance)]
        if way == "frames":
            more = range(self.chance.choice([1, 2, 5, 200]))
            frames = [self.chance.choice([b"", b"x", payload(self.chance)]) for _ in more] + frames
        elif way == "huge":
            frames = [b"{" + b" " * LARGEST]
        if self._socket is None:
            self._socket = self._connected()
        self._socket.send_multipart(frames)
        if way in ("vanish", "huge"):
            self._drop()
            return
        reply = self._reply(before)
        if reply is not None and "time" in self._checked(reply):
            self._drop()  # it was a start, or a step of the driver

    def _reply(self, before: int) -> bytes | None:
        """The next one; None: the run has ended, and another began."""
        end = time.monotonic() + LONG
        while not self._socket.poll(50):
            if self.server.problem is not None:
                raise self.server.problem
            if self.server.runs > before:
                self._drop()
                return None
            assert time.monotonic() < end, "no reply"
        return bytes(self._socket.recv_multipart()[-1])

    def _started(self) -> Any:
        """A connection that drives; a run that was left may have to end first."""
        end = time.monotonic() + LONG
        while time.monotonic() < end:
            one = self._connected()
            one.send(json.dumps({"do": "start"}).encode())
            if one.poll(2000) and json.loads(one.recv()).get("ok"):
                return one
            one.close()
            time.sleep(1e-3)
            if self.server.problem is not None:
                raise self.server.problem
        raise AssertionError("no run can be started")

    def _checked(self, reply: bytes) -> dict[str, Any]:
        found, _ = decode(reply)
        self.counts["accepted" if found["ok"] else "refused"] += 1
        if not found["ok"]:
            assert len(found["error"]) < LONGEST_ERROR, found
            assert "\n" not in found["error"], found
        return found

    def _still_there(self) -> None:
        """A driver beside whom something was sent drives on; now and then a stranger asks."""
        if self._good is not None:
            self._good.send(json.dumps({"do": "step", "inputs": HOLD}).encode())
            self._wait(lambda: self._good.poll(10))
            assert "time" in json.loads(self._good.recv())
        if self.counts["asked"] < self.counts.total() // 50:
            self.counts["asked"] += 1
            self._asked_by_another()

    def _asked_by_another(self) -> None:
        """Describes itself; a question on its way while a run ends and another begins is lost."""
        end = time.monotonic() + LONG
        while True:
            with RemoteClient(self.server.address, timeout=5.0) as other:
                try:
                    assert set(other.describe()["inputs"]) == {"tensions", "motion"}
                    return
                except BridgeError:
                    if self.server.problem is not None:
                        raise self.server.problem from None
                    if time.monotonic() > end:
                        raise

    def _connected(self) -> Any:
        made = self._context.socket(zmq.DEALER)
        made.setsockopt(zmq.LINGER, 0)
        made.connect(self.server.address)
        return made

    def _drop(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def main() -> None:
    """Sends, and prints what became of it."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--count", type=int, default=10_000)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument(
        "--pace", choices=list(SyncMode), help="only this one, with half the count"
    )
    asked = options.parse_args()
    for number, pace in enumerate(SyncMode):
        if asked.pace not in (None, pace):
            continue
        sender = Sender(pace, len(SyncMode) * asked.seed + number)
        for _ in range(asked.count // len(SyncMode)):
            sender.send()
        sender.close()
        print(json.dumps({"pace": pace, "ends": sender.server.ends, **sender.counts}, indent=2))


if __name__ == "__main__":
    main()
