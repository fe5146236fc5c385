"""What LLVM does not find by itself, said in its own words: reading side by side, turning blocks, asking ahead.

A ray fan reads a line of posts at places that are close together but not one after the other. A processor's gather
fetches such places one by one; a few vector loads and permutations fetch a vector of them together, which makes the
fast sweep up to twice as fast. Processors without AVX2 read the places one by one.

Each of these is written into the kernel that calls it. Arrays are contiguous; nothing is checked against their ends.
"""

from __future__ import annotations

from typing import Any

import numba
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.codegen import get_host_cpu_features
from numba.extending import intrinsic

__all__ = [
    "AVX2",
    "AVX512",
    "BLOCK",
    "LANES",
    "compiled_for",
    "pick",
    "pick_pair",
    "pick_pair_wide",
    "prefetch",
    "turn_block",
]

AVX2, AVX512 = "+avx2", "+avx512f"
BLOCK = 8  # rows and columns that are turned at once
INT32, INT64, FLOAT32 = ir.IntType(32), ir.IntType(64), ir.FloatType()


def compiled_for(feature: str) -> bool:
    """Whether the processor that is compiled for has a feature, as LLVM names them."""
    unknown_processor = bool(numba.config.CPU_NAME) and not numba.config.CPU_FEATURES
    features = numba.config.CPU_FEATURES or ("" if unknown_processor else get_host_cpu_features())
    return feature in features.split(",")


LANES = 16 if compiled_for(AVX512) else 8


def _load(builder: Any, address: Any, kind: Any) -> Any:
    return builder.load(builder.bitcast(address, kind.as_pointer()), align=4)


def _store(builder: Any, value: Any, address: Any) -> None:
    builder.store(value, builder.bitcast(address, value.type.as_pointer()), align=4)


def _alike(kind: Any, value: int) -> Any:
    return ir.Constant(kind, [value] * kind.count)


def _permuted(builder: Any, loaded: list[Any], beyond: Any) -> Any:
    """Element ``beyond`` of the vectors loaded, taken as one; one of them, two, or four."""
    if len(loaded) == 4:
        is_far = builder.icmp_signed(">=", beyond, _alike(beyond.type, 2 * LANES))
        return builder.select(is_far, _permuted(builder, loaded[2:], beyond), _permuted(builder, loaded[:2], beyond))
    near, far = loaded[0], loaded[-1]
    # each permutation looks at as many of the lowest bits of a place as it has use for
    if LANES == 16:
        function = ir.FunctionType(near.type, [near.type, beyond.type, far.type])
        permute = cgutils.get_or_insert_function(builder.module, function, "llvm.x86.avx512.vpermi2var.ps.512")
        return builder.call(permute, [near, beyond, far])
    function = ir.FunctionType(near.type, [near.type, beyond.type])
    permute = cgutils.get_or_insert_function(builder.module, function, "llvm.x86.avx2.permps")
    if len(loaded) == 1:
        return builder.call(permute, [near, beyond])
    is_odd = builder.icmp_signed("!=", builder.and_(beyond, _alike(beyond.type, LANES)), _alike(beyond.type, 0))
    return builder.select(is_odd, builder.call(permute, [far, beyond]), builder.call(permute, [near, beyond]))


def _picking(arrays: tuple[Any, Any, Any], rows: int, vectors: int) -> tuple[Any, Any]:
    """Signature and code of an intrinsic (source, first, places, start, out, row) that picks LANES places."""
    source, places, out = arrays

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source_data = context.make_array(source)(context, builder, arguments[0]).data
        places_data = context.make_array(places)(context, builder, arguments[2]).data
        table = context.make_array(out)(context, builder, arguments[4])
        _, first, _, start, _, row = arguments

        def out_from(k: int) -> Any:
            at = [builder.add(row, INT64(k)), start]
            return cgutils.get_item_pointer(context, builder, out, table, at)

        places_from = builder.gep(places_data, [start])
        if not compiled_for(AVX2):
            for i in range(LANES):
                place = builder.sext(builder.load(builder.gep(places_from, [INT64(i)])), INT64)
                at = builder.gep(source_data, [builder.add(first, place)])
                for k in range(rows):
                    value = builder.load(builder.gep(at, [INT64(k)]))
                    builder.store(value, builder.gep(out_from(k), [INT64(i)]))
            return context.get_dummy_value()

        reals, whole = ir.VectorType(FLOAT32, LANES), ir.VectorType(INT32, LANES)
        place = builder.load(places_from)
        nothing = ir.Constant(whole, ir.Undefined)
        all_first = builder.shuffle_vector(builder.insert_element(nothing, place, INT32(0)), nothing, _alike(whole, 0))
        beyond = builder.sub(_load(builder, places_from, whole), all_first)
        at = builder.gep(source_data, [builder.add(first, builder.sext(place, INT64))])
        loaded = [_load(builder, builder.gep(at, [INT64(k * LANES)]), reals) for k in range(vectors)]
        for k in range(rows):
            _store(builder, _permuted(builder, loaded, builder.add(beyond, _alike(whole, k))), out_from(k))
        return context.get_dummy_value()

    return types.void(source, types.int64, places, types.int64, out, types.int64), generate


