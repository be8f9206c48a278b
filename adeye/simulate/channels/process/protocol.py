"""What programs are told and what they answer: one line of JSON each, ``adeye/channel@1``.

The same lines are what ``adeye replay --dump`` saves and what ``adeye.testing.feed`` reads. Numbers
are in SI units and keep every bit; what is not a number is null, what is infinite is 1e999.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from pydantic import BaseModel

from adeye.identity import unique_keys
from adeye.ports import ScalarCommand
from adeye.signals import OK, REASON_LABELS, STATUS_LABELS

if TYPE_CHECKING:
    from typing import BinaryIO

    from numpy.typing import NDArray

    from adeye.ports import ChannelContext, ControlChannel
    from adeye.signals import ControlCommand, Measurement, Observation

# --- What programs are told and what they answer: one line of JSON each, ``adeye/channel@1`` ------

PROTOCOL: Final = "adeye/channel@1"
"""Name and version; the version is raised when a line changes its meaning."""
_COMMAND: Final = ("tick", "acceleration", "steering_angle", "status")
_NEEDED: Final = frozenset(_COMMAND[:3])
_SHOWN: Final = 60
"""How much of a wrong answer a message repeats [characters]."""


def encode(content: dict[str, Any]) -> bytes:
    r"""Write one line.

    >>> encode({"tick": 0, "gap": float("inf"), "speed": float("nan")})
    b'{"tick":0,"gap":1e999,"speed":null}\n'
    """
    text = json.dumps(content, ensure_ascii=True, separators=(",", ":"), default=_plain)
    if "Infinity" in text or "NaN" in text:
        text = json.dumps(_spelled(content), ensure_ascii=True, separators=(",", ":"))
        text = text.replace('"\\u0000"', "1e999").replace('"-\\u0000"', "-1e999")
    return text.encode("ascii") + b"\n"


def hello(context: ChannelContext, run: int) -> dict[str, Any]:
    """Return the first line that a program is sent: what is known before the drive.

    Args:
        context: Of the batch.
        run: Which of its runs.
    """
    parameters = context.parameters[run]
    return {
        "hello": PROTOCOL,
        "channel": context.channel_id,
        "step": context.step,
        "period": context.period,
        "parameters": _record(parameters),
        "desired_speed": float(context.desired_speed[run]),
        "links": list(context.links),
        "sensors": {
            name: {
                "kind": kind,
                "model": context.models.get(name, kind),
                "mount": _listed(context.mounts[name][run]) if name in context.mounts else None,
                "data_sheet": {
                    field: float(values[run])
                    for field, values in context.data_sheets.get(name, {}).items()
                }
                if name in context.data_sheets
                else None,
            }
            for name, kind in context.sensors.items()
        },
        "vehicle": context.vehicles[run].model_dump(mode="json"),
        "road": {
            name: _listed(value) if isinstance(value, np.ndarray) else value
            for name, value in context.road.told(run).items()
        },
    }


def observation_shown(observation: Observation, run: int, tick: int) -> dict[str, Any]:
    """Return the line of one observation of one run.

    Args:
        observation: Of the batch.
        run: Which of its runs.
        tick: How many observations the channel had before in this run.
    """
    authority = observation.authority
    return {
        "tick": tick,
        "time": observation.time,
        "sensors": {
            name: _measurement(item, run) for name, item in observation.measurements.items()
        },
        "channels": {name: _command(item, run) for name, item in observation.commands.items()},
        "switch": None
        if authority is None
        else {
            "authority": int(authority.channel[run]),
            "reason": REASON_LABELS[int(authority.reason[run])],
        },
    }


def wrong_hello(line: bytes, version: str = "") -> str:
    """Say what is wrong with a program's answer to the first line; empty if nothing is.

    Args:
        line: Without its line feed.
        version: What it must say that it is; empty where its content is known.
    """
    content, wrong = _read(line)
    if wrong:
        return wrong
    wanted = {"hello": PROTOCOL, **({"version": version} if version else {})}
    for key, word in wanted.items():
        if content.get(key) != word:
            return f"its first line says {key} {_short(content.get(key))}, not {word!r}"
    return _unknown(content, tuple(wanted))


def read_command(line: bytes, tick: int) -> tuple[ScalarCommand | None, str]:
    """Read a program's answer to an observation.

    Args:
        line: Without its line feed.
        tick: Of the observation that it must answer.

    Returns:
        The command, or what is wrong with it.
    """
    content, wrong = _read(line)
    wrong = wrong or _unknown(content, _COMMAND)
    missing = sorted(_NEEDED - set(content))
    if wrong or missing:
        return None, wrong or f"it lacks {', '.join(missing)}"
    if content["tick"] is True or content["tick"] != tick:
        return None, f"it answers tick {_short(content['tick'])}, not {tick}"
    for name in ("acceleration", "steering_angle"):
        if not _is_number(content[name]):
            return None, f"{name} {_short(content[name])} is no finite number"
    status = content.get("status", STATUS_LABELS[OK])
    if status not in STATUS_LABELS:
        return None, f"status {_short(status)} is none of {', '.join(STATUS_LABELS)}"
    return (
        ScalarCommand(
            float(content["acceleration"]),
            float(content["steering_angle"]),
            STATUS_LABELS.index(status),
        ),
        "",
    )


def _read(line: bytes) -> tuple[dict[str, Any], str]:
    try:
        content = json.loads(
            line.decode("utf-8"), parse_constant=_refuse, object_pairs_hook=unique_keys
        )
    except (ValueError, RecursionError) as error:
        why = f": {error}" if type(error) is ValueError else ""
        return {}, f"{_short(line.decode('utf-8', 'replace'))} is no line of JSON{why}"
    if not isinstance(content, dict):
        return {}, f"{_short(content)} is no JSON object"
    return content, ""


def _refuse(word: str) -> None:
    msg = f"{word} is no JSON"
    raise ValueError(msg)


def _unknown(content: dict[str, Any], known: tuple[str, ...]) -> str:
    others = sorted(set(content) - set(known))
    return f"there is no key {_short(others[0])}; known are {', '.join(known)}" if others else ""


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…"


def _measurement(item: Measurement, run: int) -> dict[str, Any]:
    content = {
        "stamp": float(item.stamp[run]),
        "fresh": bool(item.fresh[run]),
        "alive": bool(item.alive[run]),
        "most": int(item.mask.shape[1]),
        "detections": _listed(item.detections[run][item.mask[run]]),
    }
    return content | _given(item, run, "estimate", "values", "points")


def _command(item: ControlCommand, run: int) -> dict[str, Any]:
    content: dict[str, Any] = {
        "acceleration": float(item.acceleration[run]),
        "steering_angle": float(item.steering_angle[run]),
        "stamp": float(item.stamp[run]),
        "status": STATUS_LABELS[int(item.status[run])],
    }
    return content | _given(item, run, "plan", "monitors", "tracks")


def _given(item: Measurement | ControlCommand, run: int, *names: str) -> dict[str, Any]:
    every = {name: getattr(item, name) for name in names}
    return {name: _listed(rows[run]) for name, rows in every.items() if rows is not None}


def _listed(values: NDArray[Any]) -> list[Any]:
    listed: list[Any] = np.asarray(values).tolist()
    return listed


def _record(parameters: Any) -> dict[str, Any]:
    if isinstance(parameters, BaseModel):
        return parameters.model_dump(mode="json")
    return dict(parameters or {})


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else str(value)


def _spelled(value: Any) -> Any:
    """Replace what JSON has no number for."""
    if isinstance(value, dict):
        return {name: _spelled(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_spelled(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        if math.isnan(value):
            return None
        # No text holds a null byte: YAML refuses them.
        return "\0" if value > 0.0 else "-\0"
    return value


# --- Writes down what a channel is shown, whatever its kind, as the lines that a program would
# get.


class Witness:
    """Takes down what one channel is shown in the first run of a batch.

    Attributes:
        channel: Id of the channel.
    """

    def __init__(self, channel: str, stream: BinaryIO) -> None:
        """Prepare.

        Args:
            channel: Id of the channel.
            stream: Where the lines go.
        """
        self.channel = channel
        self._stream = stream
        self._tick = 0

    def begin(self, context: ChannelContext, kind: str) -> None:
        """Take down what is known before the drive, and the kind of the channel.

        Args:
            context: Of the batch.
            kind: As the architecture has it.
        """
        self._tick = 0
        self._stream.write(encode({**hello(context, 0), "kind": kind}))

    def take(self, observation: Observation) -> None:
        """Take down an observation."""
        if observation.running[0]:
            self._stream.write(encode(observation_shown(observation, 0, self._tick)))
            self._tick += 1


class WitnessedChannel:
    """A channel under the eyes of a witness; it answers as it does without."""

    def __init__(self, channel: ControlChannel, kind: str, witness: Witness) -> None:
        """Wrap a channel.

        Args:
            channel: The channel.
            kind: As the architecture has it.
            witness: Who takes down what it is shown.
        """
        self._channel = channel
        self._kind = kind
        self._witness = witness
        self.monitor_ids: tuple[str, ...] = tuple(channel.monitor_ids)

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        self._witness.begin(context, self._kind)
        self._channel.reset(context)

    def act(self, observation: Observation) -> ControlCommand:
        """Answer one observation."""
        self._witness.take(observation)
        return self._channel.act(observation)
