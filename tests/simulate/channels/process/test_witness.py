"""A witness takes down what a channel is shown, and nothing of it changes."""

import io
import json

import numpy as np

from adeye.signals import Observation
from adeye.simulate.channels.process.protocol import Witness, WitnessedChannel
from adeye.testing import ScriptedChannel, channel_context


def test_lines_are_those_of_the_protocol_while_the_run_goes_on() -> None:
    stream = io.BytesIO()
    witness = Witness("tested", stream)
    channel = WitnessedChannel(ScriptedChannel([0.5, -1.0]), "nominal", witness)
    channel.reset(channel_context(None, links=(), sensors={}))
    answers = [
        channel.act(Observation(0.05 * tick, {}, {}, None, np.array([tick < 2])))
        for tick in range(3)
    ]
    lines = [json.loads(line) for line in stream.getvalue().splitlines()]
    assert (lines[0]["hello"], lines[0]["kind"]) == ("adeye/channel@1", "nominal")
    assert [(line["tick"], line["time"]) for line in lines[1:]] == [(0, 0.0), (1, 0.05)]
    assert [answer.acceleration[0] for answer in answers] == [0.5, -1.0, -1.0]
