"""Branches of supports, against a naive oracle: the same nodes, in the same order."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fracslice.printing.pillars import (
    FARTHEST,
    FOOT,
    LOWEST,
    NARROW,
    STRENGTHS,
    TRIES,
    Forest,
    Room,
)

pytestmark = pytest.mark.once

Point = tuple[float, float, float]


def far(a: Point, b: Point) -> float:
    (x, y, z) = (p - q for p, q in zip(a, b, strict=True))
    return math.sqrt(x * x + y * y + z * z)


def across(a: Point, b: Point) -> float:
    x, y = a[0] - b[0], a[1] - b[1]
    return math.sqrt(x * x + y * y)


class Oracle:
    """Branches, led one by one; each looks at all others."""

    def __init__(self, room: Room, tips: list[Point]) -> None:
        self.room, self.place, self.down = room, list(tips), [-1] * len(tips)
        self.trunks, self.joins = list[int](), list[list[int]]()
        self.open = set(range(len(tips)))
        while self.open:
            k = max(self.open, key=lambda k: (self.place[k][2], -k))
            self.open.remove(k)
            self.lead(k)

    def at(self, point: Point) -> tuple[int, int, int]:
        z, y, x = (int(axis) for axis in self.room.at(np.array(point)))
        return z, y, x

    def cost(self, point: Point) -> float:
        return float(self.room.cost[self.at(point)])

    def is_free(self, start: Point, end: Point, least: int) -> bool:
        steps = int(2 * far(start, end) / float(self.room.cell.min())) + 1
        shares = [n / steps for n in range(steps + 1)]
        along = [tuple(p + s * (q - p) for p, q in zip(start, end, strict=True)) for s in shares]
        return all(self.room.away[self.at(point)] >= least for point in along)  # type: ignore[arg-type]

    def add(self, point: Point) -> int:
        self.place.append(point)
        self.down.append(-1)
        return len(self.place) - 1

    def lead(self, k: int) -> None:
        point, wide = self.place[k], self.room.wide
        for _, is_trunk, number, meeting in sorted(self.meetings(k))[:TRIES]:
            other = point if is_trunk else self.place[number]
            if not (self.is_free(point, meeting, wide) and self.is_free(other, meeting, wide)):
                continue
            self.down[k] = self.add(meeting)
            if is_trunk:
                self.joins[number].append(self.down[k])
            else:
                self.open = self.open - {number} | {self.down[k]}
                self.down[number] = self.down[k]
            return
        corner = self.corner(point)
        if corner[2] > self.room.floor or across(corner, point) > 0:
            self.down[k] = self.add(corner)
            self.open.add(self.down[k])
        else:
            self.trunks.append(k)
            self.joins.append([])

    def meetings(self, k: int) -> list[tuple[float, bool, int, Point]]:
        point, floor, found = self.place[k], self.room.floor, []
        own = self.cost(point) + FOOT
        both = [(False, j, self.place[j]) for j in self.open]
        both += [(True, n, self.place[j]) for n, j in enumerate(self.trunks)]
        for is_trunk, number, other in both:
            away = across(other, point)
            if is_trunk:
                meeting = other[0], other[1], min(point[2] - away, other[2])
                saved = own - far(meeting, point)
            else:
                low = min((point[2] + other[2] - away) / 2, other[2])
                share = min((point[2] - low) / away, 1.0) if away > 0 else 1.0
                x, y = (p + share * (q - p) for p, q in zip(point[:2], other[:2], strict=True))
                meeting = x, y, low
                saved = (
                    own + self.cost(other) - far(meeting, point) - far(meeting, other) - self.cost(meeting)
                )
            longest = max(far(meeting, point), 0.0 if is_trunk else far(meeting, other))
            if saved > 0 and longest <= FARTHEST and meeting[2] >= floor + LOWEST:
                found.append((-saved, is_trunk, number, meeting))
        return found

    def corner(self, start: Point) -> Point:
        room, way = self.room, [start]
        wide, deep, high = room.cell.tolist()
        z, y, x = self.at(start)
        for k in range(z - 1, -1, -1):
            steps = [(0, 0, high)]
            steps += [(0, i, math.sqrt(wide * wide + high * high)) for i in (-1, 1)]
            steps += [(j, 0, math.sqrt(deep * deep + high * high)) for j in (-1, 1)]
            inner = [
                (length + float(room.cost[k, y + j, x + i]), n, y + j, x + i)
                for n, (j, i, length) in enumerate(steps)
                if 0 <= y + j < room.away.shape[1] and 0 <= x + i < room.away.shape[2]
            ]
            least, _, to_y, to_x = min(inner)
            if math.isinf(least):
                to_y, to_x = y, x
            low_x, low_y, low_z = room.origin.tolist()
            aside = (to_y, to_x) != (y, x)
            px, py = (low_x + (to_x + 0.5) * wide, low_y + (to_y + 0.5) * deep) if aside else way[-1][:2]
            way.append((px, py, low_z + (k + 0.5) * high))
            y, x = to_y, to_x
        way[-1] = *way[-1][:2], room.floor
        least_steps = room.wide if room.away[self.at(start)] >= room.wide else NARROW
        step = len(way) - 1
        while step > 1:
            end = way[step]
            steep = across(start, end) <= (start[2] - end[2]) * 1.001
            if steep and self.is_free(start, end, least_steps):
                break
            step //= 2
        return way[step]


@pytest.mark.parametrize("seed", range(4))
def test_branches_are_those_of_the_oracle(seed: int) -> None:
    """Between boulders, in cells that are no cubes. two of the four forests have a branch on a trunk."""
    rng = np.random.default_rng(seed)
    full = np.zeros((40, 30, 34), bool)
    for z, y, x in rng.integers((8, 2, 2), (34, 26, 30), (10, 3)):
        full[z : z + 2, y : y + 3, x : x + 3] = True
    room = Room.around(full, full, rng.uniform(-5, 5, 3), 0.0, np.array([0.5, 0.6, 0.4]), 0.9)
    room = Room(room.origin, float(room.origin[2]) + 0.1, room.cell, room.away, room.wide, full)
    tips = room.origin + rng.uniform((0.1, 0.1, 0.3), 0.95, (40, 3)) * room.cell * full.shape[::-1]
    tips = tips[np.isfinite(room.cost[room.at(tips)])]
    made = Forest(room, STRENGTHS["medium"], tips, np.full(len(tips), 0.2))
    expected = Oracle(room, [tuple(tip) for tip in tips.tolist()])  # type: ignore[misc]
    assert len(tips) > 20 and len(made.place) > len(tips)
    assert made.place.tolist() == [list(place) for place in expected.place]
    assert (made.down, made.trunks, made.joins) == (expected.down, expected.trunks, expected.joins)
