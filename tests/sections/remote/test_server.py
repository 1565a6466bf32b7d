"""Whatever arrives or ceases, a server waits on, or a run ends with what was simulated."""

import json
import os
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, suppress

import msgpack
import numpy as np
import pytest
import zmq

from cdpr_drake.errors import BridgeError, ClientEndedError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.sections.remote.client import RemoteClient
from cdpr_drake.sections.remote.driver import Driver, Port, SyncMode
from cdpr_drake.sections.remote.messages import (
    JSON,
    LARGEST,
    MSGPACK,
    decode,
    encode,
    listed,
    vector,
)
from cdpr_drake.sections.remote.server_socket import SLICE, ServerSocket
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.tensions.methods import distribute
from tests.sections.remote.served import LONG, beside, scenario, server

HOLD = {"tensions": [4.0] * 8}
STEPS = 7


def settings(*overrides):
    return scenario("integration.engine=compiled", "remote.place=distributor", *overrides)


def served(client, *overrides, timeout=LONG, stop=lambda: False):
    """A run beside which a client, a function of the address, is called; and what that returned."""
    with server(timeout, stop) as one:
        with beside(client, one.socket.address) as found:
            run = one.run(settings(*overrides))
        return run, found[0]


@pytest.fixture
def raw():
    """Connects to an address; what it returns says a message, bytes or for JSON."""
    with zmq.Context() as context, ExitStack() as closing:

        def connected(address):
            socket = closing.enter_context(context.socket(zmq.REQ))
            socket.setsockopt(zmq.LINGER, 0)
            socket.connect(address)

            def say(message, answered=True):
                socket.send(message if isinstance(message, bytes) else json.dumps(message).encode())
                return socket.recv() if answered else None

            return say

        yield connected


def driver_of(socket, size=2):
    """Without a run, and with one port in and out."""
    port = Port("tensions", size, "N", "commanded")
    return Driver(
        socket, {}, [port], [port], pace=SyncMode.LOCK_STEP, timeout=LONG, period=1e-3, services={}
    )


def some_steps(say, last, steps=STEPS):
    """Starts, steps, and then sends what is no good; the reply."""
    assert json.loads(say({"do": "start"}))["time"] == 0.0
    for number in range(1, steps + 1):
        now = json.loads(say({"do": "step", "inputs": HOLD}))
        assert now["time"] == pytest.approx(1e-3 * number)
    return say(last)


NONSENSE = {
    "garbage": (b"\xff\x00garbage", "accepted: one object"),
    "half of a message": (b'{"do": "st', "accepted: one object"),
    "deep": (b'{"a":' + b"[" * 100_000, "accepted: one object"),
    "nothing": (b"", "accepted: one object"),
    "a list": (msgpack.packb([1, 2]), "accepted: one object"),
    "no question": ({"what": 1}, "do: found None"),
    "another one": ({"do": "fly"}, "do: found 'fly'"),
    "start again": ({"do": "start"}, "drives it already"),
    "wrong size": ({"do": "step", "inputs": {"tensions": [1.0] * 7}}, "found 7 entries"),
    "NaN in JSON": (b'{"do":"step","inputs":{"tensions":[NaN,1,1,1,1,1,1,1]}}', "one object"),
    "NaN": (
        msgpack.packb({"do": "step", "inputs": {"tensions": [float("nan")] * 8}}),
        "8 finite numbers",
    ),
    "infinite": (b'{"do":"step","inputs":{"tensions":[1e999,1,1,1,1,1,1,1]}}', "finite numbers"),
    "too large": (
        b'{"do":"step","inputs":{"tensions":[' + b"9" * 400 + b",1,1,1,1,1,1,1]}}",
        "one object",
    ),
    "truth": ({"do": "step", "inputs": {"tensions": [True] * 8}}, "finite numbers"),
    "words": ({"do": "step", "inputs": {"tensions": ["1"] * 8}}, "finite numbers"),
    "unknown port": ({"do": "step", "inputs": {**HOLD, "torques": [1.0]}}, "accepted: tensions"),
    "missing port": ({"do": "step", "inputs": {}}, "accepted: tensions"),
    "no inputs": ({"do": "step"}, "found None; accepted: tensions"),
    "pushing": ({"do": "step", "inputs": {"tensions": [-1.0] * 8}}, "a cable does not push"),
}


