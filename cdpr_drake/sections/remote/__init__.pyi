from .client import RemoteClient as RemoteClient
from .driver import Driver as Driver
from .messages import JSON as JSON
from .messages import decode as decode
from .messages import encode as encode
from .messages import shown as shown
from .messages import vector as vector
from .place import Remote as Remote
