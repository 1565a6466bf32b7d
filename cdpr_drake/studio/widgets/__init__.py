"""What several panels are made of: messages, forms from schemas, tables with bars.

`SchemaGroups` is the form of a document, made from its schema: units, ranges, errors beside the
fields. `cable_table` and `fact_table` are HTML, one element for many numbers. `quietly` shows what
a handler raises as a message in the page.
"""

from cdpr_drake.studio.widgets.notices import message, quietly, shown
from cdpr_drake.studio.widgets.numbers import bar_scale, cable_table, fact_table, number_words
from cdpr_drake.studio.widgets.schema_form import SchemaForm
from cdpr_drake.studio.widgets.schema_tables import SchemaGroups

__all__ = [
    "SchemaForm", "SchemaGroups", "bar_scale", "cable_table", "fact_table", "message",
    "number_words", "quietly", "shown",
]  # fmt: skip
