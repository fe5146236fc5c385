"""Reading many posts that lie side by side, at once.

A ray fan reads a line of posts at places that are close together but not one after the other. A processor's gather
fetches such places one by one; two vector loads and a permutation fetch eight of them together, which makes the fast
sweep up to twice as fast. LLVM does not find this by itself, so ``_pick_8`` says it in LLVM's own words. Processors
without AVX2 read the places one by one.
"""

from __future__ import annotations

from typing import Any

import numba
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.codegen import get_host_cpu_features
from numba.extending import intrinsic

from .kernel_options import inner_loop

__all__ = ["LANES", "WIDEST_REACH", "permutations_active", "pick", "pick_near"]

LANES = 8
WIDEST_REACH = 2 * LANES - 1  # from the first place of eight to the last


def permutations_active() -> bool:
    """Whether the processor that is compiled for has AVX2."""
    unknown_processor = bool(numba.config.CPU_NAME) and not numba.config.CPU_FEATURES
    features = numba.config.CPU_FEATURES or ("" if unknown_processor else get_host_cpu_features())
    return "+avx2" in features.split(",")


@intrinsic  # type: ignore[untyped-decorator] # as numba ships it
def _pick_8(typing_context: Any, source: Any, first: Any, places: Any, start: Any, out: Any, row: Any) -> Any:
    """Eight of ``pick``, from start on; reads 16 of source from the first place."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def data(number: int) -> Any:
            return context.make_array(signature.args[number])(context, builder, arguments[number]).data

        def load(address: Any, kind: Any) -> Any:
            return builder.load(builder.bitcast(address, kind.as_pointer()), align=4)

        int32, int64 = ir.IntType(32), ir.IntType(64)
        reals, whole = ir.VectorType(ir.FloatType(), LANES), ir.VectorType(int32, LANES)
        places_from = builder.gep(data(2), [arguments[3]])
        table = context.make_array(out)(context, builder, arguments[4])
        out_from = cgutils.get_item_pointer(context, builder, out, table, [arguments[5], arguments[3]])
        place = builder.load(places_from)
        nothing = ir.Constant(whole, ir.Undefined)
        all_first = builder.shuffle_vector(
            builder.insert_element(nothing, place, int32(0)), nothing, ir.Constant(whole, [0] * LANES)
        )
        beyond = builder.sub(load(places_from, whole), all_first)
        source_from = builder.gep(data(0), [builder.add(arguments[1], builder.sext(place, int64))])
        permute = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(reals, [reals, whole]), "llvm.x86.avx2.permps"
        )
        # each permutation looks at the lowest three bits of a place
        near = builder.call(permute, [load(source_from, reals), beyond])
        far = builder.call(permute, [load(builder.gep(source_from, [int64(LANES)]), reals), beyond])
        is_far = builder.icmp_signed(">=", beyond, ir.Constant(whole, [LANES] * LANES))
        picked = builder.select(is_far, far, near)
        builder.store(picked, builder.bitcast(out_from, reals.as_pointer()), align=4)
        return context.get_dummy_value()

    return types.void(source, types.int64, places, types.int64, out, types.int64), generate


@inner_loop
def pick(source, first, places, count, out, row):  # type: ignore[no-untyped-def] # a kernel
    """out[row, i] = source[first + places[i]] for i < count."""
    for i in range(count):
        out[row, i] = source[first + places[i]]


def _pick_near(source, first, places, count, out, row):  # type: ignore[no-untyped-def] # a kernel
    """As ``pick``, for rising places of which 8 in a row span at most WIDEST_REACH.

    source: (n,) float32; places: (m,) int32; out: (rows, m) float32; m has room for the next multiple of 8
    above count.
    """
    start = 0
    while start < count and first + places[start] + 2 * LANES <= source.shape[0]:
        _pick_8(source, first, places, start, out, row)
        start += LANES
    for i in range(start, count):
        out[row, i] = source[first + places[i]]


pick_near = inner_loop(_pick_near) if permutations_active() else pick
