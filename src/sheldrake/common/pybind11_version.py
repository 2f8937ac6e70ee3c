"""pydrake tells here which pybind11 it was built with. sheldrake is built with none."""

__all__ = ["commit", "repository", "sha256"]

repository = ""
commit = ""
sha256 = ""
