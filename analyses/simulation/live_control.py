"""The run's end of the connection: what it says, and what it does about what it is told."""

from __future__ import annotations

import select
from collections.abc import Callable
from multiprocessing.connection import Connection
from time import monotonic
from typing import Any

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, EventStatus

from cdpr_drake.analyses.simulation.by_hand import BREAK, PUSH, ByHand
from cdpr_drake.analyses.simulation.live_messages import Message, receive, send
from cdpr_drake.analyses.simulation.live_samples import Moments
from cdpr_drake.analyses.simulation.realtime_rate import FASTEST_SPEED, SLOWEST_SPEED, RealtimeRate
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.loops.loop_choice import uses_compiled_loop

SAMPLE_RATE = 30.0
"""Samples per second at most [Hz]."""

IMAGE_RATE = 15.0
"""Images per second at most [Hz]."""

LISTEN_PERIOD = 0.02
"""Time between looks whether something was said, where the run need not wait [s]."""

LONGEST_WAIT = 0.05
"""Time between looks whether a run that stands is to be stopped [s]."""


def check_steered(scenario: Any) -> None:
    """Refuses runs without a diagram that could be looked into.

    Raises:
        ScenarioError: The scenario asks for the compiled loop.
    """
    if uses_compiled_loop(scenario):
        raise ScenarioError(
            f"{scenario.name}: integration.loop: found compiled, but a loop cannot be looked into; "
            "accepted: diagram or automatic"
        )


class Steering:
    """Shows a run to who holds the other end of a connection, and obeys.

    It looks between steps and changes nothing in the simulation, but what it is told to break or to
    push. Where the other end does not read, samples and images are left out: nobody makes a run
    wait but by asking for it.
    """

    def __init__(
        self,
        scenario: Any,
        connection: Connection,
        *,
        should_stop: Callable[[], bool],
        ask_stop: Callable[[], None],
    ) -> None:
        """Says how the run begins.

        Args:
            scenario: The scenario.
            connection: Its end of the connection.
            should_stop: Whether the run was asked to stop by other ways.
            ask_stop: Asks it to stop.

        Raises:
            ScenarioError: See `check_steered`.
        """
        check_steered(scenario)
        self._connection = connection
        self._should_stop, self._ask_stop = should_stop, ask_stop
        self._pace = RealtimeRate()
        self._moments = Moments(scenario)
        self._period = 1.0 / scenario.log_rate
        self._sample_due = self._image_due = self._listen_due = 0.0
        self._told: tuple[bool, float | None] | None = None
        self._is_there = True
        self._by_hand = ByHand(scenario)
        begin = self._moments.begin()
        takes = {"takes": list(self._by_hand.takes)}
        self._send(Message("begin", begin.data | takes), always=True)

    def prepare(self, simulator: Simulator, diagram: Diagram) -> None:
        """Looks at a run from now on; for `run_scenario`."""
        self._by_hand.find(diagram)
        simulator.set_monitor(lambda context: self._look(diagram, context))

    def _look(self, diagram: Diagram, context: Context) -> EventStatus:
        now, wall = context.get_time(), monotonic()
        if wall >= self._listen_due:
            self._listen(now)
            self._listen_due = wall + LISTEN_PERIOD
        if wall >= self._sample_due:
            self._show(diagram, context, wall)
        shown = False
        while (wait := self._pace.wait(now)) > 0.0 and self._is_there and not self._should_stop():
            if self._pace.paused and not shown:
                self._tell_pace(now)
                self._image_due = 0.0
                self._show(diagram, context, monotonic())
                shown = True
            if self._hears(min(wait, LONGEST_WAIT)):
                self._listen(now)
        self._tell_pace(now)
        return EventStatus.DidNothing()

    def _show(self, diagram: Diagram, context: Context, wall: float) -> None:
        """Sends a sample, and an image if it is time."""
        self._sample_due = wall + 1.0 / SAMPLE_RATE
        self._send(self._moments.sample(diagram, context))
        if wall >= self._image_due:
            image = self._moments.image(diagram, context)
            if image is not None:
                self._send(image)
            self._image_due = monotonic() + 1.0 / IMAGE_RATE

    def _tell_pace(self, now: float) -> None:
        stands = (self._pace.paused, self._pace.speed)
        if stands != self._told:
            self._told = stands
            data = {"t": now, "paused": stands[0], "speed": stands[1]}
            self._send(Message("pace", data), always=True)

    def _send(self, message: Message, always: bool = False) -> None:
        """Sends a message if the other end has read what was there."""
        if not self._is_there:
            return
        try:
            if always or _has_room(self._connection):
                send(self._connection, message)
        except OSError:
            self._hang_up()

    def _hang_up(self) -> None:
        """Whoever asked for this run is gone: it ends, and keeps what it has."""
        self._is_there = False
        self._pace.go()
        self._pace.go_at(None)
        self._ask_stop()

    def _hears(self, seconds: float) -> bool:
        try:
            return self._connection.poll(seconds)
        except OSError:
            self._hang_up()
            return False

    def _listen(self, now: float) -> None:
        """Does all that was said by now."""
        while self._is_there and self._hears(0.0):
            try:
                message = receive(self._connection)
            except (EOFError, OSError):
                self._hang_up()
            except ValueError:
                continue
            else:
                if message.kind == "do":
                    self._obey(message.data, now)

    def _obey(self, data: dict[str, Any], now: float) -> None:
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
            pace.go_at(
                None if factor is None else min(max(float(factor), SLOWEST_SPEED), FASTEST_SPEED)
            )
        elif what == "stop":
            pace.go()
            pace.go_at(None)
            self._ask_stop()
        elif what in (BREAK, PUSH):
            try:
                done = self._by_hand.do(data, now)
            except ScenarioError as problem:
                done = {"t": now, "refused": str(problem)}
            self._send(Message("event", done), always=True)


def _has_room(connection: Connection) -> bool:
    """Whether what is sent now goes off at once."""
    poll = select.poll()
    poll.register(connection.fileno(), select.POLLOUT)
    return bool(poll.poll(0))
