"""Machine code where the address space is nearly full: code and its constants must be within two gigabytes."""

import platform
import subprocess
import sys

import pytest

SCRIPT = """
import ctypes
import sys

from sheldrake.common._native import disk_cache, store
from sheldrake.multibody.contact_solvers._kernels.solve import solve_to_rest

code = disk_cache.read(store._path(solve_to_rest)) or store.make(solve_to_rest)
store.initialise()
libc = ctypes.CDLL(None)
libc.mmap.restype = ctypes.c_void_p
libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_long]
libc.munmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
SIZE, NOTHING, NO_MEMORY = 4 << 30, 0, 0x4022  # of what is taken; no access; private, without a file, not reserved


def take(size):
    return libc.mmap(None, size, NOTHING, NO_MEMORY, -1, 0)


low = take(SIZE)
while take(24576) > low:  # no room left above for the code, which takes more
    pass
for k in range(1, 51):  # but for its constants
    libc.munmap(low + SIZE - 65536 * k, 20480)
link = store._by_mcjit if "MCJIT" in sys.argv else store._link
print("linked" if link(code, store.symbol_of(solve_to_rest)) else "")
"""


@pytest.mark.skipif(
    (sys.platform, platform.machine()) != ("linux", "x86_64"), reason="memory is taken by Linux's own calls, on x86"
)
@pytest.mark.parametrize("how, expected", [("", "linked\n"), ("MCJIT", "")])
def test_code_and_constants_stay_together(how, expected):
    """What MCJIT does tells that the address space is as it should be for this test."""
    found = subprocess.run([sys.executable, "-c", SCRIPT, how], capture_output=True, text=True, timeout=300)
    assert found.stdout == expected
    assert ("Assertion" in found.stderr) == (how == "MCJIT")
