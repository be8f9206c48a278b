"""A recorded run as other programs are given it: every field, pinned."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf.text_format import MessageToString
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from osi3trace.osi_trace import OSITrace

from adeye.exchange.commonroad import write_commonroad
from adeye.exchange.mcap import write_mcap
from adeye.exchange.osi import write_osi
from adeye.exchange.view import Account, Remark, RunView
from adeye.trace import Trace
from tests.exchange.handed import in_left_hand_traffic, with_camera
from tests.frozen import assert_frozen, masked
from tests.judge.conftest import HandMade

ACCOUNT = Account(
    run="ab" * 32,
    about={"scenario": "follow", "fault": "none"},
    remarks=(
        Remark(0.25, "info", "switch", "authority to safety"),
        Remark(9.0, "error", "FSR-01", "FAIL: ttc >= 1 s"),
    ),
    metrics={"min_ttc_s": None, "contact": 0.0},
)
SHOWN = (0, 4)
"""Messages of each kind that are written out."""


def nine_digits(text: str) -> str:
    """Round what is written with more digits."""
    return re.sub(r"-?\d+\.\d{7,}(?:e-?\d+)?", lambda found: f"{float(found[0]):.9g}", text)


@pytest.fixture
def trace() -> Trace:
    """A turning ego that sees one of two objects from row 3 on; a safety channel takes over."""
    made = HandMade(rows=9, objects=("lead", "block"), tail_rows=2)
    made.ego(heading=0.3, d=5.25, acceleration=-1.5, steering_angle=0.04)
    made.columns["ego"][0, :, 6] = 0.05
    made.object("lead", size=(12.0, 2.5), heading=-0.2, d=1.75, acceleration=0.5)
    made.columns["sensor_stamp"][0, 1:, 0] = made.time[:-1]
    made.columns["sensor_stamp"][0, 0, 0] = -1.0
    made.columns["detected"][0, 3:, 0, 0] = True
    made.columns["detections"][0, :, 0, 0] = [44.123456789, 1.987654321]
    made.columns["tracks"][0, 4:, 1, 0] = [40.0, -2.0, -5.0, 0.5, 4.5, 1.8]
    # Three candidates of four places, anew at row 3 and at the last two.
    fan = 10.0 * np.arange(4)[:, None] * np.ones((1, 9, 2, 3, 4, 2))
    fan[..., 1] = 5.25 + np.arange(3)[:, None] * np.arange(4)
    fan[0, 3:] += 1.0
    fan[0, 7] += 1.0
    fan[0, 8] += 2.0
    made.columns["candidates"] = fan.astype(np.float32)
    costs = np.array([5.0, 2.0, np.inf]) * np.ones((1, 9, 2, 3))
    costs[:, :, 0] = np.nan
    made.columns["candidate_costs"] = costs.astype(np.float32)
    made.columns["chosen"][0, :, 1] = 1
    made.columns["authority"][0, 5:] = 1
    made.columns["reason"][0, 5:] = 2
    made.columns["acceleration"][0, 5:, 1] = -4.0
    made.columns["status"][0, 5:] = [4, 2]
    mount: Any = {"x": 1.2, "y": 0.4, "z": 1.3, "yaw": 0.2}
    return with_camera(made.trace(), mount=mount)


def standing() -> Trace:
    """Nothing moves until row 4, and nothing after row 6: what stays is not sent again."""
    made = HandMade(rows=9, objects=("lead",), tail_rows=2)
    place = np.array([0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.5, 1.5, 1.5])
    made.ego(s=place, speed=0.0).object("lead", s=30.0, speed=0.0)
    made.columns["detected"][0, 1:3, 0, 0] = True
    made.columns["detections"][0, :, 0, 0] = [30.0, 0.0]
    return made.trace()


@pytest.mark.parametrize("side", ["right", "left", "standing"])
def test_mcap_is_frozen(trace: Trace, tmp_path: Path, side: str) -> None:
    path = tmp_path / "run.mcap"
    shown = {"right": trace, "left": in_left_hand_traffic(trace), "standing": standing()}[side]
    write_mcap(RunView(shown), ACCOUNT, path)
    lines, counts, decoders = [], dict[str, int](), DecoderFactory()
    times = dict[str, list[int]]()
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            count = counts[channel.topic] = counts.get(channel.topic, 0) + 1
            times.setdefault(channel.topic, []).append(message.log_time // 10**6)
            if count - 1 not in SHOWN:
                continue
            content: Any = message.data.decode("utf-8", "replace")
            if channel.message_encoding == "json":
                content = json.dumps(json.loads(content), ensure_ascii=False)
            else:
                decode = decoders.decoder_for(channel.message_encoding, schema)
                assert decode is not None
                content = re.sub(r"\s+", " ", MessageToString(decode(message.data)))
            name = "" if schema is None else schema.name
            lines.append(f"{channel.topic} ({name}) at {message.log_time}: {content}")
    lines += [f"{topic}: {count} messages, {times[topic]} ms" for topic, count in counts.items()]
    assert_frozen(f"mcap_{side}.txt", masked(nine_digits("\n".join(sorted(lines)))))


def test_osi_is_frozen(trace: Trace, tmp_path: Path) -> None:
    lines = [f"{text}" for text in write_osi(RunView(trace), ACCOUNT, tmp_path)]
    for kind, mark in (("GroundTruth", "_gt_"), ("SensorData", "_sd_")):
        for path in sorted(path for path in tmp_path.iterdir() if mark in path.name):
            found = OSITrace(str(path), kind)
            messages = list(found)
            found.close()
            lines.append(f"{kind}: {len(messages)} messages")
            lines += [MessageToString(messages[at]) for at in SHOWN if at < len(messages)]
    text = masked(nine_digits("\n".join(lines)), tmp_path)
    # Of the bindings and their library.
    text = re.sub(r"(?<=d_|t_|i_)\d+_\d+(?=_)|(?<=version_)(\w+: )\d+", r"\1V", text)
    assert_frozen("osi.txt", re.sub(r"\n\s*(\w+: .*)(?=\n)", r" \1", text))


@pytest.mark.parametrize("side", ["right", "left"])
def test_commonroad_is_frozen(trace: Trace, tmp_path: Path, side: str) -> None:
    shown = trace if side == "right" else in_left_hand_traffic(trace)
    write_commonroad(RunView(shown), ACCOUNT, tmp_path)
    text = "\n".join(path.read_text("utf-8") for path in sorted(tmp_path.iterdir()))
    text = re.sub(r">\s*<", ">\n<", text)
    assert_frozen(f"commonroad_{side}.xml", masked(nine_digits(text)))
