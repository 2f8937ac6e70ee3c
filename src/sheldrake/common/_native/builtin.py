"""Machine code as Python's own builtin functions: a call takes some 20 ns where one through ctypes takes 250 ns.

Python calls a builtin function as `f(self, args, count)`. Here `self` is a *block*: an int64 array that says which
kernel to call on which words, which stages must be up to date before, and what the given arguments must be: floats, or
float64 arrays of known shapes, whose bits or addresses go into the kernel's words. Only objects that stay as they are
for the life of the process are touched: the first fields of NumPy's arrays (they are its binary interface) and of
CPython's objects with a global interpreter lock. `available` looks whether they are where they should be; else calls go
through ctypes.

A block may be for *many memories*: the first argument of a call is a tuple of a slab, a side and a room (int64 arrays),
and models, a number of their own and their addresses. The words that depend on where these are (relocations) are
written before the kernel runs, if another memory was meant the last time.
The lock is held meanwhile, so that threads may share blocks, and what kernels fill that is not in the slab.

Layout of a block, in words:

    0  address of the kernel's function
    1  t, the bits of a float
    2  address of PyLong_FromLongLong
    3  address of the type numpy.ndarray
    4  address of the dtype float64
    5  number of given arguments
    6  stages it needs, one bit each
    7  number of arguments before the given ones: 1, or 0 for a block of one memory
    8  where the counter is that says when stages grow old [bytes from the side; an address where there is no side]
    9  where two words are: the counter's last value, bits of stages done [bytes from the room; likewise]
    10 address of the stages: each a bit, a function, an address of words and one of relocations
    11 number of stages
    12 where the kernel's words begin in the block
    13 address of the array object of which a copy is the answer when the status is 0, or 0
    14 address of PyArray_NewCopy
    15 which flags of that copy stay as they are: all, or all but the one that lets it be written
    16 the function of Python that raises an error when a stage fails, given slab and models, or 0: then the answer is
       the status
    17 address of PyObject_CallFunctionObjArgs
    18 address of the relocations of the kernel's words: their number, what the last memory was, and for each a word, a
       kind, a value:
           ELSEWHERE    the address of an array that is always there [doubles]
           IN_SIDE      a place in the side [words]
           IN_ROOM      a place in the room [words]
           MODEL        a place in the table of models; the word is an address [bytes]
           MODEL_FAR    the same [doubles from the slab]
    19 ... for each given argument: which of the kernel's words, number of axes, lengths of the two first axes;
           for a float -1 axes, and two types that such a number may have
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._native import sanitizer
from sheldrake.common._native.binding import DATA, OBJECTS_AS_EXPECTED
from sheldrake.common.kernel import MISFIT

if TYPE_CHECKING:
    from llvmlite.binding import TargetMachine

HEAD, PER_ARGUMENT, PER_STAGE = 19, 4, 4
ELSEWHERE, IN_SIDE, IN_ROOM, MODEL, MODEL_FAR = range(5)
IN_SLAB = -1  # needs no relocation
RELOCATIONS_HEAD = 5
SYMBOL = "sheldrake_call"
METH_FASTCALL = 0x0080
_NEW_COPY = 85  # in NumPy's table of functions
_TYPE, _DATA, _AXES, _SHAPE, _DTYPE, _FLAGS = 8, DATA, 24, 32, 56, 64  # [bytes] into an array object
_VALUE = 16  # [bytes] into a float, and into NumPy's
_ITEMS = 24  # [bytes] into a tuple
_IN_ORDER = 0x101  # C contiguous and aligned
ALL_FLAGS, READ_ONLY = -1, ~0x400


def block_word(name: str, index: int, kind: str = "i64") -> str:
    """LLVM's text that loads a word of the block."""
    return f"""  %{name}_at = getelementptr i64, ptr %block, i64 {index}
  %{name} = load {kind}, ptr %{name}_at"""


