"""How numba sees `Vectors`: any number of vectors in the slab, found through pairs (offset, size) in the words.

One compiled kernel serves any number of inputs. Imports numba.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model
from numba.np.arrayobj import populate_array

I64 = ir.IntType(64)
VECTOR = types.Array(types.float64, 1, "C")


class VectorsType(types.Type):
    """numba's type of a `Vectors` parameter."""

    def __init__(self) -> None:
        super().__init__(name="sheldrake.Vectors")


VECTORS = VectorsType()


@register_model(VectorsType)
class _VectorsModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        members = [("slab", types.int64), ("pairs", types.CPointer(types.int64)), ("number", types.int64)]
        super().__init__(manager, kind, members)


def make_vectors(context: Any, builder: Any, slab: Any, words: Any, number: Any, at: Any) -> Any:
    """The value of a `Vectors` parameter whose pairs begin at words[at]; `slab` is the slab's address as an integer."""
    value = cgutils.create_struct_proxy(VECTORS)(context, builder)
    value.slab, value.number, value.pairs = slab, number, builder.gep(words, [at])
    return value._getvalue()


# Typing and lowering are given directly, not as an overload: an overload is a function, and without numba's runtime
# a function may not return an array.


@infer_global(len)
class _Len(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(types.intp, *args) if isinstance(args[0], VectorsType) else None


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(VECTOR, args[0], types.intp) if isinstance(args[0], VectorsType) else None


@lower_builtin(len, VectorsType)
def _lower_len(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return cgutils.create_struct_proxy(VECTORS)(context, builder, value=args[0]).number


@lower_builtin(operator.getitem, VectorsType, types.intp)
def _lower_getitem(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    value = cgutils.create_struct_proxy(VECTORS)(context, builder, value=args[0])
    at = builder.mul(args[1], I64(2))
    offset = builder.load(builder.gep(value.pairs, [at]))
    size = builder.load(builder.gep(value.pairs, [builder.add(at, I64(1))]))
    address = builder.add(value.slab, builder.shl(offset, I64(3)))
    data = builder.inttoptr(address, context.get_data_type(types.float64).as_pointer())
    array = context.make_array(VECTOR)(context, builder)
    populate_array(array, data=data, shape=[size], strides=[I64(8)], itemsize=I64(8), meminfo=None)
    return array._getvalue()
