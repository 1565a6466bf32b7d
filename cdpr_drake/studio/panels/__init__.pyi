from .panel import message as message
from .panel import notify as notify
from .panel import on_page as on_page
from .panel import show_errors as show_errors
from .schema_tables import SchemaGroups as SchemaGroups
from .table import PANELS as PANELS
