"""zenoh between adeye and a node: the lines of ``adeye/channel@1`` as messages.

The node connects with the configuration that ``ZENOH_CONFIG`` names, subscribes to
``{ADEYE_KEY}/observation`` and puts its answers to ``{ADEYE_KEY}/command``.
"""

from __future__ import annotations

import json
import queue
import socket
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from uuid import uuid4

import zenoh

from adeye.simulate.bridges.bridge_program import WAITING

if TYPE_CHECKING:
    from collections.abc import Mapping

CONFIG: Final = "zenoh.json5"
_TRIES: Final = 20


class Peer:
    """A session that listens at a port of its own, and finds nobody by itself."""

    def __init__(self) -> None:
        """Prepare."""
        self._answers: queue.Queue[Any] = queue.Queue(WAITING)

    def open(self, hello: dict[str, Any]) -> Mapping[str, str]:
        """Listen, and write down how the node connects."""
        del hello
        key = f"adeye/{uuid4().hex}"
        self._session, endpoint = _listening()
        self._subscriber = self._session.declare_subscriber(f"{key}/command", self._hear)
        self._publisher = self._session.declare_publisher(
            f"{key}/observation",
            congestion_control=zenoh.CongestionControl.BLOCK,
            reliability=zenoh.Reliability.RELIABLE,
            express=True,
        )
        Path(CONFIG).write_text(
            json.dumps({**_alone(), "mode": "client", "connect": {"endpoints": [endpoint]}})
        )
        return {"ZENOH_CONFIG": str(Path(CONFIG).resolve()), "ADEYE_KEY": key}

    def links(self) -> int:
        """Tell whether the node has subscribed."""
        return int(self._publisher.matching_status.matching)

    def greet(self, line: bytes) -> Any:
        """Send the first line; the node answers it as any other."""
        self._publisher.put(line)

    def publish(self, line: bytes, shown: dict[str, Any]) -> None:
        """Send the line of a tick."""
        del shown
        self._publisher.put(line)

    def receive(self, patience: float) -> Any:
        """Return what the node has put; what is no JSON as a text."""
        try:
            return self._answers.get(timeout=patience)
        except queue.Empty:
            return None

    def _hear(self, sample: Any) -> None:
        payload = sample.payload.to_bytes()
        try:
            content = json.loads(payload)
        except (ValueError, RecursionError):
            content = payload.decode("utf-8", "replace")
        # A full queue keeps the session, and with it who floods it, waiting.
        self._answers.put("null" if content is None else content)


def _alone() -> dict[str, Any]:
    off = {"enabled": False}
    return {"scouting": {"multicast": off, "gossip": off}}


def _listening() -> tuple[Any, str]:
    """Open a session at a free port, which another may have taken meanwhile."""
    for left in reversed(range(_TRIES)):
        with socket.create_server(("127.0.0.1", 0)) as probe:
            endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
        told = {**_alone(), "mode": "router", "listen": {"endpoints": [endpoint]}}
        try:
            return zenoh.open(zenoh.Config.from_json5(json.dumps(told))), endpoint
        except zenoh.ZError:
            if not left:
                raise
    raise AssertionError
