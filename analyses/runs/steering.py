"""A run that another program follows and steers over a connection, such as the studio.

`steered` lets the program at the other end see samples and images of the run, pause it, change its
speed, stop it, break a cable, or push the platform. The run is looked at between its steps, and
waits there: its numbers are those of a run that nobody looks at, but for cables and pushes, which
are entered into the scenario with their times. If the other end does not read, samples and images
are left out.

Messages are JSON, followed by bytes for an image. The run sends:

======== ==========================================================================================
kind     data
======== ==========================================================================================
begin    scenario, title, robot, cables (names), limits (two tensions [N]), duration [s], period of
         the log [s], takes (what can be done by hand: break, push)
sample   t [s], position_error [m], rotation_error [rad], tensions [N], lengths [m], unstrained
         [m] or null, pose (quaternion w x y z, position [m]), outcome
image    t [s], then the image as JPEG
pace     t [s], paused, speed: a factor, or null for as fast as possible; after each change
event    t [s], words: what was done by hand, or refused: why it was not
======== ==========================================================================================

It takes messages of the kind `do`, with `what`: pause, go, step (with `seconds`, or null for the
period of the log), speed (with `factor`, or null), stop, break (with `cable`, its number), push
(with `force` [N] in W and `seconds`, a half sine). The end of the connection stops the run.
"""

from __future__ import annotations

import json
import math
import select
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from time import monotonic
from typing import Any

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, EventStatus

from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.runs.samples import Samples
from cdpr_drake.errors import CdprError, ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.systems.loops.loop_choice import uses_compiled_loop
from cdpr_drake.systems.robots.failures import BREAKS, Failure, Failures
from cdpr_drake.systems.sections import sections_at

SAMPLE_RATE, IMAGE_RATE = 30.0, 15.0
"""Samples and images per second at most [Hz]."""

LISTEN_PERIOD, LONGEST_WAIT = 0.02, 0.05
"""Times between looks at the connection of a run that goes on, and of one that stands [s]."""

SLOWEST_SPEED, FASTEST_SPEED = 0.01, 1000.0
"""Accepted factors of real time."""

BEHIND = 0.1
"""A run that is later does not catch up: it goes on at its speed from there [s]."""

LARGEST_MESSAGE = 16 * 2**20
"""Size of a message or image; larger ones are no messages of a run [byte]."""

BREAK, PUSH = "break", "push"
"""What the studio lets be done by hand; `UNTOUCHED` has all there is."""

UNTOUCHED = {BREAK: ("failures", "{events: []}")} | {
    act: (key, least)
    for key, section in sections_at("robot_scenario").items()
    for act, least in section.by_hand.items()
}
"""By what can be done by hand, the section of a scenario that it needs, and its least content."""


def steered(follow: Follow, scenario: Any, descriptor: int) -> Follow:
    """Lets the program at the other end of a socket steer a run.

    Args:
        follow: Who follows besides.
        scenario: The scenario of the run.
        descriptor: The open socket.

    Raises:
        CdprError: There is no such socket.
    """
    try:
        connection = Connection(descriptor)
    except (OSError, ValueError) as problem:
        raise CdprError(
            f"steered_by: found {descriptor}; accepted: the number of an open socket"
        ) from problem
    steering = Steering(scenario, connection, follow.stop)
    acts = bool(steering.hands.takes)
    return replace(follow, prepare=steering.prepare, stop=steering.stop, acts=acts)


def check_steered(scenario: Any) -> None:
    """Refuses a run without a diagram that could be looked into.

    Raises:
        ScenarioError: The scenario asks for the compiled loop.
    """
    if uses_compiled_loop(scenario):
        raise ScenarioError(
            f"{scenario.name}: integration.loop: found compiled, but a loop cannot be looked into; "
            "accepted: diagram or automatic"
        )


@dataclass(frozen=True)
class Message:
    """A message.

    Attributes:
        kind: See above.
        data: Numbers and words, for JSON.
        blob: The bytes that follow; may be empty.
    """

    kind: str
    data: dict[str, Any] = field(default_factory=dict)
    blob: bytes = b""


def pieces(message: Message) -> list[bytes]:
    """A message as bytes, in which numbers that are not finite become null."""
    head = {"kind": message.kind, "blob": len(message.blob), **message.data}
    text = json.dumps(finite(head), allow_nan=False).encode()
    return [text, message.blob] if message.blob else [text]


def head_of(piece: bytes) -> tuple[Message, bool]:
    """What the first piece of a message says, and whether its blob follows.

    Raises:
        ValueError: That was no message.
    """
    head = load_json(piece)
    if not isinstance(head, dict) or not isinstance(head.get("kind"), str):
        raise ValueError("found no kind in a message")
    kind, size = head.pop("kind"), head.pop("blob", 0)
    return Message(kind, head), bool(size)


