"""A node that does one thing wrong at one tick, on each middleware; executed as a program.

It is told by ``values`` which: ``misdeed`` and ``at``. What must come of it is in ``MISDEEDS``.
"""

import json
import math
import os
import queue
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

COMPLETED = ""
TICKS = 6


class Misdeed(NamedTuple):
    """What must come of it: outcome of the channel, and words of the detail."""

    outcome: str
    words: str = ""


MISDEEDS = {
    "honest": Misdeed(COMPLETED),
    "twice": Misdeed(COMPLETED),
    "out_of_order": Misdeed(COMPLETED),
    "floods": Misdeed(COMPLETED),
    "crashes": Misdeed("channel_error", "its node ended by signal 11"),
    "dies": Misdeed("channel_error", "its node ended with code 3: it was too much"),
    "closes": Misdeed("channel_error", "its node has closed its connections"),
    "ends_at_once": Misdeed("channel_error", "its node ended with code 4"),
    "hangs": Misdeed("channel_timeout"),
    "loses": Misdeed("channel_timeout"),
    "late": Misdeed("channel_timeout"),
    "never_connects": Misdeed("channel_timeout"),
    "wrong_type": Misdeed("channel_timeout"),
    "nan": Misdeed("channel_invalid_output", "acceleration None is no finite number"),
    "future": Misdeed("channel_invalid_output", "it answers tick 4, not 3"),
}


class Link(NamedTuple):
    """One middleware as the node uses it."""

    ask: Callable[[], int]
    """Wait for the next tick."""
    answer: Callable[[int, float], None]
    """Answer a tick with an acceleration."""
    close: Callable[[], None]


def stamp(tick: int) -> tuple[int, int]:
    return divmod(tick * 50_000_000, 10**9)


def on_zenoh(*, is_wrong: bool) -> Link:
    import zenoh

    heard: queue.Queue[bytes] = queue.Queue()
    key = os.environ["ADEYE_KEY"]
    session = zenoh.open(zenoh.Config.from_env())
    command = session.declare_publisher(
        f"{key}/command", congestion_control=zenoh.CongestionControl.BLOCK, express=True
    )
    session.declare_subscriber(
        f"{key}/observation", lambda sample: heard.put(bytes(sample.payload))
    )
    command.put(b"\xff{" if is_wrong else json.dumps({"hello": json.loads(heard.get())["hello"]}))

    def answer(tick: int, acceleration: float) -> None:
        value = None if math.isnan(acceleration) else acceleration
        content = {"tick": tick, "acceleration": value, "steering_angle": 0.0}
        command.put(json.dumps(content))

    return Link(lambda: int(json.loads(heard.get())["tick"]), answer, session.close)


def on_ros2(*, is_wrong: bool) -> Link:
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    from adeye.simulate.bridges.ros2_peer import QOS, Messages

    messages = Messages()
    participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    kind = "std_msgs/String" if is_wrong else "ackermann_msgs/AckermannDriveStamped"
    clock = Topic(participant, "rt/clock", messages.type_of("rosgraph_msgs/Clock"), qos=QOS)
    reader = DataReader(participant, clock, qos=QOS)
    topic = Topic(participant, "rt/ackermann_cmd", messages.type_of(kind), qos=QOS)
    writer = DataWriter(participant, topic, qos=QOS)

    def ask() -> int:
        time = reader.take_one().clock
        return int(time.sec * 10**9 + time.nanosec) // 50_000_000

    def answer(tick: int, acceleration: float) -> None:
        sec, nanosec = stamp(tick)
        header = {"stamp": {"secs": sec, "nsecs": nanosec}}
        writer.write(
            messages.make(kind, {"header": header, "drive": {"acceleration": acceleration}})
        )

    def close() -> None:
        participant._delete(participant._ref)

    return Link(ask, answer, close)


def on_ros1(*, is_wrong: bool) -> Link:
    import rospy
    from ackermann_msgs.msg import AckermannDriveStamped
    from rosgraph_msgs.msg import Clock
    from std_msgs.msg import String

    heard: queue.Queue[int] = queue.Queue()
    rospy.init_node("misdeeds", disable_signals=True)
    kind = String if is_wrong else AckermannDriveStamped
    publisher = rospy.Publisher("/ackermann_cmd", kind, queue_size=1000)
    subscriber = rospy.Subscriber(
        "/clock",
        Clock,
        lambda message: heard.put(message.clock.to_nsec() // 50_000_000),
        tcp_nodelay=True,
    )

    def answer(tick: int, acceleration: float) -> None:
        message = AckermannDriveStamped()
        message.header.stamp = rospy.Time(*stamp(tick))
        message.drive.acceleration = acceleration
        publisher.publish(message)

    def close() -> None:
        publisher.unregister()
        subscriber.unregister()

    return Link(heard.get, answer, close)


def sin(link: Link, name: str, tick: int) -> None:
    """Answer a tick wrongly."""
    if name == "crashes":
        os.kill(os.getpid(), signal.SIGSEGV)
    if name == "dies":
        sys.stdout.write("it was too much\n")
        sys.stdout.flush()
        os._exit(3)
    if name == "closes":
        link.close()
        time.sleep(60)
    if name == "hangs":
        time.sleep(60)
    if name == "late":
        link.answer(tick - 1, 0.5)
    if name == "future":
        link.answer(tick + 1, 0.5)
    if name == "nan":
        link.answer(tick, float("nan"))


def main() -> None:
    hello = json.loads(Path(os.environ["ADEYE_HELLO"]).read_text())
    values = hello["parameters"]["values"]
    name, at = values["misdeed"], values["at"]
    if name == "ends_at_once":
        sys.exit(4)
    if name == "never_connects":
        time.sleep(60)
    links = {"zenoh": on_zenoh, "ros1": on_ros1, "ros2": on_ros2}
    link = links[values["middleware"]](is_wrong=name == "wrong_type")
    while True:
        tick = link.ask()
        if name == "floods" and tick:
            for _ in range(2000):
                link.answer(tick - 1, 9.0)
        if name == "out_of_order" and tick:
            link.answer(tick - 1, 9.0)
        if tick >= at and MISDEEDS[name].outcome:
            sin(link, name, tick)
        else:
            link.answer(tick, 0.1 * tick)
        if name == "twice":
            link.answer(tick, 9.0)


if __name__ == "__main__":
    main()