@pytest.mark.parametrize("kind", ["garbage", "pushing"])
def test_nonsense_ends_the_run_with_what_was_simulated(kind, raw):
    last, words = NONSENSE[kind]
    run, reply = served(lambda address: some_steps(raw(address), last))
    assert run.outcome == Outcome.CLIENT_ENDED
    assert words in run.message
    assert run.sim_time == pytest.approx(1e-3 * STEPS)
    assert np.all(run.log["tensions"][1:] == 4.0)
    summary = run.as_dict()
    assert (summary["outcome"], summary["message"]) == ("client_ended", run.message)
    assert summary["remote"]["exchanges"] == STEPS + (kind == "pushing")
    assert isinstance(reply, bytes)  # who sends nonsense gets a reply


@pytest.mark.parametrize("kind", [kind for kind in NONSENSE if kind != "pushing"])
def test_nonsense_is_named_and_answered(kind, raw):
    """Pushing is refused by the diagram alone."""
    last, words = NONSENSE[kind]
    with server() as one, beside(some_steps, raw(one.socket.address), last, 1) as found:
        driver = driver_of(one.socket, 8)
        driver.wait(LONG)
        assert driver.exchange(0.0, lambda _: np.zeros(8))["tensions"].tolist() == HOLD["tensions"]
        with pytest.raises(ClientEndedError) as ended:
            driver.exchange(1e-3, lambda _: np.zeros(8))
    said = str(ended.value)
    assert words in said
    assert len(said) < 500
    assert "\n" not in said
    assert isinstance(found[0], bytes)


def test_a_message_that_is_too_long_is_not_read(raw):
    def flood(address):
        say = raw(address)
        say({"do": "start", "outputs": []})
        say(b"{" + b" " * LARGEST, answered=False)

    refused = pytest.raises(ClientEndedError, match=str(LARGEST))
    with server() as one, beside(flood, one.socket.address), refused:
        drive_on(one.socket)


DYING = """
import os, sys, json, zmq
socket = zmq.Context().socket(zmq.REQ)
socket.connect(sys.argv[1])
socket.send(b'{"do": "start"}')
for _ in range(5):
    socket.recv()
    socket.send(json.dumps({"do": "step", "inputs": {"tensions": [4.0] * 8}}).encode())
socket.recv()
os._exit(9)
"""


def test_a_client_that_dies_is_missed_at_once():
    """The time-out is a minute, and would be the message."""
    with server() as one:
        dying = subprocess.Popen([sys.executable, "-c", DYING, one.socket.address])
        run = one.run(settings())
        assert dying.wait() == 9
    assert run.outcome == Outcome.CLIENT_ENDED
    assert run.message.startswith("the client went away")
    assert run.sim_time == pytest.approx(5e-3)


@pytest.mark.parametrize(("pace", "timeout"), [("lock_step", 1.0), ("real_time", 0.2)])
def test_a_silent_client(pace, timeout, raw):
    """In real time what was held last goes on, and leads away within a second."""

    def fall_silent(address):
        say = raw(address)
        say({"do": "start"})
        say({"do": "step", "inputs": HOLD}, answered=False)

    changes = (f"remote.pace={pace}", "duration=60.0")
    run, _ = served(fall_silent, *changes, timeout=timeout)
    assert run.outcome == Outcome.CLIENT_ENDED
    assert run.message == f"the client was silent for {timeout:g} s"
    if pace == "lock_step":
        assert run.sim_time == pytest.approx(1e-3)
    else:
        assert run.sim_time < 60.0
        assert run.built.outside.report()["held_steps"] > 0


