"""``new`` and ``init``: what they write runs as it is."""

import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml

from adeye.cli.new import (
    EXAMPLES,
    Service,
    class_name,
    example_files,
    project_files,
    write_example,
    write_files,
)
from adeye.judge.metrics.registry import METRICS, register_metric
from adeye.plugins import Part, load_part, require, validate_parameters
from adeye.ports import ScalarMeasurement, ScalarObservation
from adeye.signals import EGO_SPEED
from adeye.spec.load import load_odd, shipped
from adeye.spec.sensors import PluginSensor
from adeye.sweep.expand import expand
from adeye.testing import check_channel, check_sensor, passenger_car

# --- ``new``: writes a file once, and says how to use it


KINDS = ("channel", "sensor", "metric")


@pytest.mark.parametrize("kind", KINDS)
def test_file_is_written_once_and_its_use_printed(adeye: Any, folder: Path, kind: str) -> None:
    ended = adeye("new", kind, "lane_keeper", "--path", "parts/mine").ok
    assert ended.err == "wrote parts/mine/lane_keeper.py\n"
    assert (folder / "parts/mine/lane_keeper.py").is_file()
    assert "./lane_keeper.py:LaneKeeper" in str(yaml.safe_load(ended.out))
    (folder / "mine.py").write_text("precious")
    assert "exists and is not overwritten" in adeye("new", kind, "mine").refused
    assert (folder / "mine.py").read_text() == "precious"


def test_name_that_cannot_be_one_is_refused(adeye: Any, folder: Path) -> None:
    for name in ("Mine", "1st", "a-b", "../a", "class", "a b", "", "x" * 65):
        assert adeye("new", "channel", name).code == 2
        assert list(folder.iterdir()) == []


def test_class_names() -> None:
    names = {"follower": "Follower", "lane_keeper": "LaneKeeper", "a1_b": "A1B", "a__b": "AB"}
    assert {name: class_name(name) for name in names} == names


# --- the examples work as they are written: they pass the conformance suites and do what they say


