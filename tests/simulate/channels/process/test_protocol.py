"""Lines of the protocol: numbers keep every bit, and nonsense is told apart."""

import io
import json
import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.signals import REQUESTS_AUTHORITY, Authority, ControlCommand, Observation
from adeye.simulate.channels.process import protocol
from adeye.testing import ScriptedChannel, channel_context, straight_road
from adeye.testing.scenes import object_measurement

GOOD = '{"tick":3,"acceleration":-1.5,"steering_angle":0.01}'


@given(st.floats(allow_nan=False))
def test_numbers_keep_every_bit(value: float) -> None:
    read = json.loads(protocol.encode({"value": value}))["value"]
    assert (read, math.copysign(1.0, read)) == (value, math.copysign(1.0, value))


def test_what_is_no_number_is_null() -> None:
    assert protocol.encode({"a": [math.nan, 1.0]}) == b'{"a":[null,1.0]}\n'


def test_text_that_names_infinity_stays_text() -> None:
    content = {"text": "-Infinity, NaN", "value": math.inf}
    assert json.loads(protocol.encode(content)) == content


def test_hello_tells_what_is_known_before_the_drive() -> None:
    context = channel_context({"gain": 2}, links=("front",), sensors={"front": "radar"})
    content = json.loads(protocol.encode(protocol.hello(context, 0)))
    assert content["hello"] == protocol.PROTOCOL
    assert (content["channel"], content["links"]) == ("tested", ["front"])
    assert content["parameters"] == {"gain": 2}
    assert content["sensors"]["front"]["kind"] == "radar"
    assert content["vehicle"]["wheelbase"] == 2.7
    assert (content["desired_speed"], content["road"]["lanes"]) == (30.0, 3)


def test_observation_shows_one_run_and_nothing_else() -> None:
    ego, objects = np.zeros((2, 7)), np.zeros((2, 1, 5))
    objects[:, 0, 0] = [20.0, 40.0]
    front = object_measurement(ego, objects, 0.1, road=straight_road(2))
    command = ControlCommand(
        "nominal",
        np.array([1.0, 2.0]),
        np.array([0.0, np.nan]),
        np.full(2, 0.05),
        np.full(2, REQUESTS_AUTHORITY),
    )
    authority = Authority(np.array([0, 1]), np.array([1, 2]))
    seen = Observation(0.1, {"front": front}, {"nominal": command}, authority, np.ones(2, bool))
    content = json.loads(protocol.encode(protocol.observation_shown(seen, 1, 7)))
    assert (content["tick"], content["time"]) == (7, 0.1)
    (row,) = content["sensors"]["front"]["detections"]
    assert row[0] == 40.0
    assert "source" not in content["sensors"]["front"]
    assert content["channels"]["nominal"] == {
        "acceleration": 2.0,
        "steering_angle": None,
        "stamp": 0.05,
        "status": "requests_authority",
    }
    assert content["switch"] == {"authority": 1, "reason": "request"}


def test_good_answer_is_a_command() -> None:
    command, wrong = protocol.read_command(GOOD.encode(), 3)
    assert wrong == ""
    assert command is not None
    assert (command.acceleration, command.steering_angle, command.status) == (-1.5, 0.01, 0)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("", "is no line of JSON"),
        ("turn left", "is no line of JSON"),
        ("\xff", "is no line of JSON"),
        ("[1]", "is no JSON object"),
        (GOOD.replace("3", "4"), "answers tick 4, not 3"),
        (GOOD.replace("3", "true"), "answers tick True"),
        (GOOD.replace("3", '"3"'), "answers tick '3'"),
        (GOOD.replace("-1.5", "NaN"), "is no line of JSON"),
        (GOOD.replace("-1.5", "1e999"), "acceleration inf is no finite number"),
        (GOOD.replace("-1.5", "true"), "acceleration True is no finite number"),
        (GOOD.replace("-1.5", "null"), "acceleration None is no finite number"),
        (GOOD.replace("-1.5", "1" + "0" * 400), "is no finite number"),
        (GOOD.replace("}", ',"status":"fine"}'), "status 'fine' is none of ok"),
        (GOOD.replace("}", ',"status":[]}'), r"status \[\] is none of ok"),
        (GOOD.replace("}", ',"brake":1}'), "there is no key 'brake'"),
        ('{"tick":3}', "lacks acceleration, steering_angle"),
    ],
)
def test_wrong_answer_is_told(line: str, words: str) -> None:
    command, wrong = protocol.read_command(line.encode("latin-1"), 3)
    assert command is None
    assert re.search(words, wrong), wrong


def test_hello_of_another_version_is_told() -> None:
    assert protocol.wrong_hello(b'{"hello":"adeye/channel@1"}') == ""
    assert "not 'adeye/channel@1'" in protocol.wrong_hello(b'{"hello":"adeye/channel@2"}')
    assert "no key" in protocol.wrong_hello(b'{"hello":"adeye/channel@1","name":"me"}')
    assert "no line of JSON" in protocol.wrong_hello(b"hello")


# A witness takes down what a channel is shown, and nothing of it changes.


def test_lines_are_those_of_the_protocol_while_the_run_goes_on() -> None:
    stream = io.BytesIO()
    witness = protocol.Witness("tested", stream)
    channel = protocol.WitnessedChannel(ScriptedChannel([0.5, -1.0]), "nominal", witness)
    channel.reset(channel_context(None, links=(), sensors={}))
    answers = [
        channel.act(Observation(0.05 * tick, {}, {}, None, np.array([tick < 2])))
        for tick in range(3)
    ]
    lines = [json.loads(line) for line in stream.getvalue().splitlines()]
    assert (lines[0]["hello"], lines[0]["kind"]) == ("adeye/channel@1", "nominal")
    assert [(line["tick"], line["time"]) for line in lines[1:]] == [(0, 0.0), (1, 0.05)]
    assert [answer.acceleration[0] for answer in answers] == [0.5, -1.0, -1.0]
