"""A sample of `tools/fuzz_kernels.py`: random programs, compiled against what the language's page says of them."""

from __future__ import annotations

import ast

import pytest
from tools import fuzz_kernels

from sheldrake.common._native.compiler import scalars
from sheldrake.common._native.compiler.function import Function
from sheldrake.common._native.store import can_compile

pytestmark = pytest.mark.skipif(not can_compile(), reason="compiles kernels: needs llvmlite")


def test_random_programs_do_what_the_page_says():
    report = fuzz_kernels.fuzz(120, seed=1)
    assert [f"program {f.number}: {f.what}\n{f.source}" for f in report.faults] == []
    assert report.programs == 120 and len(report.sorts) == 4
    assert report.plain > 20  # some of them are Python's too
    assert report.left > 5  # some leave an array, with bounds checks


@pytest.mark.parametrize(
    ("table", "op", "wrong"),
    [("INT_OPS", ast.Sub, "add"), ("FLOAT_COMPARE", ast.Lt, "ogt"), ("FLOAT_OPS", ast.Add, "fsub")],
)
def test_a_planted_fault_is_found(monkeypatch, table, op, wrong):
    monkeypatch.setitem(getattr(scalars, table), op, wrong)
    report = fuzz_kernels.fuzz(40, seed=2)
    assert report.faults
    assert "compiled" in report.faults[0].what


def test_programs_are_the_same_for_a_seed_and_have_all_the_grammar():
    import random

    def programs():
        return [fuzz_kernels.Program(random.Random(i), i, fuzz_kernels.SORTS[i % 4]) for i in range(200)]

    texts = [p.text() for p in programs()]
    assert texts == [p.text() for p in programs()]
    found = {type(n) for text in texts for n in ast.walk(ast.parse(text))}
    taken = {getattr(ast, name[3:]) for name in vars(Function) if name[:3] in ("do_", "of_") and hasattr(ast, name[3:])}
    assert len(taken) > 20
    assert found >= taken
    assert found >= {*scalars.SIGNS} - {ast.MatMult} | {*scalars.INT_COMPARE} | {ast.And, ast.Or, ast.Not, ast.Invert}
    assert found >= {ast.UAdd, ast.USub}
