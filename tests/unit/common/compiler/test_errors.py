"""Every error of the compiler: what it says, which part of the line it underlines, and who called."""

from __future__ import annotations

import importlib.util
import linecache
import math
import os
import sys
import time
from typing import NamedTuple

import numpy as np
import pytest
from tests.unit.common.compiler.sources import module_of

from sheldrake.common._native.compiler import prelude
from sheldrake.common._native.compiler.errors import KernelError
from sheldrake.common._native.compiler.module import text_of
from sheldrake.common.kernel import kernel

HEAD = """
import math
from sheldrake.common._kernels.generic import sin
TABLE, LIST, DICT, NAME = np.ones(3), [1, 2], {1: 2}, "name"
MIXED, LARGE = (1, 2.0, 3), 2**70
class Plain: pass
def plain(v): return v
@kernel
def inner(v, w):
    return v + w
@kernel
def nothing(v):
    pass
@kernel
def itself(v):
    if v > 0: return itself(v - 1)
    return v
@kernel
def defaults(v, w=1.0): return v
@kernel
def some(v):
    if v > 0.0: return 1.0
@kernel
def mixed(v):
    if v > 0.0: return 1
    return 1.0
@kernel
def mixed_nothing(v):
    if v > 0.0: return
    return 1.0
@kernel
def counted(n):
    for i in range(n): yield i
@kernel
def twice_yielded(n):
    yield n
    yield n + 1
@kernel
def over_itself(n):
    for i in over_itself(n): yield i
@kernel
def wrong_inside(n):
    for i in range(3): yield i + NAME
unwritten = kernel(eval("lambda v: v"))
@kernel(top=True)
def entry(x: Vector, n: IntVector, A: Matrix, table: Table, one: Options, u: Vectors, k: int, a: float) -> int:
"""