Write = Callable[[str], Part]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write the example of a kind and load it as an architecture would."""

    def make(kind: str) -> Part:
        write_example(kind, "mine", tmp_path)
        return load_part("./mine.py:Mine", tmp_path)

    return make


def test_example_is_short_enough_to_read() -> None:
    for example in EXAMPLES.values():
        assert len([line for line in example.source.splitlines() if line.strip()]) <= 45


def test_channel_conforms_and_its_parameters_are_checked(write: Write) -> None:
    part = write("channel")
    require(part, "channel", ("act",))
    check_channel(part.obj, validate_parameters(part, {}).parameters)
    assert validate_parameters(part, {"time_gap": 2.5}).errors == ()
    assert validate_parameters(part, {"time_gpa": 2.5}).errors != ()


def delivered(detections: Any, estimate: Any) -> ScalarMeasurement:
    return ScalarMeasurement(
        stamp=1.0, fresh=True, alive=True, detections=detections, estimate=estimate
    )


def act(part: Part, *, speed: float, offset: float = 0.0, ahead: float | None = None) -> Any:
    """Ask the channel once: localisation and one object ahead."""
    context = SimpleNamespace(desired_speed=30.0, vehicle=passenger_car())
    estimate = np.zeros(13)
    estimate[3], estimate[12] = speed, offset
    detections = np.zeros((0, 7)) if ahead is None else np.array([[ahead, 0, 0, 0, 4.5, 1.8, 0]])
    measurements = {
        "localisation": delivered(np.zeros((0, 7)), estimate),
        "front_camera": delivered(detections, None),
    }
    channel = part.build(validate_parameters(part, {}).parameters, context)
    return channel.act(ScalarObservation(1.0, measurements, {}, None, None))


def test_channel_holds_its_speed_brakes_and_steers(write: Write) -> None:
    part = write("channel")
    free, near, far = (act(part, speed=30.0, ahead=ahead) for ahead in (None, 20.0, 200.0))
    assert (free.acceleration, free.steering_angle) == (0.0, 0.0)
    assert (near.acceleration, far.acceleration) == (-8.0, 0.0)
    assert act(part, speed=30.0, offset=1.0).steering_angle < 0.0
    assert act(part, speed=30.0, offset=-1.0).steering_angle > 0.0


def test_sensor_conforms_and_its_parameters_are_checked(write: Write, tmp_path: Path) -> None:
    part = write("sensor")
    require(part, "sensor", ("sense",))
    spec = PluginSensor(kind=f"{tmp_path}/mine.py:Mine", rate="10 Hz", parameters={"range": 80.0})
    check_sensor(part.build, spec)
    assert validate_parameters(part, {"range": 30}).errors == ()
    assert validate_parameters(part, {"reach": 30}).errors != ()


def test_metric_is_the_highest_speed_of_each_run_alone(write: Write) -> None:
    ego = np.zeros((2, 4, 7))
    ego[0, :, EGO_SPEED] = [10.0, 30.0, 20.0, 99.0]  # the last row is beyond the run's end
    ego[1, :, EGO_SPEED] = [5.0, 4.0, 3.0, 6.0]
    trace: Any = _Trace(np.arange(4) * 0.1, np.array([3, 4]), {"ego": ego})
    part = write("metric")
    column = part.build().compute(trace)
    assert column.value.tolist() == [30.0, 6.0]
    assert column.time.tolist() == pytest.approx([0.1, 0.3])
    assert (column.status, list(column.actor)) == (("value", "value"), [-1, -1])
    assert "mine_mps" not in METRICS
    register_metric(part.obj)
    assert METRICS.pop("mine_mps").unit == "m/s"


class _Trace:
    """As much of a trace as the example reads."""

    def __init__(self, time: Any, length: Any, columns: dict[str, Any]) -> None:
        self.time, self.length, self.columns, self.runs = time, length, columns, len(length)

    def __getitem__(self, name: str) -> Any:
        return self.columns[name]


# --- ``init``: a project that loads, counts to twelve, and never overwrites


def test_project_loads_and_has_twelve_test_cases_which_are_enough(folder: Path) -> None:
    write_files(folder, project_files())
    assert [path.name for path in (folder / "odd").glob("*.yaml")] == ["first.yaml"]
    files = load_odd(folder / "odd" / "first.yaml")
    assert expand(files).count == 12
    assert files.gate == ("camera_radar",)
    assert {item.min_exercised for item in files.concept.spec.requirements} == {1}


def test_init_says_what_it_wrote_and_what_comes_next(adeye: Any, folder: Path) -> None:
    run = "adeye run odd/first.yaml --report report.html\n"
    for arguments, where, before in ((("mine",), "mine/", "cd mine && "), ((), "", "")):
        ended = adeye("init", *arguments).ok
        assert f"wrote {where}odd/first.yaml" in ended.err
        assert ended.out == f"Next: {before}{run}"
        assert (folder / where / "odd/README.md").is_file()


def test_nothing_is_overwritten_and_then_nothing_is_written(adeye: Any, folder: Path) -> None:
    for name in project_files():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("precious")
        assert name in adeye("init").refused
        assert [path for path in folder.rglob("*") if path.is_file()] == [folder / name]
        assert (folder / name).read_text() == "precious"
        (folder / name).unlink()


# By their names: to read them all takes a tenth of the time of finding tests, with their maps.
@pytest.mark.parametrize("name", sorted(path.stem for path in shipped("odd").glob("*.yaml")))
def test_example_is_the_shipped_odd_with_all_that_it_reads(folder: Path, name: str) -> None:
    write_files(folder, example_files(name))
    ours, theirs = (
        load_odd(folder / "odd" / f"{name}.yaml"),
        load_odd(shipped("odd") / f"{name}.yaml"),
    )
    for kind in ("odd", "concept"):
        assert getattr(ours, kind).spec == getattr(theirs, kind).spec
    assert {key: item.spec for key, item in ours.architectures.items()} == {
        key: item.spec for key, item in theirs.architectures.items()
    }
    assert all(path.is_file() for path in ours.named_files())


def test_examples_are_listed_and_another_name_is_refused(adeye: Any) -> None:
    listed = adeye("init", "--list").ok.out
    assert "ramp " in listed
    assert "fault_campaign " in listed
    assert "Did you mean 'ramp'?" in adeye("init", "--example", "ramps").refused
    assert adeye("init", "mine", "--example", "ramp").ok.out == (
        "Next: cd mine && adeye run odd/ramp.yaml --report report.html\n"
    )


@pytest.mark.parametrize("service", Service)
def test_workflow_runs_every_odd_and_is_yaml(adeye: Any, folder: Path, service: Service) -> None:
    place = {Service.github: ".github/workflows/adeye.yml", Service.gitlab: ".gitlab-ci.yml"}
    done = adeye("init", "new", "--ci", service.value).ok
    assert f"wrote new/{place[service]}" in done.err
    assert "Next: cd new && adeye run odd/first.yaml" in done.out
    (folder / "odd" / "sub" / "concepts").mkdir(parents=True)
    files = ("odd/a.yaml", "odd/b c.yml", "odd/sub/a.yaml")
    for name in files:
        (folder / name).write_text(f"# An ODD\nodd: {Path(name).stem}\n")
    (folder / "odd" / "sub" / "concepts" / "c.yaml").write_text("concept: c\n")
    done = adeye("init", "--ci", service.value).ok
    assert (done.out, done.err) == ("", f"wrote {place[service]}\n")
    text = (folder / place[service]).read_text("utf-8")
    read = yaml.safe_load(text)
    job = read["jobs"]["odd"] if service is Service.github else read["safety"]
    listed = (
        job["strategy"]["matrix"]["include"] if "strategy" in job else job["parallel"]["matrix"]
    )
    assert [item["FILE"] for item in listed] == list(files)
    assert [item["ODD"] for item in listed] == ["a", "b-c", "sub-a"]
    assert "$$" not in text
    assert 'adeye run "$' in text
    assert "--junit" in text
    assert "already there" in adeye("init", "--ci", service.value).refused
    (folder / "odd" / "a$(b).yaml").write_text("odd: a\n")
    (folder / place[service]).unlink()
    assert "cannot stand in a workflow" in adeye("init", "--ci", service.value).refused


@pytest.mark.parametrize(
    ("text", "is_listed"),
    [
        ("extends: first.yaml\nseed: 8\n", True),
        ('"odd": other\nextends: first.yaml\n', True),
        ("{odd: other, extends: first.yaml}\n", True),
        ("\ufeffodd: other\nextends: first.yaml\n", True),
        ("? odd\n: other\nextends: first.yaml\n", True),
        ("extends: nothing.yaml\n", True),
        ("odd: [\n", True),
        ("extends: part.yaml\n", False),
        ("text: 'no odd: here'\n", False),
        ("- a: [\n", False),
    ],
)
def test_workflow_has_what_plan_takes_for_an_odd_and_what_may_be_a_broken_one(
    adeye: Any, folder: Path, text: str, is_listed: Any
) -> None:
    assert adeye("init").ok
    (folder / "odd" / "part.yaml").write_text("concept: c\n")
    (folder / "odd" / "second.yaml").write_text(text, encoding="utf-8")
    assert adeye("init", "--ci", "github").ok
    written = (folder / ".github" / "workflows" / "adeye.yml").read_text("utf-8")
    assert ("odd/second.yaml" in written) == is_listed
    assert "odd/first.yaml" in written


@pytest.mark.slow
def test_commands_of_the_readme_exist(adeye: Any) -> None:
    verbs = set(re.findall(rb"^    adeye (\w+)", project_files()["odd/README.md"], re.MULTILINE))
    assert verbs == {b"plan", b"run", b"query", b"show", b"replay"}
    for verb in verbs:
        assert adeye(verb.decode(), "--help").code == 0
