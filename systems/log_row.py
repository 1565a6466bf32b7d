"""Puts everything that a run logs into one vector, so that one sink stores it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, LeafSystem, OutputPort, PortDataType

from cdpr_drake.arrays import Array

POSE_SIZE = 7
"""Numbers of a pose in a row: qw, qx, qy, qz with qw not negative, x, y, z [-, m]."""


def pose_row(X: RigidTransform) -> Array:
    """A pose as (qw, qx, qy, qz, x, y, z), qw not negative, shape (7,) [-, m]."""
    q = X.rotation().ToQuaternion().wxyz()
    return np.concatenate([q if q[0] >= 0.0 else -q, X.translation()])


def pose_from_row(row: Array) -> RigidTransform:
    """Inverse of `pose_row`, from shape (7,) [-, m]."""
    return RigidTransform(Quaternion(row[:4] / np.linalg.norm(row[:4])), row[4:])


class LogRow(LeafSystem):
    """Collects vectors and poses into one vector. One block costs less per step than many sinks.

    ============ ======================== ==== ==============================================
    port         type                     unit meaning
    ============ ======================== ==== ==============================================
    (any name)   vector or RigidTransform any  in, one per logged quantity
    row          vector                   any  out, all of them in order, poses as `pose_row`
    ============ ======================== ==== ==============================================
    """

    def __init__(self, ports: Mapping[str, OutputPort]) -> None:
        """With an input for each output port in `ports`, of the same name, type and size."""
        super().__init__()
        self.columns: dict[str, slice] = {}
        self._readers: list[tuple[slice, Callable[[Context], Array]]] = []
        end = 0
        for name, port in ports.items():
            if port.get_data_type() == PortDataType.kVectorValued:
                size, start = port.size(), end
                reader = self.DeclareVectorInputPort(name, size).Eval
            else:
                size, start = POSE_SIZE, end
                reader = self._pose_reader(name)
            end = start + size
            self.columns[name] = slice(start, end)
            self._readers.append((self.columns[name], reader))
        self._row = np.zeros(end)
        self.DeclareVectorOutputPort("row", end, self._calc)

    def _pose_reader(self, name: str) -> Callable[[Context], Array]:
        read = self.DeclareAbstractInputPort(name, Value(RigidTransform())).Eval
        return lambda context: pose_row(read(context))

    def _calc(self, context: Context, output: BasicVector) -> None:
        for columns, read in self._readers:
            self._row[columns] = read(context)
        output.set_value(self._row)
