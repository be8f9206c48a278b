"""ROS 1 between adeye and a node: a master of the run's own in this process, and rospy.

Debian's packages are enough; those messages that are not installed are made here, for the node,
too. The node finds the run by ``ROS_MASTER_URI``.
"""

from __future__ import annotations

import importlib
import os
import queue
import sys
import warnings
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.simulate.bridges.bridge_program import GREETING, WAITING
from adeye.simulate.bridges.middleware import ROS_1
from adeye.simulate.bridges.ros_messages import COMMAND, TOPICS, Topics, definitions

if TYPE_CHECKING:
    from collections.abc import Mapping

_COMMAND: Final = "ackermann_msgs/AckermannDriveStamped"
_FOLDER: Final = "messages"
"""Where messages are made, in the working folder."""


class Peer:
    """A node with a publisher for each topic, and a subscriber of commands."""

    def __init__(self) -> None:
        """Make rospy and the messages known to this process."""
        if find_spec("rospy") is None:
            sys.path.append(ROS_1)
        self._answers: queue.Queue[Any] = queue.Queue(WAITING)

    def open(self, hello: dict[str, Any]) -> Mapping[str, str]:
        """Start the master at a free port and make publishers and subscriber."""
        self._topics = Topics(hello, 1)
        folder = str(Path.cwd())
        beside = (Path(word).parent for word in sys.argv[3:] if word.startswith("/"))
        told = {
            "ROS_IP": "127.0.0.1",
            "ROS_HOME": folder,
            "ROS_LOG_DIR": folder,
            # A launch file names its nodes by the package that lies beside it.
            "ROS_PACKAGE_PATH": ":".join(sorted({str(path) for path in beside})),
            "PYTHONPATH": str(_make_messages(Path(_FOLDER))),
        }
        os.environ.update(told)
        sys.path.append(told["PYTHONPATH"])
        master = importlib.import_module("rosmaster.master").Master(0)
        master.start()
        # The name of the machine may be known to others; only this address is listened at.
        told["ROS_MASTER_URI"] = f"http://127.0.0.1:{master.uri.rstrip('/').rpartition(':')[2]}/"
        os.environ["ROS_MASTER_URI"] = told["ROS_MASTER_URI"]
        rospy = importlib.import_module("rospy")
        self._fill = importlib.import_module("genpy.message").fill_message_args
        rospy.init_node("adeye", disable_signals=True, disable_rosout=True)
        rospy.set_param("/use_sim_time", True)  # noqa: FBT003 - as rospy has it
        # Without a queue, which it warns of, a message has been written when `publish` returns.
        warnings.simplefilter("ignore", SyntaxWarning)
        self._publishers = {
            name: rospy.Publisher(
                f"/{self._topics.topic(name)}", _type(kind), queue_size=None, tcp_nodelay=True
            )
            for name, kind in TOPICS.items()
        }
        self._subscriber = rospy.Subscriber(
            f"/{self._topics.topic(COMMAND)}", _type(_COMMAND), self._answers.put, tcp_nodelay=True
        )
        self._master = master
        return told

    def links(self) -> int:
        """Count the connections of all topics."""
        # rospy counts those that it tries, too; those of another type it tries for ever.
        heard = sum(item.md5sum is not None for item in self._subscriber.impl.connections)
        told = sum(item.get_num_connections() for item in self._publishers.values())
        return heard + told if heard and told else 0

    def greet(self, line: bytes) -> Any:
        """Greet in its name: a node of ROS shows by its connections that it is there."""
        del line
        return {"hello": GREETING}

    def publish(self, line: bytes, shown: dict[str, Any]) -> None:
        """Publish the messages of a tick."""
        for name, value in self._topics.messages(line, shown):
            publisher = self._publishers[name]
            message = publisher.data_class()
            self._fill(message, [value])
            publisher.publish(message)

    def receive(self, patience: float) -> Any:
        """Return a command."""
        try:
            message = self._answers.get(timeout=patience)
        except queue.Empty:
            return None
        time, drive = message.header.stamp, message.drive
        return self._topics.answer(time.secs, time.nsecs, drive.acceleration, drive.steering_angle)


def _type(kind: str) -> Any:
    package, _, name = kind.partition("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


def _make_messages(folder: Path) -> Path:
    """Make the Python packages of messages that are not installed, as ROS itself does.

    Returns:
        The folder that they are in.
    """
    found = definitions(1)
    search: dict[str, list[str]] = {}
    files: dict[str, list[str]] = {}
    for kind, fields in found.items():
        package, _, name = kind.partition("/")
        path = (folder / "msg" / package / f"{name}.msg").resolve()
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = []
        for kind_of, field, length, constant in fields:
            many = "" if length is None else f"[{length or ''}]"
            lines.append(f"{kind_of}{many} {field}{constant and f'={constant}'}\n")
        path.write_text("".join(lines))
        search[package] = [str(path.parent)]
        files.setdefault(package, []).append(str(path))
    generator = importlib.import_module("genpy.generator").MsgGenerator()
    initialise = importlib.import_module("genpy.generate_initpy").write_modules
    made = (folder / "python").resolve()
    made.mkdir()
    for package in files:
        if find_spec(package) is None:
            out = made / package / "msg"
            out.mkdir(parents=True)
            (out.parent / "__init__.py").touch()
            generator.generate_messages(package, files[package], str(out), search)
            initialise(str(out))
    return made