TAKE = f"""
define internal i1 @take(ptr %object, ptr %spec, ptr %types, ptr %word, i64 %slab) {{
entry:
  %axes = load i64, ptr %spec
  %n0_at = getelementptr i64, ptr %spec, i64 1
  %n0 = load i64, ptr %n0_at
  %n1_at = getelementptr i64, ptr %spec, i64 2
  %n1 = load i64, ptr %n1_at
  %type_at = getelementptr i8, ptr %object, i64 {_TYPE}
  %type = load i64, ptr %type_at
  %number = icmp slt i64 %axes, 0
  br i1 %number, label %is_number, label %is_array
is_number:
  %one_type = icmp eq i64 %type, %n0
  %other_type = icmp eq i64 %type, %n1
  %number_fits = or i1 %one_type, %other_type
  br i1 %number_fits, label %take_number, label %no
take_number:
  %value_at = getelementptr i8, ptr %object, i64 {_VALUE}
  %value = load i64, ptr %value_at
  store i64 %value, ptr %word
  ret i1 true
is_array:
  %array = load i64, ptr %types
  %type_fits = icmp eq i64 %type, %array
  br i1 %type_fits, label %is_double, label %no
is_double:                                ; only an object that is an array has these fields
  %double_at = getelementptr i64, ptr %types, i64 1
  %double = load i64, ptr %double_at
  %dtype_at = getelementptr i8, ptr %object, i64 {_DTYPE}
  %dtype = load i64, ptr %dtype_at
  %dtype_fits = icmp eq i64 %dtype, %double
  %flags_at = getelementptr i8, ptr %object, i64 {_FLAGS}
  %flags = load i32, ptr %flags_at
  %order = and i32 %flags, {_IN_ORDER}
  %order_fits = icmp eq i32 %order, {_IN_ORDER}
  %its_axes_at = getelementptr i8, ptr %object, i64 {_AXES}
  %its_axes_32 = load i32, ptr %its_axes_at
  %its_axes = sext i32 %its_axes_32 to i64
  %axes_fit = icmp eq i64 %its_axes, %axes
  %fits_0 = and i1 %dtype_fits, %order_fits
  %fits_1 = and i1 %fits_0, %axes_fit
  br i1 %fits_1, label %has_shape, label %no
has_shape:                                ; there are one or two axes, and behind the lengths stand the strides
  %shape_at = getelementptr i8, ptr %object, i64 {_SHAPE}
  %shape = load ptr, ptr %shape_at
  %length_0 = load i64, ptr %shape
  %length_1_at = getelementptr i64, ptr %shape, i64 1
  %length_1 = load i64, ptr %length_1_at
  %length_0_same = icmp eq i64 %length_0, %n0
  %any_length = icmp slt i64 %n0, 0
  %length_0_fits = or i1 %length_0_same, %any_length
  %length_1_same = icmp eq i64 %length_1, %n1
  %one_axis = icmp eq i64 %axes, 1
  %length_1_fits = or i1 %length_1_same, %one_axis
  %shape_fits = and i1 %length_0_fits, %length_1_fits
  br i1 %shape_fits, label %take_array, label %no
take_array:
  %data_at = getelementptr i8, ptr %object, i64 {_DATA}
  %data = load i64, ptr %data_at
  %address = lshr i64 %data, 3
  %offset = sub i64 %address, %slab
  store i64 %offset, ptr %word
  br i1 %any_length, label %measure, label %taken
measure:
  %length_word = getelementptr i64, ptr %word, i64 1
  store i64 %length_0, ptr %length_word
  br label %taken
taken:
  ret i1 true
no:
  ret i1 false
}}
"""
"""Takes a float's bits or an array's address into a word, if the object is as `spec` (number of axes and lengths of the
two first; for a float -1 and two types) announces it. A first length of -1 is any, and goes into the word behind.
Addresses count from `slab` [doubles].
`types` are numpy.ndarray and the dtype float64."""

