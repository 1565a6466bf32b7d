"""Random messages in every state of the protocol: each is answered, and only the driver's count.

Bytes, valid msgpack and JSON of wrong types, valid messages in the wrong state, deep, huge, not
finite, of wrong sizes. What is no message of ZeroMQ is in `test_server`.
"""

import json
import random
from contextlib import suppress

import msgpack
import numpy as np
import pytest

from cdpr_drake.errors import ClientEndedError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.sections.remote.driver import Driver, Port, SyncMode
from cdpr_drake.sections.remote.messages import LARGEST, decode
from cdpr_drake.sections.remote.service import tension_service

COUNT = 1000
"""Messages of each pace and state."""

LONGEST_ERROR = 1000
"""Characters of an error: what was sent is shown in part only."""

INPUTS = [Port("tensions", 8, "N", "commanded"), Port("motion", 3, "m", "another one")]
OUTPUTS = [Port("X_WP", 7, "-, m", "pose")]
SERVICE = tension_service(load_robot("acrobot_large"), limits=None, method="quadratic_program")
HOLD = {"tensions": [4.0] * 8, "motion": [0.0] * 3}
POSE = [1, 0, 0, 0, 0, 0, 0.1]
WORDS = ["do", "start", "step", "stop", "describe", "distribute", "inputs", "outputs", "pose", "ok",
         "wrench", "limits", "method", "tensions", "motion", "X_WP", "quadratic_program", "packed",
         "", "\ud800", "x" * 5000, "\0", "é"]  # fmt: skip
NUMBERS = [0, 1, -1, 2**63, -(2**63), -0.0, 1e308, 5e-324, float("nan"), float("inf"), 0.5]
EXTREMES = [b"[" * 100_000, b'{"a":' * 50_000, b"\x91" * 100_000, b"\x81\xa1a" * 30_000,
            b"{" + b" " * LARGEST, b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff",
            b"\xc6\xff\xff\xff\xff", b'{"do":' + b"9" * 5000 + b"}",
            b"\xd7\xff" + b"\xff" * 8]  # fmt: skip


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
    message = chance.choice([
        {"do": "describe"}, {"do": "stop"}, {"do": "step", "inputs": dict(HOLD)},
        {"do": "start", "outputs": ["X_WP"], "packed": chance.random() < 0.5},
        {"do": "step", "inputs": {"tensions": np.full(8, 5.0).tobytes(), "motion": bytes(24)}},
        {"do": "distribute", "pose": POSE, "wrench": [chance.random()] * 6},
        {"do": "distribute", "pose": POSE, "limits": [0, 1e3], "method": chance.choice(WORDS)},
    ])  # fmt: skip
    while chance.random() < 0.6:
        part = chance.choice([message, *(v for v in message.values() if isinstance(v, dict))])
        part[chance.choice([*part, chance.choice(WORDS)])] = anything(chance)
    return message


def payload(chance):
    """The bytes of a message, of any kind."""
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


class Post:
    """A socket at which letters lie, each with its sender; keeps replies by who gets them."""

    def __init__(self, *letters):
        self.letters, self.replies = list(letters), {"driver": [], "stranger": []}

    def receive(self, _):
        if not self.letters:
            raise ClientEndedError("no more letters")
        sender, letter = self.letters.pop(0)
        return [sender.encode()], letter if isinstance(letter, bytes) else json.dumps(
            letter
        ).encode()

    def send(self, envelope, letter):
        self.replies[envelope[0].decode()].append(decode(letter)[0])
        return True

    def look(self):
        pass

    follow = ignore_stop = look


def told(post, pace):
    """What a driver takes over, and why it ends."""
    driver = Driver(
        post, {}, INPUTS, OUTPUTS, pace=pace, timeout=60.0, period=1e-3,
        services={"distribute": SERVICE},
    )  # fmt: skip
    commands = []

    def drive():
        driver.wait(60.0)
        while True:
            commands.append(driver.exchange(1e-3 * len(commands), lambda _: np.array(POSE)))

    with pytest.raises(ClientEndedError) as ended:
        drive()
    driver.end({"outcome": "client_ended", "message": str(ended.value), "sim_time_s": 0.0})
    return commands, str(ended.value)


@pytest.mark.parametrize("pace", list(SyncMode))
@pytest.mark.parametrize("sender", ["driver", "stranger"])
@pytest.mark.parametrize("before", [[], ["start"], ["start", "step"]], ids=len)
def test_each_message_is_answered_and_only_those_of_the_driver_count(before, sender, pace):
    chance, refused = random.Random(0), 0
    start, step = ("driver", {"do": "start"}), ("driver", {"do": "step", "inputs": HOLD})
    for _ in range(COUNT if pace == SyncMode.LOCK_STEP else COUNT // 10):
        letter = payload(chance)
        post = Post(*(start, step)[: len(before)], (sender, letter), *[step] * bool(before))
        commands, why = told(post, pace)
        assert "\n" not in why
        assert len(why) < LONGEST_ERROR, why
        for given in commands:
            assert {name: len(row) for name, row in given.items()} == {"tensions": 8, "motion": 3}
            assert all(np.all(np.isfinite(row)) for row in given.values())
        errors = [reply["error"] for reply in post.replies[sender] if not reply["ok"]]
        assert len(errors) <= 1
        assert all("\n" not in said and len(said) < LONGEST_ERROR for said in errors), letter[:80]
        refused += len(errors)
        if sender == "stranger" and before:
            assert len(post.replies["stranger"]) == 1, letter[:80]
            assert (why, post.letters) == ("no more letters", [])
            assert not commands or commands[-1]["tensions"].tolist() == HOLD["tensions"]
        elif errors and before:
            assert why.startswith("the client's message was not accepted") or "distribute" in str(
                letter
            )
    assert refused > 10
