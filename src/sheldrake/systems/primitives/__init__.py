"""Small systems to build with."""

from sheldrake.systems.primitives._vector_log import VectorLog
from sheldrake.systems.primitives._vector_log_sink import LogVectorOutput, VectorLogSink

__all__ = ["LogVectorOutput", "VectorLog", "VectorLogSink"]
