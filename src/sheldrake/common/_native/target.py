"""Which machine code is made: platforms, and levels of processors within them. Imports llvmlite when asked for more.

Kernels are compiled for a level, not for the very processor, so that the prebuilt library, the cache and a fresh
compile give the same bits.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

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
V3_FEATURES = ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")


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
    try:
        import llvmlite.binding as llvm
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(NO_COMPILER, name="llvmlite") from error

    triple = llvm.get_process_triple()
    if triple.startswith("x86_64"):
        features = llvm.get_host_cpu_features()
        level = 3 if all(features.get(f, False) for f in V3_FEATURES) else 1
        return Target(triple, level, X86_LEVELS[level])
    return Target(triple, 1, "apple-m1" if "apple" in triple else "generic")
