"""Access to memory: elements of arrays, and lanes of them."""

from __future__ import annotations

from typing import Any

from llvmlite import ir

from .registers import Vec
from .scalars import WHOLE, number
from .values import Lanes, Value


class Memory:
    """Emits loads and stores at its builder's position."""

    lanes: Lanes
    builder: Any

    def address(self, place: Any, index: Value) -> Any:
        """Emit the address of an array element."""
        return self.builder.gep(place, [number(self.builder, index, WHOLE)])

    def intrinsic_load(self, place: Any, index: Value) -> Vec:
        """Load lanes from memory."""
        align = self.lanes.bits // 8
        return Vec(
            self.builder,
            tuple(self.builder.load(a, align=align) for a in self.registers(place, index)),
        )

    def intrinsic_store(self, place: Any, index: Value, value: Value) -> None:
        """Store lanes to memory."""
        parts = self.lanes.vec(self.builder, value).parts
        for address, part in zip(self.registers(place, index), parts, strict=True):
            self.builder.store(part, address, align=self.lanes.bits // 8)

    def intrinsic_gather(self, index: Value, place: Any) -> Vec:
        """Load an element from memory for each lane."""
        like = self.lanes.register
        parts = []
        for register in self.lanes.vec(self.builder, index).to_whole().parts:
            loaded = ir.Constant(like, ir.Undefined)
            for k in range(like.count):
                lane = ir.Constant(ir.IntType(32), k)
                address = self.builder.gep(place, [self.builder.extract_element(register, lane)])
                loaded = self.builder.insert_element(loaded, self.builder.load(address), lane)
            parts.append(loaded)
        return Vec(self.builder, tuple(parts))

    def registers(self, place: Any, index: Value) -> list[Any]:
        """Addresses of the registers of lanes, starting at an array element."""
        first, kind = self.address(place, index), self.lanes.register
        steps = (ir.Constant(WHOLE, k * kind.count) for k in range(self.lanes.registers))
        return [self.builder.bitcast(self.builder.gep(first, [step]), kind.as_pointer()) for step in steps]