def test_stop_by_the_client():
    def stop(address):
        with RemoteClient(address, timeout=LONG) as client:
            client.start()
            client.step(**HOLD)
            return client.stop()

    run, last = served(stop)
    assert run.message == "the client said stop"
    assert last.end["outcome"] == "client_ended"
    assert last.time == run.sim_time == pytest.approx(1e-3)


def test_a_request_to_stop_while_the_client_thinks(raw):
    asked = []

    def start(address):
        say = raw(address)
        say({"do": "start"})
        asked.append(True)
        return json.loads(say({"do": "step", "inputs": HOLD}))

    run, _ = served(start, stop=lambda: bool(asked))
    assert run.outcome == Outcome.INTERRUPTED


def test_strangers_are_answered_and_change_nothing():
    """Beside the driver: descriptions and tensions for all, commands from nobody else."""
    robot, home = load_robot("acrobot_large"), load_robot("acrobot_large").home.transform()
    expected = distribute(tension_problem(robot, home), "quadratic_program").tensions

    def drive(address):
        with (
            RemoteClient(address, timeout=LONG) as driver,
            RemoteClient(address, codec="json", timeout=LONG) as other,
        ):
            assert set(other.describe()["inputs"]) == {"tensions"}
            driver.start(["X_WP"])
            held, feasible = other.distribute(pose_row(home))
            np.testing.assert_array_equal(held, expected)
            assert feasible
            weight = [0.0, 0.0, 0.0, 0.0, 0.0, 3.5 * 9.81]
            moved = robot.center_of_mass()[2]
            assert moved > 0.0  # over Po, so that at home the weight has no moment
            again, _ = other.distribute(pose_row(home), weight)
            np.testing.assert_allclose(again, expected, atol=1e-9)
            _, feasible = other.distribute(pose_row(home), limits=(0.0, 1.0))
            assert not feasible
            for nonsense, words in (
                ({"do": "step", "inputs": HOLD}, "does not drive"),
                ({"do": "start"}, "does not drive"),
                ({"do": "stop"}, "does not drive"),
                ({"do": "distribute", "pose": [1, 0, 0, 0, 0, 0, 9]}, "outside the frame"),
                ({"do": "distribute", "pose": [2, 0, 0, 0, 0, 0, 0]}, "norm 2; accepted: 1"),
                ({"do": "distribute", "pose": [1.0]}, "a list of 7"),
                ({"do": "distribute", "pose": [1, 0, 0, 0, 0, 0, 0.1], "x": 1}, "found 'x'"),
            ):
                with pytest.raises(BridgeError, match=words):
                    other.ask(nonsense)
            with pytest.raises(BridgeError, match="pose"):  # the driver may ask wrongly, too
                driver.distribute([1.0])
            now = driver.step(**HOLD)
            while now.end is None:
                now = driver.step(**HOLD)
            return now.end

    run, end = served(drive)
    assert run.outcome == Outcome.COMPLETED, end
    assert end["outcome"] == "completed"
    assert run.built.outside.report()["services"] == 3


def test_nobody_comes_nowhere_to_listen_and_nobody_serves():
    with server() as one:
        with pytest.raises(ClientEndedError, match=r"within 0\.01 s"):
            driver_of(one.socket).wait(0.01)
        port = int(one.socket.address.rsplit(":", 1)[1])
        with pytest.raises(BridgeError, match=f"found 127.0.0.1:{port}"):
            ServerSocket("127.0.0.1", port, lambda: False)
    with pytest.raises(BridgeError, match="an interface of this machine"):
        ServerSocket("no.such.host.invalid", 0, lambda: False)
    with (
        RemoteClient("tcp://127.0.0.1:9", timeout=0.05) as client,
        pytest.raises(BridgeError, match=r"found no reply in 0.05 s.*cdpr serve"),
    ):
        client.describe()
    with pytest.raises(BridgeError, match="address: found 'nonsense'"):
        RemoteClient("nonsense")