# (body, what is underlined, message)
STATEMENTS = [
    ("try:\n    y = 1.0\nexcept TypeError:\n    pass", "try:", "a kernel has no statement `try`"),
    ("with open(NAME):\n    pass", "with open(NAME):", "a kernel has no statement `with`"),
    ("raise ValueError", "raise ValueError", "a kernel has no statement `raise`"),
    ("assert k > 0", "assert k > 0", "a kernel has no statement `assert`"),
    ("del k", "del k", "a kernel has no statement `delete`"),
    ("import math", "import math", "a kernel has no statement `import`"),
    ("global TABLE", "global TABLE", "a kernel has no statement `global`"),
    ("def f(): pass", "def f(): pass", "a kernel has no statement `def`"),
    ("match k:\n    case 1: pass", "match k:", "a kernel has no statement `match`"),
    ("for i in range(3): pass\nelse: k = 1", "k = 1", "a loop in a kernel has no `else`"),
    ("while k: k -= 1\nelse: k = 1", "k = 1", "a loop in a kernel has no `else`"),
    ("for i in x: pass", "x", "a kernel loops over a range or a tuple of like items, not array of floats with 1 axis"),
    ("for i in MIXED: pass", "MIXED", "a kernel loops over a range or a tuple of like items, not (int, float, int)"),
    ("for i in range(): pass", "range()", "a range has one to three arguments"),
    ("for i in range(1, 2, 3, 4): pass", "range(1, 2, 3, 4)", "a range has one to three arguments"),
    ("for i in range(0, 9, k): pass", "k", "the step of a range is a number that is known and not 0"),
    ("for i in range(0, 9, 0): pass", "0", "the step of a range is a number that is known and not 0"),
    ("for i in range(a): pass", "for i in range(a): pass", "float where int is wanted"),
    ("if k > 0: y = 1.0\nx[0] = y", "y", "`y` has a value on some ways here and none on others"),
    ("y: float\nx[0] = y", "y", "`y` has a value on some ways here and none on others"),
    ("y: float\nif k: y = 1.0\nx[0] = y", "y", "`y` has a value on some ways here and none on others"),
    ("y += 1.0", "y", "`y` has a value on some ways here and none on others"),
    ("for i in range(k): y = 1.0\nx[0] = y", "y", "`y` has a value on some ways here and none on others"),
    ("while k:\n    if k: break\n    y = 1\nk = y", "y", "`y` has a value on some ways here and none on others"),
    ("if k: return 1", "def entry(", "returns int on some ways and nothing on others"),
    ("if k: return 1\nreturn 0.5", "return 0.5", "float is returned where an earlier return gives int"),
    ("return 0.5", None, "returns float; an entry kernel returns None or an int status."),
    ("return k > 0", None, "returns bool; an entry kernel returns None or an int status."),
]
VARIABLES = [
    ("y = 0\ny = a\nk = y", "y", "float is given to `y`, which has been int: a variable has one kind, so begin with"),
    ("y = k > 0\ny = k\nk = y", "y", "int is given to `y`, which has been bool"),
    ("y = (1, 2)\ny = (1, 2, 3)\nk = y[0]", "y", "(int, int, int) is given to `y`, which has been (int, int)"),
    ("y = x\nif k: y = 1.0\nx[0] = y[0]", "y", "float is given to `y`, which has been array of floats with 1 axis"),
    ("y = 1\ny = math\nk = y", "y", "module math is given to `y`, which has been int"),
    ("f = sin\nf = inner\nk = f(1, 2)", "f", "`f` is function sin, which is known while compiling and stays"),
    ("x = A[0, 0]\nk = x", "x", "`x` is array of floats with 1 axis that the caller gave: store into its items"),
    ("y, z = 1, 2, 3", "y, z", "(int, int, int) cannot be unpacked into 2"),
    ("y, z = k", "y, z", "int cannot be unpacked into 2"),
    ("[y, z] = 1, 2", "[y, z]", "a kernel has no list: write a tuple"),
    ("y, *z = 1, 2", "*z", "a kernel has no star"),
    ("k = y", "y", "`y` has no value here"),
    ("y = nothing(a)\nk = y + 1", "y + 1", "None is not a number"),
]
EXPRESSIONS = [
    ("k = [1, 2]", "[1, 2]", "a kernel has no list: write a tuple"),
    ("k = {1: 2}", "{1: 2}", "a kernel has no dictionary"),
    ("k = {1, 2}", "{1, 2}", "a kernel has no set"),
    ("k = [i for i in (1, 2)]", "[i for i in (1, 2)]", "a kernel has no list comprehension"),
    ("k = sum(i for i in (1, 2))", "(i for i in (1, 2))", "a kernel has no generator"),
    ("k = f'{k}'", "f'{k}'", "a kernel has no text"),
    ("k = lambda: 1", "lambda: 1", "a kernel has no lambda"),
    ("k = (y := 1)", "y := 1", "a kernel has no `:=`"),
    ("k = (*MIXED,)", "*MIXED", "a kernel has no star"),
    ("k = inner(*MIXED)", "*MIXED", "a kernel has no star"),
    ("k = x[0:2]", "0:2", "a kernel has no slice"),
    ("k = yield", "yield", "a kernel has no yield"),
    ("k = counted(3)", "counted(3)", "counted yields: it is for loops, `for x in counted(...)`"),
    ("yield k", "yield k", "a kernel has no yield here"),
    ("for i in counted(): pass", "counted()", "counted(n) takes 1 arguments, not 0"),
    ("for i in counted(n=1): pass", "counted(n=1)", "a call in a kernel has no keyword arguments"),
    ("for i in twice_yielded(1): pass", "def twice_yielded(n):", "a kernel yields in one place: loops have their"),
    ("for i in over_itself(1): pass", "over_itself(n)", "over_itself loops over itself: kernels do not recurse"),
    ("for i in wrong_inside(1): pass", "i + NAME", "str name is not a number"),
    ("for i in counted(1): k = NAME + i", "NAME + i", "str name is not a number"),
    ("for i, j in counted(1): pass", "i, j", "int cannot be unpacked into 2"),
    ("for i in unwritten(1): pass", "unwritten(1)", "its source is not there. Kernels are compiled from files and"),
    ("k = 0 < k < 3", "0 < k < 3", "a kernel compares two numbers; write `a < b and b < c`"),
    ("k = k in MIXED", "k in MIXED", "a kernel has no comparison `in`"),
    ("k = k not in MIXED", "k not in MIXED", "a kernel has no comparison `not in`"),
    ("k = k is None", "k is None", "a kernel has no comparison `is`"),
    ("k = k is not None", "k is not None", "a kernel has no comparison `is not`"),
    ("k = x == x", "x == x", "array of floats with 1 axis is not a number"),
    ("if 1j: pass", "1j", "complex is neither true nor false"),
    ("k = not NAME", "not NAME", "str name is neither true nor false"),
    ("while x: pass", "x", "array of floats with 1 axis is neither true nor false"),
    ("k = a and MIXED", "MIXED", "(int, float, int) is neither true nor false"),
    ("k = x + 1.0", "x + 1.0", "array of floats with 1 axis is not a number"),
    ("k = a @ a", "a @ a", "there is no float @ float"),
    ("k = a << 2", "a << 2", "there is no float << int"),
    ("a |= 2", "a |= 2", "there is no float | int"),
    ("x[0] ^= 2", "x[0] ^= 2", "there is no float ^ int"),
    ("k = 1j // 2", "1j // 2", "there is no complex // int"),
    ("k = 1j % 2", "1j % 2", "there is no complex % int"),
    ("k = 1j ** a", "1j ** a", "there is no complex ** float"),
    ("k = k @ k", "k @ k", "there is no int @ int"),
    ("k = k ** k", "k ** k", "an integer to a power of which is not known that it is 0 to 64; write float(...)"),
    ("k = k ** -1", "k ** -1", "an integer to a power of which is not known that it is 0 to 64; write float(...)"),
    ("k = ~a", "~a", "~ takes an int, not float"),
    ("k = -NAME", "-NAME", "str name is not a number"),
    ("k = LARGE", "LARGE", "1180591620717411303424 has no place in 64 bits"),
    ("k = 9223372036854775808", "9223372036854775808", "9223372036854775808 has no place in 64 bits"),
    ("k = 9223372036854775807 + 1", "9223372036854775807 + 1", "9223372036854775808 has no place in 64 bits"),
    ("k = 2 ** 63", "2 ** 63", "9223372036854775808 has no place in 64 bits"),
    ("a = 1 if k else x", "1 if k else x", "array of floats with 1 axis is chosen where the other choice is int"),
    (
        "y = (1, 2) if k else (1.0, 2)",
        "(1, 2) if k else (1.0, 2)",
        "(float, int) is chosen where the other choice is (int",
    ),
    ("k = a.size", "a.size", "float has no `size`"),
    ("k = x.size", "x.size", "array of floats with 1 axis has no `size`"),
    ("k = math.tau2", "math.tau2", "module math has no `tau2`"),
    ("k = Both(a, k).y", "Both(a, k).y", "Both has no field 'y'; it has x, n."),
]
CALLS = [
    ("k = inner(1)", "inner(1)", "inner(v, w) takes 2 arguments, not 1"),
    ("k = inner(v=1, w=2)", "inner(v=1, w=2)", "a call in a kernel has no keyword arguments"),
    ("k = abs()", "abs()", "abs takes 1 arguments, not 0"),
    ("k = min(1)", "min(1)", "min takes 2 or more arguments, not 1"),
    ("k = complex(1, 2, 3)", "complex(1, 2, 3)", "complex takes 1 to 2 arguments, not 3"),
    ("k = Both(1)", "Both(1)", "Both has 2 fields, not 1"),
    ("k = plain(1)", "plain(1)", "a kernel may call kernels, mathematics and len, not 'plain': make it a @kernel"),
    ("k = Plain()", "Plain()", "a kernel may call kernels, mathematics and len, not 'Plain': make it a @kernel"),
    ("print(k)", "print(k)", "a kernel cannot call 'print'; of mathematics it has abs, min, max, len, sin"),
    ("k = np.zeros(3)", "np.zeros(3)", "a kernel cannot call 'zeros'; of mathematics it has abs"),
    ("k = LIST(3)", "LIST(3)", "a kernel"),
    ("k = a(3)", "a", "float cannot be called"),
    ("k = x[0](3)", "x[0]", "float cannot be called"),
    ("k = itself(1)", "itself(v - 1)", "itself calls itself: kernels do not recurse"),
    ("k = len(a)", "len(a)", "float has no length"),
    ("k = abs(1j)", "abs(1j)", "complex where int is wanted"),
    ("k = float(1j)", "float(1j)", "complex where float is wanted"),
    ("k = int(1j)", "int(1j)", "complex where int is wanted"),
    ("k = sin(x)", "sin(x)", "array of floats with 1 axis is not a number"),
    ("k = min(x, 1)", "min(x, 1)", "array of floats with 1 axis is not a number"),
    ("k = defaults(a, a)", "def defaults(v, w=1.0): return v", "a kernel takes plain parameters, without defaults"),
    ("k = some(a)", "def some(v):", "returns float on some ways and nothing on others"),
    ("k = mixed(a)", "return 1.0", "float is returned where an earlier return gives int"),
    ("k = mixed_nothing(a)", "return 1.0", "float is returned where an earlier return gives None"),
    ("k = unwritten(a)", "unwritten(a)", "its source is not there. Kernels are compiled from files and cells"),
    ("k = quotient(k, k)", "quotient(k, k)", "is for the compiler alone: write // or %"),
]
MEMORY = [
    ("x[a] = 1.0", "a", "an array of floats with 1 axis takes 1 int as index, not (float)"),
    ("x[0, 1] = 1.0", "0, 1", "an array of floats with 1 axis takes 1 int as index, not (int, int)"),
    ("A[0] = 1.0", "0", "an array of floats with 2 axes takes 2 int as index, not (int)"),
    ("x[-1] = 1.0", "-1", "an index in a kernel does not count from the end: write `a[a.shape[0] - 1]`"),
    ("k = A[0, -2]", "0, -2", "an index in a kernel does not count from the end"),
    ("k = table[-1].k", "-1", "an index in a kernel does not count from the end"),
    ("k = u[-1][0]", "-1", "an index in a kernel does not count from the end"),
    ("k = table.trees[-1].first", "-1", "an index in a kernel does not count from the end"),
    ("n[0] = 0.5", "n[0]", "float is stored where there is room for int"),
    ("x[0] = 1j", "x[0]", "complex is stored where there is room for float"),
    ("x[0] = MIXED", "x[0]", "(int, float, int) is stored where there is room for float"),
    ("y = MIXED\ny[0] = 1", "y[0]", "nothing can be stored into an item of (int, float, int)"),
    ("u[0] = x", "u[0]", "nothing can be stored into an item of Vectors of floats"),
    ("y = Both(a, k)\ny.x = 1.0", "y.x", "nothing can be stored into an attribute of Both"),
    ("x.shape = 1", "x.shape", "nothing can be stored into an attribute of array of floats with 1 axis"),
    ("math.x = 1", "math.x", "nothing can be stored into an attribute of module math"),
    ("table.law = A", "table.law", "`law` is an array: store into its items"),
    ("table[0].w = 1.0", "table[0].w", "`w` is an array: store into its items"),
    ("table.trees = 1.0", "table.trees", "`trees` is an array: store into its items"),
    ("table.dtt = 1.0", "table.dtt", "Table has no field 'dtt'; it has law, J, option, flag, tree, x, dt, nodes, tup"),
    ("k = table[0].kk", "table[0].kk", "Table has no field 'kk'; it has k, V, m, w, s, c, rest, J."),
    ("k = table.trees[0].kk", "table.trees[0].kk", "Tree has no field 'kk'; it has first, pair, ids."),
    ("k = one.kk", "one.kk", "Options has no field 'kk'; it has dt, nodes, tup."),
    (
        "table[0].V = (1.0, 2.0)",
        "table[0].V",
        "(float, float) is stored where there is room for ((float, float, float)",
    ),
    ("table.trees[0].first = 0.5", "table.trees[0].first", "float is stored where there is room for int"),
    ("table.nowhere += 1.0", "table.nowhere", "Table has no field 'nowhere'"),
    ("k = MIXED[k]", "k", "which item of (int, float, int) must be known: they are of several kinds"),
    ("k = MIXED[3]", "MIXED[3]", "(int, float, int) has 3 items and no item 3"),
    ("k = MIXED[-4]", "MIXED[-4]", "(int, float, int) has 3 items and no item -4"),
    ("k = MIXED[a]", "a", "(int, float, int) takes an int as index, not float"),
    ("k = MIXED[0, 1]", "0, 1", "(int, float, int) takes one int as index"),
    ("k = table[a].k", "table[a]", "float where int is wanted"),
    ("k = a[0]", "a", "float has no items"),
    ("k = TABLE[0]", "TABLE", "ndarray"),
    ("k = LIST[0]", "LIST", "has no items"),
    ("k = DICT[1]", "DICT", "has no items"),
    ("k = table[0][1]", "table[0]", "Table has no items"),
]


