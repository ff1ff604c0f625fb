"""Version of the package; its one place."""

__version__ = "0.1.0"
APPLICATION = f"fracslice {__version__}"
"""Name and version of this program, for metadata of files."""
