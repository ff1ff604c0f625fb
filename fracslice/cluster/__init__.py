"""One job on several machines: tasks are made by workers, and their results are files that all can reach."""

from .arrays import Files, packed, unpacked
from .pieces import Contents, Pool, ResultFolder, Task
from .shards import Shard
from .workers import HIDDEN, Workers, connected

__all__ = [
    "HIDDEN",
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
