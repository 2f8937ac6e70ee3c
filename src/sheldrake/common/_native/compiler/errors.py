"""What is wrong with a kernel, and where: file, line, column, the line itself, and who called it."""

from __future__ import annotations

import ast
import linecache


class KernelError(TypeError):
    """A kernel that cannot be compiled; its text has the place, the line, and the calls that led there."""

    def __init__(self, message: str, path: str, node: ast.AST) -> None:
        self.message, self.place, self.shown = message, _place(path, node), _shown(path, node)
        self.callers: list[str] = []
        super().__init__(message)

    def called_at(self, name: str, path: str, node: ast.AST) -> None:
        """Notes one more caller."""
        self.callers.append(f"  {_place(path, node)}: calls {name}")

    def __str__(self) -> str:
        return "\n".join([f"{self.place}: {self.message}", self.shown, *self.callers])


def _place(path: str, node: ast.AST) -> str:
    return f"{path}:{node.lineno}:{_column(path, node) + 1}"  # type: ignore[attr-defined]


def _column(path: str, node: ast.AST) -> int:
    """Characters before a node in its line; syntax trees count bytes."""
    line = linecache.getline(path, node.lineno)  # type: ignore[attr-defined]
    return len(line.encode()[: node.col_offset].decode())  # type: ignore[attr-defined]


def _shown(path: str, node: ast.AST) -> str:
    """The node's first line, with the node underlined."""
    line = linecache.getline(path, node.lineno).rstrip()  # type: ignore[attr-defined]
    start = _column(path, node)
    end = len(line)
    if node.end_lineno == node.lineno:  # type: ignore[attr-defined]
        end = len(line.encode()[: node.end_col_offset].decode())  # type: ignore[attr-defined]
    indent = len(line) - len(line.lstrip())
    return f"    {line.strip()}\n    {' ' * (start - indent)}{'^' * max(end - start, 1)}"
