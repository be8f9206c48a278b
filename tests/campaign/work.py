"""Work that worker processes import: what it does is told by its task."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final, TypeVar

DIE: Final = 3
"""Exit code of a worker that is told to die."""

Task = TypeVar("Task")


class Again(Iterator[Task]):
    """Tasks that may come back after their end, as lost blocks do."""

    def __init__(self, *tasks: Task) -> None:
        self.waiting = list(tasks)

    def __next__(self) -> Task:
        if not self.waiting:
            raise StopIteration
        return self.waiting.pop(0)


def perform(task: str) -> str:
    """Do what a task says: echo its argument, die, raise, tell the pid, be signalled, hang."""
    kind, _, argument = task.partition(":")
    if kind == "die":
        os._exit(DIE)
    if kind == "raise":
        msg = f"refused {argument}"
        raise ValueError(msg)
    if kind == "interrupt":
        os.kill(os.getpid(), signal.SIGINT)
    if kind == "terminate":
        os.kill(os.getpid(), signal.SIGTERM)
    if kind == "child":
        child = subprocess.Popen([sys.executable, "-c", "import signal; signal.pause()"])
        Path(argument).write_text(str(child.pid), "utf-8")
        signal.pause()
    if kind == "ask":
        here, there = multiprocessing.Pipe()
        context = multiprocessing.get_context("fork")
        other = context.Process(target=there.send, args=(argument,))
        other.start()
        answer: str = here.recv()
        other.join()
        return answer
    if kind == "leave":
        sleeping = multiprocessing.get_context("fork").Process(target=signal.pause)
        sleeping.start()
        Path(argument).write_text(str(sleeping.pid), "utf-8")
    if kind == "hang":
        Path(argument).write_text(str(os.getpid()), "utf-8")
        signal.pause()
    return str(os.getpid()) if kind == "pid" else argument
