"""ROS 2 between adeye and a node, at wire level: Cyclone DDS with the names and types of ROS 2.

The node finds the run by ``ROS_DOMAIN_ID`` and ``CYCLONEDDS_URI``, as anything that is built on
Cyclone DDS does by itself. A domain is one run's: its first place is taken, and with it the ports
that no other run can have; a tag keeps away whoever does not know it.
"""

from __future__ import annotations

import dataclasses
import os
import types
from typing import TYPE_CHECKING, Any, Final
from uuid import uuid4

from cyclonedds.core import (
    DDSException,
    InstanceState,
    Policy,
    Qos,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types as idl
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from adeye.simulate.bridges.bridge_program import GREETING, WAITING, BridgeError
from adeye.simulate.bridges.ros_messages import COMMAND, TOPICS, Topics, definitions, filled

if TYPE_CHECKING:
    from collections.abc import Mapping

DOMAINS: Final = range(1, 233)
"""Domains whose ports there are."""
PARTICIPANTS: Final = 31
"""Most participants of a run that find each other."""

_CONFIG: Final = (
    '<CycloneDDS><Domain Id="any"><General><Interfaces><NetworkInterface address="127.0.0.1"'
    ' multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast></General>'
    "<Discovery><Tag>{tag}</Tag><ParticipantIndex>{index}</ParticipantIndex>"
    "<MaxAutoParticipantIndex>{most}</MaxAutoParticipantIndex>"
    '<Peers><Peer Address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)
_PRIMITIVES: Final[Mapping[str, Any]] = {
    **{name: getattr(idl, name) for name in ("float32", "float64", "int8", "int32", "int64")},
    **{name: getattr(idl, name) for name in ("uint8", "uint16", "uint32")},
    "bool": bool,
    "string": str,
}
_PATIENCE_S: Final = 60
QOS: Final = Qos(
    Policy.Reliability.Reliable(duration(seconds=_PATIENCE_S)),
    Policy.History.KeepAll,
    Policy.ResourceLimits(max_samples=WAITING),
    Policy.DataRepresentation(use_cdrv0_representation=True),
)


class Messages:
    """The types of ROS 2, made from their definitions."""

    def __init__(self) -> None:
        """Make none yet."""
        self._definitions = definitions(2)
        self._made: dict[str, Any] = {}

    def type_of(self, kind: str) -> Any:
        """Return the class of a type: a dataclass that can be sent."""
        if kind in _PRIMITIVES:
            return _PRIMITIVES[kind]
        if kind not in self._made:
            name, fields = "builtin_interfaces/Time", {"sec": idl.int32, "nanosec": idl.uint32}
            if kind != "time":
                name, fields = kind, {}
                for field in self._fields(kind):
                    item = self.type_of(field.kind)
                    if field.length is not None:
                        length = field.length
                        item = idl.array[item, length] if length else idl.sequence[item]
                    fields[field.name] = item
            package, _, short = name.partition("/")
            self._made[kind] = _structure(f"{package}.msg.dds_.{short}_", fields)
        return self._made[kind]

    def make(self, kind: str, value: Any) -> Any:
        """Make a message of a dictionary; what it leaves out is nothing, or 0."""
        return filled(self._definitions, kind, value, lambda kind, of: self.type_of(kind)(**of))

    def _fields(self, kind: str) -> Any:
        return [field for field in self._definitions[kind] if not field.constant]


def _structure(name: str, fields: Mapping[str, Any]) -> Any:
    content = {"__annotations__": dict(fields), "__module__": __name__}
    made = types.new_class(
        name.rpartition(".")[2],
        (IdlStruct,),
        {"typename": name},
        lambda space: space.update(content),
    )
    return dataclasses.dataclass(made)


class Peer:
    """A participant with a writer for each topic, and a reader of commands."""

    def open(self, hello: dict[str, Any]) -> Mapping[str, str]:
        """Take a domain and make writers and reader."""
        self._topics = Topics(hello, 2)
        self._messages = Messages()
        tag = uuid4().hex
        self._domain, number = _own_domain(tag)
        participant = DomainParticipant(number)

        def topic(name: str, kind: str) -> Topic[Any]:
            named = f"rt/{self._topics.topic(name)}"
            return Topic(participant, named, self._messages.type_of(kind), qos=QOS)

        self._writers = {
            name: DataWriter(participant, topic(name, kind), qos=QOS)
            for name, kind in TOPICS.items()
        }
        command = topic(COMMAND, "ackermann_msgs/AckermannDriveStamped")
        self._reader = DataReader(participant, command, qos=QOS)
        self._waiting: list[Any] = []
        self._wait = WaitSet(participant)
        state = ViewState.Any | InstanceState.Any | SampleState.NotRead
        self._condition = ReadCondition(self._reader, state)
        self._wait.attach(self._condition)
        uri = _CONFIG.format(tag=tag, index="auto", most=PARTICIPANTS)
        return {"ROS_DOMAIN_ID": str(number), "CYCLONEDDS_URI": uri}

    def links(self) -> int:
        """Count the readers of all topics and the writers of commands."""
        heard = len(self._reader.get_matched_publications())
        told = sum(len(item.get_matched_subscriptions()) for item in self._writers.values())
        return heard + told if heard and told else 0

    def greet(self, line: bytes) -> Any:
        """Greet in its name: a node of ROS shows by its connections that it is there."""
        del line
        return {"hello": GREETING}

    def publish(self, line: bytes, shown: dict[str, Any]) -> None:
        """Write the messages of a tick."""
        for name, value in self._topics.messages(line, shown):
            self._writers[name].write(self._messages.make(TOPICS[name], value))

    def receive(self, patience: float) -> Any:
        """Return a command."""
        if not self._waiting:
            self._wait.wait(duration(seconds=patience))
            taken = self._reader.take(WAITING)
            # A writer that leaves is told of by samples without content.
            self._waiting = [item for item in taken if not isinstance(item, InvalidSample)]
        if not self._waiting:
            return None
        sample = self._waiting.pop(0)
        time, drive = sample.header.stamp, sample.drive
        return self._topics.answer(time.sec, time.nanosec, drive.acceleration, drive.steering_angle)


def _own_domain(tag: str) -> tuple[Domain, int]:
    """Take the first place in a domain where nobody has it."""
    config = _CONFIG.format(tag=tag, index=0, most=PARTICIPANTS)
    for step in range(len(DOMAINS)):
        number = DOMAINS[(os.getpid() + step) % len(DOMAINS)]
        try:
            return Domain(number, config), number
        except DDSException:
            continue
    msg = "no domain is free"
    raise BridgeError(msg)