def send(connection: Connection, message: Message) -> None:
    """Sends a message.

    Raises:
        OSError: The other end is closed.
    """
    for piece in pieces(message):
        connection.send_bytes(piece)


def receive(connection: Connection) -> Message:
    """Waits for the next message.

    Raises:
        EOFError: The other end is closed.
        OSError: The connection broke.
        ValueError: That was no message.
    """
    message, has_blob = head_of(connection.recv_bytes(LARGEST_MESSAGE))
    if has_blob:
        return replace(message, blob=connection.recv_bytes(LARGEST_MESSAGE))
    return message


class Steering:
    """The run's end of the connection: it shows the run, and does what the other end asks for.

    Attributes:
        hands: What is done by hand.
    """

    def __init__(
        self, scenario: Any, connection: Connection, stop: Callable[[], bool] = lambda: False
    ) -> None:
        """Sends the message `begin`.

        Args:
            scenario: The scenario.
            connection: Its end of the connection.
            stop: True if the run should stop for another reason.
        """
        self._connection, self._stop_of_others = connection, stop
        self._pace, self._samples = Pace(), Samples(scenario)
        self.hands, self._period = ByHand(scenario), 1.0 / scenario.log_rate
        self._sample_due = self._image_due = self._listen_due = 0.0
        self._reported: tuple[bool, float | None] | None = None
        self._connected, self._stopped = True, False
        begin = {**self._samples.header(), "takes": list(self.hands.takes)}
        self._send(Message("begin", begin), always=True)

    def stop(self) -> bool:
        """True if the run should stop."""
        return self._stopped or self._stop_of_others()

    def prepare(self, run: Any, simulator: Simulator, diagram: Diagram) -> None:
        """Looks at a run from now on, see `Follow.prepare`."""
        self.hands.prepare(diagram)
        simulator.set_monitor(lambda context: self._look(diagram, context))

    def _look(self, diagram: Diagram, context: Context) -> EventStatus:
        now, wall = context.get_time(), monotonic()
        if wall >= self._listen_due:
            self._listen(now)
            self._listen_due = wall + LISTEN_PERIOD
        if wall >= self._sample_due:
            self._show(diagram, context, wall)
        shown = False
        while (wait := self._pace.wait(now)) > 0.0 and self._connected and not self.stop():
            if self._pace.paused and not shown:
                self._report_pace(now)
                self._image_due = 0.0
                self._show(diagram, context, monotonic())
                shown = True
            if self._poll(min(wait, LONGEST_WAIT)):
                self._listen(now)
        self._report_pace(now)
        return EventStatus.DidNothing()

    def _show(self, diagram: Diagram, context: Context, wall: float) -> None:
        """Sends a sample, and an image if it is time."""
        self._sample_due = wall + 1.0 / SAMPLE_RATE
        self._send(Message("sample", self._samples.sample(diagram, context)))
        if wall >= self._image_due:
            jpeg = self._samples.image(diagram, context)
            if jpeg:
                self._send(Message("image", {"t": context.get_time()}, jpeg))
            self._image_due = monotonic() + 1.0 / IMAGE_RATE

    def _report_pace(self, now: float) -> None:
        state = (self._pace.paused, self._pace.speed)
        if state != self._reported:
            self._reported = state
            data = {"t": now, "paused": state[0], "speed": state[1]}
            self._send(Message("pace", data), always=True)

    def _send(self, message: Message, always: bool = False) -> None:
        """Sends a message, unless it would wait for the other end to read."""
        if not self._connected:
            return
        try:
            room = select.poll()
            room.register(self._connection.fileno(), select.POLLOUT)
            if always or room.poll(0):
                send(self._connection, message)
        except OSError:
            self._hang_up()

    def _hang_up(self) -> None:
        """The other end is gone: the run ends, and keeps what it has."""
        self._connected = False
        self._end()

    def _end(self) -> None:
        self._pace.go()
        self._pace.go_at(None)
        self._stopped = True

    def _poll(self, seconds: float) -> bool:
        try:
            return self._connection.poll(seconds)
        except OSError:
            self._hang_up()
            return False

    def _listen(self, now: float) -> None:
        """Does what messages ask for that have arrived."""
        while self._connected and self._poll(0.0):
            try:
                message = receive(self._connection)
            except (EOFError, OSError):
                self._hang_up()
            except ValueError:
                continue
            else:
                if message.kind == "do":
                    self._do(message.data, now)

    def _do(self, data: dict[str, Any], now: float) -> None:
        what, pace = data.get("what"), self._pace
        if what == "pause":
            pace.pause()
        elif what == "go":
            pace.go()
        elif what == "step":
            seconds = data.get("seconds")
            pace.step(now, self._period if seconds is None else max(float(seconds), 0.0))
        elif what == "speed":
            factor = data.get("factor")
            if factor is not None:
                factor = min(max(float(factor), SLOWEST_SPEED), FASTEST_SPEED)
            pace.go_at(factor)
        elif what == "stop":
            self._end()
        elif what in UNTOUCHED:
            try:
                event = self.hands.do(data, now)
            except ScenarioError as problem:
                event = {"t": now, "refused": str(problem)}
            self._send(Message("event", event), always=True)


