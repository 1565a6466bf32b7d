"""Sends random messages to a server in every state of the protocol; it has to wait on.

`python -m tests.systems.remote.message_fuzz --count 10000 --seed 0`

States: nobody drives; another client drives, in lock step or in real time; the sender drives. What
is sent: bytes, valid msgpack and JSON of wrong types, valid messages in the wrong state, deep,
huge, not finite, of wrong sizes, several frames, connections that speak no ZeroMQ or an old one,
and clients that go away at once. Whoever does not drive gets one reply to each message, and nothing
else happens; a driver that sends nonsense ends the run by `ClientEndedError`, and the next one
begins.
"""

from __future__ import annotations

import argparse
import json
import random
import socket
import threading
import time
from collections import Counter
from contextlib import suppress

import msgpack
import numpy as np
import zmq

from cdpr_drake.errors import ClientEndedError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.remote.messages import LARGEST, decode
from cdpr_drake.systems.remote.remote_driver import Driver, Port, SyncMode
from cdpr_drake.systems.remote.server_socket import ServerSocket
from cdpr_drake.systems.remote.service import tension_service

LONG = 1800.0
"""Longer than anything takes on a machine that is busy [s]."""

LONGEST_ERROR = 1000
"""Characters of an error: what was sent is shown in part only."""

INPUTS = [Port("tensions", 8, "N", "commanded"), Port("motion", 3, "m", "another one")]
OUTPUTS = [Port("X_WP", 7, "-, m", "pose")]
STATES = ("waiting", "beside a driver", "driving")
HOLD = {"tensions": [4.0] * 8, "motion": [0.0] * 3}
STEP = json.dumps({"do": "step", "inputs": HOLD}).encode()
WORDS = ["do", "start", "step", "stop", "describe", "distribute", "inputs", "outputs", "pose", "ok",
         "wrench", "limits", "method", "tensions", "motion", "X_WP", "quadratic_program", "packed",
         "", "\ud800", "x" * 5000, "\0", "é"]  # fmt: skip
NUMBERS = [0, 1, -1, 2**63, -(2**63), -0.0, 1e308, 5e-324, float("nan"), float("inf"), 0.5]
RAW = [b"\x01\x00\x02\x00{", b"\x00" * 5, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
       b"\x01\x00\x11\x00" + b'{"do": "start"}\n', b"\xff" + bytes(8) + b"\x7f\x03\x00NULL",
       b"\xff" + bytes(8) + b"\x7f\x01\x05", b""]  # fmt: skip
"""Bytes on the wire that are no message of ZMTP 3; the first five ended the server once."""

EXTREMES = [b"[" * 100_000, b'{"a":' * 50_000, b"\x91" * 100_000, b"\x81\xa1a" * 30_000,
            b"{" + b" " * (LARGEST - 1), b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff",
            b"\xc6\xff\xff\xff\xff", b'{"do":' + b"9" * 5000 + b"}",
            b"\xd7\xff" + b"\xff" * 8]  # fmt: skip


class FuzzedServer:
    """A server in a thread, whose runs begin anew when they are ended; `stop` ends it."""

    def __init__(self, pace):
        """Listens at a free port of this machine."""
        self._stopped, self._pace = threading.Event(), pace
        self.ends, self.problem, self.runs = Counter(), None, 0
        robot = load_robot("acrobot_large")
        self._service = tension_service(robot, limits=None, method="quadratic_program")
        self._socket = ServerSocket("127.0.0.1", 0, self._stopped.is_set)
        self.address = self._socket.address
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def wait(self, holds):
        """Until something holds; raises what ended the server."""
        end = time.monotonic() + LONG
        while not holds():
            if self.problem is not None:
                raise self.problem
            assert time.monotonic() < end, "the server hangs"
            time.sleep(1e-3)

    def stop(self):
        """Ends it; raises what it ended by before."""
        self._stopped.set()
        self._thread.join(LONG)
        if self.problem is not None:
            raise self.problem

    def _serve(self):
        try:
            while True:
                self.runs += 1
                self._run()
                self._socket.close()  # as each run of `cdpr serve` has a socket of its own
                port = int(self.address.rpartition(":")[2])
                self._socket = ServerSocket("127.0.0.1", port, self._stopped.is_set)
        except KeyboardInterrupt:
            pass
        except BaseException as problem:
            self.problem = problem
        self._socket.close()

    def _run(self):
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


def anything(chance, depth=0):
    """A value of any type that JSON or msgpack knows."""
    kind = chance.randrange(8 if depth < 4 else 5)
    if kind < 3:
        return chance.choice((NUMBERS, WORDS, [None, True, False])[kind])
    if kind == 3:
        return chance.randbytes(chance.choice([0, 1, 7, 8, 24, 56, 64]))
    if kind == 4:
        return msgpack.ExtType(chance.randrange(128), chance.randbytes(chance.randrange(20)))
    count = chance.choice([0, 1, 3, 6, 7, 8])
    if kind < 7:
        return [anything(chance, depth + 1) for _ in range(count)]
    return {chance.choice(WORDS): anything(chance, depth + 1) for _ in range(count)}


