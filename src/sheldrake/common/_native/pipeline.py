"""numba's compiler without what kernels never use: closures, `with`, literal loops, array expressions. Imports numba.

Kernels are small functions, some 240 for one scene, so that what numba does for each of them is most of a compile.
"""

from __future__ import annotations

from numba.core import typed_passes as typed
from numba.core import untyped_passes as untyped
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager

PASSES: tuple[type, ...] = (
    untyped.TranslateByteCode,
    untyped.FixupArgs,
    untyped.IRProcessing,
    untyped.GenericRewrites,  # tuple[constant], x ** 2
    untyped.ReconstructSSA,
    typed.NopythonTypeInference,
    typed.PreLowerStripPhis,
    typed.NoPythonSupportedFeatureValidation,
    typed.IRLegalization,
    typed.NativeLowering,
    typed.NoPythonBackend,
)


class KernelCompiler(CompilerBase):
    """The passes a kernel goes through."""

    def define_pipelines(self) -> list[PassManager]:
        """The one list of passes."""
        passes = PassManager("kernel")
        for each in PASSES:
            passes.add_pass(each, each.__name__)
        passes.finalize()
        self.state.type_annotation = None
        return [passes]
