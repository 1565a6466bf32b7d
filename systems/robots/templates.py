"""Classes out of Drake's templates of systems, without a search that takes half a second."""

from __future__ import annotations

from threading import Thread
from typing import Any

from pydrake.systems.framework import LeafSystem
from pydrake.systems.scalar_conversion import TemplateSystem


def class_for_floats(template: TemplateSystem) -> type[LeafSystem]:
    """The class of a template for float; those for all its other scalars are made as well.

    For every class Drake looks through the whole call stack twice, with the source of each frame,
    and those of an import are many and have none. A thread has a short stack of its own.
    """
    failed: list[Exception] = []

    def make() -> None:
        try:
            for param in template.param_list:
                template.get_instantiation(param)
        except Exception as problem:
            failed.append(problem)

    thread = Thread(target=make)
    thread.start()
    thread.join()
    if failed:
        raise failed[0]
    made: Any = template[float]
    return made
