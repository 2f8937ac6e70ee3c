"""Mathematical programs and solvers. Nothing of it exists yet; the module does, so that scripts may import it."""

__all__: list[str] = []