def refusal(text, name="entry", **names):
    """What is said about an entry: the error."""
    with pytest.raises(TypeError) as caught:
        text_of(module_of(text, **names)[name], "k")
    return caught.value


@pytest.mark.parametrize(
    ("body", "underlined", "message"), [*STATEMENTS, *VARIABLES, *EXPRESSIONS, *CALLS, *MEMORY], ids=lambda x: x
)
def test_message_place_and_line(body, underlined, message):
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    error = refusal(HEAD + lines, quotient=prelude.quotient)
    assert message in str(error)
    if underlined is None:
        return
    assert isinstance(error, KernelError)
    place, shown, carets, *callers = str(error).splitlines()
    start, end = carets.index("^"), carets.rindex("^") + 1
    assert shown[start:end].startswith(underlined)
    assert shown[start:end] == underlined or underlined == "def entry("
    path, line, column = place.split(": ")[0].rsplit(":", 2)
    whole = linecache.getline(path, int(line))
    assert whole[int(column) - 1 :].startswith(underlined)
    assert shown.strip() == whole.strip()
    for caller in callers:
        assert ": calls " in caller


def test_all_of_an_error_and_the_chain_of_calls():
    text = """
@kernel
def area(r):
    y = r * WIDTH
    return y + r[0]

@kernel
def middle(r):
    total = 0.0
    total += area(r)
    return total

@kernel(top=True)
def entry(x: Vector):
    for i in range(3):
        x[i] = middle(x[i])
"""
    error = refusal(text, WIDTH=2.0)
    path = str(error).partition(":")[0]
    assert str(error) == (
        f"{path}:5:16: area: float has no items\n"
        "    return y + r[0]\n"
        "               ^\n"
        f"  {path}:10:14: calls area\n"
        f"  {path}:16:16: calls middle"
    )


