"""Builtin functions of Python that take numbers out of objects' slots, run a kernel on them, and make a new object.

As in `builtin`, `self` is a block that says what to look for. What is not exactly what was announced (a subclass,
another scalar, an array in another order) gives None, and so does a kernel that gives a status other than 0: whoever
asks then goes the long way. Another function may be asked before: the same for duals (`duals`).

Layout of a block, in words:

    0  address of the kernel's function        6   number of rows that take
    1  address of the type numpy.ndarray       7   number of rows that make
    2  address of the dtype float64            8   where the rows that make begin in the block
    3  number of given arguments               9   where the kernel's words begin in the block
    4  address of None                         10  PyArray_NewCopy, 11  PyType_GenericAlloc
    5  Py_IncRef                               12  PyFloat_FromDouble
    13  what is called with the same arguments before None is the answer, or 0
    14  PyObject_Vectorcall                    15  not where the first argument is of this type
    16 ... rows that take numbers: which argument; which of the kernel's words; a type that the argument must have, or
           0, and how many bytes into it stands the object to go on with; the same of that object; number of axes and
           lengths of the two first, a first of -1 for any, which the kernel is told; or, for a float, -1 and two types
           that it may have
       ... rows that make objects, the last of them the answer:
           0, address of an array that is copied, which flags of the copy stay;
           1, address of a double;
           2, address of a double, objects that stand for it if it is 0 and if it is not;
           a type, number of its slots, and for each slot how many bytes into the object it is, and which row made what
           belongs there
"""

from __future__ import annotations

import ctypes
import functools
from typing import Any

from sheldrake.common._native import builtin
from sheldrake.common._native.builtin import block_word

SYMBOL = "sheldrake_method"
HEAD, PER_TAKEN, PER_MADE = 16, 9, 8
MOST_MADE = 8
AN_ARRAY, A_FLOAT, A_TRUTH = 0, 1, 2
NEXT = 13

