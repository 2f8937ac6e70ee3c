"""The syntax tree of a kernel, and which of its variables need memory."""

from __future__ import annotations

import ast
import functools
import linecache
import types
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple


class Source(NamedTuple):
    """A function's syntax tree; its lines and columns are those of the file."""

    path: str
    tree: ast.FunctionDef | ast.Lambda
    parameters: tuple[str, ...]
    variables: frozenset[str]  # what only statements give values to
    slotted: frozenset[str]  # what needs memory
    body: list[ast.stmt]
    expression: ast.expr | None  # what it returns, if that is all it does
    yields: int  # in how many places


@functools.cache
def source_of(function: types.FunctionType) -> Source:
    """The syntax tree of a function.

    Raises:
        TypeError: if its source is not to be had, or is not what the function was made from.
    """
    code = function.__code__
    path = code.co_filename
    linecache.checkcache(path)
    text = "".join(linecache.getlines(path, function.__globals__))
    try:
        found = _functions(path, text).get((code.co_name, code.co_firstlineno))
    except SyntaxError:  # not what was compiled
        found = None
    where = f"{function.__qualname__} ({path}:{code.co_firstlineno})"
    if found is None:
        raise TypeError(f"{where}: its source is not there. Kernels are compiled from files and cells of notebooks.")
    tree, made = found
    if not _is_same(made, code) and not any(_is_same(alone, code) for alone in _made_alone(path, text, code)):
        raise TypeError(f"{where}: its source has changed since it was imported: import it anew.")
    if isinstance(tree, ast.Lambda):  # of the prelude: one on a line
        body: list[ast.stmt] = [ast.copy_location(ast.Return(tree.body), tree.body)]
    else:
        body = tree.body[1:] if ast.get_docstring(tree, clean=False) is not None else tree.body
    only = body[0].value if len(body) == 1 and isinstance(body[0], ast.Return) else None
    parameters = tuple(a.arg for a in tree.args.args)
    yields = sum(isinstance(n, (ast.Yield, ast.YieldFrom)) for s in body for n in ast.walk(s))
    return Source(path, tree, parameters, *_names(body, parameters), body, only, yields)


def _is_same(made: types.CodeType, code: types.CodeType) -> bool:
    one, other = ((c.co_code, c.co_names, c.co_varnames, c.co_freevars, _constants(c)) for c in (made, code))
    return one == other


def _made_alone(path: str, text: str, code: types.CodeType) -> Iterator[types.CodeType]:
    """A function of a notebook's cell as it is made there: statement by statement.

    Python writes `np.sin(x)` in another way where it sees that `np` is imported.
    """
    for statement in ast.parse(text, path).body:
        if (statement.end_lineno or 0) >= code.co_firstlineno:
            whole = compile(ast.Module([statement], []), path, "exec", dont_inherit=True)
            yield from (
                c for c in _codes(whole) if (c.co_name, c.co_firstlineno) == (code.co_name, code.co_firstlineno)
            )
            return


def _constants(code: types.CodeType) -> list[str]:
    return [repr(c) for c in code.co_consts if not isinstance(c, types.CodeType)]


@functools.lru_cache(maxsize=512)
def _functions(path: str, text: str) -> dict[tuple[str, int], tuple[ast.FunctionDef | ast.Lambda, types.CodeType]]:
    """Functions of a file by name and first line."""
    tree = ast.parse(text, path)
    trees = {_key(n): n for n in ast.walk(tree) if isinstance(n, (ast.FunctionDef, ast.Lambda))}
    codes = {(c.co_name, c.co_firstlineno): c for c in _codes(compile(text, path, "exec", dont_inherit=True))}
    return {key: (trees[key], codes[key]) for key in trees.keys() & codes.keys()}


def _key(function: ast.FunctionDef | ast.Lambda) -> tuple[str, int]:
    """The name and the first line that Python gives to a function."""
    if isinstance(function, ast.Lambda):
        return "<lambda>", function.lineno
    return function.name, min([function.lineno, *(d.lineno for d in function.decorator_list)])


def _codes(code: types.CodeType) -> Iterator[types.CodeType]:
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _codes(constant)


def _names(body: list[ast.stmt], parameters: tuple[str, ...]) -> tuple[frozenset[str], frozenset[str]]:
    """Variables that are no parameters, and all that are read, and stored more than once.

    What is stored once is there wherever it is read: `Body.known` makes sure of that.
    """
    nodes = [n for s in body for n in ast.walk(s)]
    names = [n for n in nodes if isinstance(n, ast.Name)]
    stores = Counter([*parameters, *(n.id for n in names if isinstance(n.ctx, ast.Store))])
    changed = {n.target.id for n in nodes if isinstance(n, ast.AugAssign) and isinstance(n.target, ast.Name)}
    read = changed | {n.id for n in names if isinstance(n.ctx, ast.Load)}
    return frozenset(stores.keys() - set(parameters)), frozenset(name for name in read if stores[name] > 1)