RELOCATE = f"""
define internal void @relocate(ptr %words, ptr %list, ptr %models, ptr %bases) {{
entry:
  %count = load i64, ptr %list
  %then_at = getelementptr i64, ptr %list, i64 1
  %then_123 = load <3 x i64>, ptr %then_at, align 8
  %now_123 = load <3 x i64>, ptr %bases, align 8
  %others = icmp ne <3 x i64> %then_123, %now_123
  %then_models_at = getelementptr i64, ptr %list, i64 4
  %then_models = load i64, ptr %then_models_at
  %now_models = load i64, ptr %models
  %other_models = icmp ne i64 %then_models, %now_models
  %other_0 = extractelement <3 x i1> %others, i64 0
  %other_1 = extractelement <3 x i1> %others, i64 1
  %other_2 = extractelement <3 x i1> %others, i64 2
  %other_01 = or i1 %other_0, %other_1
  %other_23 = or i1 %other_2, %other_models
  %other = or i1 %other_01, %other_23
  br i1 %other, label %begin, label %done
begin:
  store <3 x i64> %now_123, ptr %then_at, align 8
  store i64 %now_models, ptr %then_models_at
  br label %each
each:
  %i = phi i64 [0, %begin], [%i_next, %set]
  %more = icmp slt i64 %i, %count
  br i1 %more, label %one, label %done
one:
  %from = mul i64 %i, 3
  %first = add i64 %from, {RELOCATIONS_HEAD}
  %row = getelementptr i64, ptr %list, i64 %first
  %at = load i64, ptr %row
  %kind_at = getelementptr i64, ptr %row, i64 1
  %kind = load i64, ptr %kind_at
  %value_at = getelementptr i64, ptr %row, i64 2
  %value = load i64, ptr %value_at
  %base_at = getelementptr i64, ptr %bases, i64 %kind
  %base = load i64, ptr %base_at
  %of_model = icmp sge i64 %kind, {MODEL}
  br i1 %of_model, label %model, label %set
model:
  %address_at = getelementptr i64, ptr %models, i64 %value
  %address = load i64, ptr %address_at
  %far = icmp eq i64 %kind, {MODEL_FAR}
  %shift = select i1 %far, i64 3, i64 0
  %place = lshr i64 %address, %shift
  br label %set
set:
  %what = phi i64 [%value, %one], [%place, %model]
  %word = add i64 %base, %what
  %word_at = getelementptr i64, ptr %words, i64 %at
  store i64 %word, ptr %word_at
  %i_next = add i64 %i, 1
  br label %each
done:
  ret void
}}
"""
"""Writes the words of a kernel that depend on the memory of a call; `bases` has what each kind counts from."""

