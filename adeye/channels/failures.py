"""Which runs a channel has failed in, since when and how; a failed channel stays silent."""

from __future__ import annotations

import os
import traceback
from pathlib import Path
from typing import Final

import numpy as np

from adeye.signals import SILENT, Bools, ControlCommand
from adeye.trace import ChannelEvent

ERROR: Final = "channel_error"
INVALID_OUTPUT: Final = "channel_invalid_output"
KILLED: Final = "channel_killed"
TIMEOUT: Final = "channel_timeout"
MAX_DETAIL: Final = 500
"""Longest detail that is kept [characters]."""
_LONGEST_NAME: Final = 100
_ADEYE: Final = f"{Path(__file__).parents[1]}{os.sep}"


class Failures:
    """The first failure of one channel in each run of a batch.

    Attributes:
        channel: Id of the channel.
        events: (B) first failure in each run, or None.
        silent: (B,) whether it has failed.
    """

    def __init__(self, channel: str, runs: int) -> None:
        self.channel = channel
        self.events: list[ChannelEvent | None] = [None] * runs
        self.silent: Bools = np.zeros(runs, dtype=np.bool_)

    def add(
        self,
        runs: Bools,
        outcome: str,
        time: float,
        detail: str,
        *,
        is_machine_dependent: bool = False,
    ) -> None:
        """Record a failure in the runs (B,) that have none yet.

        Args:
            runs: (B,) where it happened.
            outcome: ``channel_error``, ``channel_invalid_output``, ``channel_killed`` or
                ``channel_timeout``.
            time: [s].
            detail: What was wrong.
            is_machine_dependent: Whether it may be the machine's speed or load that it shows.
        """
        event = ChannelEvent(outcome, self.channel, time, detail[:MAX_DETAIL], is_machine_dependent)
        for run in np.flatnonzero(runs & ~self.silent):
            self.events[run] = event
        self.silent |= runs

    def hold(self, command: ControlCommand, previous: ControlCommand) -> ControlCommand:
        """Return the command with the failed runs silent: no new values, stamp frozen.

        Args:
            command: Newest command; its values in failed runs are not used.
            previous: The command before it.
        """
        return silenced(command, previous, self.silent)


def silenced(command: ControlCommand, previous: ControlCommand, runs: Bools) -> ControlCommand:
    """Return a command that is silent in some runs: no new values, stamp frozen.

    Args:
        command: The command; it is returned itself if no run is to be silent.
        previous: The last command before; its values stand in the silent runs.
        runs: (B,) runs to silence.
    """
    if not runs.any():
        return command
    quiet = command.copy()
    quiet.acceleration[runs] = previous.acceleration[runs]
    quiet.steering_angle[runs] = previous.steering_angle[runs]
    quiet.stamp[runs] = previous.stamp[runs]
    quiet.status[runs] = SILENT
    if quiet.monitors is not None:
        quiet.monitors[runs] = False
    for extra in (quiet.plan, quiet.tracks, quiet.candidates, quiet.candidate_costs):
        if extra is not None:
            extra[runs] = np.nan
    if quiet.chosen is not None:
        quiet.chosen[runs] = -1
    return quiet


def describe(error: BaseException) -> str:
    """Say what an exception is and where it was raised, without folders.

    Paths are left out because the text is stored with results that must not depend on a machine.
    """
    frame = _own_frame(traceback.extract_tb(error.__traceback__))
    place = "" if frame is None else f" ({_folder_and_name(frame)[1]}:{frame.lineno})"
    kind = type(error).__name__[:_LONGEST_NAME]
    try:
        said = str(error)[:MAX_DETAIL]
    except Exception:  # noqa: BLE001 - it is described, not obeyed
        said = "it cannot say what it is"
    # A text that no encoding takes, or that ends early in the database, is shown escaped.
    said = said.encode("utf-8", "backslashreplace").decode().replace("\0", "\\0")
    # However much it says, the place is told.
    return f"{kind}: {said[: MAX_DETAIL - len(kind) - len(place) - 2]}{place}"


def _own_frame(frames: traceback.StackSummary) -> traceback.FrameSummary | None:
    """Find the innermost frame of the guest's own files, not of a library that it calls."""
    guest = [frame for frame in frames if not frame.filename.startswith(_ADEYE)]
    home = _folder_and_name(guest[0])[0] if guest else ""
    own = [
        frame
        for frame in guest
        if _folder_and_name(frame)[0].startswith(home)
        and "site-packages/" not in _folder_and_name(frame)[0][len(home) :]
    ]
    return own[-1] if own else frames[-1] if frames else None


def _folder_and_name(frame: traceback.FrameSummary) -> tuple[str, str]:
    folder, slash, name = frame.filename.replace("\\", "/").rpartition("/")
    return folder + slash, name
