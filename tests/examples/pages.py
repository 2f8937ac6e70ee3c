"""Runs the Python of a Markdown page and compares what it prints with the comment that says so."""

from __future__ import annotations

import ast
import contextlib
import io
import linecache
import pathlib
import re
import sys
import tokenize

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = sorted((ROOT / "docs").glob("*.md"))
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?(?!\w)")


class Wrong(AssertionError):
    """A page says one thing and its code another."""


def blocks(text):
    """Returns (line, code) of every Python block of a page."""
    found = re.finditer(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    return [(text[: match.start()].count("\n") + 2, match.group(1)) for match in found]


def _python_alone(text):
    """Returns the lines of a page, those of its words empty."""
    lines = ["\n"] * (text.count("\n") + 1)
    for first, code in blocks(text):
        own = code.splitlines(keepends=True)
        lines[first - 1 : first - 1 + len(own)] = own
    return lines


def run_page(path):
    """Runs the blocks of a page in one namespace; raises Wrong where a comment after a print does not hold.

    Every statement that prints must be followed by what it prints: a comment on its (last) line, or below it.
    Returns how many were compared.
    """
    namespace = {"__name__": "__main__"}
    compared, wrong = 0, []
    text = path.read_text(encoding="utf-8")
    linecache.cache[str(path)] = (len(text), None, _python_alone(text), str(path))  # as notebooks do: kernels are read
    for first, code in blocks(text):
        comments = _comments(code)
        for node in ast.parse(code).body:
            line = node.end_lineno
            ast.increment_lineno(node, first - 1)
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                exec(compile(ast.Module([node], []), str(path), "exec"), namespace)
            if out.getvalue():
                expected = _expected(comments, line)
                missing = f"prints {out.getvalue()!r}, and no comment says so"
                difference = missing if expected is None else compare(expected, out.getvalue())
                wrong += [f"{path.name}:{node.end_lineno}: {difference}"] if difference else []
                compared += 1
    if wrong:
        raise Wrong("\n".join(wrong))
    return compared


def compare(expected, got):
    """Says how a printed text differs from the one expected, or "": numbers may differ by one in their last digit."""
    said, is_ = NUMBER.findall(expected), NUMBER.findall(got)
    words = [" ".join(NUMBER.sub("0", text).split()) for text in (expected, got)]
    if words[0] != words[1] or len(said) != len(is_):
        return f"says {expected!r}, prints {got.strip()!r}"
    for a, b in zip(said, is_):
        mantissa, _, exponent = a.partition("e")
        unit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
        exact = "." not in a and "e" not in a
        if abs(float(a) - float(b)) > (0.0 if exact else 1.01 * unit):
            return f"says {a} but prints {b}, in {got.strip()!r}"
    return ""


def _comments(code):
    """Returns {line: (comment, whether it is alone on its line)}."""
    tokens = tokenize.generate_tokens(io.StringIO(code).readline)
    found = [token for token in tokens if token.type == tokenize.COMMENT]
    return {token.start[0]: (token.string.lstrip("# "), token.start[1] == 0) for token in found}


def _expected(comments, line):
    if line in comments:
        return comments[line][0]
    below = []
    while (line := line + 1) in comments and comments[line][1]:
        below.append(comments[line][0])
    return "\n".join(below) or None


if __name__ == "__main__":
    print(run_page(pathlib.Path(sys.argv[1])))
