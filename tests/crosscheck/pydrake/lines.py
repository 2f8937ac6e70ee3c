"""Files of Python lines that must give the same in sheldrake and in pydrake: text by text, numbers to 1e-12."""

import importlib
import re
import warnings

import numpy as np

_ASSIGNMENT = re.compile(r"[A-Za-z_][\w.]*\s*=[^=]")
_ONLY_ITS_CLASS = re.compile(r"<library\.[\w.]+\.(\w+)object>")
_NUMBER = re.compile(r"-?(?:\d+\.?\d*(?:e[+-]?\d+)?|inf|nan)", re.IGNORECASE)


def answers(name, path, modules, setup=""):
    """What each line gives in a library: its text, or the kind of its error."""
    scope = {"np": np}
    for module in modules:
        loaded = importlib.import_module(f"{name}.{module}")
        public = getattr(loaded, "__all__", None) or [n for n in dir(loaded) if not n.startswith("_")]
        scope.update({n: getattr(loaded, n) for n in public})
    exec(setup, scope)
    out = {}
    with warnings.catch_warnings(), np.printoptions(precision=17, floatmode="unique", linewidth=10_000):
        warnings.simplefilter("ignore")
        for i, line in enumerate(path.read_text(encoding="utf-8").splitlines()):
            try:
                value = exec(line, scope) if _ASSIGNMENT.match(line) else eval(line, scope)
                text = re.sub(r" at 0x\w+", "", repr(value)).replace(name, "library")
            except Exception as error:
                text = type(error).__name__
            out[f"{i + 1}: {line}"] = re.sub(r"\s+", "", text)  # padding depends on digits
    return out


def same(a, b, tolerance=1e-12):
    """Whether two texts are the same up to round-off of the numbers in them.

    Of some objects Drake says the class alone, and sheldrake more.
    """
    plain = _ONLY_ITS_CLASS.fullmatch(b)
    if a == b or (plain and a.startswith(f"<{plain[1]}")):
        return True
    if _NUMBER.sub("#", a) != _NUMBER.sub("#", b):
        return False
    x, y = (np.array([float(n) for n in _NUMBER.findall(text)]) for text in (a, b))
    return bool(np.allclose(x, y, rtol=tolerance, atol=tolerance, equal_nan=True))


def differences(path, modules, setup=""):
    """The lines that give something else, with both answers."""
    mine, peers = (answers(name, path, modules, setup) for name in ("sheldrake", "pydrake"))
    assert len(peers) > 20
    return {line: (mine[line], text) for line, text in peers.items() if not same(mine[line], text)}