def request(chance):
    """A message that is valid, or was before some things of it changed."""
    pose = [1, 0, 0, 0, 0, 0, 0.1]
    message = chance.choice([
        {"do": "describe"}, {"do": "stop"}, {"do": "step", "inputs": dict(HOLD)},
        {"do": "start", "outputs": ["X_WP"], "packed": chance.random() < 0.5},
        {"do": "step", "inputs": {"tensions": np.full(8, 5.0).tobytes(), "motion": bytes(24)}},
        {"do": "distribute", "pose": pose, "wrench": [chance.random()] * 6},
        {"do": "distribute", "pose": pose, "limits": [0, 1e3], "method": chance.choice(WORDS)},
    ])  # fmt: skip
    while chance.random() < 0.6:
        inner = [message, *(part for part in message.values() if isinstance(part, dict))]
        part = chance.choice(inner)
        part[chance.choice([*part, chance.choice(WORDS)])] = anything(chance)
    return message


def payload(chance):
    """One frame, of any kind."""
    kind = chance.randrange(10)
    if kind == 0:
        return chance.randbytes(chance.choice([0, 1, 2, 3, 5, 8, 50, 1000]))
    if kind == 1:
        return chance.choice(EXTREMES)
    made = anything(chance) if kind == 2 else request(chance)
    written = repr(made).encode("utf-8", "replace")
    with suppress(TypeError, ValueError, OverflowError, RecursionError):
        if chance.random() < 0.5:
            written = json.dumps(made).encode("utf-8", "surrogatepass")
        else:
            written = msgpack.packb(made, unicode_errors="surrogatepass")
    at = chance.randrange(len(written) + 1)
    if kind == 3:
        return written[:at] + chance.randbytes(1) + written[at + 1 :]
    return written[:at] if kind == 4 else written


class Sender:
    """Sends to one server, and checks what comes back."""

    def __init__(self, pace, seed):
        """With a server of its own."""
        self.server, self.chance, self.counts = FuzzedServer(pace), random.Random(seed), Counter()
        self._context = zmq.Context()
        self._good = None  # who drives beside

    def close(self):
        """Ends the server too; raises what it ended by."""
        self._settle(beside=False)
        self._context.destroy(linger=0)
        self.server.stop()

    def send(self):
        """One random thing in one random state; raises AssertionError where it is not answered."""
        way = self.chance.choices(("message", "frames", "raw", "vanish"), (80, 8, 5, 5))[0]
        state = self.chance.choice(STATES[:2] if way == "raw" else STATES)
        self.counts[state] += 1
        self._settle(beside=state == "beside a driver")
        before = self.server.runs
        if way == "raw":
            host, port = self.server.address.removeprefix("tcp://").split(":")
            with suppress(OSError), socket.create_connection((host, int(port)), LONG) as one:
                one.sendall(self.chance.choice(RAW) or self.chance.randbytes(100))
        else:
            one = self._started() if state == "driving" else self._connected()
            if state == "driving" and self.chance.random() < 0.5:
                one.send(STEP)
                self._reply(one, before)
            more = range(self.chance.choice([1, 2, 5, 200]) if way == "frames" else 0)
            frames = [self.chance.choice([b"", b"x", payload(self.chance)]) for _ in more]
            one.send_multipart([*frames, payload(self.chance)])
            if way != "vanish":
                self._reply(one, before)
            one.close()  # which ends the run of who drives, if that has not
            if state == "driving":
                self.server.wait(lambda: self.server.runs > before)
        if self._good is not None:  # who drives beside drives on
            self._good.send(STEP)
            self.server.wait(lambda: self._good.poll(10))
            assert "time" in json.loads(self._good.recv())

    def _settle(self, beside):
        """Has a driver beside this sender, or none."""
        if beside and self._good is None:
            self._good = self._started()
        elif not beside and self._good is not None:
            before = self.server.runs
            self._good.close()
            self._good = None
            self.server.wait(lambda: self.server.runs > before)

    def _reply(self, one, before):
        """Waits for a reply, or for the end of the run."""
        self.server.wait(lambda: one.poll(50) or self.server.runs > before)
        if one.poll(0):
            reply, _ = decode(bytes(one.recv_multipart()[-1]))
            self.counts["accepted" if reply["ok"] else "refused"] += 1
            assert len(reply.get("error", "")) < LONGEST_ERROR, reply
            assert "\n" not in reply.get("error", ""), reply

    def _started(self):
        """A connection that drives; a run that was left may have to end first."""
        one = None

        def drives():
            nonlocal one
            one = self._connected()
            one.send(b'{"do": "start"}')
            if one.poll(2000) and json.loads(one.recv()).get("ok"):
                return True
            one.close()
            return False

        self.server.wait(drives)
        return one

    def _connected(self):
        made = self._context.socket(zmq.DEALER)
        made.setsockopt(zmq.LINGER, 0)
        made.connect(self.server.address)
        return made


def main():
    """Sends, and prints what became of it."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--count", type=int, default=10_000)
    options.add_argument("--seed", type=int, default=0)
    arguments = options.parse_args()
    for number, pace in enumerate(SyncMode):
        sender = Sender(pace, len(SyncMode) * arguments.seed + number)
        for _ in range(arguments.count // len(SyncMode)):
            sender.send()
        sender.close()
        print(json.dumps({"pace": pace, "ends": sender.server.ends, **sender.counts}, indent=2))


if __name__ == "__main__":
    main()