CODE = f"""{TAKE}{RELOCATE}
define ptr @{SYMBOL}(ptr %self, ptr %args, i64 %count) {{
entry:
  %block_at = getelementptr i8, ptr %self, i64 {_DATA}
  %block = load ptr, ptr %block_at
{block_word("make", 2, "ptr")}
  %types = getelementptr i64, ptr %block, i64 3
{block_word("given", 5)}
{block_word("begin", 12)}
  %words = getelementptr i64, ptr %block, i64 %begin
  %bases = alloca [5 x i64]
{block_word("before", 7)}
  %own = getelementptr ptr, ptr %args, i64 %before
  %own_count = sub i64 %count, %before
  %as_many = icmp eq i64 %own_count, %given
  br i1 %as_many, label %begin_memory, label %misfit

begin_memory:
  %one_memory = icmp eq i64 %before, 0
  br i1 %one_memory, label %arguments, label %place
place:                                    ; what depends on where this call's memory is
  %memory = load ptr, ptr %args
  %items = getelementptr i8, ptr %memory, i64 {_ITEMS}
  %slab_object_here = load ptr, ptr %items
  %side_object_at = getelementptr ptr, ptr %items, i64 1
  %side_object = load ptr, ptr %side_object_at
  %room_object_at = getelementptr ptr, ptr %items, i64 2
  %room_object = load ptr, ptr %room_object_at
  %models_object_at = getelementptr ptr, ptr %items, i64 3
  %models_object_here = load ptr, ptr %models_object_at
  %slab_at = getelementptr i8, ptr %slab_object_here, i64 {_DATA}
  %slab_here = load ptr, ptr %slab_at
  %side_at = getelementptr i8, ptr %side_object, i64 {_DATA}
  %side_here = load ptr, ptr %side_at
  %room_at = getelementptr i8, ptr %room_object, i64 {_DATA}
  %room_here = load ptr, ptr %room_at
  %models_at = getelementptr i8, ptr %models_object_here, i64 {_DATA}
  %models_here = load ptr, ptr %models_at
  %slab_address = ptrtoint ptr %slab_here to i64
  %slab_doubles_here = lshr i64 %slab_address, 3
  %from_slab = sub i64 0, %slab_doubles_here
  %side_address = ptrtoint ptr %side_here to i64
  %side_doubles = lshr i64 %side_address, 3
  %side_from_slab = sub i64 %side_doubles, %slab_doubles_here
  %room_address = ptrtoint ptr %room_here to i64
  %room_doubles = lshr i64 %room_address, 3
  %room_from_slab = sub i64 %room_doubles, %slab_doubles_here
  %base_1 = getelementptr i64, ptr %bases, i64 {IN_SIDE}
  %base_2 = getelementptr i64, ptr %bases, i64 {IN_ROOM}
  %base_3 = getelementptr i64, ptr %bases, i64 {MODEL}
  %base_4 = getelementptr i64, ptr %bases, i64 {MODEL_FAR}
  store i64 %from_slab, ptr %bases
  store i64 %side_from_slab, ptr %base_1
  store i64 %room_from_slab, ptr %base_2
  store i64 0, ptr %base_3
  store i64 %from_slab, ptr %base_4
{block_word("relocations", 18, "ptr")}
  call void @relocate(ptr %words, ptr %relocations, ptr %models_here, ptr %bases)
  br label %arguments

arguments:                                ; each must be a number or an array as it was announced
  %slab = phi ptr [null, %begin_memory], [%slab_here, %place], [%slab, %one_argument]
  %side = phi ptr [null, %begin_memory], [%side_here, %place], [%side, %one_argument]
  %room = phi ptr [null, %begin_memory], [%room_here, %place], [%room, %one_argument]
  %models = phi ptr [null, %begin_memory], [%models_here, %place], [%models, %one_argument]
  %slab_object = phi ptr [null, %begin_memory], [%slab_object_here, %place], [%slab_object, %one_argument]
  %models_object = phi ptr [null, %begin_memory], [%models_object_here, %place], [%models_object, %one_argument]
  %slab_doubles = phi i64 [0, %begin_memory], [%slab_doubles_here, %place], [%slab_doubles, %one_argument]
  %i = phi i64 [0, %begin_memory], [0, %place], [%i_next, %one_argument]
  %more = icmp slt i64 %i, %given
  br i1 %more, label %one_argument, label %stages
one_argument:
  %arg_at = getelementptr ptr, ptr %own, i64 %i
  %arg = load ptr, ptr %arg_at
  %row_from = mul i64 %i, {PER_ARGUMENT}
  %row_start_of = add i64 %row_from, {HEAD}
  %argument = getelementptr i64, ptr %block, i64 %row_start_of
  %slot = load i64, ptr %argument
  %word = getelementptr i64, ptr %words, i64 %slot
  %spec = getelementptr i64, ptr %argument, i64 1
  %fits = call i1 @take(ptr %arg, ptr %spec, ptr %types, ptr %word, i64 %slab_doubles)
  %i_next = add i64 %i, 1
  br i1 %fits, label %arguments, label %misfit

stages:                                   ; what is needed and was not done since the counter changed
{block_word("needs", 6)}
  %needs_none = icmp eq i64 %needs, 0
  br i1 %needs_none, label %run, label %look
look:
  %counter_at = getelementptr i64, ptr %block, i64 8
  %counter_place = load i64, ptr %counter_at
  %counter = getelementptr i8, ptr %side, i64 %counter_place
  %now = load i64, ptr %counter
  %kept_at = getelementptr i64, ptr %block, i64 9
  %kept_place = load i64, ptr %kept_at
  %kept = getelementptr i8, ptr %room, i64 %kept_place
  %then = load i64, ptr %kept
  %done_at = getelementptr i64, ptr %kept, i64 1
  %done_then = load i64, ptr %done_at
  %fresh = icmp eq i64 %now, %then
  %done_0 = select i1 %fresh, i64 %done_then, i64 0
  %open = xor i64 %done_0, -1
  %to_do = and i64 %needs, %open
  store i64 %now, ptr %kept
  store i64 %done_0, ptr %done_at
  %all_done = icmp eq i64 %to_do, 0
  br i1 %all_done, label %run, label %walk
walk:
{block_word("table", 10, "ptr")}
  %count_at = getelementptr i64, ptr %block, i64 11
  %stage_count = load i64, ptr %count_at
  br label %each
each:
  %j = phi i64 [0, %walk], [%j_next, %onward]
  %left = icmp slt i64 %j, %stage_count
  br i1 %left, label %one, label %run
one:
  %row_start = mul i64 %j, {PER_STAGE}
  %row = getelementptr i64, ptr %table, i64 %row_start
  %bit = load i64, ptr %row
  %wants = and i64 %bit, %to_do
  %skip = icmp eq i64 %wants, 0
  br i1 %skip, label %onward, label %compute
compute:
  %stage_at = getelementptr i64, ptr %row, i64 1
  %stage = load ptr, ptr %stage_at
  %stage_words_at = getelementptr i64, ptr %row, i64 2
  %stage_words = load ptr, ptr %stage_words_at
  br i1 %one_memory, label %run_stage, label %place_stage
place_stage:
  %stage_relocations_at = getelementptr i64, ptr %row, i64 3
  %stage_relocations = load ptr, ptr %stage_relocations_at
  call void @relocate(ptr %stage_words, ptr %stage_relocations, ptr %models, ptr %bases)
  br label %run_stage
run_stage:
  %stage_status = call i64 %stage(double 0.0, ptr %slab, ptr %stage_words)
  %stage_fine = icmp eq i64 %stage_status, 0
  br i1 %stage_fine, label %note, label %failed
note:
  %done_before = load i64, ptr %done_at
  %done_now = or i64 %done_before, %bit
  store i64 %done_now, ptr %done_at
  br label %onward
onward:
  %j_next = add i64 %j, 1
  br label %each
failed:
{block_word("refuse", 16, "ptr")}
  %no_refuse = icmp eq ptr %refuse, null
  br i1 %no_refuse, label %tell, label %raise
raise:
{block_word("caller", 17, "ptr")}
  %raised = call ptr (ptr, ...) %caller(ptr %refuse, ptr %slab_object, ptr %models_object, ptr null)
  ret ptr %raised
tell:
  %failure = tail call ptr %make(i64 %stage_status)
  ret ptr %failure

run:
  %kernel = load ptr, ptr %block
  %t_at = getelementptr i64, ptr %block, i64 1
  %t = load double, ptr %t_at
  %status = call i64 %kernel(double %t, ptr %slab, ptr %words)
{block_word("answer", 13, "ptr")}
  %no_answer = icmp eq ptr %answer, null
  %not_fine = icmp ne i64 %status, 0
  %number_only = or i1 %no_answer, %not_fine
  br i1 %number_only, label %say, label %copy
copy:
{block_word("copier", 14, "ptr")}
  %new = call ptr %copier(ptr %answer, i32 0)
  %no_memory = icmp eq ptr %new, null
  br i1 %no_memory, label %give, label %flag
flag:
  %mask_at = getelementptr i64, ptr %block, i64 15
  %mask_64 = load i64, ptr %mask_at
  %mask = trunc i64 %mask_64 to i32
  %new_flags_at = getelementptr i8, ptr %new, i64 {_FLAGS}
  %new_flags = load i32, ptr %new_flags_at
  %kept_flags = and i32 %new_flags, %mask
  store i32 %kept_flags, ptr %new_flags_at
  br label %give
give:
  ret ptr %new
say:
  %result = tail call ptr %make(i64 %status)
  ret ptr %result
misfit:
  %refusal = tail call ptr %make(i64 {MISFIT})
  ret ptr %refusal
}}
"""


