"""Builtin functions as in `methods` whose numbers are duals: AutoDiffXd, with their derivatives.

The kernel is run on the values, with the bits it gives for floats, and then, as `sweep` does it, on complex numbers
once for each derivative. Numbers may be without derivatives; all others must have the same number of them, at most
MOST. What of the answer has any, what each number is a function of says.

Layout of a block: the head, and the rows that make, are those of `methods`; but an array is (0, an array of objects of
which a copy is filled with duals, which flags of the copy stay, which of the answer's numbers comes first), a single
dual (1, 0, 0, which number). Then

    16  dtype of objects                      25  is one to be told whether a number of the answer is a dual: all given
    17  type of duals                             numbers must be
    18  bytes into a dual: its value          26  numbers of the answer: how many
    19  bytes into a dual: its derivatives    27  their values          28  their derivatives, one row each
    20  float    21  NumPy's float            29  arrays that are copied for derivatives, by their number less one
    22  given numbers: values                 30  MOST                  31  1, -1, 0: what `take` is told of derivatives
    23  given numbers: complex                34  Py_DecRef             35  the kernel `sweep`
    24  given numbers: derivatives, one       36  words of it           37  two of them: the number of derivatives
        row each; and behind 38               38  of each given number, which of the answer's are functions of it, a bit
    39  PyMem_RawMalloc                       40  PyMem_RawFree
    41 ... rows that take numbers: as those of `methods`, without what a kernel is told, and then which of the given
            numbers comes first, and how many there are; for a float, which of the kernel's words it is
"""

from __future__ import annotations

import functools

from sheldrake.common._native import builtin, methods
from sheldrake.common._native.builtin import block_word

SYMBOL = "sheldrake_duals"
HEAD, PER_TAKEN = 41, 11
MOST = 64
MOST_NUMBERS = 63
"""Numbers of an answer: each has a bit of a word."""
_D, _T, _S = builtin._DATA, builtin._TYPE, 8


