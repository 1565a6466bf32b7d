"""A sensor that reads its input at a fixed rate: the event and the state that all share."""

from __future__ import annotations

from abc import abstractmethod

from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from cdpr_drake.arrays import Array
from cdpr_drake.errors import SensorError


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
        self._sample = self.DeclareDiscreteState(size)
        self.DeclareInitializationUnrestrictedUpdateEvent(self._take_sample)
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / rate, 0.0, self._take_sample)

    @abstractmethod
    def measure(self, context: Context, number: int) -> Array:
        """The sample of now; `number` counts samples, the first is 1."""

    def sample(self, context: Context) -> Array:
        """The latest sample; zeros before the first."""
        return context.get_discrete_state(self._sample).value()

    def _take_sample(self, context: Context, state: State) -> None:
        number = round(context.get_time() * self._rate) + 1
        values = state.get_mutable_discrete_state().get_mutable_vector(self._sample)
        values.SetFromVector(self.measure(context, number))

    def _declare_slice(self, name: str, start: int, size: int) -> None:
        """Adds a vector output port with a part of the sample."""

        def write(context: Context, output: BasicVector) -> None:
            output.SetFromVector(self.sample(context)[start : start + size])

        self.DeclareVectorOutputPort(name, size, write, {self.discrete_state_ticket(self._sample)})
