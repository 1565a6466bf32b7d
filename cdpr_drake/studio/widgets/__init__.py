"""What several panels are made of: messages, tables with bars, in NiceGUI or plain HTML."""

from cdpr_drake.studio.widgets.notices import message, quietly, shown
from cdpr_drake.studio.widgets.numbers import bar_scale, cable_table, fact_table, number_words

__all__ = [
    "bar_scale", "cable_table", "fact_table", "message", "number_words", "quietly", "shown",
]  # fmt: skip
