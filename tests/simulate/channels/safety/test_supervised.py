"""The supervised channel: contract, monitors, batches, and what it watches through health links."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from adeye.signals import Bools, Floats
from adeye.simulate.channels.factory import make_channel
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.safety import SupervisedSafetyChannel
from adeye.simulate.channels.safety.supervisor import THRESHOLDS
from adeye.spec.channels import SafetyParameters
from adeye.spec.supervisor import KINDS, MANOEUVRE_MONITORS
from adeye.testing import channel_context, check_channel
from adeye.testing.scenes import object_measurement, straight_road
from tests.simulate.channels.safety.supervised import SILENT, parameters


@pytest.mark.slow
@pytest.mark.parametrize("stop", ["in_lane", "planned"])
@pytest.mark.parametrize("links", [("truth", "channels.nominal", "switch", "health.front")])
def test_conforms(stop: str, links: tuple[str, ...]) -> None:
    every = {
        "silent": SILENT,
        "wrong": {"kind": "channel_implausible", "watches": ["nominal"]},
        "off": {"kind": "off_road", "level": 2},
        "lane": {"kind": "lane_departure", "level": 3},
        "danger": {"kind": "object_danger"},
        "area": {"kind": "critical_area", "level": 1},
        "rss": {"kind": "rss_danger", "level": 1},
        "odd": {"kind": "odd_exit", "max_speed": "25 m/s", "level": 3},
    } | ({"last": {"kind": "last_safe_stop"}} if stop == "planned" else {})
    item = parameters(every, stop=stop)
    check_channel(
        lambda: SupervisedSafetyChannel(item),
        item,
        links=links[:3],
        sensors={"truth": "ground_truth"},
    )


def test_parameters_say_which_channel_is_made() -> None:
    item = parameters({"b": SILENT, "a": {"kind": "off_road"}})
    made = make_channel("safety", Path(), item)
    assert made.monitor_ids == ("a", "b", *MANOEUVRE_MONITORS)


def test_every_kind_has_its_thresholds() -> None:
    assert set(THRESHOLDS) == set(KINDS)


FRONT = {"kind": "sensor_silent", "watches": ["front"]}


def drive_batch(items: Sequence[SafetyParameters]) -> list[tuple[Floats, Bools]]:
    channel, size = SupervisedSafetyChannel(items[0]), len(items)
    links = ("truth", "health.front")
    channel.reset(
        channel_context(
            list(items), links=links, sensors={"truth": "ground_truth"}, runs=size, step=0.05
        )
    )
    road, answers = straight_road(size), []
    running = np.ones(size, dtype=np.bool_)
    for tick in range(60):
        time = 0.05 * tick
        ego = np.zeros((size, 7))
        ego[:, 3], ego[:, 1], ego[:, 0] = 20.0, 1.75, 20.0 * time
        objects = np.zeros((size, 1, 5))
        objects[:, 0, 0], objects[:, 0, 1], objects[:, 0, 3] = 80.0 + 5.0 * time, 1.75, 5.0
        truth = object_measurement(ego, objects, time, road=road)
        front = object_measurement(ego, objects, min(time, 1.0))
        readings = {"truth": truth, "front": front}
        seen = observe(links, time, readings, {}, None, running, protect=False)
        answer = channel.act(seen)
        assert answer.monitors is not None
        answers.append((np.stack([answer.acceleration, answer.steering_angle]), answer.monitors))
    return answers


def test_runs_of_a_batch_decide_as_they_do_alone_whatever_their_thresholds() -> None:
    items = [
        parameters(
            {
                "front": {
                    "kind": "sensor_silent",
                    "watches": ["front"],
                    "timeout": f"{0.2 * at} s",
                },
                "rss": {"kind": "rss_danger", "level": at, "response_time": f"{at} s"},
                "last": {"kind": "last_safe_stop"},
            },
            counter={"fault": at},
            rate=("20 Hz", "10 Hz", "5 Hz")[at - 1],
        )
        for at in (1, 2, 3)
    ]
    together = drive_batch(items)
    assert len({rows[1][run].tobytes() for run in range(3) for rows in together}) > 3
    for number, item in enumerate(items):
        for one, all_ in zip(drive_batch([item]), together, strict=True):
            assert one[0][:, 0].tobytes() == all_[0][:, number].tobytes()
            assert one[1][0].tobytes() == all_[1][number].tobytes()


def test_sensor_is_silent_its_timeout_after_the_last_sample_that_the_health_link_showed() -> None:
    item = parameters({"front": FRONT | {"timeout": "0.3 s"}}, rate="20 Hz")
    shown = [bool(rows[1][0, 0, 0]) for rows in drive_batch([item])]
    # The newest sample is of 1.0 s; the first evaluation that is more than 0.3 s later finds it.
    assert shown.index(True) == round((1.0 + 0.3 + 0.05) / 0.05)
    confirmed = [bool(rows[1][0, 0, 1]) for rows in drive_batch([item])]
    assert confirmed.index(True) == shown.index(True) + 7
