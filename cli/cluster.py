"""Options of commands that share a job between machines."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import click

from fracslice.errors import ClusterError

from .inputs import BadInput
from .options import RunOptions, option
from .working import NOTHING

if TYPE_CHECKING:
    from fracslice.cluster import Pool
    from fracslice.work import Work


class ClusterOptions(RunOptions):
    """Other processes and machines."""

    output: str
    cluster: str | None = option(
        str,
        "Share the job between workers: tcp://HOST:8786, a scheduler of Dask; or local:N processes.",
        metavar="WHERE",
    )
    shard: str | None = option(
        str, "Make the I-th of N shares of the job, such as 3/64; shard 1 writes the file.", metavar="I/N"
    )
    store: str | None = option(
        str,
        "Folder or fsspec URL for pieces, which all machines reach; beside the file by default.",
        metavar="FOLDER",
    )

    @property
    def beside(self) -> str:
        """File beside which pieces are kept by default."""
        return self.output

    @contextmanager
    def working(self, kept: str = NOTHING, **settings: Any) -> Iterator[Work]:
        """Work with the pool of --cluster and --shard."""
        with ExitStack() as stack:
            pool = stack.enter_context(self._pooled())
            with super().working(kept, cluster=pool, **settings) as work:
                yield work
                stack.pop_all().close()  # Ctrl-C while workers end would say that nothing was written

    @contextmanager
    def _pooled(self) -> Iterator[Pool | None]:
        """Pool of the given options; None without --cluster and --shard."""
        if self.cluster and self.shard:
            raise click.UsageError("--cluster and --shard: expected one of them")
        if not self.cluster and not self.shard:
            if self.store:
                raise click.UsageError("--store: needs --cluster or --shard")
            yield None
            return
        from fracslice.cluster import HIDDEN, ResultFolder, Shard, connected

        place = self.store or os.path.join(os.path.dirname(os.path.abspath(self.beside)), HIDDEN)
        place = place if "://" in place else os.path.abspath(place)
        with ExitStack() as stack:
            try:
                pool: Pool = (
                    Shard.read(self.shard, ResultFolder(place))
                    if self.shard
                    else stack.enter_context(connected(str(self.cluster), place, self.threads))
                )
            except ClusterError as error:
                raise BadInput(str(error)) from None
            yield pool
        if not self.shard:
            pool.pieces.tidy()