class Block(np.ndarray):
    """The words of one builtin function; keeps alive what their addresses are of."""

    keep: Any = None
    following: Any = None
    code = 0
    """Address of the machine code that works on it."""


class _Method(ctypes.Structure):
    """CPython's PyMethodDef."""

    _fields_ = [
        ("name", ctypes.c_char_p),
        ("function", ctypes.c_void_p),
        ("flags", ctypes.c_int),
        ("doc", ctypes.c_char_p),
    ]


class MachineCode:
    """A function in LLVM's language, of which builtin functions are made, each with a block of its own.

    Args:
        symbol: Its name.
        text: What it is.
        doc: What Python shows of the builtin functions.
    """

    def __init__(self, symbol: str, text: str, doc: bytes) -> None:
        self.symbol, self.text, self._doc = symbol, text, doc

    @functools.cached_property
    def address(self) -> int | None:
        """Where it is; None where there is none, and no compiler."""
        return code_address(self.symbol, self.text)

    @functools.cached_property
    def _method(self) -> _Method:
        return _Method(self.symbol.encode(), self.address, METH_FASTCALL, self._doc)

    def make(self, words: list[int] | np.ndarray, keep: Any) -> Any:
        """A builtin function of the block `words`, which keeps alive what is to be kept."""
        block = np.array(words, np.int64).view(Block)
        block.keep, block.code = keep, self.address or 0
        return _factory()(ctypes.byref(self._method), block, None)


