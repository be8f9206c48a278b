"""Bags of ROS: read back by their own library, and what is in them is what was told."""

import io
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.campaign.replay import Execution, rerun
from adeye.errors import UsageError
from adeye.exchange.rosbag import write_rosbag
from adeye.reporting import handing_out
from tests.project import Executed
from tests.refusals import refused

rosbags = pytest.importorskip("rosbags", reason="needs adeye[viz]")

MOUNT = [2.0, 0.5, 0.4, 0.1]
SENSORS = {
    **{name: {"kind": name, "mount": None} for name in ("localisation", "imu", "gnss")},
    **{name: {"kind": name, "mount": MOUNT} for name in ("radar", "lidar")},
}
HELLO = {"hello": "adeye/channel@1", "parameters": {}, "sensors": SENSORS}


def item(stamp: float, **more: Any) -> dict[str, Any]:
    return {
        "stamp": stamp,
        "fresh": True,
        "alive": True,
        "most": len(more.get("detections", ())),
        "detections": [],
        **more,
    }


def line(tick: int) -> dict[str, Any]:
    """Return what a channel of all kinds of sensors is told at a tick."""
    time = 0.05 * tick
    ego = [100.0 + tick, 5.25, 0.1, 20.0 + tick / 3.0, 0.5, 0.01, 0.02, 100.0, 5.25, 0.1, 0.0, 1.0]
    return {
        "tick": tick,
        "time": time,
        "sensors": {
            "localisation": item(time, estimate=[*ego, 0.0]),
            "imu": item(time, values=[0.1 * tick, -0.2, 0.03]),
            "gnss": item(time, values=[100.0 + tick, 5.0, 20.0, 0.0]),
            "radar": item(time + 0.02, detections=[[40.0 + tick, 2.0, -3.0, 1.0, 4.5, 1.8, 0]]),
            "lidar": item(
                time,
                detections=[[30.0, 1.0, 0.0, 0.0, 4.0, 2.0, -1]],
                points=[[25.0 + tick, 0.2, -0.01], [0.0, 0.3, 0.0]],
            ),
        },
        "channels": {},
        "switch": None,
    }


LINES = [line(tick) for tick in range(4)]


def read(path: Path) -> dict[str, list[tuple[int, Any]]]:
    from rosbags.highlevel import AnyReader

    found: dict[str, list[tuple[int, Any]]] = {}
    with AnyReader([path]) as reader:
        for connection, time, content in reader.messages():
            message = reader.deserialize(content, connection.msgtype)
            found.setdefault(connection.topic, []).append((time, message))
    return found


def bag(folder: Path, version: int, lines: list[Any] = LINES) -> Path:
    path = folder / ("run.bag" if version == 1 else "run")
    if version == 2:
        path.mkdir()
    write_rosbag([json.dumps(row).encode() + b"\n" for row in (HELLO, *lines)], path, path.name)
    return path


@pytest.mark.parametrize("version", [1, 2])
def test_messages_are_what_was_told(version: int, tmp_path: Path) -> None:
    found = read(bag(tmp_path, version))
    assert sorted(found) == [
        *("/adeye/observation", "/clock", "/fix", "/imu", "/objects", "/odom", "/points", "/tf"),
    ]
    for tick, row in enumerate(LINES):
        sensors, now = row["sensors"], round(row["time"] * 1e9)
        time, clock = found["/clock"][tick]
        assert time == now == clock.clock.sec * 10**9 + clock.clock.nanosec
        assert json.loads(found["/adeye/observation"][tick][1].data) == row
        (_, odom), ego = found["/odom"][tick], sensors["localisation"]["estimate"]
        pose = odom.pose.pose
        told = [pose.position.x, pose.position.y, 2.0 * math.asin(pose.orientation.z)]
        assert [*told, odom.twist.twist.linear.x] == pytest.approx(ego[:4], abs=1e-6)
        imu, (east, north) = found["/imu"][tick][1], sensors["gnss"]["values"][:2]
        assert imu.linear_acceleration.x == pytest.approx(0.1 * tick, abs=1e-6)
        assert imu.orientation_covariance.tolist() == [-1.0, *[0.0] * 8]
        fix = found["/fix"][tick][1]
        assert np.radians(fix.longitude) * 6_378_137.0 == pytest.approx(east, abs=1e-6)
        assert np.radians(fix.latitude) * 6_335_439.327 == pytest.approx(north, abs=1e-6)
        radar, lidar = (message for _, message in found["/objects"][2 * tick : 2 * tick + 2])
        assert radar.header.frame_id == "radar"
        stamp = radar.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == round(sensors["radar"]["stamp"] * 1e9)
        (seen,) = radar.detections
        turned = math.cos(0.1) * (38.0 + tick) + math.sin(0.1) * 1.5
        assert seen.bbox.center.position.x == pytest.approx(turned, abs=1e-6)
        assert len(seen.results) == 1
        assert len(lidar.detections[0].results) == 0
        cloud = found["/points"][tick][1]
        x, y, _ = np.frombuffer(cloud.data.tobytes(), dtype="<f4")
        assert math.hypot(x, y) == pytest.approx((25.0 + tick) * math.cos(-0.01), rel=1e-6)
        frames = {frame.child_frame_id: frame for frame in found["/tf"][tick][1].transforms}
        assert list(frames["radar"].transform.translation.__dict__.values())[:3] == MOUNT[:3]


