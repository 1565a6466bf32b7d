"""Puts everything that a run logs into one vector, so that one sink stores it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    PortDataType,
    System,
)
from pydrake.systems.primitives import LogVectorOutput, Multiplexer, VectorLogSink

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_row

POSE_SIZE = 7
"""Numbers of a pose in a row: qw, qx, qy, qz with qw not negative, x, y, z [-, m]."""


class LogRow(LeafSystem):
    """Collects vectors and poses into one vector. One block costs less per step than many sinks.

    ============ ======================== ==== ==============================================
    port         type                     unit meaning
    ============ ======================== ==== ==============================================
    (any name)   vector or RigidTransform any  in, one per logged quantity
    log_row      vector                   any  out, all of them in order, poses as `pose_row`
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
        self.DeclareVectorOutputPort("log_row", end, self._calc)

    def _pose_reader(self, name: str) -> Callable[[Context], Array]:
        read = self.DeclareAbstractInputPort(name, Value(RigidTransform())).Eval
        return lambda context: pose_row(read(context))

    def _calc(self, context: Context, output: BasicVector) -> None:
        for columns, read in self._readers:
            self._row[columns] = read(context)
        output.set_value(self._row)


@dataclass(frozen=True)
class RunLog:
    """The sink that stores a run, and where each quantity stands in its rows.

    Attributes:
        sink: Drake's log sink of the block `LogRow`.
        columns: Columns by name of the quantity.
    """

    sink: VectorLogSink
    columns: dict[str, slice]

    def read(self, context: Context) -> dict[str, Array]:
        """Times "time", shape (n,) [s], and each quantity, shape (n, size), from a root context."""
        log = self.sink.FindLog(context)
        rows = log.data().T
        return {
            "time": log.sample_times().copy(),
            **{name: rows[:, columns].copy() for name, columns in self.columns.items()},
        }

    def rows(self, context: Context) -> int:
        """Number of rows that the sink holds, in a root context."""
        return int(self.sink.FindLog(context).num_samples())

    def clear(self, context: Context) -> None:
        """Empties the sink, in a root context; what comes is logged as before."""
        self.sink.FindMutableLog(context).Clear()


def add_log(builder: DiagramBuilder, ports: Mapping[str, OutputPort], rate: float) -> RunLog:
    """Adds a block "log_row" and a sink that store ports by name at a rate [Hz].

    Where all ports are vectors, Drake's Multiplexer stands in for `LogRow`: it costs nothing while
    nothing is logged.
    """
    if all(port.get_data_type() == PortDataType.kVectorValued for port in ports.values()):
        sizes = [port.size() for port in ports.values()]
        ends = np.cumsum([0, *sizes])
        columns = {name: slice(int(ends[k]), int(ends[k + 1])) for k, name in enumerate(ports)}
        row: System = builder.AddNamedSystem("log_row", Multiplexer(sizes))
        for k, port in enumerate(ports.values()):
            builder.Connect(port, row.get_input_port(k))
    else:
        row = builder.AddNamedSystem("log_row", LogRow(ports))
        columns = row.columns
        for name, port in ports.items():
            builder.Connect(port, row.GetInputPort(name))
    return RunLog(LogVectorOutput(row.get_output_port(0), builder, 1.0 / rate), columns)