def test_who_called_a_kernel_that_yields():
    text = """
@kernel
def each(n):
    for i in range(n):
        yield i + WRONG

@kernel(top=True)
def entry(x: Vector):
    for i in each(2):
        x[i] = 1.0 + BAD
"""
    path, *lines = str(refusal(text, WRONG="w", BAD=1.0)).splitlines()
    assert path.endswith(":5:15: each: str w is not a number")
    assert [line.partition(":")[2] for line in lines[2:]] == ["9:14: calls each"]
    path, *lines = str(refusal(text, WRONG=0, BAD="b")).splitlines()
    assert path.endswith(":10:16: entry: str b is not a number") and len(lines) == 2


def test_columns_are_characters_where_the_line_is_not_ascii():
    error = refusal("@kernel(top=True)\ndef entry(ω: Vector):\n    αβγ = ω[0]; ω[1] = αβγ + 'ü'; ω[0] = 1.0\n")
    place, shown, carets = str(error).splitlines()
    assert place.split(":")[1:3] == ["3", "24"]
    assert shown[carets.index("^") : carets.rindex("^") + 1] == "αβγ + 'ü'"
    assert "str ü is not a number" in place


def test_what_goes_over_several_lines_is_underlined_to_the_end_of_the_first():
    error = refusal("@kernel(top=True)\ndef entry(x: Vector):\n    x[0] = (x +\n        1.0)\n")
    _, shown, carets = str(error).splitlines()
    assert shown.strip() == "x[0] = (x +" and shown[carets.index("^") :] == "x +"


