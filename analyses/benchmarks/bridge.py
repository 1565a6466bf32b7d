"""Benchmark of a process outside in the loop: lock step against a bare ZeroMQ echo.

Both ways two processes exchange a message and its reply on this machine, in turns, by the clock on
the wall: what takes time is waiting for each other. The echo's messages are as long as the
bridge's, and nothing is done with them.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from cdpr_drake.analyses.benchmarks.dynamic_loops import SCENARIO
from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved
from cdpr_drake.analyses.simulation.tension_control_run import make_control
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.remote_tension_loop import RemoteTensionLoop
from cdpr_drake.systems.remote.messages import encode
from cdpr_drake.systems.remote.remote_driver import Driver, SyncMode
from cdpr_drake.systems.remote.server_socket import ServerSocket
from cdpr_drake.systems.remote.service import tension_service
from cdpr_drake.systems.robots.settings import COMPILED

WARM = 200
"""Exchanges that do not count."""

LONGEST = 600.0
"""Time after which a process that does not come is given up [s]; a busy machine takes minutes."""

SEEN = ("platform_state", "desired_wrench")

ECHO = """
import sys, zmq
socket = zmq.Context().socket(zmq.REQ)
socket.connect(sys.argv[1])
message = bytes(int(sys.argv[2]))
for _ in range(int(sys.argv[3])):
    socket.send(message)
    socket.recv()
"""

CLIENT = """
import sys
from cdpr_drake.systems.remote.remote_client import RemoteClient
with RemoteClient(sys.argv[1], timeout=float(sys.argv[3])) as client:
    now = client.start(sys.argv[2].split(","))
    tensions = client.distribute(now.outputs["platform_state"][:7])[0]
    while now.end is None:
        now = client.step(tensions=tensions)
"""


@contextmanager
def _other(program: str, *arguments: str) -> Iterator[None]:
    """Another Python beside the block, which ends it where that fails."""
    with subprocess.Popen([sys.executable, "-c", program, *arguments]) as process:
        try:
            yield
            process.wait(LONGEST)
        finally:
            process.kill()


def echo_rate(count: int, size: int) -> float:
    """Exchanges of `size` bytes and back per second by REQ and REP."""
    import zmq

    context = zmq.Context()
    socket = context.socket(zmq.REP)
    socket.setsockopt(zmq.RCVTIMEO, round(1e3 * LONGEST))
    port = socket.bind_to_random_port("tcp://127.0.0.1")
    try:
        with _other(ECHO, f"tcp://127.0.0.1:{port}", str(size), str(count + WARM)):
            for number in range(count + WARM):
                if number == WARM:
                    began = time.perf_counter()
                socket.send(socket.recv())
            return count / (time.perf_counter() - began)
    finally:
        socket.close()
        context.term()


def bridge_rate(count: int) -> float:
    """Control steps per second, each with a client's tensions: motion, log and all."""
    overrides = [f"integration.engine={COMPILED}", "remote.place=distributor"]
    scenario = load_scenario(SCENARIO, overrides)
    control = make_control(scenario)
    loop, remote = RemoteTensionLoop(control, scenario.log_rate), control.remote
    assert remote is not None
    period = 1.0 / scenario.controller.rate
    socket = ServerSocket("127.0.0.1", 0, lambda: False)
    service = tension_service(
        control.robot,
        limits=scenario.limits(),
        method=scenario.distribution.method,
        cables=scenario.believed_cables(control.robot),
    )

    driver = Driver(
        socket, {}, remote.inputs, remote.outputs, pace=SyncMode.LOCK_STEP, timeout=LONGEST,
        period=period, services={"distribute": service},
    )  # fmt: skip
    try:
        with _other(CLIENT, socket.address, ",".join(SEEN), str(LONGEST)):
            driver.wait(LONGEST)
            remote.commander = driver
            loop.advance_to(WARM * period)
            began = time.perf_counter()
            loop.advance_to((WARM + count) * period)
            rate = count / (time.perf_counter() - began)
            driver.end({"outcome": "completed", "message": "", "sim_time_s": loop.time})
        return rate
    finally:
        socket.close()


def message_size() -> int:
    """Bytes of what the client is told at an instant."""
    outputs = {SEEN[0]: np.full(13, 0.1).tobytes(), SEEN[1]: np.full(6, 0.1).tobytes()}
    return len(encode({"ok": True, "time": 0.1, "outputs": outputs}, "msgpack"))


def bridge_rows(quick: bool) -> list[TimingRow]:
    """Lock step against the echo; none where ZeroMQ is not installed."""
    try:
        import msgpack  # noqa: F401
        import zmq  # noqa: F401
    except ImportError:
        return []
    count, repeats = (1000, 3) if quick else (5000, 9)
    size = message_size()
    lock_step, echo = interleaved(
        [lambda: bridge_rate(count), lambda: echo_rate(count, size)], repeats
    )
    return [
        TimingRow(
            "dynamic loop with a process outside, lock step",
            lock_step,
            "exchanges/s",
            "bare ZeroMQ echo between two processes",
            echo,
            lock_step / echo,
            ratio_means="of the echo's exchanges per second",
        )
    ]
