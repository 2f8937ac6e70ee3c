"""Entry kernels that run one after another, each on the named values it asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._native.binding import HERE, arguments, first_words, join
from sheldrake.common.kernel import Kernel

if TYPE_CHECKING:
    from sheldrake.common._types import KernelArgument
    from sheldrake.common.kernel import Bound

_ALL_OF_MEMORY = 2**60  # [doubles]


class Chain:
    """Kernels in turn; a status that is not 0 ends it. Their parameters' names say which of the values they take."""

    def __init__(self, kernels: Iterable[Kernel]):
        self.kernels = tuple(kernels)

    def __call__(self, **values: KernelArgument) -> int:
        """Runs the Python sources."""
        for kernel in self.kernels:
            status = kernel(*(values[name] for name in kernel.names))
            if status:
                return status
        return 0

    def bind(self, **values: KernelArgument) -> Callable[[], int]:
        """The native kernels on these very arrays, as one call without arguments."""
        blocks: dict = {}
        calls = [kernel.bind(*(values[name] for name in kernel.names), blocks=blocks) for kernel in self.kernels]

        def run() -> int:
            for call in calls:
                status = call()
                if status:
                    return status
            return 0

        return run

    def native(self, **values: KernelArgument) -> int:
        """Binds and runs once."""
        return self.bind(**values)()

    def table(self, **values: KernelArgument) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The native kernels on these very arrays, for another that calls them (`common.rows.call_row`).

        What is bound to it must keep the arrays, and begin its memory at address 0: see `bound_to_all_memory`.

        Returns:
            Addresses of the kernels, the words of all of them, and where in these each one's begin.
        """
        blocks: dict = {}
        words, at = join(arguments(k, tuple(values[name] for name in k.names), blocks)[0] for k in self.kernels)
        rows = np.array([HERE.address(kernel) for kernel in self.kernels], np.int64)
        return rows, words.placed(), np.array(at, np.int64)


def bound_to_all_memory(kernel: Kernel, *rest: Any) -> Bound:
    """A kernel of time, of memory and of `rest`, bound so that its memory begins at address 0."""
    call = kernel.bind(0.0, np.zeros(1), *rest)
    first = first_words(kernel)["memory"]
    call.keep[0][first : first + 2] = 0, _ALL_OF_MEMORY
    return call