def test_closures_are_compiled_with_what_they_hold_and_refused_without():
    text = """
def make(factor, later=False):
    @kernel
    def scaled(v):
        return v * factor
    @kernel(top=True)
    def entry(x: Vector):
        x[0] = scaled(x[0])
    if later:
        del factor
    return entry
two, text, empty = make(2.0), make("text"), make(2.0, True)
"""
    assert "fmul" in text_of(module_of(text)["two"], "k")
    assert "str text is not a number" in str(refusal(text, "text"))
    assert "`factor` has no value here" in str(refusal(text, "empty"))


def test_stars_and_defaults_of_an_entry():
    for parameters in ("*x", "x: Vector, **y", "x: Vector, *, y: int", "x: Vector, /", "x: Vector = None"):
        scope = module_of(f"@kernel(top=True)\ndef entry({parameters}):\n    pass\n")
        with pytest.raises(TypeError, match=r"plain parameters|takes Vector"):
            text_of(scope["entry"], "k")


def test_a_class_that_only_looks_like_one_of_mathematics():
    class Odd:
        __hash__ = None

        def __call__(self):
            return 1

    assert "make it a @kernel" in str(refusal("@kernel(top=True)\ndef entry(x: Vector):\n    odd()\n", odd=Odd()))


class Kinds(NamedTuple):
    """Whose fields are no numbers."""

    x: float
    table: np.ndarray