@intrinsic  # type: ignore[untyped-decorator] # as numba ships it
def pick(typing_context: Any, source: Any, first: Any, places: Any, start: Any, out: Any, row: Any) -> Any:
    """out[row, i] = source[first + places[i]] for the LANES i from start on.

    source (n,) and out (rows, m) float32; places (m,) int32, rising, and within LANES - 1 of the first of the LANES;
    reads LANES of source from there on.
    """
    return _picking((source, places, out), 1, 1)


@intrinsic  # type: ignore[untyped-decorator] # as numba ships it
def pick_pair(typing_context: Any, source: Any, first: Any, places: Any, start: Any, out: Any, row: Any) -> Any:
    """As ``pick``, and what comes after each place into the row below; places within 2 LANES - 2; reads 2 LANES."""
    return _picking((source, places, out), 2, 2)


@intrinsic  # type: ignore[untyped-decorator] # as numba ships it
def pick_pair_wide(typing_context: Any, source: Any, first: Any, places: Any, start: Any, out: Any, row: Any) -> Any:
    """As ``pick_pair``, for places within 4 LANES - 2; reads 4 LANES of source."""
    return _picking((source, places, out), 2, 4)


@intrinsic  # type: ignore[untyped-decorator] # as numba ships it
def turn_block(typing_context: Any, source: Any, row: Any, col: Any, out: Any, out_row: Any, out_col: Any) -> Any:
    """out[out_row + k, out_col + i] = source[row + i, col + k] for i, k < BLOCK, both (rows, cols) float32."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source_array = context.make_array(source)(context, builder, arguments[0])
        out_array = context.make_array(out)(context, builder, arguments[3])

        def address(kind: Any, array: Any, start: list[Any], step: int) -> Any:
            at = [builder.add(start[0], INT64(step)), start[1]]
            return cgutils.get_item_pointer(context, builder, kind, array, at)

        def swapped(lines: list[Any], distance: int, low: list[int]) -> list[Any]:
            """Lines that far apart swap corners; ``low`` is what the upper one of each two becomes."""
            order = ir.VectorType(INT32, BLOCK)
            turned = list(lines)
            for i in range(BLOCK):
                if not i & distance:
                    two = lines[i], lines[i + distance]
                    turned[i] = builder.shuffle_vector(*two, ir.Constant(order, low))
                    turned[i + distance] = builder.shuffle_vector(*two, ir.Constant(order, [p + distance for p in low]))
            return turned

        reals = ir.VectorType(FLOAT32, BLOCK)
        lines = [_load(builder, address(source, source_array, arguments[1:3], i), reals) for i in range(BLOCK)]
        # single values, then pairs, then fours
        lines = swapped(lines, 1, [0, 8, 2, 10, 4, 12, 6, 14])
        lines = swapped(lines, 2, [0, 1, 8, 9, 4, 5, 12, 13])
        lines = swapped(lines, 4, [0, 1, 2, 3, 8, 9, 10, 11])
        for k in range(BLOCK):
            _store(builder, lines[k], address(out, out_array, arguments[4:6], k))
        return context.get_dummy_value()

    return types.void(source, types.int64, types.int64, out, types.int64, types.int64), generate


@intrinsic  # type: ignore[untyped-decorator] # as numba ships it
def prefetch(typing_context: Any, grid: Any, row: Any, col: Any) -> Any:
    """Ask for the cache line of grid[row, col] before it is needed; a column beyond the row asks in vain."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(grid)(context, builder, arguments[0])
        item = cgutils.get_item_pointer(context, builder, grid, array, arguments[1:])
        address = builder.bitcast(item, ir.IntType(8).as_pointer())
        function = ir.FunctionType(ir.VoidType(), [address.type, INT32, INT32, INT32])
        ask = cgutils.get_or_insert_function(builder.module, function, "llvm.prefetch.p0i8")
        builder.call(ask, [address, INT32(0), INT32(3), INT32(1)])  # to read, to keep, data
        return context.get_dummy_value()

    return types.void(grid, types.int64, types.int64), generate