class Pace:
    """When a run may go on: paused, step by step, or at a factor of real time.

    Attributes:
        paused: True if it stands.
        speed: Simulated seconds per second; None: as fast as possible.
    """

    def __init__(self, speed: float | None = None, clock: Callable[[], float] = monotonic) -> None:
        """Of a run that goes on; `clock` returns a time that passes [s]."""
        self.paused, self.speed, self._clock = False, speed, clock
        self._until = math.inf
        self._anchor: tuple[float, float] | None = None

    def pause(self) -> None:
        """Stands still from now on."""
        self.paused, self._until = True, math.inf

    def go(self) -> None:
        """Goes on."""
        self.paused, self._until, self._anchor = False, math.inf, None

    def step(self, now: float, seconds: float) -> None:
        """Goes on from a simulated time for some simulated seconds, and stands then."""
        self.go()
        self._until = now + seconds

    def go_at(self, speed: float | None) -> None:
        """Changes the speed; a run that stands still does so."""
        self.speed, self._anchor = speed, None

    def wait(self, now: float) -> float:
        """Time to wait at a simulated time [s]: 0 to go on, infinite if it stands [s]."""
        if not self.paused and now >= self._until * (1.0 - 1e-12):
            self.pause()
        if self.paused:
            self._anchor = None
            return math.inf
        if self.speed is None:
            return 0.0
        wall = self._clock()
        if self._anchor is None:
            self._anchor = (wall, now)
        since, start = self._anchor
        ahead = since + (now - start) / self.speed - wall
        if ahead < -BEHIND:
            self._anchor = (wall, now)
        return max(ahead, 0.0)


class ByHand:
    """Breaks cables of a running diagram, and does what sections of its scenario let be done.

    What is done is entered into the sections, with its time, so that the scenario in the results
    gives the same run again.

    Attributes:
        takes: What can be done, of `UNTOUCHED`.
    """

    def __init__(self, scenario: Any) -> None:
        """For the scenario of which the diagram is built."""
        sections = {act: getattr(scenario, key, None) for act, (key, _) in UNTOUCHED.items()}
        failures: Any = sections[BREAK]
        if failures is not None and failures.events:
            del sections[BREAK]  # events at the start fix the times of events in the diagram
        self._sections = {act: section for act, section in sections.items() if section is not None}
        self.takes = tuple(self._sections)
        self._cables = [cable.name for cable in load_robot(scenario.robot).cables]
        self._broken: set[int] = set()
        self._failures: Failures | None = None

    def prepare(self, diagram: Diagram) -> None:
        """Takes the block of a diagram that breaks cables."""
        for system in diagram.GetSystems():
            if isinstance(system, Failures):
                self._failures = system
            elif isinstance(system, Diagram):
                self.prepare(system)

    def do(self, request: Mapping[str, Any], now: float) -> dict[str, Any]:
        """Does it at the next step; returns time and words.

        Args:
            request: `what` and what belongs to it, see the messages above.
            now: The simulated time [s].

        Raises:
            ScenarioError: It cannot be done; one line.
        """
        what = request["what"]
        if what not in self.takes:
            raise ScenarioError(
                f"{what}: found it with a scenario without {UNTOUCHED[what][0]}; accepted: "
                f"{', '.join(self.takes) or 'nothing by hand'}"
            )
        if what == BREAK:
            return self._break(request, now)
        done: dict[str, Any] = self._sections[what].do(request, now)
        return done

    def _break(self, request: Mapping[str, Any], now: float) -> dict[str, Any]:
        assert self._failures is not None
        number, count = request.get("cable"), len(self._cables)
        if not isinstance(number, int) or not 0 <= number < count or number in self._broken:
            accepted = ", ".join(str(k) for k in range(count) if k not in self._broken)
            raise ScenarioError(f"cable: found {number}; accepted: {accepted}")
        self._broken.add(number)
        self._failures.add(Failure(kind=BREAKS, time=now, cable=number))
        return {"t": now, "words": f"{self._cables[number]} breaks", "cable": number}