def test_constants_that_hold_arrays_are_refused_by_name():
    constant = Kinds(1.0, np.ones(3))
    text = "@kernel(top=True)\ndef entry(x: Vector):\n    x[0] = C.x + C.table[0]\n"
    assert "has no items" in str(refusal(text, C=constant))


# ---- sources


def module_at(path, name):
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


FILE = """from sheldrake.common.kernel import Vector, kernel

@kernel
def inner(v):
    return v + 1.0

@kernel(top=True)
def entry(x: Vector):
    x[0] = inner(x[0])
"""


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda t: t.replace("1.0", "2.0"), "its source has changed since it was imported: import it anew"),
        (lambda t: t.replace("v + 1.0", "v - 1.0"), "its source has changed since it was imported"),
        (lambda t: "\n\n" + t, "its source is not there"),
        (lambda t: t.replace("return v", "return ("), "its source is not there"),
        (lambda t: "", "its source is not there"),
    ],
)
def test_a_file_that_has_changed_since_it_was_imported(tmp_path, edit, message):
    path = tmp_path / "changing.py"
    path.write_text(FILE)
    fresh = module_at(path, "changing_kernels")
    path.write_text(edit(FILE))
    os.utime(path, (time.time() + 10, time.time() + 10))
    with pytest.raises(TypeError, match=r"changing.py") as caught:
        text_of(fresh.entry, "k")
    assert message in str(caught.value)


def test_comments_and_docstrings_may_change(tmp_path):
    path = tmp_path / "commented.py"
    path.write_text(FILE)
    module = module_at(path, "commented_kernels")
    path.write_text(FILE.replace("return v + 1.0", "return v + 1.0  # more"))
    os.utime(path, (time.time() + 10, time.time() + 10))
    assert "fadd" in text_of(module.entry, "k")


def test_a_source_that_was_never_there():
    scope = {"kernel": kernel, "__name__": "nowhere"}
    exec(compile("@kernel(top=True)\ndef entry(k: int) -> int:\n    return k\n", "<nowhere>", "exec"), scope)
    with pytest.raises(TypeError, match=r"entry \(<nowhere>:1\): its source is not there. Kernels are compiled from"):
        text_of(scope["entry"], "k")


def test_math_of_python_and_numpy_is_the_same():
    text = "@kernel(top=True)\ndef entry(x: Vector):\n    x[0] = {}(x[0])\n"
    for name, other in (("math.sin", "np.sin"), ("math.atan", "np.arctan")):
        texts = [text_of(module_of(text.format(n), math=math)["entry"], "k") for n in (name, other)]
        assert texts[0] == texts[1]


def test_expressions_that_are_nested_too_deeply():
    text = f"@kernel(top=True)\ndef entry(x: Vector):\n    x[0] = {' + '.join(['x[0]'] * 900)}\n"
    with pytest.raises(TypeError, match=r"<kernel cell.entry>: an expression or the calls in it are nested too deeply"):
        text_of(module_of(text)["entry"], "k")
