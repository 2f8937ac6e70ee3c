"""A compiler for kernels: Python's syntax tree in, LLVM's language out. Standard library and NumPy only.

    source    the tree of a function, which variables need memory, which may have no value
    kinds     what a value can be, and which LLVM values it is made of
    body      LLVM's text of one function: blocks, names, slots
    scalars   arithmetic, comparison and conversion of numbers
    memory    items of arrays, rows and fields of tables
    builtins  what kernels may call that is not a kernel; those that are several instructions are kernels in `prelude`
    function  one kernel for one list of argument kinds: statements and expressions
    module    all functions of an entry, and the entry's own, which reads the arguments' words
    errors    what is wrong, and where

The language is written down in `docs/kernels.md`. LLVM itself (llvmlite) is asked for in `_native/lower.py` only.
"""
