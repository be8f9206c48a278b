"""Programs as channels: any language, one process for each run, lines of JSON between them."""

from adeye.channels.process.channel import MOST_PROGRAMS, ProcessChannel
from adeye.channels.process.program import command_files, find_program

__all__ = ["MOST_PROGRAMS", "ProcessChannel", "command_files", "find_program"]
