"""The files that decide what the machine code of kernels is, and what in them decides: not docstrings, not comments.

A library is made from files; it serves as long as their code is the same. Hashes of bytes answer that at once; where
bytes differ, the code alone is compared, found by means that all Pythons have alike (positions in the syntax tree,
not the tree or its text).
"""

from __future__ import annotations

import ast
import hashlib
import io
import os
import pathlib
import tokenize
from collections.abc import Iterable

PACKAGE = pathlib.Path(__file__).resolve().parents[2]
_COMPILER = ("binding", "builtin", "instances", "lower", "methods", "target")


def compiler_files(package: pathlib.Path = PACKAGE) -> list[pathlib.Path]:
    """The compiler itself."""
    return sorted((package / "common" / "_native" / "compiler").glob("*.py"))


def source_files(package: pathlib.Path = PACKAGE) -> list[pathlib.Path]:
    """Every file that decides what the kernels' machine code is."""
    fixed = [package / "common" / name for name in ("kernel.py", "record.py", "rows.py")]
    fixed += [package / "common" / "_native" / f"{name}.py" for name in _COMPILER]
    return sorted([*fixed, *compiler_files(package), *package.rglob("_kernels/*.py")])


def source_hashes(package: pathlib.Path = PACKAGE) -> dict[str, list[str]]:
    """Of each of `source_files`, by its path: a hash of its bytes and one of its code; the same on every platform."""
    return {_name(path, package): [_hash(_bytes(path)), _code_hash(path)] for path in source_files(package)}


def is_made_from(hashes: dict[str, list[str]], package: pathlib.Path = PACKAGE) -> bool:
    """Whether the code that is installed is that of earlier `source_hashes`.

    A file more says nothing: it matters only to one that imports it, which has changed then.
    """

    def is_same(path: pathlib.Path, bytes_then: str, code_then: str) -> bool:
        return path.is_file() and (_hash(_bytes(path)) == bytes_then or _code_hash(path) == code_then)

    return all(is_same(package / name, *known) for name, known in hashes.items())


def stamps(paths: Iterable[pathlib.Path | str]) -> list[list[int]]:
    """Of each file what changes when it is written, replaced or moved: its times [ns], size and number.

    Raises:
        OSError: one is not there.
    """
    found = map(os.stat, paths)
    return [[status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino] for status in found]


def code_alone(source: str) -> str:
    """A file without docstrings and comments, and the lines that only they take."""
    given = source.splitlines()
    lines = list(given)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            row, column = token.start
            lines[row - 1] = lines[row - 1][:column].rstrip()
    removed = {i for i, line in enumerate(lines) if not line and given[i]}
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node, clean=False):
            removed |= set(range(node.body[0].lineno - 1, node.body[0].end_lineno or 0))
    return "\n".join(line for i, line in enumerate(lines) if i not in removed)


def _name(path: pathlib.Path, package: pathlib.Path) -> str:
    return path.relative_to(package).as_posix()


def _bytes(path: pathlib.Path) -> bytes:
    return path.read_bytes().replace(b"\r\n", b"\n")


def _code_hash(path: pathlib.Path) -> str:
    return _hash(code_alone(_bytes(path).decode()).encode())


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:20]
