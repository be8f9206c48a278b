"""What a channel is shown: what its links name, and nothing that it could alter."""

import numpy as np
import pytest

from adeye.signals import SILENT, Authority, ControlCommand, Measurement
from adeye.simulate.channels.links import View, linked_channels, observe


def measurement() -> Measurement:
    return Measurement(
        np.zeros(2),
        np.ones(2, dtype=np.bool_),
        np.ones(2, dtype=np.bool_),
        np.ones((2, 1), dtype=np.bool_),
        np.ones((2, 1, 7)),
        np.zeros((2, 1), dtype=np.int64),
        np.ones((2, 13)),
    )


def command() -> ControlCommand:
    status = np.zeros(2, dtype=np.int64)
    return ControlCommand(
        "a", np.ones(2), np.zeros(2), np.zeros(2), status, plan=np.zeros((2, 3, 4))
    )


AUTHORITY = Authority(np.zeros(2, dtype=np.int64), np.ones(2, dtype=np.int64))
RUNNING = np.ones(2, dtype=np.bool_)
READINGS = {"front": measurement(), "rear": measurement()}


def test_only_what_is_linked_is_seen() -> None:
    seen = observe(("front",), 1.0, READINGS, {"a": command()}, AUTHORITY, RUNNING, protect=False)
    assert set(seen.measurements) == {"front"}
    assert seen.commands == {}
    assert seen.authority is None


def test_source_of_a_detection_is_blanked_and_the_sensor_keeps_its_own() -> None:
    seen = observe(("front",), 1.0, READINGS, {}, None, RUNNING, protect=False)
    assert (seen.measurements["front"].source == -1).all()
    assert (READINGS["front"].source == 0).all()


def test_linked_channel_and_switch_are_seen() -> None:
    links = ("channels.a", "switch")
    seen = observe(links, 1.0, {}, {"a": command()}, AUTHORITY, RUNNING, protect=False)
    assert set(seen.commands) == {"a"}
    assert seen.authority is AUTHORITY


def test_channel_that_has_not_commanded_is_seen_silent() -> None:
    seen = observe(("channels.a",), 0.0, {}, {}, None, RUNNING, protect=False)
    assert (seen.commands["a"].status == SILENT).all()
    assert (seen.commands["a"].stamp == -1.0).all()


def test_fan_that_is_there_for_pictures_is_not_seen() -> None:
    given = command()
    given.candidates, given.candidate_costs = np.zeros((2, 5, 3, 2)), np.zeros((2, 5))
    given.chosen = np.zeros(2, dtype=np.int64)
    for protect in (False, True):
        seen = observe(("channels.a",), 0.0, {}, {"a": given}, None, RUNNING, protect=protect)
        heard = seen.commands["a"]
        assert (heard.candidates, heard.candidate_costs, heard.chosen) == (None, None, None)
        assert heard.plan is not None


def test_protected_observation_cannot_alter_the_truth() -> None:
    links = ("front", "channels.a", "switch")
    given = command()
    seen = observe(links, 1.0, READINGS, {"a": given}, AUTHORITY, RUNNING, protect=True)
    estimate = seen.measurements["front"].estimate
    assert estimate is not None
    assert seen.authority is not None
    plan = seen.commands["a"].plan
    assert plan is not None
    for array in (
        seen.measurements["front"].detections,
        estimate,
        seen.commands["a"].acceleration,
        plan,
        seen.authority.channel,
        seen.running,
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    assert not np.shares_memory(seen.commands["a"].acceleration, given.acceleration)


def test_linked_channels_are_listed_in_order() -> None:
    assert linked_channels(("front", "channels.b", "switch", "channels.a")) == ("b", "a")


def test_view_shows_what_is_behind_each_link_and_another_thing_instead() -> None:
    view = View(READINGS, {"a": command()}, AUTHORITY)
    assert view.shown("front", 2) is READINGS["front"]
    assert view.shown("channels.a", 2) is view.commands["a"]
    assert view.shown("switch", 2) is AUTHORITY
    silent = view.shown("channels.b", 2)
    assert isinstance(silent, ControlCommand)
    assert silent.status.tolist() == [SILENT] * 2
    other = measurement()
    changed = view.instead("front", other)
    assert changed.measurements["front"] is other
    assert changed.measurements["rear"] is READINGS["rear"]
    assert view.measurements["front"] is READINGS["front"]
    assert view.instead("switch", None).authority is None
    assert view.instead("channels.b", silent).commands["b"] is silent


def test_health_link_shows_stamp_and_validity_of_its_sensor_and_nothing_else() -> None:
    readings = {"front": measurement()}
    readings["front"].alive[1] = False
    seen = observe(("health.front",), 1.0, readings, {}, None, RUNNING, protect=False)
    assert set(seen.measurements) == {"health.front"}
    health = seen.measurements["health.front"]
    assert (health.stamp == readings["front"].stamp).all()
    assert health.alive.tolist() == [True, False]
    assert health.mask.size == health.detections.size == health.source.size == 0
    for name in ("estimate", "points", "hits", "values"):
        assert getattr(health, name) is None


def test_what_stands_for_a_health_link_leaves_the_sensor_itself_alone() -> None:
    view = View({"front": measurement()}, {}, None)
    late = view.shown("health.front", 2)
    assert isinstance(late, Measurement)
    other = late.copy()
    other.stamp[:] = 7.0
    changed = view.instead("health.front", other)
    links = ("front", "health.front")
    seen = observe(
        links, 1.0, changed.measurements, {}, None, RUNNING, protect=True, health=changed.health
    )
    assert (seen.measurements["health.front"].stamp == 7.0).all()
    assert (seen.measurements["front"].stamp == 0.0).all()
    assert changed.shown("health.front", 2) is other