QUERY = MachineCode(SYMBOL, CODE, b"A kernel on fixed arrays.")


@functools.cache
def constants() -> tuple[int, int, int]:
    """Words 2 to 4 of every block."""
    address = ctypes.cast(ctypes.pythonapi.PyLong_FromLongLong, ctypes.c_void_p).value
    return int(address or 0), id(np.ndarray), id(np.dtype(np.float64))


@functools.cache
def caller() -> int:
    """Word 17 of every block."""
    return int(ctypes.cast(ctypes.pythonapi.PyObject_CallFunctionObjArgs, ctypes.c_void_p).value or 0)


NUMBER = -1, id(float), id(np.float64)
"""What stands behind the word of a float's block: no axes but types."""


@functools.cache
def new_copy() -> int:
    """Address of PyArray_NewCopy; 0 where NumPy does not show its functions."""
    try:
        from numpy._core._multiarray_umath import _ARRAY_API  # type: ignore[import-not-found, attr-defined]
    except ImportError:
        try:
            from numpy.core._multiarray_umath import _ARRAY_API  # type: ignore[no-redef]
        except ImportError:
            return 0
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    table = get(_ARRAY_API, None)
    return ctypes.c_int64.from_address(table + 8 * _NEW_COPY).value


@functools.cache
def available() -> bool:
    """Whether this interpreter's and this NumPy's objects look as the code expects, and the code is there."""
    if sanitizer.SANITIZED:
        return False  # it takes addresses of arrays that nobody has placed
    if not OBJECTS_AS_EXPECTED:
        return False
    return _objects_as_expected() and _arrays_as_expected() and new_copy() != 0 and QUERY.address is not None


def _objects_as_expected() -> bool:
    numbers: tuple[float, ...] = 1.5, np.float64(-2.5)
    items = "slab", "side", "room", "models"
    found = (ctypes.c_int64 * 4).from_address(id(items) + _ITEMS)
    alike = all(ctypes.c_double.from_address(id(x) + _VALUE).value == x for x in numbers)
    return alike and [*found] == [*map(id, items)]


def _arrays_as_expected() -> bool:
    a = np.zeros((3, 5))

    def word(where: int, offset: int, kind: Any = ctypes.c_int64) -> int:
        return kind.from_address(where + offset).value

    return (
        word(id(a), _TYPE) == id(np.ndarray)
        and word(id(a), _DATA) == a.__array_interface__["data"][0]
        and word(id(a), _AXES, ctypes.c_int32) == 2
        and [word(word(id(a), _SHAPE), 8 * i) for i in range(4)] == [3, 5, 40, 8]
        and word(id(a), _DTYPE) == id(np.dtype(np.float64))
        and word(id(a), _FLAGS, ctypes.c_int32) & _IN_ORDER == _IN_ORDER
        and word(id(a.T), _FLAGS, ctypes.c_int32) & _IN_ORDER != _IN_ORDER
    )


@functools.cache
def _factory() -> Any:
    new = ctypes.pythonapi.PyCFunction_NewEx
    new.restype, new.argtypes = ctypes.py_object, [ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p]
    return new


def code_address(symbol: str, text: str) -> int | None:
    """Address of a function in LLVM's language: from the wheel's library, the user's cache, or made now."""
    from sheldrake.common._native import disk_cache, prebuilt, store

    found, _ = prebuilt.library()
    if found is not None and hasattr(found.dll, symbol):
        return ctypes.cast(getattr(found.dll, symbol), ctypes.c_void_p).value
    try:
        path = store.cache_folder() / f"{symbol}-{hashlib.sha256(text.encode()).hexdigest()[:20]}.o"
        code = disk_cache.read(path)
        if code is None:
            from sheldrake.common._native.target import host

            code = assemble(text, host())
            disk_cache.write(path, code)
        return store._link(code, symbol)
    except ModuleNotFoundError:
        return None


def assemble(text: str, target: TargetMachine) -> bytes:
    """An object file of LLVM's language for a target."""
    import llvmlite.binding as llvm

    from sheldrake.common._native.target import initialise

    initialise()
    module = llvm.parse_assembly(text)
    machine = target.machine()
    module.triple, module.data_layout = target.triple, str(machine.target_data)
    return machine.emit_object(module)