def test_a_client_needs_neither_drake_nor_numba():
    words = (
        "import sys, cdpr_drake.sections.remote.client; "
        "print([m for m in ('pydrake', 'numba', 'zmq', 'msgpack', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", words], capture_output=True, text=True, check=True, env=os.environ
    )
    assert done.stdout.strip() == "[]"


def test_vectors_as_they_are_sent():
    values = [0.1, -1e300, 2.0, 1e-320]
    for found in (values, np.array(values).tobytes()):
        assert vector("v", found, 4).tobytes() == np.array(values).tobytes()
    assert vector("v", [1, 2.5], 2).tolist() == [1.0, 2.5]
    assert vector("v", [1.7e308, 1.7e308], 2).tolist() == [1.7e308, 1.7e308]
    for codec in (JSON, MSGPACK):
        again, how = decode(encode({"v": listed(np.array(values), codec)}, codec))
        assert how == codec
        assert vector("v", again["v"], 4).tobytes() == np.array(values).tobytes()
    assert listed(np.array([np.nan, 1.0]), JSON) == [None, 1.0]
    bad = (b"", b"1234567", [1.0], [None, 1.0], "ab", [[1.0], [2.0]], [np.inf, 1.0], [10**400, 1],
           np.array([np.nan, 1.0]).tobytes(), {"a": 1}, None)  # fmt: skip
    for found in bad:
        with pytest.raises(BridgeError, match=r"^v: found .*accepted: .*finite numbers"):
            vector("v", found, 2)


def test_in_real_time_a_command_holds_until_the_next():
    """A client that pauses is not waited for; what it asked for last stays."""

    def pause(address):
        with RemoteClient(address, timeout=LONG) as client:
            client.start(["tensions"])
            now = client.step(tensions=[3.0] * 8)
            time.sleep(0.03)
            while now.end is None:
                now = client.step(tensions=[5.0] * 8)
            return now.end

    run, end = served(pause, "remote.pace=real_time", "duration=0.2", "log_rate=1000")
    assert run.outcome == Outcome.COMPLETED, end
    assert end["outcome"] == "completed"
    commanded = run.log["tensions"][1:, 0]
    assert set(commanded) <= {3.0, 5.0}
    assert np.all(np.diff(commanded) >= 0.0)
    assert np.count_nonzero(commanded == 3.0) > 1
    report = run.built.outside.report()
    assert report["held_steps"] > 0
    assert report["exchanges"] + report["held_steps"] >= len(commanded) - 1


def test_stop_before_anybody_drives_is_answered_and_ends_the_wait():
    def stop(address):
        with RemoteClient(address, codec="json", timeout=LONG) as client:
            return client.stop().end

    with (
        server() as one,
        beside(stop, one.socket.address) as found,
        pytest.raises(ClientEndedError, match="said stop"),
    ):
        driver_of(one.socket).wait(LONG)
    assert found[0] == {
        "outcome": "client_ended", "message": "the client said stop", "sim_time_s": 0.0
    }  # fmt: skip


RAW = [b"\x01\x00\x02\x00{", b"\x00" * 5, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
       b"\x01\x00\x11\x00" + b'{"do": "start"}\n', b"\xff" + bytes(8) + b"\x7f\x03\x00NULL",
       b"\xff" + bytes(8) + b"\x7f\x01\x05", b""]  # fmt: skip
"""Bytes on the wire that are no message of ZMTP 3; the first five ended the server once."""

CONNECTIONS = 2300
"""More than ZeroMQ keeps events of for who does not read them, some 2000."""


@pytest.fixture
def listening():
    one = ServerSocket("127.0.0.1", 0, lambda: False)
    yield one
    one.close()


def knock(one, payload):
    """Sends bytes that ZeroMQ did not write, and goes."""
    host, port = one.address.removeprefix("tcp://").split(":")
    with suppress(ConnectionError), socket.create_connection((host, int(port)), timeout=LONG) as to:
        to.sendall(payload)


def starts(one, before):
    """Does something as a stranger does, and starts then; the first instant."""
    before()
    with RemoteClient(one.address, timeout=LONG) as client:
        return client.start([])