def test_same_lines_have_the_same_bytes(tmp_path: Path) -> None:
    for version in (1, 2):
        made = []
        for name in "ab":
            folder = tmp_path / f"{name}{version}"
            folder.mkdir()
            path = bag(folder, version)
            files = [path] if path.is_file() else sorted(path.iterdir())
            made.append([(file.name, file.read_bytes()) for file in files])
        assert made[0] == made[1]


def test_types_are_those_of_ros(tmp_path: Path) -> None:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    for version, known in ((1, Stores.ROS1_NOETIC), (2, Stores.ROS2_HUMBLE)):
        store = get_typestore(known)
        with AnyReader([bag(tmp_path, version)]) as reader:
            digests = {item.msgtype: item.digest for item in reader.connections}
        common = set(digests) & set(store.types)
        others = {"vision_msgs/msg/Detection3DArray", "tf2_msgs/msg/TFMessage"}
        assert set(digests) - common <= others, "packages of their own"
        for name in common:
            wanted = store.generate_msgdef(name)[1] if version == 1 else store.hash_rihs01(name)
            assert digests[name] == wanted, name


@pytest.fixture(scope="module")
def done(mini: Executed) -> tuple[Execution, io.BytesIO]:
    """A run, and what its nominal channel was shown."""
    shown = io.BytesIO()
    with mini.opened() as (repository, campaign):
        rows = repository.results(campaign.id)
        first = dict(zip(rows.columns, rows.rows[0], strict=True))
        return rerun(repository, repository.find_run(first["run"]), (None, shown)), shown


@pytest.mark.parametrize("name", ["bag", "run.bag"])
def test_stored_run_is_written(
    name: str, done: tuple[Execution, io.BytesIO], tmp_path: Path
) -> None:
    execution, shown = done
    handing_out(rosbag=tmp_path / name, shown=shown)(execution)
    found = read(tmp_path / name)
    assert len(found["/clock"]) == int(execution.trace.length[0]) - 1
    ego = execution.trace["ego"][0]
    for time, message in found["/odom"][::50]:
        row = round((message.header.stamp.sec + message.header.stamp.nanosec / 1e9) / 0.05)
        assert message.pose.pose.position.x == pytest.approx(ego[row, 0], abs=1.0)
        assert time >= message.header.stamp.nanosec
    assert [path.name for path in tmp_path.iterdir()] == [name]
    handing_out(rosbag=tmp_path / name, shown=shown)(execution)


def test_bag_that_was_recorded_is_not_replaced(
    done: tuple[Execution, io.BytesIO], tmp_path: Path
) -> None:
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_typestore

    execution, shown = done
    kind, store = "std_msgs/msg/Header", get_typestore(Stores.ROS1_NOETIC)
    with rosbag1.Writer(tmp_path / "drive.bag") as writer:
        writer.add_connection("/clock", kind, typestore=store, callerid="/adeye")
    store, plugin = get_typestore(Stores.ROS2_HUMBLE), rosbag2.StoragePlugin.MCAP
    with rosbag2.Writer(tmp_path / "drive", version=9, storage_plugin=plugin) as second:
        second.add_connection("/clock", kind, typestore=store)
    # Whatever lies beside metadata of ours is not for that reason ours.
    handing_out(rosbag=tmp_path / "mixed", shown=shown)(execution)
    (tmp_path / "mixed" / "mixed.mcap").write_bytes((tmp_path / "drive/drive.mcap").read_bytes())
    for name in ("drive.bag", "drive", "mixed"):
        path = tmp_path / name
        files = [path] if path.is_file() else sorted(path.iterdir())
        before = [file.read_bytes() for file in files]

        def write(path: Path = path) -> None:
            handing_out(rosbag=path, shown=shown)(execution)

        refused(UsageError, write, says="that adeye has not written")
        assert [file.read_bytes() for file in files] == before


def test_folder_of_somebody_else_is_kept(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    refused(UsageError, handing_out, rosbag=tmp_path, shown=io.BytesIO(), says="bag of ROS 2")
