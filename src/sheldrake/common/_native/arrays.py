"""How numba sees the arrays of a kernel: an address and a shape, C order, float64 or int64. Imports numba.

numba's own array carries seven words and more (owner, number of items, strides, ...); passed from kernel to kernel by
value, they were most of the code that LLVM had to read: these types halved the time of a compile.

`Vectors`, any number of vectors in the slab, are found through pairs (offset, size) in the words: one compiled kernel
serves any number of inputs.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import lower_builtin, lower_getattr, models, register_model

I64 = ir.IntType(64)


class ArrayType(types.Type):
    """numba's type of a `Vector`, `Matrix`, `IntVector` or `IntMatrix`."""

    def __init__(self, dtype: Any, ndim: int) -> None:
        self.dtype, self.ndim = dtype, ndim
        self.index = types.intp if ndim == 1 else types.UniTuple(types.intp, ndim)
        super().__init__(name=f"sheldrake.Array({dtype}, {ndim})")


VECTOR, INT_VECTOR = ArrayType(types.float64, 1), ArrayType(types.int64, 1)


@register_model(ArrayType)
class _ArrayModel(models.StructModel):
    def __init__(self, manager: Any, kind: ArrayType) -> None:
        members = [("data", types.CPointer(kind.dtype)), *((f"n{i}", types.intp) for i in range(kind.ndim))]
        super().__init__(manager, kind, members)


def make_array(context: Any, builder: Any, kind: ArrayType, data: Any, shape: list[Any]) -> Any:
    """The value of an array at the address `data` (a pointer or an integer)."""
    pointer = context.get_data_type(kind.dtype).as_pointer()
    value = builder.insert_value(
        ir.Constant(context.get_value_type(kind), ir.Undefined),
        builder.inttoptr(data, pointer) if isinstance(data.type, ir.IntType) else data,
        0,
    )
    for i, n in enumerate(shape):
        value = builder.insert_value(value, n, i + 1)
    return value


# Typing and lowering are given directly, not as overloads: an overload is a function, compiled like one.


def _is_index(kind: ArrayType, index: Any) -> bool:
    if kind.ndim == 1:
        return isinstance(index, types.Integer)
    parts: Any = index.types if isinstance(index, types.BaseTuple) else ()  # type: ignore[attr-defined]
    return len(parts) == kind.ndim and all(isinstance(i, types.Integer) for i in parts)


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        kind, index = args
        if isinstance(kind, ArrayType) and _is_index(kind, index):
            return signature(kind.dtype, kind, kind.index)
        return signature(ArrayType(kind.dtype, 1), kind, types.intp) if isinstance(kind, VectorsType) else None


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        kind, index, _ = args
        if isinstance(kind, ArrayType) and _is_index(kind, index):
            return signature(types.none, kind, kind.index, kind.dtype)
        return None


@infer_global(len)
class _Len(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(types.intp, *args) if isinstance(args[0], (ArrayType, VectorsType)) else None


@infer_getattr
class _Shape(AttributeTemplate):
    key = ArrayType

    def resolve_shape(self, kind: ArrayType) -> Any:
        return types.UniTuple(types.intp, kind.ndim)


def _item(context: Any, b: Any, kind: ArrayType, array: Any, index: Any) -> Any:
    indices = [index] if kind.ndim == 1 else [b.extract_value(index, i) for i in range(kind.ndim)]
    shape = [b.extract_value(array, i + 1) for i in range(kind.ndim)]
    if context.enable_boundscheck:
        for i, n in zip(indices, shape):
            cgutils.do_boundscheck(context, b, i, n)
    at = indices[0]
    for i, n in zip(indices[1:], shape[1:]):
        at = b.add(b.mul(at, n, flags=("nsw",)), i, flags=("nsw",))
    return b.gep(b.extract_value(array, 0), [at], inbounds=True)


@lower_builtin(operator.getitem, ArrayType, types.intp)
@lower_builtin(operator.getitem, ArrayType, types.UniTuple)
def _lower_getitem(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.load(_item(context, builder, sig.args[0], *args))


@lower_builtin(operator.setitem, ArrayType, types.intp, types.Number)
@lower_builtin(operator.setitem, ArrayType, types.UniTuple, types.Number)
def _lower_setitem(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    array, index, value = args
    builder.store(value, _item(context, builder, sig.args[0], array, index))
    return context.get_dummy_value()


@lower_builtin(len, ArrayType)
def _lower_len(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.extract_value(args[0], 1)


@lower_getattr(ArrayType, "shape")
def _lower_shape(context: Any, builder: Any, kind: ArrayType, value: Any) -> Any:
    return cgutils.pack_array(builder, [builder.extract_value(value, i + 1) for i in range(kind.ndim)])


class VectorsType(types.Type):
    """numba's type of a `Vectors` parameter."""

    def __init__(self, dtype: Any = types.float64) -> None:
        self.dtype = dtype
        super().__init__(name="sheldrake.Vectors" if dtype is types.float64 else f"sheldrake.Vectors({dtype})")


@register_model(VectorsType)
class _VectorsModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        members = [("slab", types.int64), ("pairs", types.CPointer(types.int64)), ("number", types.int64)]
        super().__init__(manager, kind, members)


def make_vectors(context: Any, builder: Any, kind: VectorsType, slab: Any, words: Any, number: Any, at: Any) -> Any:
    """The value of a `Vectors` parameter whose pairs begin at words[at]; `slab` is the slab's address as an integer."""
    value = cgutils.create_struct_proxy(kind)(context, builder)
    value.slab, value.number, value.pairs = slab, number, builder.gep(words, [at])
    return value._getvalue()


@lower_builtin(len, VectorsType)
def _lower_number(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return cgutils.create_struct_proxy(sig.args[0])(context, builder, value=args[0]).number


@lower_builtin(operator.getitem, VectorsType, types.intp)
def _lower_vector(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    value = cgutils.create_struct_proxy(sig.args[0])(context, builder, value=args[0])
    at = builder.mul(args[1], I64(2))
    offset = builder.load(builder.gep(value.pairs, [at]))
    size = builder.load(builder.gep(value.pairs, [builder.add(at, I64(1))]))
    address = builder.add(value.slab, builder.shl(offset, I64(3)))
    return make_array(context, builder, sig.return_type, address, [size])
