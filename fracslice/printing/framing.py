"""The part of a scene around the bodies that stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..fields.field import Field
from ..formulas import box as box_node
from ..formulas import transform
from ..records import PIECES
from ..volume import Plan, extent
from ..volume.sizing import Sizing, box_of_the_rest
from ..work import Work
from .bridging import clusters, nearer
from .edits import edited_field
from .samples import SolidComponents, components_of
from .thin_features import resolve_connectivity, sampled_object

SAMPLES = 128, 384, 640
"""Samples along the longest side, as many as it takes to tell bodies from crumbs of thin walls."""

MARGIN = 4
"""Minimum margin around the bodies, samples."""

SPARE = 0.1
"""Margin around the bodies for tips thinner than a sample, as a fraction of their longest side."""

FRAMED = 0.75
"""Size of the part around the bodies, as a fraction of the sampled part, that ends the search."""

ROUNDS = 16
"""Maximum number of parts that are sampled, each within the one before."""


def frame_bodies(planned: Plan, size: Sizing, count: int, work: Work) -> Plan:
    """Plan the part of a scene around its largest bodies.

    The size of the object is that of the bodies that stay. Bodies that are much smaller than the whole scene
    need samples of their own: the part around them is sampled again, until they fill it.

    The voxel in mm is that of `planned`.
    """
    made, region = planned, planned.outer
    for _ in range(ROUNDS):
        components = _resolve_components(made, work)
        bodies = components.bodies
        if len(bodies) <= count:
            break
        chosen = components.box(bodies[:count])
        margin = max(MARGIN * components.solid.voxel, SPARE * max(chosen.size))
        near, part = (chosen.grown(by) & planned.outer for by in (margin / 2, margin))
        if region & near == near and max(part.size) > FRAMED * max(region.size):
            made = _keep_bodies(made, components, count, work)
            break
        frame = transform(box_node(size=part.size), translate=part.centre)
        made, region = _intersect_plan(planned, frame, max(part.size) / SAMPLES[0], work), part
    return replace(made, voxel=planned.voxel * size.scale(planned.box) / size.scale(made.box))


def _resolve_components(planned: Plan, work: Work) -> SolidComponents:
    """Components of samples that tell bodies from crumbs."""
    root, outer, longest = planned.root, planned.outer, max(planned.outer.size)
    for samples in SAMPLES:
        bricks = sampled_object(root, outer, longest, samples, work)
        components = components_of(bricks)
        if components.thin_share < PIECES:
            return components
    return components_of(resolve_connectivity(root, bricks, 0.0, True, work))


def _keep_bodies(planned: Plan, components: SolidComponents, count: int, work: Work) -> Plan:
    """Plan with the exact box of the bodies that stay, cut off from those that touch them."""
    chosen, others = np.split(components.bodies, [count])
    cluster, voxel = clusters(components), components.solid.voxel
    if not planned.root.bounds.exterior_only and np.isin(cluster[others], cluster[chosen]).any():
        return _intersect_plan(planned, nearer(components, chosen, others), voxel, work)
    whole, rest = (np.array([b.lo, b.hi]) for b in map(components.box, (components.bodies, chosen)))
    seen, tips = replace(planned, voxel=voxel), components.outermost(chosen)
    return replace(planned, box=box_of_the_rest(seen, whole, rest, tips, work))


def _intersect_plan(planned: Plan, kept: Field, voxel: float, work: Work) -> Plan:
    """Plan of the part of a scene inside another field."""
    root = edited_field(planned.root, "keep", kept)
    extents = extent(root, work)
    return replace(planned, root=root, box=extents.box, outer=extents.outer, tips=extents.tips, voxel=voxel)