FIND_AND_MAKE = f"""{builtin.TAKE}
define internal ptr @find(ptr %given, ptr %row) {{
entry:
  %type_0_at = getelementptr i64, ptr %row, i64 2
  %type_0 = load i64, ptr %type_0_at
  %hop_0_at = getelementptr i64, ptr %row, i64 3
  %hop_0 = load i64, ptr %hop_0_at
  %type_1_at = getelementptr i64, ptr %row, i64 4
  %type_1 = load i64, ptr %type_1_at
  %hop_1_at = getelementptr i64, ptr %row, i64 5
  %hop_1 = load i64, ptr %hop_1_at
  %plain = icmp eq i64 %type_0, 0
  br i1 %plain, label %found, label %outer
outer:
  %outer_type_at = getelementptr i8, ptr %given, i64 {builtin._TYPE}
  %outer_type = load i64, ptr %outer_type_at
  %outer_fits = icmp eq i64 %outer_type, %type_0
  br i1 %outer_fits, label %into, label %no
into:
  %slot_0 = getelementptr i8, ptr %given, i64 %hop_0
  %held_0 = load ptr, ptr %slot_0
  %empty_0 = icmp eq ptr %held_0, null
  br i1 %empty_0, label %no, label %deeper
deeper:
  %one_hop = icmp eq i64 %type_1, 0
  br i1 %one_hop, label %found, label %inner
inner:
  %inner_type_at = getelementptr i8, ptr %held_0, i64 {builtin._TYPE}
  %inner_type = load i64, ptr %inner_type_at
  %inner_fits = icmp eq i64 %inner_type, %type_1
  br i1 %inner_fits, label %into_inner, label %no
into_inner:
  %slot_1 = getelementptr i8, ptr %held_0, i64 %hop_1
  %held_1 = load ptr, ptr %slot_1
  %empty_1 = icmp eq ptr %held_1, null
  br i1 %empty_1, label %no, label %found
found:
  %object = phi ptr [%given, %entry], [%held_0, %deeper], [%held_1, %into_inner]
  ret ptr %object
no:
  ret ptr null
}}

define internal ptr @copy_of(ptr %array, i64 %keeps, ptr %block) {{
entry:
{block_word("copier", 10, "ptr")}
  %copy = call ptr %copier(ptr %array, i32 0)
  %no_copy = icmp eq ptr %copy, null
  br i1 %no_copy, label %done, label %flag
flag:
  %mask = trunc i64 %keeps to i32
  %flags_at = getelementptr i8, ptr %copy, i64 {builtin._FLAGS}
  %flags = load i32, ptr %flags_at
  %kept_flags = and i32 %flags, %mask
  store i32 %kept_flags, ptr %flags_at
  br label %done
done:
  ret ptr %copy
}}

define internal ptr @make(ptr %row, ptr %block, ptr %made) {{
entry:
  %what = load i64, ptr %row
  %a_at = getelementptr i64, ptr %row, i64 1
  %a = load ptr, ptr %a_at
  %b_at = getelementptr i64, ptr %row, i64 2
  %b = load i64, ptr %b_at
  %c_at = getelementptr i64, ptr %row, i64 3
  %c = load ptr, ptr %c_at
  switch i64 %what, label %instance [
    i64 {AN_ARRAY}, label %array
    i64 {A_FLOAT}, label %number
    i64 {A_TRUTH}, label %truth
  ]
array:
  %copy = call ptr @copy_of(ptr %a, i64 %b, ptr %block)
  ret ptr %copy
number:
  %value = load double, ptr %a
{block_word("float", 12, "ptr")}
  %new_float = call ptr %float(double %value)
  ret ptr %new_float
truth:
  %said = load double, ptr %a
  %is_false = fcmp oeq double %said, 0.0
  %false = inttoptr i64 %b to ptr
  %answer = select i1 %is_false, ptr %false, ptr %c
{block_word("keep", 5, "ptr")}
  call void %keep(ptr %answer)
  ret ptr %answer
instance:
{block_word("alloc", 11, "ptr")}
  %type = inttoptr i64 %what to ptr
  %new = call ptr %alloc(ptr %type, i64 0)
  %slots = ptrtoint ptr %a to i64
  %no_new = icmp eq ptr %new, null
  br i1 %no_new, label %none, label %each
each:
  %i = phi i64 [0, %instance], [%i_next, %fill]
  %more = icmp slt i64 %i, %slots
  br i1 %more, label %fill, label %whole
fill:
  %from = mul i64 %i, 2
  %first = add i64 %from, 2
  %into_at = getelementptr i64, ptr %row, i64 %first
  %into = load i64, ptr %into_at
  %which_at = getelementptr i64, ptr %into_at, i64 1
  %which = load i64, ptr %which_at
  %part_at = getelementptr ptr, ptr %made, i64 %which
  %part = load ptr, ptr %part_at
  %slot = getelementptr i8, ptr %new, i64 %into
  store ptr %part, ptr %slot
  %i_next = add i64 %i, 1
  br label %each
whole:
  ret ptr %new
none:
  ret ptr null
}}
"""
"""Finds what a row that takes speaks of, null where an object is of another type; makes what a row that makes says.

`copy_of` is an array's copy, of whose flags those stay that `keeps` has; null where there is no memory."""

