import numpy as np
import pytest

from adeye.signals import SILENT, ControlCommand
from adeye.testing import ScriptedChannel, World, channel_context, drive


def scripted(acceleration: float) -> ScriptedChannel:
    channel = ScriptedChannel([acceleration])
    channel.reset(channel_context(None, links=(), sensors={}, channel_id="nominal"))
    return channel


def test_coasting_ego_keeps_its_speed_and_lane() -> None:
    done = drive({"nominal": scripted(0.0)}, {"nominal": ()}, World(speed=20.0), horizon=1.0)
    assert len(done.time) == 21
    assert done.ego[-1, :4] == pytest.approx([20.0, 5.25, 0.0, 20.0])


def test_braking_ego_stops_where_the_closed_form_says() -> None:
    done = drive({"nominal": scripted(-4.0)}, {"nominal": ()}, World(speed=20.0), horizon=8.0)
    # v² / (2 b), and the lag of 0.15 s at full speed.
    assert done.ego[-1, 0] == pytest.approx(20.0**2 / 8.0 + 20.0 * 0.15, abs=0.2)


def test_distance_is_to_the_nearest_body() -> None:
    world = World(objects=lambda _: [[50.0, 5.25, 0, 0, 0], [90.0, 5.25, 0, 0, 0]], speed=0.0)
    done = drive({"nominal": scripted(0.0)}, {"nominal": ()}, world, horizon=0.1)
    assert done.distance.tolist() == pytest.approx([45.5] * 3)
    assert (
        drive({"nominal": scripted(0.0)}, {"nominal": ()}, World(), horizon=0.0).distance[0]
        == np.inf
    )


def test_hook_makes_a_fault_between_channel_and_switch() -> None:
    def silence(_time: float, proposals: list[ControlCommand]) -> list[ControlCommand]:
        quiet = proposals[0].copy()
        quiet.status[:] = SILENT
        quiet.stamp[:] = -1.0
        return [quiet]

    done = drive(
        {"nominal": scripted(-4.0)}, {"nominal": ()}, World(), horizon=1.0, on_commands=silence
    )
    assert (done.authority == -1).all()
    assert done.ego[-1, 3] == 30.0
