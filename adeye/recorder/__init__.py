"""Writes a batch tick by tick into the columns of a trace."""

from adeye.recorder.columns import TRACKS, Memory, Recorder, trace_bytes

__all__ = ["TRACKS", "Memory", "Recorder", "trace_bytes"]
