"""A universal library of macOS: one file with the machine code of several kinds of processor."""

from __future__ import annotations

import struct
from collections.abc import Sequence

_MAGIC_64, _MAGIC_UNIVERSAL = 0xFEEDFACF, 0xCAFEBABE
_PAGE = 14  # libraries begin at multiples of 2**14 bytes, a page of Apple's processors


def universal_library(libraries: Sequence[bytes]) -> bytes:
    """One file of several 64-bit libraries in Apple's format, which the system chooses from.

    Raises:
        ValueError: one of them is in another format.
    """
    heads, place = [], 1 << _PAGE
    for library in libraries:
        magic, kind, version = struct.unpack_from("<III", library)
        if magic != _MAGIC_64:
            raise ValueError(f"universal_library(): one begins with {magic:#x}, not as a 64-bit library of macOS.")
        heads.append(struct.pack(">IIIII", kind, version, place, len(library), _PAGE))
        place += -(-len(library) // (1 << _PAGE)) << _PAGE
    out = struct.pack(">II", _MAGIC_UNIVERSAL, len(libraries)) + b"".join(heads)
    for library in libraries:
        out += bytes(-len(out) % (1 << _PAGE)) + library
    return out
