from .panel import message as message
from .panel import on_page as on_page
from .panel import show_errors as show_errors
from .panel import shown as shown
from .schema_tables import SchemaGroups as SchemaGroups
from .table import PANELS as PANELS
