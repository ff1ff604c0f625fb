"""One job on several machines: tasks are made by workers, and their results are files that all can reach."""

from .arrays import Files, packed, unpacked
from .connection import connected
from .pool import Pool, Task
from .result_folder import PAGE, Contents, ResultFolder
from .shards import Shard
from .workers import HIDDEN, Workers

__all__ = [
    "HIDDEN",
    "PAGE",
    "Contents",
    "Files",
    "Pool",
    "ResultFolder",
    "Shard",
    "Task",
    "Workers",
    "connected",
    "packed",
    "unpacked",
]