CODE = f"""{FIND_AND_MAKE}
define ptr @{SYMBOL}(ptr %self, ptr %args, i64 %count) {{
entry:
  %made = alloca [{MOST_MADE} x ptr]
  %block_at = getelementptr i8, ptr %self, i64 {builtin._DATA}
  %block = load ptr, ptr %block_at
{block_word("given", 3)}
{block_word("takes", 6)}
{block_word("makes", 7)}
{block_word("recipes", 8)}
{block_word("begin", 9)}
  %words = getelementptr i64, ptr %block, i64 %begin
  %as_many = icmp eq i64 %count, %given
  br i1 %as_many, label %arguments, label %misfit
arguments:
  %i = phi i64 [0, %entry], [%i_next, %right_type]
  %more = icmp slt i64 %i, %takes
  br i1 %more, label %one, label %run
one:
  %row_from = mul i64 %i, {PER_TAKEN}
  %row_start = add i64 %row_from, {HEAD}
  %row = getelementptr i64, ptr %block, i64 %row_start
  %which = load i64, ptr %row
  %slot_at = getelementptr i64, ptr %row, i64 1
  %slot = load i64, ptr %slot_at
  %word = getelementptr i64, ptr %words, i64 %slot
  %arg_at = getelementptr ptr, ptr %args, i64 %which
  %arg = load ptr, ptr %arg_at
  %object = call ptr @find(ptr %arg, ptr %row)
  %i_next = add i64 %i, 1
  %other_type = icmp eq ptr %object, null
  br i1 %other_type, label %misfit, label %right_type
right_type:
  %spec = getelementptr i64, ptr %row, i64 6
  %types = getelementptr i64, ptr %block, i64 1
  %fits = call i1 @take(ptr %object, ptr %spec, ptr %types, ptr %word, i64 0)
  br i1 %fits, label %arguments, label %misfit
run:
  %kernel = load ptr, ptr %block
  %status = call i64 %kernel(double 0.0, ptr null, ptr %words)
  %fine = icmp eq i64 %status, 0
  br i1 %fine, label %answer, label %misfit
answer:                                   ; without memory for all of it, what was made of it is lost
  %j = phi i64 [0, %run], [%j_next, %another]
  %last = phi ptr [null, %run], [%part, %another]
  %left = icmp slt i64 %j, %makes
  br i1 %left, label %another, label %done
another:
  %recipe_from = mul i64 %j, {PER_MADE}
  %recipe_start = add i64 %recipe_from, %recipes
  %recipe = getelementptr i64, ptr %block, i64 %recipe_start
  %part = call ptr @make(ptr %recipe, ptr %block, ptr %made)
  %part_at = getelementptr ptr, ptr %made, i64 %j
  store ptr %part, ptr %part_at
  %j_next = add i64 %j, 1
  %no_memory = icmp eq ptr %part, null
  br i1 %no_memory, label %failed, label %answer
done:
  ret ptr %last
failed:
  ret ptr null
misfit:
  %next_at = getelementptr i64, ptr %block, i64 {NEXT}
  %next = load ptr, ptr %next_at
  %no_next = icmp eq ptr %next, null
  %none_given = icmp eq i64 %count, 0
  %ask_none = or i1 %no_next, %none_given
  br i1 %ask_none, label %nothing, label %whose
whose:
  %first = load ptr, ptr %args
  %first_type_at = getelementptr i8, ptr %first, i64 {builtin._TYPE}
  %first_type = load i64, ptr %first_type_at
{block_word("not_for", 15)}
  %ours = icmp eq i64 %first_type, %not_for
  br i1 %ours, label %nothing, label %ask_next
ask_next:
{block_word("caller", 14, "ptr")}
  %said_next = tail call ptr %caller(ptr %next, ptr %args, i64 %count, ptr null)
  ret ptr %said_next
nothing:
{block_word("none", 4, "ptr")}
{block_word("keep", 5, "ptr")}
  call void %keep(ptr %none)
  ret ptr %none
}}
"""


METHOD = builtin.MachineCode(SYMBOL, CODE, b"A kernel on the numbers of objects.")


@functools.cache
def available() -> bool:
    """Whether builtin calls are to be had, and this code too."""
    return builtin.available() and METHOD.address is not None


def ask_next(function: Any, following: Any) -> None:
    """Lets a function that was made ask another one, or none, before it gives None."""
    block = function.__self__
    block[NEXT] = 0 if following is None else id(following)
    block.following = following


@functools.cache
def functions() -> dict[str, int]:
    """Addresses of what the code calls of Python."""
    names = ["Py_IncRef", "Py_DecRef", "PyType_GenericAlloc", "PyFloat_FromDouble", "PyObject_Vectorcall"]
    names += ["PyMem_RawMalloc", "PyMem_RawFree"]
    return {name: int(ctypes.cast(getattr(ctypes.pythonapi, name), ctypes.c_void_p).value or 0) for name in names}


@functools.cache
def place_of_slot(cls: type, name: str) -> int:
    """How many bytes into an object of a class a slot is.

    Raises:
        TypeError: it is not where objects of slots have theirs.
    """
    new: Any = object.__new__(cls)
    mark = object()
    descriptor = getattr(cls, name)
    descriptor.__set__(new, mark)
    for at in range(object.__basicsize__, cls.__basicsize__, 8):
        if ctypes.c_int64.from_address(id(new) + at).value == id(mark):
            return at
    raise TypeError(f"{cls.__name__}.{name} is no slot of its objects.")
