"""Files that other people wrote: model descriptions, mesh files, saved contexts."""

from __future__ import annotations

import functools
import pathlib
import random

from tools.torture import documents, meshes
from tools.torture.documents import DIRECTIVES, SEEDS, WHOLE, Grammar, check_parse, expand, mutate

from sheldrake.common import MemoryFile
from sheldrake.geometry import InMemoryMesh
from sheldrake.geometry._meshes.mesh_files import read_mesh
from sheldrake.geometry._meshes.mesh_source import MeshSource


@functools.cache
def _texts() -> dict[pathlib.Path, str]:
    return {path: path.read_text() for path in SEEDS}


@functools.cache
def _grammar(kind: str) -> Grammar:
    return Grammar(text for path, text in _texts().items() if path.suffix == kind)


def changed_models(chance: random.Random, number: int) -> None:
    """One of our model files after some changes; what is a model then is stepped in every fifth."""
    path = chance.choice(SEEDS)
    check_parse(path, mutate(chance, _texts()[path]), steps=number % 5 == 0)


def new_models(chance: random.Random, number: int) -> None:
    """A model file that a grammar makes, changed in every fifth; what is a model is stepped in every other."""
    kind = chance.choice((".urdf", ".sdf", ".xml", ".dmd.yaml"))
    text = expand(chance, DIRECTIVES, "directives") if kind == ".dmd.yaml" else _grammar(kind).document(chance)
    text = mutate(chance, text) if chance.random() < 0.2 else text
    check_parse(documents.MODELS / f"new{kind}", text, steps=number % 2 == 0)


@functools.cache
def _first_readings() -> None:
    """Imports of libraries are not of the time that a file takes."""
    for kind in meshes.KINDS:
        read_mesh(MeshSource(InMemoryMesh(mesh_file=MemoryFile(meshes.seed(kind), kind, "first"))))


def some_meshes(chance: random.Random, number: int) -> None:
    """A mesh file that a grammar makes, or a box with other bytes."""
    _first_readings()
    meshes.read(*meshes.some_file(chance))


@functools.cache
def _places() -> list[tuple[pathlib.Path, str, str]]:
    found = []
    for path in WHOLE:
        before = documents.messages(path, _texts()[path])
        if not (before and before[-1].startswith("error: ")):
            silent = documents.SILENT | documents.left_out(before)
            found += [(path, *place) for place in documents.unheard_of(path, silent)]
    return found


def nonsense(chance: random.Random, number: int) -> None:
    """An attribute or an element that means nothing, at each place of our files: somebody says so."""
    path, place, text = _places()[number % len(_places())]
    heard = documents.messages(path, text)
    assert any(documents.UNHEARD in message for message in heard), f"{path.name}: {place}"
