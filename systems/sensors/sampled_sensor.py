"""A sensor that reads its input at a fixed rate: event, state and random numbers that all share.

`SampledSensor` is the base. Where a robot can have several sensors of one kind, `named_stream`
gives each name a stream of random numbers.
"""

from __future__ import annotations

import zlib
from abc import abstractmethod
from typing import Any

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteStateIndex, LeafSystem, State

from cdpr_drake.arrays import Array
from cdpr_drake.errors import SensorError
from cdpr_drake.estimation.sensor_noise import sensor_random


class SampledSensor(LeafSystem):
    """Base of the sensors: holds the latest sample.

    The sample of time t is on the ports for a controller that acts at t, since it is taken by an
    unrestricted update, which Drake performs before the discrete updates of the same time. Samples
    are taken at 0, T, 2 T, ...; a simulator shortens its steps to meet them. A log of time t is
    written before, and so shows the sample of t - T.
    """

    def __init__(self, size: int, rate: float) -> None:
        """With the number of values of a sample and samples per second [Hz].

        Raises:
            SensorError: The rate is not positive.
        """
        super().__init__()
        if not rate > 0.0:
            raise SensorError(f"rate of a sensor: found {rate:g}; accepted: a number > 0 [Hz]")
        self._rate = rate
        self.period = 1.0 / rate
        self._size = size
        self._frozen: list[tuple[float, Array]] = []
        self._late: list[tuple[float, Array, int, DiscreteStateIndex]] = []
        self._sample = self.DeclareDiscreteState(size)
        self.DeclareInitializationUnrestrictedUpdateEvent(self._take_sample)
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / rate, 0.0, self._take_sample)

    def truth(self, context: Context) -> Any:
        """What `measure` takes, from the inputs; that of the first one."""
        return self.get_input_port(0).Eval(context)

    @abstractmethod
    def measure(self, truth: Any, number: int) -> Array:
        """The sample of a truth, what stands at the input; `number` counts, the first is 1."""

    @abstractmethod
    def reading(self, sample: Array) -> Any:
        """What a sample says, as estimators read it; zeros stand for none yet."""

    def number_at(self, time: float) -> int:
        """Number of the sample of a time [s]."""
        return round(time * self._rate) + 1

    def nothing(self) -> Array:
        """What stands for a sample before the first."""
        return np.zeros(self._size)

    def sample(self, context: Context) -> Array:
        """The latest sample; zeros before the first."""
        return context.get_discrete_state(self._sample).value()

    def freeze(self, begins: float, entries: Array) -> None:
        """From a time [s] on, gives numbers of its sample as they were, True in `entries`."""
        self._frozen.append((begins, np.asarray(entries, bool)))

    def delay(self, begins: float, entries: Array, delay: float) -> None:
        """From a time [s] on, gives numbers of its sample, True in `entries`, later by so much [s],
        rounded up to whole periods; before the first of these comes, as they were.

        To be called before there is a context: samples on their way are part of its state.
        """
        periods = int(np.ceil(delay * self._rate * (1.0 - 1e-12)))
        if periods > 0:
            room = self.DeclareDiscreteState(periods * self._size)
            self._late.append((begins, np.asarray(entries, bool), periods, room))

    def channels(self, cable: int | None) -> Array:
        """Which numbers of a sample belong to a cable, shape (size,); None: all.

        For sensors with one number, or several in turn, of each cable.
        """
        if cable is None:
            return np.ones(self._size, bool)
        return np.arange(self._size) % self._per_turn() == cable

    def _per_turn(self) -> int:
        return self._size

    def _take_sample(self, context: Context, state: State) -> None:
        truth = self.truth(context)
        values = state.get_mutable_discrete_state().get_mutable_vector(self._sample)
        time = context.get_time()
        sample = self.measure(truth, self.number_at(time))
        for begins, entries in self._frozen:
            if time >= begins:
                sample = np.where(entries, self.sample(context), sample)
        for begins, entries, periods, room in self._late:
            sample = self._arrived(context, state, sample, (begins, entries, periods, room))
        values.SetFromVector(sample)

    def _arrived(
        self, context: Context, state: State, sample: Array,
        late: tuple[float, Array, int, DiscreteStateIndex],
    ) -> Array:  # fmt: skip
        """Sends a sample off, and gives what has come of those that are late."""
        begins, entries, periods, room = late
        way = state.get_mutable_discrete_state().get_mutable_vector(room)
        on_the_way = way.value().reshape(periods, self._size)
        first, time = on_the_way[0].copy(), context.get_time()
        way.SetFromVector(np.concatenate([on_the_way[1:].ravel(), sample]))
        if time < begins:
            return sample
        sent = time - periods * self.period
        last = first if sent >= begins - 1e-9 * self.period else self.sample(context)
        return np.where(entries, last, sample)

    def _declare_slice(self, name: str, start: int, size: int) -> None:
        """Adds a vector output port with a part of the sample."""

        def write(context: Context, output: BasicVector) -> None:
            output.SetFromVector(self.sample(context)[start : start + size])

        self.DeclareVectorOutputPort(name, size, write, {self.discrete_state_ticket(self._sample)})


RANGES, INERTIAL, DEPTH, ODOMETRY, PAN_TILT, DEPTH_POINTS = 211, 223, 227, 229, 233, 239
CAMERA_JOINTS = 241
"""Tell the random numbers of sensors of one kind from those of others."""


def named_stream(kind: int, name: str) -> int:
    """The stream of a sensor by its kind and its name, whatever other sensors there are."""
    return (kind << 32) + zlib.crc32(name.encode())


def large_noise(seed: int, stream: int, number: int, size: int) -> Array:
    """As `sensor_noise.sample_noise`, for samples of so many numbers that none are kept."""
    return np.asarray(sensor_random(seed, stream, number).standard_normal(size))
