from .folder import differences as differences
