"""Drives an estimator step by step, as a controller of the same rate would."""

from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

RATE = 25.0
PERIOD = 1.0 / RATE


class EstimatorBench:
    """Sets inputs at control steps and reads what a controller reads at that instant."""

    def __init__(self, estimator):
        self.estimator = estimator
        self.simulator = Simulator(estimator)
        self.context = self.simulator.get_mutable_context()
        self.steps = 0

    def step(self, **inputs):
        """Estimate at the next control step, with inputs of that instant."""
        for name, value in inputs.items():
            self.estimator.GetInputPort(name).FixValue(self.context, value)
        X_WP = self.read()
        self.steps += 1
        # The update of this instant happens first thing; that of the next one waits.
        self.simulator.AdvanceTo(self.steps * PERIOD)
        return X_WP

    def read(self):
        """Estimate now; a copy, since Drake hands out its cache."""
        return RigidTransform(self.estimator.GetOutputPort("X_WP").Eval(self.context))
