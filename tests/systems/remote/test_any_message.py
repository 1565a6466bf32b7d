"""Whatever arrives, a server waits on; a slice of `python -m tests.systems.remote.message_fuzz`."""

import socket
import time
from contextlib import suppress

import numpy as np
import pytest

from cdpr_drake.errors import ClientEndedError
from cdpr_drake.systems.remote.remote_client import RemoteClient
from cdpr_drake.systems.remote.remote_driver import Driver, Port, SyncMode
from cdpr_drake.systems.remote.server_socket import SLICE, ServerSocket
from tests.systems.remote.message_fuzz import RAW, Sender
from tests.systems.remote.served import LONG, beside

COUNT = 150
"""Messages for each pace."""

CONNECTIONS = 2300
"""More than ZeroMQ keeps events of for who does not read them, some 2000."""


def driver(one, pace=SyncMode.LOCK_STEP):
    port = Port("tensions", 2, "N", "commanded")
    return Driver(one, {}, [port], [port], pace=pace, timeout=LONG, period=1e-3, services={})


@pytest.fixture
def listening():
    one = ServerSocket("127.0.0.1", 0, lambda: False)
    yield one
    one.close()


def raw(one, payload):
    host, port = one.address.removeprefix("tcp://").split(":")
    with suppress(ConnectionError), socket.create_connection((host, int(port)), timeout=LONG) as to:
        to.sendall(payload)


def starts(one, before):
    """Does something as a stranger does, and starts then; the first instant."""
    before()
    with RemoteClient(one.address, timeout=LONG) as client:
        return client.start([])


def drive(one, instants=0):
    """Runs with who comes, until that goes away."""
    made = driver(one)
    made.wait(LONG)
    for now in range(instants):
        made.exchange(float(now), lambda _: None)
    with pytest.raises(ClientEndedError):
        made.exchange(float(instants), lambda _: None)


@pytest.mark.parametrize("payload", RAW, ids=[repr(each[:12]) for each in RAW])
def test_bytes_that_are_no_message_do_not_end_a_server_that_waits(listening, payload):
    with beside(starts, listening, lambda: raw(listening, payload)) as found:
        drive(listening)
    assert found[0].time == 0.0


def test_who_speaks_an_old_protocol_is_refused_in_words(listening):
    """As a web page could send it: nobody can be told from others by it, nor be missed."""

    def ask():
        host, port = listening.address.removeprefix("tcp://").split(":")
        with socket.create_connection((host, int(port)), timeout=LONG) as to:
            to.sendall(b"\x01\x00\x10\x00" + b'{"do": "start"}')
            said = b""
            while b"ZeroMQ 4" not in said:
                said += to.recv(1000)
        with RemoteClient(listening.address, timeout=LONG) as client:
            client.start([])

    with beside(ask) as found:
        drive(listening)
    assert found == [None]


def test_many_that_connect_and_go_do_not_make_it_deaf(listening):
    def knock():
        for _ in range(CONNECTIONS):
            raw(listening, b"")

    with beside(starts, listening, knock) as found:
        drive(listening)
    assert found[0].time == 0.0, found


def test_the_end_of_an_earlier_connection_is_not_that_of_the_driver(listening):
    """The system gives its number to the next connection."""

    def look():
        for _ in range(20):
            with RemoteClient(listening.address, timeout=LONG) as other:
                other.describe()
        with RemoteClient(listening.address, timeout=LONG) as client:
            client.start([])
            time.sleep(4 * SLICE)  # so that the server looks after it
            return [client.step(tensions=[1.0, 2.0]).time for _ in range(3)]

    with beside(look) as found:
        drive(listening, 3)
    assert found == [[1.0, 2.0, 3.0]]


def test_who_has_gone_before_its_start_was_read_is_missed_at_once(listening):
    """Also if another connection has its number by then; the time-out is half an hour."""

    def start_and_go():
        import zmq

        with zmq.Context() as context, context.socket(zmq.DEALER) as one:
            one.connect(listening.address)
            one.send(b'{"do": "describe"}')
            one.recv()
            one.send(b'{"do": "start"}')
            one.setsockopt(zmq.LINGER, round(1e3 * LONG))
        for _ in range(3):
            raw(listening, b"")

    made = driver(listening)
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
        driver(Flooded()).wait(0.01)
    flooded = Flooded()
    flooded.wish = True
    with pytest.raises(KeyboardInterrupt):
        driver(flooded).wait(LONG)


@pytest.mark.parametrize("pace", list(SyncMode))
def test_random_messages_in_every_state(pace):
    sender = Sender(pace, seed=list(SyncMode).index(pace))
    for _ in range(COUNT):
        sender.send()
    sender.close()
    states = {key.partition(",")[0] for key in sender.counts}
    assert {"waiting", "beside a driver", "driving"} <= states
    assert sender.counts["refused"] > COUNT / 5
    assert sender.server.ends["the client's message was not accepted"] > COUNT / 10
