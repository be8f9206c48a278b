"""The verbs of a walk, forked from one process that has imported them.

A page calls ``adeye`` many times, and most of what such a call takes is the imports. So a walk
starts one server; its ``adeye`` hands arguments, environment, folder and files over to it, and ends
as the child ends that the server forks. The child runs what the console script runs.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import json
import os
import shlex
import signal
import socket
import subprocess
import sys
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).resolve().parent.parent

_CLIENT: Final = """\
import array, json, os, signal, socket, sys
end = socket.socket(socket.AF_UNIX)
end.connect(sys.argv[1])
asked = {"arguments": sys.argv[2:], "folder": os.getcwd(), "environment": dict(os.environ)}
text = json.dumps(asked).encode()
files = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", [0, 1, 2]))]
end.sendmsg([len(text).to_bytes(8, "big")], files)
end.sendall(text)
child = int.from_bytes(end.recv(8), "big")
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, lambda sent, _: os.kill(child, sent))
said = end.recv(1)
sys.exit(said[0] if said else 137)
"""
"""What ``adeye`` of a walk is: no more than the standard library, so that it starts at once."""


@contextlib.contextmanager
def serving(folder: Path) -> Iterator[str]:
    """Start the server; give the command that calls it.

    Args:
        folder: For its socket and the client.
    """
    client, place = folder / "client.py", folder / "served"
    client.write_text(_CLIENT, "utf-8")
    source = "import sys; from docs.served import serve; serve(sys.argv[1])"
    process = subprocess.Popen(  # noqa: S603 - this interpreter
        [sys.executable, "-c", source, str(place)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    try:
        if process.stdout is None or not process.stdout.readline():
            msg = f"the server of the walk ended with {process.wait()}"
            raise RuntimeError(msg)
        words = [sys.executable, "-I", "-S", str(client), str(place)]
        yield " ".join(map(shlex.quote, words))
    finally:
        process.terminate()
        process.communicate()


def serve(place: str) -> None:
    """Fork a child for each that asks, until the process is ended."""
    _load(Path(place).parent)
    gc.freeze()
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    listening = socket.socket(socket.AF_UNIX)
    listening.bind(place)
    listening.listen(64)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while True:
        end, _ = listening.accept()
        if os.fork() == 0:
            listening.close()
            _child(end)
        end.close()


def _load(folder: Path) -> None:
    """Have in memory what verbs import and their machine code: run and report a campaign once."""
    from adeye.cli.app import main

    files = ["--db", str(folder / "once.db"), "--report", str(folder / "once.html")]
    arguments = ["run", str(ROOT / "odd" / "motorway_chauffeur.yaml"), "--quiet", *files]
    with (
        open(os.devnull, "w") as nothing,  # noqa: PTH123
        contextlib.redirect_stdout(nothing),
        contextlib.redirect_stderr(nothing),
    ):
        code = main([*arguments, "--threads", "1"])
    if code:
        msg = f"a campaign cannot be run: exit code {code}"
        raise RuntimeError(msg)


def _child(end: socket.socket) -> None:
    code = 70
    try:
        asked = _received(end)
        end.sendall(os.getpid().to_bytes(8, "big"))
        code = _verb(asked)
    except BaseException:  # noqa: BLE001 - a child must never return into the loop
        traceback.print_exc()
    finally:
        with contextlib.suppress(OSError):
            end.sendall(bytes([code]))
        os._exit(code)


def _received(end: socket.socket) -> dict[str, Any]:
    """Take over files, and read what is asked."""
    head, files, _, _ = socket.recv_fds(end, 8, 3)
    for number, file in enumerate(files):
        os.dup2(file, number)
        os.close(file)
    sys.stdin, sys.stdout = open(0, closefd=False), open(1, "w", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", buffering=1, closefd=False)  # noqa: SIM115
    left, parts = int.from_bytes(head, "big"), []
    while left:
        parts.append(end.recv(left))
        left -= len(parts[-1])
    asked: dict[str, Any] = json.loads(b"".join(parts))
    return asked


def _verb(asked: dict[str, Any]) -> int:
    from adeye.cli.app import main

    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    os.chdir(asked["folder"])
    os.environ.clear()
    os.environ.update(asked["environment"])
    # As where the interpreter is started: plug-ins of the project can be imported, by workers, too.
    sys.path[0] = asked["folder"]
    sys.argv = ["adeye", *asked["arguments"]]
    code = main(asked["arguments"])
    # ``os._exit`` leaves them out.
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError):
            stream.flush()
    return code
