from .messages import JSON as JSON
from .messages import decode as decode
from .messages import encode as encode
from .messages import shown as shown
from .messages import vector as vector
from .remote_client import RemoteClient as RemoteClient
from .remote_driver import Driver as Driver
from .remote_place import Remote as Remote