CODE = f"""{methods.FIND_AND_MAKE}
define internal i1 @is_number(i64 %type, ptr %block) {{
entry:
{block_word("float", 20)}
{block_word("other", 21)}
  %one = icmp eq i64 %type, %float
  %two = icmp eq i64 %type, %other
  %either = or i1 %one, %two
  ret i1 %either
}}

; Looks at a number; %found then has the address of its derivatives by eight and how many, which are none for a float.
define internal i1 @look(ptr %x, ptr %block, ptr %value_at, ptr %found) {{
entry:
  %count_at = getelementptr i64, ptr %found, i64 1
  store i64 0, ptr %count_at
  %type_at = getelementptr i8, ptr %x, i64 {_T}
  %type = load i64, ptr %type_at
  %plain = call i1 @is_number(i64 %type, ptr %block)
  br i1 %plain, label %take_value, label %dual
dual:
{block_word("kind", 17)}
  %is_dual = icmp eq i64 %type, %kind
  br i1 %is_dual, label %value, label %no
value:
{block_word("v", 18)}
  %slot_v = getelementptr i8, ptr %x, i64 %v
  %its_value = load ptr, ptr %slot_v
  %no_value = icmp eq ptr %its_value, null
  br i1 %no_value, label %no, label %look_at_value
look_at_value:
  %value_type_at = getelementptr i8, ptr %its_value, i64 {_T}
  %value_type = load i64, ptr %value_type_at
  %value_fits = call i1 @is_number(i64 %value_type, ptr %block)
  br i1 %value_fits, label %derivatives, label %no
derivatives:
{block_word("d", 19)}
  %slot_d = getelementptr i8, ptr %x, i64 %d
  %its_d = load ptr, ptr %slot_d
{block_word("none", 4, "ptr")}
  %no_d = icmp eq ptr %its_d, null
  br i1 %no_d, label %no, label %has_d
has_d:
  %constant = icmp eq ptr %its_d, %none
  br i1 %constant, label %take_value, label %measure
measure:
  %spec = getelementptr i64, ptr %block, i64 31
  %types = getelementptr i64, ptr %block, i64 1
  %fits = call i1 @take(ptr %its_d, ptr %spec, ptr %types, ptr %found, i64 0)
  br i1 %fits, label %take_value, label %no
take_value:
  %holder = phi ptr [%x, %entry], [%its_value, %has_d], [%its_value, %measure]
  %number_at = getelementptr i8, ptr %holder, i64 {builtin._VALUE}
  %number = load double, ptr %number_at
  store double %number, ptr %value_at
  ret i1 true
no:
  ret i1 false
}}

; Reads the numbers of one array, from the i-th given number on, in two passes: how many derivatives, then all.
define internal i1 @read(ptr %object, ptr %row, ptr %block, i1 %fill, ptr %state) {{
entry:
  %found = alloca [2 x i64]
  %spec = getelementptr i64, ptr %row, i64 6
  %first_at = getelementptr i64, ptr %row, i64 9
  %first = load i64, ptr %first_at
  %count_at = getelementptr i64, ptr %row, i64 10
  %count = load i64, ptr %count_at
  %floats = getelementptr i64, ptr %block, i64 1
  %are_floats = call i1 @take(ptr %object, ptr %spec, ptr %floats, ptr %found, i64 0)
  br i1 %are_floats, label %begin, label %objects
objects:
{block_word("array", 1)}
  %type_at = getelementptr i8, ptr %object, i64 {_T}
  %type = load i64, ptr %type_at
  %types = getelementptr i64, ptr %state, i64 4
  %types_1 = getelementptr i64, ptr %types, i64 1
{block_word("of_objects", 16)}
  store i64 %array, ptr %types
  store i64 %of_objects, ptr %types_1
  %are_objects = call i1 @take(ptr %object, ptr %spec, ptr %types, ptr %found, i64 0)
  br i1 %are_objects, label %begin, label %no
begin:
  %data_by_eight = load i64, ptr %found
  %data_int = shl i64 %data_by_eight, 3
  %data = inttoptr i64 %data_int to ptr
{block_word("values", 22, "ptr")}
{block_word("complexes", 23, "ptr")}
{block_word("slopes", 24, "ptr")}
{block_word("bits", 38, "ptr")}
{block_word("most", 30)}
  %length_at = getelementptr i64, ptr %found, i64 1
  br label %each
each:
  %i = phi i64 [0, %begin], [%i_next, %onward]
  %more = icmp slt i64 %i, %count
  br i1 %more, label %one, label %yes
one:
  %i_next = add i64 %i, 1
  %k = add i64 %first, %i
  %value_at = getelementptr double, ptr %values, i64 %k
  br i1 %are_floats, label %a_float, label %an_object
a_float:
  %float_at = getelementptr double, ptr %data, i64 %i
  %float = load double, ptr %float_at
  store double %float, ptr %value_at
  store i64 0, ptr %length_at
  br label %known
an_object:
  %x_at = getelementptr ptr, ptr %data, i64 %i
  %x = load ptr, ptr %x_at
  %nothing = icmp eq ptr %x, null
  br i1 %nothing, label %no, label %something
something:
  %fits = call i1 @look(ptr %x, ptr %block, ptr %value_at, ptr %found)
  br i1 %fits, label %known, label %no
known:
  %length = load i64, ptr %length_at
  %n = load i64, ptr %state
  %has_none = icmp eq i64 %length, 0
  br i1 %fill, label %copy, label %compare
compare:                                  ; all that have derivatives must have as many
  %unknown = icmp eq i64 %n, 0
  %as_many = icmp eq i64 %length, %n
  %fine_0 = or i1 %unknown, %as_many
  %few = icmp sle i64 %length, %most
  %fine_1 = and i1 %fine_0, %few
  %fine = or i1 %fine_1, %has_none
  br i1 %fine, label %note, label %no
note:
  %n_now = select i1 %has_none, i64 %n, i64 %length
  store i64 %n_now, ptr %state
  br label %onward
copy:
  %real_index = mul i64 %k, 2
  %real_at = getelementptr double, ptr %complexes, i64 %real_index
  %value = load double, ptr %value_at
  store double %value, ptr %real_at
  %row_from = mul i64 %k, %n
  %into = getelementptr double, ptr %slopes, i64 %row_from
  br i1 %has_none, label %zeros, label %its_own
zeros:
  call void @copy_row(ptr %into, ptr null, i64 %n)
  %constants_at = getelementptr i64, ptr %state, i64 2
  store i64 1, ptr %constants_at
  br label %onward
its_own:
  %from_by_eight = load i64, ptr %found
  %from_int = shl i64 %from_by_eight, 3
  %from = inttoptr i64 %from_int to ptr
  call void @copy_row(ptr %into, ptr %from, i64 %n)
  %its_bits_at = getelementptr i64, ptr %bits, i64 %k
  %its_bits = load i64, ptr %its_bits_at
  %mask_at = getelementptr i64, ptr %state, i64 1
  %mask = load i64, ptr %mask_at
  %mask_now = or i64 %mask, %its_bits
  store i64 %mask_now, ptr %mask_at
  br label %onward
onward:
  br label %each
yes:
  ret i1 true
no:
  ret i1 false
}}

define internal void @copy_row(ptr %into, ptr %from, i64 %n) {{
entry:
  %zeros = icmp eq ptr %from, null
  br label %each
each:
  %i = phi i64 [0, %entry], [%i_next, %put]
  %more = icmp slt i64 %i, %n
  br i1 %more, label %one, label %done
one:
  br i1 %zeros, label %put, label %get
get:
  %from_at = getelementptr double, ptr %from, i64 %i
  %number = load double, ptr %from_at
  br label %put
put:
  %x = phi double [0.0, %one], [%number, %get]
  %into_at = getelementptr double, ptr %into, i64 %i
  store double %x, ptr %into_at
  %i_next = add i64 %i, 1
  br label %each
done:
  ret void
}}

; Dual number k of the answer.
define internal ptr @make_dual(i64 %k, ptr %block, ptr %state) {{
entry:
{block_word("alloc", 11, "ptr")}
{block_word("kind", 17, "ptr")}
{block_word("float", 12, "ptr")}
{block_word("none", 4, "ptr")}
{block_word("v", 18)}
{block_word("d", 19)}
  %values_at = getelementptr i64, ptr %state, i64 6
  %values = load ptr, ptr %values_at
  %slopes_at = getelementptr i64, ptr %state, i64 7
  %slopes = load ptr, ptr %slopes_at
  %n = load i64, ptr %state
  %mask_at = getelementptr i64, ptr %state, i64 1
  %mask = load i64, ptr %mask_at
  %new = call ptr %alloc(ptr %kind, i64 0)
  %no_new = icmp eq ptr %new, null
  br i1 %no_new, label %failed, label %value
value:
  %value_at = getelementptr double, ptr %values, i64 %k
  %number = load double, ptr %value_at
  %its_value = call ptr %float(double %number)
  %slot_v = getelementptr i8, ptr %new, i64 %v
  store ptr %its_value, ptr %slot_v
  %slot_d = getelementptr i8, ptr %new, i64 %d
  %shifted = lshr i64 %mask, %k
  %bit = and i64 %shifted, 1
  %is_constant = icmp eq i64 %bit, 0
  br i1 %is_constant, label %without, label %with
without:
{block_word("keep", 5, "ptr")}
  call void %keep(ptr %none)
  store ptr %none, ptr %slot_d
  ret ptr %new
with:
{block_word("arrays", 29, "ptr")}
{block_word("copier", 10, "ptr")}
  %which = sub i64 %n, 1
  %array_at = getelementptr ptr, ptr %arrays, i64 %which
  %array = load ptr, ptr %array_at
  %copy = call ptr %copier(ptr %array, i32 0)
  store ptr %copy, ptr %slot_d
  %no_copy = icmp eq ptr %copy, null
  br i1 %no_copy, label %failed, label %fill
fill:
  %data_at = getelementptr i8, ptr %copy, i64 {_D}
  %data = load ptr, ptr %data_at
  %row_from = mul i64 %k, %n
  %from = getelementptr double, ptr %slopes, i64 %row_from
  call void @copy_row(ptr %data, ptr %from, i64 %n)
  ret ptr %new
failed:
  ret ptr null
}}

define internal ptr @make_array(ptr %row, ptr %block, ptr %state) {{
entry:
  %a_at = getelementptr i64, ptr %row, i64 1
  %a = load ptr, ptr %a_at
  %b_at = getelementptr i64, ptr %row, i64 2
  %b = load i64, ptr %b_at
  %first_at = getelementptr i64, ptr %row, i64 3
  %first = load i64, ptr %first_at
  %count_at = getelementptr i64, ptr %row, i64 4
  %count = load i64, ptr %count_at
{block_word("drop", 34, "ptr")}
  %copy = call ptr @copy_of(ptr %a, i64 %b, ptr %block)
  %no_copy = icmp eq ptr %copy, null
  br i1 %no_copy, label %failed, label %begin
begin:
  %data_at = getelementptr i8, ptr %copy, i64 {_D}
  %data = load ptr, ptr %data_at
  br label %each
each:
  %i = phi i64 [0, %begin], [%i_next, %put]
  %more = icmp slt i64 %i, %count
  br i1 %more, label %one, label %done
one:
  %k = add i64 %first, %i
  %x = call ptr @make_dual(i64 %k, ptr %block, ptr %state)
  %no_x = icmp eq ptr %x, null
  br i1 %no_x, label %failed, label %put
put:
  %place = getelementptr ptr, ptr %data, i64 %i
  %old = load ptr, ptr %place
  store ptr %x, ptr %place
  call void %drop(ptr %old)
  %i_next = add i64 %i, 1
  br label %each
done:
  ret ptr %copy
failed:
  ret ptr null
}}

define ptr @{SYMBOL}(ptr %self, ptr %args, i64 %arg_count) {{
entry:
  %made = alloca [{methods.MOST_MADE} x ptr]
  %state = alloca [8 x i64]               ; number of derivatives, what of the answer has any, are there constants
  %mask_at = getelementptr i64, ptr %state, i64 1
  %constants_at = getelementptr i64, ptr %state, i64 2
  store i64 0, ptr %state
  store i64 0, ptr %mask_at
  store i64 0, ptr %constants_at
  %block_at = getelementptr i8, ptr %self, i64 {_D}
  %block = load ptr, ptr %block_at
{block_word("given", 3)}
{block_word("takes", 6)}
{block_word("makes", 7)}
{block_word("recipes", 8)}
{block_word("begin", 9)}
  %words = getelementptr i64, ptr %block, i64 %begin
  %as_many = icmp eq i64 %arg_count, %given
  br i1 %as_many, label %pass, label %misfit
pass:
  %fill = phi i1 [false, %entry], [true, %passed]
  br label %arguments
arguments:
  %i = phi i64 [0, %pass], [%i_next, %right]
  %more = icmp slt i64 %i, %takes
  br i1 %more, label %one, label %passed
passed:
  br i1 %fill, label %check, label %pass
one:
  %i_next = add i64 %i, 1
  %row_from = mul i64 %i, {PER_TAKEN}
  %row_start = add i64 %row_from, {HEAD}
  %row = getelementptr i64, ptr %block, i64 %row_start
  %which = load i64, ptr %row
  %arg_at = getelementptr ptr, ptr %args, i64 %which
  %arg = load ptr, ptr %arg_at
  %object = call ptr @find(ptr %arg, ptr %row)
  %other_type = icmp eq ptr %object, null
  br i1 %other_type, label %misfit, label %right_type
right_type:
  %spec = getelementptr i64, ptr %row, i64 6
  %axes = load i64, ptr %spec
  %is_float = icmp slt i64 %axes, 0
  br i1 %is_float, label %take_float, label %take_numbers
take_float:
  %slot_at = getelementptr i64, ptr %row, i64 1
  %slot = load i64, ptr %slot_at
  %word = getelementptr i64, ptr %words, i64 %slot
  %types = getelementptr i64, ptr %block, i64 1
  %float_fits = call i1 @take(ptr %object, ptr %spec, ptr %types, ptr %word, i64 0)
  br label %right
take_numbers:
  %numbers_fit = call i1 @read(ptr %object, ptr %row, ptr %block, i1 %fill, ptr %state)
  br label %right
right:
  %fits = phi i1 [%float_fits, %take_float], [%numbers_fit, %take_numbers]
  br i1 %fits, label %arguments, label %misfit
check:
  %constants = load i64, ptr %constants_at
  %n = load i64, ptr %state
{block_word("demands", 25)}
  %mixed = and i64 %constants, %demands
  %is_mixed = icmp ne i64 %mixed, 0
  %has_slopes = icmp ne i64 %n, 0
  %too_mixed = and i1 %is_mixed, %has_slopes
  br i1 %too_mixed, label %misfit, label %run
run:
  %kernel = load ptr, ptr %block
  %status = call i64 %kernel(double 0.0, ptr null, ptr %words)
  %fine = icmp eq i64 %status, 0
  br i1 %fine, label %whether, label %misfit
whether:
{block_word("numbers", 26)}
  %no_numbers = icmp eq i64 %numbers, 0
  %no_slopes = icmp eq i64 %n, 0
  %values_only = or i1 %no_numbers, %no_slopes
  br i1 %values_only, label %keep_numbers, label %derive
derive:
{block_word("sweep", 35, "ptr")}
{block_word("its_words", 36, "ptr")}
{block_word("two", 37, "ptr")}
  %two_1 = getelementptr i64, ptr %two, i64 1
  %n_0 = load i64, ptr %two
  %n_0_at = getelementptr i64, ptr %its_words, i64 %n_0
  store i64 %n, ptr %n_0_at
  %n_1 = load i64, ptr %two_1
  %n_1_at = getelementptr i64, ptr %its_words, i64 %n_1
  store i64 %n, ptr %n_1_at
  %sweep_status = call i64 %sweep(double 0.0, ptr null, ptr %its_words)
  %sweep_fine = icmp eq i64 %sweep_status, 0
  br i1 %sweep_fine, label %keep_numbers, label %misfit
keep_numbers:                             ; to make an object may collect garbage, whose finalizers may call this again
{block_word("its_values", 27, "ptr")}
{block_word("its_slopes", 28, "ptr")}
{block_word("get_memory", 39, "ptr")}
{block_word("free_memory", 40, "ptr")}
  %count_of_slopes = mul i64 %numbers, %n
  %count_of_all = add i64 %numbers, %count_of_slopes
  %bytes = mul i64 %count_of_all, 8
  %own_values = call ptr %get_memory(i64 %bytes)
  %own_slopes = getelementptr double, ptr %own_values, i64 %numbers
  %no_own = icmp eq ptr %own_values, null
  br i1 %no_own, label %misfit, label %copy_numbers
copy_numbers:
  call void @copy_row(ptr %own_values, ptr %its_values, i64 %numbers)
  call void @copy_row(ptr %own_slopes, ptr %its_slopes, i64 %count_of_slopes)
  %values_at = getelementptr i64, ptr %state, i64 6
  store ptr %own_values, ptr %values_at
  %slopes_at = getelementptr i64, ptr %state, i64 7
  store ptr %own_slopes, ptr %slopes_at
  br label %answer
answer:                                   ; without memory for all of it, what was made of it is lost
  %j = phi i64 [0, %copy_numbers], [%j_next, %another_made]
  %last = phi ptr [null, %copy_numbers], [%part, %another_made]
  %left = icmp slt i64 %j, %makes
  br i1 %left, label %another, label %done
another:
  %recipe_from = mul i64 %j, {methods.PER_MADE}
  %recipe_start = add i64 %recipe_from, %recipes
  %recipe = getelementptr i64, ptr %block, i64 %recipe_start
  %what = load i64, ptr %recipe
  switch i64 %what, label %another_object [
    i64 {methods.AN_ARRAY}, label %an_array
    i64 {methods.A_FLOAT}, label %a_number
  ]
an_array:
  %new_array = call ptr @make_array(ptr %recipe, ptr %block, ptr %state)
  br label %another_made
a_number:
  %index_at = getelementptr i64, ptr %recipe, i64 3
  %index = load i64, ptr %index_at
  %new_number = call ptr @make_dual(i64 %index, ptr %block, ptr %state)
  br label %another_made
another_object:
  %new_object = call ptr @make(ptr %recipe, ptr %block, ptr %made)
  br label %another_made
another_made:
  %part = phi ptr [%new_array, %an_array], [%new_number, %a_number], [%new_object, %another_object]
  %part_at = getelementptr ptr, ptr %made, i64 %j
  store ptr %part, ptr %part_at
  %j_next = add i64 %j, 1
  %no_memory = icmp eq ptr %part, null
  br i1 %no_memory, label %failed, label %answer
done:
  call void %free_memory(ptr %own_values)
  ret ptr %last
failed:
  call void %free_memory(ptr %own_values)
  ret ptr null
misfit:
{block_word("none", 4, "ptr")}
{block_word("keep", 5, "ptr")}
  call void %keep(ptr %none)
  ret ptr %none
}}
"""


DUALS = builtin.MachineCode(SYMBOL, CODE, b"A kernel on the duals of objects.")


@functools.cache
def available() -> bool:
    """Whether this code is there, where `methods` are."""
    return methods.available() and DUALS.address is not None
