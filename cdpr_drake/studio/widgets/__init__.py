"""What several panels are made of: messages, and later fields and bars, in NiceGUI."""

from cdpr_drake.studio.widgets.notices import message, quietly, shown

__all__ = ["message", "quietly", "shown"]
