"""Which machine code is made: platforms, and levels of processors within them. Imports llvmlite when asked for more.

Kernels are compiled for a level, not for the very processor, so that the prebuilt library, the cache and a fresh
compile give the same bits.
"""

from __future__ import annotations

import functools
import platform
import re
import sys
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from llvmlite.binding import TargetMachine

LIBM = frozenset(
    "sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp exp2 expm1 log log2 log10 log1p pow sqrt "
    "floor ceil trunc round fabs fmod fma fmin fmax hypot cbrt copysign ldexp memset memcpy memmove".split()
)
"""The only symbols a kernel may leave to the linker: kernels allocate nothing and call nobody."""


class Target(NamedTuple):
    """One kind of machine code."""

    triple: str
    level: int
    cpu: str
    features: str = ""
    reloc: str = "pic"
    abi: str = ""

    def machine(self) -> TargetMachine:
        """LLVM's target machine."""
        import llvmlite.binding as llvm

        initialise()
        target = llvm.Target.from_triple(self.triple)
        return target.create_target_machine(
            cpu=self.cpu, features=self.features, opt=3, reloc=self.reloc, codemodel="default", abiname=self.abi
        )


NO_COMPILER = (
    "kernels that are not prebuilt must be compiled, which needs llvmlite: pip install 'sheldrake[kernels]'. "
    "`sheldrake info` says which kernels are prebuilt, and why others are not."
)
X86_LEVELS = {1: "x86-64", 3: "x86-64-v3"}
V3_FEATURES = {"bmi": "bmi1", "lzcnt": "abm"} | {name: name for name in "avx avx2 bmi2 f16c fma movbe".split()}
"""What level 3 needs, as LLVM calls it, and as Linux does."""
_ONE_PROCESSOR = 8192
"""Bytes in which /proc/cpuinfo has said all of its first processor."""


@functools.cache
def initialise() -> None:
    """Registers LLVM's code generators, all of them, once per process."""
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    llvm.initialize_native_asmparser()


@functools.cache
def host() -> Target:
    """The target of this process.

    Raises:
        ModuleNotFoundError: if nothing is there that could compile for it.
    """
    llvm = _llvm()
    triple = llvm.get_process_triple()
    kind, level = processor()
    if kind == "x86_64":
        return Target(triple, level, X86_LEVELS[level])
    return Target(triple, level, "apple-m1" if "apple" in triple else "generic")


def _llvm() -> Any:
    try:
        import llvmlite.binding
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(NO_COMPILER, name="llvmlite") from error
    return llvmlite.binding


def compiler_version() -> str:
    """That of llvmlite, without loading LLVM.

    Raises:
        ModuleNotFoundError: if it is not installed.
    """
    try:
        import llvmlite
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(NO_COMPILER, name="llvmlite") from error
    return llvmlite.__version__


@functools.cache
def processor() -> tuple[str, int]:
    """The kind of this process's processor, and its level; on Linux and x86-64 without loading LLVM.

    Raises:
        ModuleNotFoundError: if nothing is there that could compile for it.
    """
    flags = _flags_of_linux()
    if flags:
        return "x86_64", 3 if flags.issuperset(V3_FEATURES.values()) else 1
    llvm = _llvm()
    kind = llvm.get_process_triple().split("-")[0]
    features = llvm.get_host_cpu_features() if kind == "x86_64" else {}
    return kind, 3 if features and all(features.get(f, False) for f in V3_FEATURES) else 1


def _flags_of_linux() -> frozenset[str]:
    """What Linux says that the first processor can; nothing elsewhere, or where that is no x86-64."""
    if sys.platform != "linux" or platform.machine() != "x86_64":
        return frozenset()
    try:
        with open("/proc/cpuinfo", "rb") as file:
            found = re.search(rb"^flags\s*:(.*)$", file.read(_ONE_PROCESSOR), re.MULTILINE)
    except OSError:
        return frozenset()
    return frozenset(found[1].decode().split()) if found else frozenset()
