"""Channels at an address: what programs answer over a pipe, over a connection of TCP."""

import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from adeye.analysis.dependence import dependencies
from adeye.campaign.replay import replay_run
from adeye.errors import PlatformError
from adeye.signals import SILENT, ControlCommand, Observation
from adeye.simulate.channels.process.channel import ProcessChannel, RemoteChannel
from adeye.spec.architecture import Architecture
from adeye.spec.channels import Place, ProcessParameters, RemoteParameters
from adeye.testing import channel_context, zoo
from adeye.trace import ChannelEvent
from tests.conftest import MakeProject
from tests.motorway import ARCHITECTURE, cut_ins
from tests.project import CANDIDATE, Project
from tests.refusals import refused

TICKS = 8
PATIENCE_S = 0.5


class Bench:
    """A host: it starts a program of the zoo for each connection, as inetd would.

    Attributes:
        address: Where it listens.
        connections: How many it has had.
    """

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._programs: list[subprocess.Popen[bytes]] = []
        self.address = f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"
        self.connections = 0
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        with suppress(OSError):
            while True:
                connection, _ = self._listener.accept()
                self.connections += 1
                with connection:
                    command = [sys.executable, "-I", "-S", "-B", str(zoo.PROGRAM)]
                    end = connection.fileno()
                    self._programs.append(
                        subprocess.Popen(command, stdin=end, stdout=end, stderr=subprocess.DEVNULL)
                    )

    @property
    def ended(self) -> bool:
        """Whether every program that was started ends within some seconds."""
        until = time.monotonic() + 5.0
        while any(item.poll() is None for item in self._programs):
            if time.monotonic() > until:
                return False
            time.sleep(0.01)
        return True

    def close(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for item in self._programs:
            item.kill()
            item.wait()


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def at(address: str, animal: str = "", **content: Any) -> RemoteParameters:
    given = {
        "address": address,
        "version": "zoo",
        "values": {"animal": animal, "from_tick": 3},
        "start_deadline": "60 s",
        "step_deadline": f"{PATIENCE_S} s",
    }
    return RemoteParameters.model_validate({**given, **content})


def drive(channel: ProcessChannel, given: list[Any]) -> list[ControlCommand]:
    runs = len(given)
    channel.reset(channel_context(given, links=(), sensors={}, runs=runs))
    running = np.ones(runs, dtype=np.bool_)
    answers = [
        channel.act(Observation(0.05 * tick, {}, {}, None, running)).copy() for tick in range(TICKS)
    ]
    channel.close()
    return answers


def event_of(given: RemoteParameters) -> ChannelEvent:
    channel = RemoteChannel(Path())
    answers = drive(channel, [given])
    (event,) = channel.events
    assert event is not None
    assert answers[-1].status.tolist() == [SILENT]
    return event


def test_program_answers_over_a_connection_as_over_a_pipe(bench: Bench, tmp_path: Path) -> None:
    zoo.settle(tmp_path)
    near = ProcessParameters.model_validate(zoo.parameters())
    over_pipe = drive(ProcessChannel(tmp_path), [near])
    over_tcp = drive(RemoteChannel(tmp_path), [at(bench.address)])
    for one, other in zip(over_pipe, over_tcp, strict=True):
        for name in ("acceleration", "steering_angle", "stamp", "status"):
            assert np.array_equal(getattr(one, name), getattr(other, name))


def test_each_run_has_a_connection_and_none_is_left(bench: Bench) -> None:
    before = len(list(Path("/proc/self/fd").iterdir()))
    channel = RemoteChannel(Path())
    answers = drive(channel, [at(bench.address)] * 5)
    assert (bench.connections, channel.events) == (5, [None] * 5)
    assert answers[-1].acceleration.tolist() == [0.1] * 5
    assert len(list(Path("/proc/self/fd").iterdir())) == before
    assert bench.ended


NONSENSE = [
    name
    for name, animal in zoo.ANIMALS.items()
    if animal.outcome == "channel_invalid_output"
    and name not in {"says_half_a_line", "says_another_version"}
]


@pytest.mark.parametrize("name", NONSENSE)
def test_nonsense_is_called_what_it_is_called_over_a_pipe(bench: Bench, name: str) -> None:
    event = event_of(at(bench.address, name))
    detail = zoo.ANIMALS[name].detail.replace("6, not 5", "4, not 3").replace("2, not 5", "0, not")
    assert event.outcome == "channel_invalid_output"
    assert detail.replace("tick 5, not 6", "tick 3, not 4") in event.detail


@pytest.mark.parametrize("name", ["raises", "segfaults", "leaves", "fails_at_once"])
def test_peer_that_dies_has_closed_its_connection(bench: Bench, name: str) -> None:
    event = event_of(at(bench.address, name))
    assert (event.outcome, event.detail) == ("channel_error", "it closed its connection")
    assert event.is_machine_dependent


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sleeps", "never_says_hello", "says_half_a_line_and_waits"])
def test_peer_that_hangs_is_given_up_at_its_deadline(bench: Bench, name: str) -> None:
    began = time.perf_counter()
    event = event_of(at(bench.address, name, start_deadline=f"{PATIENCE_S} s"))
    assert (event.outcome, event.is_machine_dependent) == ("channel_timeout", True)
    assert time.perf_counter() - began < PATIENCE_S + 2.0


def test_half_a_line_is_told(bench: Bench) -> None:
    event = event_of(at(bench.address, "says_half_a_line"))
    assert event.detail == "a part of a line, then it closed its connection"


def test_peer_of_another_version_is_refused(bench: Bench) -> None:
    event = event_of(at(bench.address, version="zoo 2"))
    assert event.outcome == "channel_invalid_output"
    assert event.detail == "its first line says version 'zoo', not 'zoo 2'"


def test_failing_run_leaves_the_others_their_bits(bench: Bench) -> None:
    names = ["", "raises", "says_nan", "says_unknown_status", ""]
    channel = RemoteChannel(Path())
    answers = drive(channel, [at(bench.address, name) for name in names])
    assert answers[-1].acceleration[[0, 4]].tolist() == [0.1, 0.1]
    assert [event is None for event in channel.events] == [True, False, False, False, True]


def test_address_where_nobody_listens_is_no_failure_of_the_channel() -> None:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        address = f"tcp://127.0.0.1:{probe.getsockname()[1]}"
    says = "no connection to 127.0.0.1"
    refused(PlatformError, drive, RemoteChannel(Path()), [at(address)], says=says)


# What an architecture may say.


@pytest.mark.parametrize("version", ["", " ", "—", "zoo\n2", "zoo\u20282", "zoo\x1b[1A"])
def test_version_is_a_line_that_says_something(version: str) -> None:
    refused(ValidationError, at, "tcp://127.0.0.1:7000", version=version, says="version")


@pytest.mark.parametrize("host", ["127.0.0.1", "127.9.9.9", "[::1]", "localhost"])
def test_addresses_on_this_machine_need_no_word(host: str) -> None:
    assert at(f"tcp://{host}:7000").place.is_here


@pytest.mark.parametrize("host", ["10.0.0.5", "bench.local", "[2001:db8::1]", "localhost.evil.org"])
def test_other_addresses_need_the_word(host: str) -> None:
    refused(ValidationError, at, f"tcp://{host}:7000", says="network: unprotected")
    assert not at(f"tcp://{host}:7000", network="unprotected").place.is_here


@pytest.mark.parametrize(
    "text",
    [
        *("127.0.0.1:7000", "udp://127.0.0.1:7000", "tcp://127.0.0.1", "tcp://:7000"),
        *("tcp://h:0", "tcp://h:65536", "tcp://h:7000/x", "tcp://a b:7000", "tcp://user@h:7000"),
    ],
)
def test_what_is_no_address_is_refused(text: str) -> None:
    refused(ValueError, Place.read, text, says="is no address like tcp://127.0.0.1:7000")


def test_channels_on_one_host_share_it() -> None:
    content = dict(ARCHITECTURE)
    kind = {"kind": "remote", "links": [], "rate": "20 Hz"}
    content["channels"] = {
        name: {**kind, "parameters": {"address": f"tcp://localhost:{port}", "version": "1"}}
        for name, port in (("one", 7000), ("two", 7001))
    }
    content["switch"] = {**content["switch"], "priority": ["one", "two"], "default": "one"}
    (pair,) = dependencies(Architecture.model_validate(content), ()).pairs
    assert ("localhost", "host that both are on") in {(it.what, it.how) for it in pair.shared}


# What a campaign makes of it.


def remote_project(make_project: MakeProject, address: str, animal: str = "") -> Project:
    project = make_project(cut_ins("remote", "30 m", "50 m"))
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["guest"] = {
            "kind": "remote",
            "links": ["localisation"],
            "rate": "20 Hz",
            "parameters": {
                "address": address,
                "version": "zoo",
                "values": {"animal": animal, "from_tick": 5},
            },
        }
    return project


@pytest.mark.slow
def test_results_are_marked_and_count_by_the_version(
    make_project: MakeProject, bench: Bench
) -> None:
    project = remote_project(make_project, bench.address)
    assert any("counts by its word, version zoo" in text for text in project.plan().notices)
    project.run()
    rows = project.rows()
    assert [(row["outcome"], bool(row["machine_dependent"])) for row in rows] == [
        ("completed", True)
    ] * 2
    # A connection for each run, not for each tick or campaign.
    assert bench.connections == 2
    assert replay_run(project.db, rows[0]["run"]).identical
    assert project.run().executed == 0
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["guest"]["parameters"]["version"] = "zoo 2"
    assert project.run().executed == 2
    assert {row["outcome"] for row in project.rows()} == {"channel_invalid_output"}


@pytest.mark.slow
def test_host_that_answers_otherwise_today_is_told_by_a_replay(
    make_project: MakeProject, bench: Bench
) -> None:
    project = remote_project(make_project, bench.address, "reads_the_clock")
    project.run()
    replayed = replay_run(project.db, project.rows()[0]["run"])
    assert not replayed.identical
    assert "depends on the machine" in replayed.note


def test_host_that_is_not_there_leaves_nothing_behind(make_project: MakeProject) -> None:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        address = f"tcp://127.0.0.1:{probe.getsockname()[1]}"
    project = remote_project(make_project, address)
    refused(PlatformError, project.run, says="no connection to 127.0.0.1")
    assert [row for row in project.rows() if row["outcome"]] == []


def test_way_to_another_host_is_said_to_be_unprotected(make_project: MakeProject) -> None:
    project = remote_project(make_project, "tcp://10.0.0.5:7000")
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["guest"]["parameters"]["network"] = "unprotected"
    assert any("reached unprotected: nothing is encr" in text for text in project.plan().notices)
