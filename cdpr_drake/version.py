"""The version of this package, from which its metadata take theirs."""

__version__ = "0.2.0"
"""See CHANGELOG.md; semantic versioning."""
