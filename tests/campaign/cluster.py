"""A Dask cluster of real processes, of which any may be killed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.project import ROOT


class Cluster:
    """A scheduler and its workers, each a process without a guard that starts it again."""

    def __init__(self, folder: Path) -> None:
        """Start the scheduler at an address of its own choice."""
        self._environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        self._file = folder / "scheduler.json"
        self._folder = folder
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", "0")
        self.workers: list[subprocess.Popen[bytes]] = []
        while not self._file.exists() or not self._file.read_bytes():
            assert self.scheduler.poll() is None, "the scheduler has ended"

    @property
    def address(self) -> str:
        """Where the scheduler is."""
        return str(json.loads(self._file.read_text("utf-8"))["address"])

    def add_worker(self, *more: str) -> subprocess.Popen[bytes]:
        """Start a worker with one thread.

        Args:
            more: Options of ``dask worker``.
        """
        options = ("--no-nanny", "--nthreads", "1", "--memory-limit", "0", *more)
        self.workers.append(self._start("worker", *options))
        return self.workers[-1]

    def close(self) -> None:
        """Kill whatever is left."""
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()

    def _start(self, kind: str, *options: str) -> subprocess.Popen[bytes]:
        module = f"distributed.cli.dask_{kind}"
        command = [sys.executable, "-m", module, "--scheduler-file", str(self._file)]
        return subprocess.Popen(
            [*command, "--no-dashboard", *options],
            env=self._environment,
            cwd=self._folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )


@contextmanager
def started_cluster(folder: Path, workers: int) -> Iterator[Cluster]:
    """Start a cluster, and leave no process of it."""
    folder.mkdir(parents=True, exist_ok=True)
    cluster = Cluster(folder)
    try:
        for _ in range(workers):
            cluster.add_worker()
        yield cluster
    finally:
        cluster.close()
