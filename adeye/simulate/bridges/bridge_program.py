"""Puts a middleware between adeye and a program of the user: a program of its own for each run.

It is started with the name of the middleware and the command of the user's node. adeye talks to it
in the lines of ``adeye/channel@1``, as to any channel that is a program; the node is its child and
is asked over the middleware, one tick after the other. Deadlines are adeye's: while the node owes
an answer this waits, and it ends as soon as the node has.
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

GREETING: Final = "adeye/channel@1"
HELLO: Final = "hello.json"
"""Where the first line lies for a node, in its working folder."""
WATCH_S: Final = 0.05
"""Time between two looks at whether the node is still there [s]."""
SETTLED_S: Final = 0.2
"""How long the number of connections must have stayed the same before the first tick [s]: a node
connects one after the other."""
AGAIN_S: Final = 0.5
"""How long the first tick is waited for until it is told again [s], then twice as long: that the
ends of a middleware know each other is seen from one end only, and what the other sends before it
knows of this one is lost."""
ENDING_S: Final = 1.0
"""How long a node that has closed its connections has to end before it is told of these [s]."""
TAIL: Final = 2048
WAITING: Final = 1000
"""Answers that may wait to be read; whoever sends more has to wait."""


class BridgeError(Exception):
    """The node, or the middleware, is not there any more."""


class Peer(Protocol):
    """A middleware, with the node at the other end."""

    def open(self, hello: dict[str, Any]) -> Mapping[str, str]:
        """Begin, on the loop-back interface and apart from every other run.

        Returns:
            What the node needs in its environment to find this run.
        """
        ...

    def links(self) -> int:
        """Count the connections with the node; 0 as long as an end of them is missing."""
        ...

    def greet(self, line: bytes) -> Any:
        """Say the first line, and return what the node answers; None for nothing yet."""
        ...

    def publish(self, line: bytes, shown: dict[str, Any]) -> None:
        """Tell the node of a tick."""
        ...

    def receive(self, patience: float) -> Any:
        """Return an answer as ``adeye/channel@1`` has it, or None after some seconds."""
        ...


class Node:
    """The user's program."""

    def __init__(self, argv: Sequence[str], environment: Mapping[str, str]) -> None:
        """Start it in the group of this process, which is what adeye ends."""
        try:
            self._process = subprocess.Popen(  # noqa: S603 - what the architecture names
                list(argv),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env={**os.environ, **environment},
            )
        except OSError as error:
            msg = f"its node cannot be started: {error}"
            raise BridgeError(msg) from error
        self._said = b""
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def require(self, patience: float = 0.0) -> None:
        """Refuse to go on without it.

        Args:
            patience: How long it is waited for [s].

        Raises:
            BridgeError: It has ended.
        """
        try:
            code = self._process.wait(patience)
        except subprocess.TimeoutExpired:
            return
        self._listener.join(ENDING_S)
        lines = self._said.decode("utf-8", "replace").strip().splitlines()
        said = f": {lines[-1].strip()}" if lines else ""
        how = f"by signal {-code}" if code < 0 else f"with code {code}"
        msg = f"its node ended {how}{said}"
        raise BridgeError(msg)

    def kill(self) -> None:
        """End it, if it has not ended."""
        self._process.kill()

    def _listen(self) -> None:
        """Pass on what it prints, and keep the end of it."""
        assert self._process.stdout is not None
        fd = self._process.stdout.fileno()
        while text := os.read(fd, TAIL):
            os.write(2, text)
            self._said = (self._said + text)[-TAIL:]


def serve(peer: Peer, argv: Sequence[str], lines: Any, answer: Callable[[Any], None]) -> None:
    """Answer one line after the other until there are no more.

    Raises:
        BridgeError: The node has ended or closed its connections.
    """
    line: bytes = lines.readline()
    Path(HELLO).write_bytes(line)
    node = Node(argv, {"ADEYE_HELLO": str(Path(HELLO).resolve()), **peer.open(json.loads(line))})
    try:
        _settle(peer, node)
        content = peer.greet(line)
        while content is None:
            node.require()
            content = peer.receive(WATCH_S)
        answer(content)
        is_known = False
        for line in lines:
            shown = json.loads(line)
            early = _unasked(peer, shown["tick"])
            peer.publish(line, shown)
            again = None if is_known else partial(peer.publish, line, shown)
            answer(_answer(peer, node, shown["tick"], again) if early is None else early)
            is_known = True
    finally:
        node.kill()


def _settle(peer: Peer, node: Node) -> None:
    """Wait until the node is connected."""
    links, since = 0, time.monotonic()
    while True:
        node.require()
        found = peer.links()
        if found != links:
            links, since = found, time.monotonic()
        if links and time.monotonic() >= since + SETTLED_S:
            return
        time.sleep(0.005)


def _unasked(peer: Peer, tick: int) -> Any:
    """Return what was said before a tick is told, and answers none of those before; else None.

    An answer to the tick has a text in the place of its number: it was made without being asked.
    """
    while (content := peer.receive(0.0)) is not None:
        told = _tick_of(content)
        if told is None or told >= tick:
            return content if told is None else {**content, "tick": f"{told}, before it is asked"}
    return None


def _tick_of(content: Any) -> int | None:
    told = content.get("tick") if isinstance(content, dict) else None
    return told if type(told) is int else None


def _answer(peer: Peer, node: Node, tick: int, again: Callable[[], None] | None) -> Any:
    """Return the first answer that is not of an earlier tick, late or told twice."""
    patience, asked = AGAIN_S, time.monotonic()
    while True:
        content = peer.receive(WATCH_S)
        if content is None:
            node.require()
            if again is not None and time.monotonic() >= asked + patience:
                again()
                patience, asked = 2 * patience, time.monotonic()
            if not peer.links():
                node.require(ENDING_S)
                msg = "its node has closed its connections"
                raise BridgeError(msg)
            continue
        told = _tick_of(content)
        if told is None or told >= tick:
            return content


def main(arguments: Sequence[str]) -> None:
    """Serve the middleware that is named; what is printed goes to standard error."""
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)
    # Installed or not, the modules beside this one are those of the same adeye.
    sys.path.append(str(Path(__file__).resolve().parents[3]))

    def answer(content: Any) -> None:
        out.write(json.dumps(content, separators=(",", ":")).encode("ascii") + b"\n")

    try:
        peer: Peer = importlib.import_module(f"adeye.simulate.bridges.{arguments[1]}_peer").Peer()
        serve(peer, arguments[2:], sys.stdin.buffer, answer)
    except Exception as error:  # noqa: BLE001 - its last line of standard error is what is told
        name = "" if type(error).__name__ == BridgeError.__name__ else f"{type(error).__name__}: "
        sys.stderr.write(" ".join(f"{name}{error}".split()) + "\n")
        sys.stderr.flush()
        # Threads of a middleware must not keep it from ending.
        os._exit(1)
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv)
