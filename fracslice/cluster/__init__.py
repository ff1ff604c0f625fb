"""One job on several machines: tasks are made by workers, and their results are files that all can reach."""

from .pieces import Pieces, Pool, Task
from .shards import Shard
from .workers import HIDDEN, Workers, connected

__all__ = ["HIDDEN", "Pieces", "Pool", "Shard", "Task", "Workers", "connected"]
