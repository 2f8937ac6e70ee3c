"""numba's compiler without what kernels never use: closures, `with`, literal loops, array expressions. Imports numba.

Kernels are small functions, some 240 for one scene, so that what numba does for each of them is most of a compile.
"""

from __future__ import annotations

from typing import Any

from numba.core import typed_passes as typed
from numba.core import types
from numba.core import untyped_passes as untyped
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager
from numba.core.typing import context as typing_context

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


class TypedOnce:
    """While active, an operator or built-in function is typed once for each list of argument types.

    numba asks all its templates, NumPy's among them, at every `a * b`.
    """

    def __enter__(self) -> None:
        self.plain = plain = typing_context.BaseContext.resolve_function_type
        known: dict[tuple, Any] = {}

        def resolve(self: Any, function: Any, args: tuple, kws: dict) -> Any:
            if kws or not isinstance(function, types.Function) or any(isinstance(a, types.Dispatcher) for a in args):
                return plain(self, function, args, kws)
            key = (function, *args)
            if key not in known:
                found = plain(self, function, args, kws)
                if found is None:
                    return None
                known[key] = found
            return known[key]

        setattr(typing_context.BaseContext, "resolve_function_type", resolve)  # noqa: B010

    def __exit__(self, *_: object) -> None:
        setattr(typing_context.BaseContext, "resolve_function_type", self.plain)  # noqa: B010
