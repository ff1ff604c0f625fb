"""Options of commands that share a job between machines."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import click

from fracslice.errors import ClusterError

from .inputs import BadInput

if TYPE_CHECKING:
    from fracslice.cluster import Pool

_OPTIONS = [
    click.option(
        "--cluster",
        metavar="WHERE",
        help="Share the job between workers: tcp://HOST:8786, a scheduler of Dask; or local:N processes.",
    ),
    click.option(
        "--shard",
        metavar="I/N",
        help="Make the I-th of N shares of the job, such as 3/64; shard 1 writes the file.",
    ),
    click.option(
        "--store",
        metavar="FOLDER",
        help="Folder or fsspec URL for pieces, which all machines reach; beside the file by default.",
    ),
]


def cluster_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator that adds --cluster, --shard and --store, which `pooled` takes."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


@contextmanager
def pooled(
    output: str, threads: int, cluster: str | None, shard: str | None, store: str | None
) -> Iterator[Pool | None]:
    """Pool of the given options; None without --cluster and --shard."""
    if cluster and shard:
        raise click.UsageError("--cluster and --shard: expected one of them")
    if not cluster and not shard:
        if store:
            raise click.UsageError("--store: needs --cluster or --shard")
        yield None
        return
    from fracslice.cluster import HIDDEN, ResultFolder, Shard, connected

    place = store or os.path.join(os.path.dirname(os.path.abspath(output)), HIDDEN)
    place = place if "://" in place else os.path.abspath(place)
    with ExitStack() as stack:
        try:
            pool: Pool = (
                Shard.read(shard, ResultFolder(place))
                if shard
                else stack.enter_context(connected(str(cluster), place, threads))
            )
        except ClusterError as error:
            raise BadInput(str(error)) from None
        yield pool
    if not shard:
        pool.pieces.tidy()
