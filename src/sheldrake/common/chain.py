"""Entry kernels that run one after another, each on the named values it asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from sheldrake.common.kernel import Kernel


class Chain:
    """Kernels in turn; a status that is not 0 ends it. Their parameters' names say which of the values they take."""

    def __init__(self, kernels: Iterable[Kernel]):
        self.kernels = tuple(kernels)

    def __call__(self, **values: Any) -> int:
        """Runs the Python sources."""
        for kernel in self.kernels:
            status = kernel(*(values[name] for name in kernel.names))
            if status:
                return status
        return 0

    def bind(self, **values: Any) -> Callable[[], int]:
        """The native kernels on these very arrays, as one call without arguments."""
        calls = [kernel.bind(*(values[name] for name in kernel.names)) for kernel in self.kernels]

        def run() -> int:
            for call in calls:
                status = call()
                if status:
                    return status
            return 0

        return run

    def native(self, **values: Any) -> int:
        """Binds and runs once."""
        return self.bind(**values)()