def drive_on(one, instants=0):
    """Runs with who comes, until that goes away."""
    made = driver_of(one)
    made.wait(LONG)
    for now in range(instants + 1):
        made.exchange(float(now), lambda _: None)


def old_protocol(one):
    """As a web page could send it: nobody can be told from others by it, nor be missed."""
    host, port = one.address.removeprefix("tcp://").split(":")
    with socket.create_connection((host, int(port)), timeout=LONG) as to:
        to.sendall(b"\x01\x00\x10\x00" + b'{"do": "start"}')
        said = b""
        while b"ZeroMQ 4" not in said:
            said += to.recv(1000)


def frames(one):
    """Many frames instead of one, by who goes before the reply."""
    with zmq.Context() as context, context.socket(zmq.DEALER) as socket:
        socket.connect(one.address)
        socket.send_multipart([b"", b"x"] * 100 + [b"{}"])
        assert json.loads(socket.recv_multipart()[-1])["ok"] is False
        socket.send_multipart([b"", b"x"] * 100 + [b'{"do": "describe"}'])


STRANGERS = {
    "frames": frames,
    **{repr(each[:12]): lambda one, each=each: knock(one, each) for each in RAW},
    "many": lambda one: [knock(one, b"") for _ in range(CONNECTIONS)],
    "an old protocol": old_protocol,
}


@pytest.mark.parametrize("stranger", STRANGERS)
def test_strangers_do_not_end_a_server_that_waits_nor_make_it_deaf(listening, stranger):
    """Bytes that are no message; many that connect and go; one that is refused in words."""
    before = lambda: STRANGERS[stranger](listening)  # noqa: E731
    with beside(starts, listening, before) as found, pytest.raises(ClientEndedError):
        drive_on(listening)
    assert found[0].time == 0.0, found


def test_the_end_of_an_earlier_connection_is_not_that_of_the_driver_of(listening):
    """The system gives its number to the next connection."""

    def look():
        for _ in range(20):
            with RemoteClient(listening.address, timeout=LONG) as other:
                other.describe()
        with RemoteClient(listening.address, timeout=LONG) as client:
            client.start([])
            time.sleep(4 * SLICE)  # so that the server looks after it
            return [client.step(tensions=[1.0, 2.0]).time for _ in range(3)]

    with beside(look) as found, pytest.raises(ClientEndedError):
        drive_on(listening, 3)
    assert found == [[1.0, 2.0, 3.0]]


def test_who_has_gone_before_its_start_was_read_is_missed_at_once(listening):
    """Also if another connection has its number by then; the time-out is half an hour."""

    def start_and_go():
        with zmq.Context() as context, context.socket(zmq.DEALER) as one:
            one.connect(listening.address)
            one.send(b'{"do": "describe"}')
            one.recv()
            one.send(b'{"do": "start"}')
            one.setsockopt(zmq.LINGER, round(1e3 * LONG))
        for _ in range(3):
            knock(listening, b"")

    made = driver_of(listening)
    with beside(start_and_go):
        made._listen(time.monotonic() + LONG)
    time.sleep(0.2)  # until the others have come; too short, it only tries less
    made.wait(LONG)
    with pytest.raises(ClientEndedError, match="went away"):
        made.exchange(0.0, lambda _: np.zeros(2))


class Flooded:
    """A socket at which there is always one more message of a stranger."""

    def __init__(self):
        self.wish = False

    def receive(self, deadline):
        return [b"stranger"], b"{}"

    def send(self, envelope, payload):
        return True

    def look(self):
        if self.wish:
            raise KeyboardInterrupt


def test_strangers_who_never_cease_keep_nobody_waiting():
    """Neither the time-out nor the request to stop waits for a moment without messages."""
    with pytest.raises(ClientEndedError, match="no client came"):
        driver_of(Flooded()).wait(0.01)
    flooded = Flooded()
    flooded.wish = True
    with pytest.raises(KeyboardInterrupt):
        driver_of(flooded).wait(LONG)
