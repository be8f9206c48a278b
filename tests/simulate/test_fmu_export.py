"""Parts as FMUs: driven by an importer of others they do what they do inside."""

import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from adeye import signals
from adeye.errors import AdeyeError, UsageError
from adeye.signals import Authority, ControlCommand, Measurement, Observation, Scene
from adeye.simulate import engine, parts
from adeye.simulate.channels import links, rack
from adeye.simulate.fmu_export import OF_SCENARIO, Export, write_fmu
from adeye.simulate.sensors.rig import Rig
from adeye.spec.architecture import Architecture
from adeye.spec.fault import FAULT
from adeye.spec.load import load_architecture, load_scenario, merge
from adeye.sweep.axes import default_values
from adeye.sweep.case import TestCase, lone_case
from adeye.trace import Trace
from adeye.version import __version__
from tests.refusals import refused

fmpy = pytest.importorskip("fmpy", reason="needs adeye[fmi]")
pytest.importorskip("pythonfmu3", reason="needs adeye[fmi]")

ROOT = Path(__file__).resolve().parents[2]
STEP = 0.05
SILENT = {
    "id": "radar_silent",
    "target": "sensors.front_radar",
    "model": "drop_out",
    "onset": {"at": "2 s"},
}

Named = dict[str, Any]


def case_of(
    architecture: str = "camera_radar", scenario: str = "motorway/cut_in", *faults: Any
) -> TestCase:
    record = load_scenario(ROOT / "scenarios_db" / f"{scenario}.yaml").spec
    case = lone_case(
        record,
        load_architecture(ROOT / "odd" / "architectures" / f"{architecture}.yaml").spec,
        default_values(record),
        step=STEP,
        seed=7,
    )
    found = tuple(FAULT.validate_python(item) for item in faults)
    return replace(case, faults=found, fault_entry="+".join(item.id for item in found) or "none")


def architecture_content(name: str) -> Any:
    return load_architecture(ROOT / "odd" / "architectures" / f"{name}.yaml").content


def values_of(found: Sequence[parts.Value]) -> Named:
    return {value.name: value.get() for value in found}


def export_of(kind: Any, name: str, case: TestCase) -> Export:
    found = Export(kind, case.architecture, case.step)
    if kind not in OF_SCENARIO:
        return found
    more: Any = {"scenario": case.scenario, "parameters": case.parameters, "seed": case.seed}
    return replace(found, name=name, **more)


class Taken(NamedTuple):
    """What went in and came out of the parts of a run, by tick.

    Attributes:
        trace: Of the run.
        scenes: What was true.
        sensed: What the sensors delivered, before faults.
        shown: What each channel was shown; None where it was not its turn.
        answers: Commands before faults.
        proposals: Commands after faults.
        decided: Who got authority.
    """

    trace: Trace
    scenes: list[Scene]
    sensed: list[dict[str, Measurement]]
    shown: list[dict[str, Observation]]
    answers: list[list[ControlCommand]]
    proposals: list[list[ControlCommand]]
    decided: list[Authority]


def watch(case: TestCase, monkeypatch: pytest.MonkeyPatch) -> Taken:
    """Run a test case and take down what its parts are told and answer."""
    taken = Taken(Any, [], [], [], [], [], [])  # type: ignore[arg-type]
    names = {spec.links: name for name, spec in case.architecture.channels.items()}
    look = links.observe

    def observe(linked: tuple[str, ...], *given: Any, **more: Any) -> Observation:
        found = look(linked, *given, **more)
        measurements = {name: item.copy() for name, item in found.measurements.items()}
        commands = {name: item.copy() for name, item in found.commands.items()}
        taken.shown[-1][names[linked]] = replace(
            found, measurements=measurements, commands=commands
        )
        return found

    class Watched(rack.ChannelRack):
        def act(self, *given: Any, **more: Any) -> list[ControlCommand]:
            taken.shown.append({})
            answers = super().act(*given, **more)
            taken.answers.append([item.copy() for item in answers])
            return answers

        def remember(self, proposals: Sequence[ControlCommand], authority: Authority) -> None:
            taken.proposals.append([item.copy() for item in proposals])
            taken.decided.append(Authority(authority.channel.copy(), authority.reason.copy()))
            super().remember(proposals, authority)

    class Sensing(Rig):
        def sense(self, scene: Scene) -> dict[str, Measurement]:
            taken.scenes.append(scene.copy())
            found = super().sense(scene)
            taken.sensed.append({name: item.copy() for name, item in found.items()})
            return found

    monkeypatch.setattr(rack, "observe", observe)
    monkeypatch.setattr(engine, "ChannelRack", Watched)
    monkeypatch.setattr(engine, "Rig", Sensing)
    return taken._replace(trace=engine.run([case]))


class Imported:
    """An FMU in an importer of others, which knows nothing of adeye."""

    TYPES = ("Float64", "Boolean", "Int64")

    def __init__(self, path: Path, folder: Path, **start: Any) -> None:
        from fmpy.simulation import instantiate_fmu

        self.description = fmpy.read_model_description(str(path), validate=True)
        fmpy.extract(str(path), str(folder))
        self._fmu = instantiate_fmu(str(folder), self.description, fmi_type="CoSimulation")
        self._known = {item.name: item for item in self.description.modelVariables}
        self._time = 0.0
        self._fmu.enterInitializationMode(startTime=0.0)
        self.set(start)
        self._fmu.exitInitializationMode()

    def set(self, values: Named) -> None:
        for kind in self.TYPES:
            names = [name for name in values if self._known[name].type == kind]
            found = [self._known[name].valueReference for name in names]
            if names:
                getattr(self._fmu, f"set{kind}")(found, [values[name] for name in names])

    def step(self, values: Named, size: float = STEP) -> Named:
        self.set(values)
        self._fmu.doStep(currentCommunicationPoint=self._time, communicationStepSize=size)
        self._time += size
        return self.outputs()

    def known(self, values: Named) -> Named:
        """Return those of some values that are its variables."""
        return {name: value for name, value in values.items() if name in self._known}

    def outputs(self) -> Named:
        told: Named = {}
        for kind in self.TYPES:
            found = [
                item
                for item in self._known.values()
                if item.causality == "output" and item.type == kind
            ]
            answer = getattr(self._fmu, f"get{kind}")([item.valueReference for item in found])
            told |= {item.name: value for item, value in zip(found, answer, strict=True)}
        return told

    def reset(self) -> None:
        self._fmu.reset()
        self._time = 0.0
        self._fmu.enterInitializationMode(startTime=0.0)
        self._fmu.exitInitializationMode()

    def close(self) -> None:
        self._fmu.freeInstance()


@pytest.fixture
def imported(tmp_path: Path) -> Iterator[Any]:
    """Give what writes a part as an FMU, validates it and imports it."""
    made: list[Imported] = []

    def make(kind: Any, name: str, case: TestCase, **start: Any) -> Imported:
        from fmpy.validation import validate_fmu

        path = tmp_path / f"{len(made)}.fmu"
        write_fmu(export_of(kind, name, case), path)
        assert validate_fmu(str(path)) == []
        made.append(Imported(path, tmp_path / f"{len(made)}", **start))
        return made[-1]

    yield make
    for item in made:
        item.close()


def require_same(told: Named, wanted: Named, tick: int) -> None:
    assert {name: told[name] for name in wanted} == pytest.approx(
        wanted, rel=0.0, abs=1e-9, nan_ok=True
    ), f"tick {tick}"


def told_of(observation: Observation, channels: tuple[str, ...]) -> Named:
    """Return what a channel was shown by the names of the inputs."""
    found = [
        value
        for name, item in observation.measurements.items()
        for value in parts.measurement_values(name, item)
    ]
    for name, command in observation.commands.items():
        found += parts.command_values(f"channels.{name}.", command, ())
    if observation.authority is not None:
        found += parts.authority_values("switch.", observation.authority, channels)
    return values_of(found)


CHANNELS = [
    ("camera_radar", "motorway/cut_in", "safety"),
    ("camera_radar", "motorway/cut_in", "nominal"),
    ("supervised", "motorway/cut_in", "safety"),
    ("trajectory", "motorway/cut_in", "nominal"),
    ("study_lidar_roof", "urban/pedestrian_crossing", "nominal"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("architecture", "scenario", "name"), CHANNELS)
def test_channel_answers_as_inside(
    architecture: str,
    scenario: str,
    name: str,
    imported: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    case = case_of(architecture, scenario, *([SILENT] if scenario.startswith("motorway") else []))
    with monkeypatch.context() as patch:
        taken = watch(case, patch)
    channels = tuple(case.architecture.channels)
    place = channels.index(name)
    fmu = imported("channel", name, case)
    for tick, (shown, answers) in enumerate(zip(taken.shown, taken.answers, strict=True)):
        told = fmu.step(told_of(shown[name], channels) if name in shown else {})
        command = parts.command_values("", answers[place], ())
        require_same(told, values_of(command), tick)
    assert tick > 100


@pytest.mark.slow
def test_arbiter_decides_as_inside_and_the_fault_makes_it_decide_otherwise(
    imported: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    silent = {"id": "out", "target": "channels.nominal", "model": "silent", "onset": {"at": "2 s"}}
    case = case_of("camera_radar", "motorway/cut_in", silent)
    with monkeypatch.context() as patch:
        taken = watch(case, patch)
    trace, channels = taken.trace, tuple(case.architecture.channels)
    fmu, stuck = imported("arbiter", "", case), imported("arbiter", "", case)
    for tick, proposals in enumerate(taken.proposals):
        told: Named = {}
        for name, command in zip(channels, proposals, strict=True):
            told |= values_of(parts.command_values(f"{name}.", command, ()))
        acceleration, angle = trace["command"][0, tick].tolist()
        wanted = {"acceleration": acceleration, "steering_angle": angle}
        wanted |= values_of(parts.authority_values("", taken.decided[tick], channels))
        require_same(fmu.step(told), wanted, tick)
        last = stuck.step({**told, "faults.stuck": True})
    assert wanted["authority"] == channels.index("safety")
    assert last["authority"] != wanted["authority"]


@pytest.mark.slow
def test_plant_moves_as_inside_and_in_the_place_of_it(imported: Any, tmp_path: Path) -> None:
    case = case_of()
    trace = engine.run([case])
    ego, command = trace["ego"][0], trace["command"][0]
    names = ("x", "y", "heading", "speed", "acceleration", "steering_angle", "yaw_rate")
    begin = {f"start.{name}": float(ego[0, place]) for place, name in enumerate(names[:4])}
    friction = float(trace.layout.context.surroundings.friction[0])
    fmu = imported("plant", "", case, **begin)
    require_same(fmu.outputs(), dict(zip(names[:4], ego[0].tolist(), strict=False)), 0)
    for tick in range(int(trace.length[0]) - 1):
        told = {
            "command.acceleration": float(command[tick, 0]),
            "command.steering_angle": float(command[tick, 1]),
            "friction": friction,
        }
        wanted = dict(zip(names, ego[tick + 1].tolist(), strict=True))
        require_same(fmu.step(told), wanted, tick)
    plant = {
        "file": "./0.fmu",
        "inputs": {
            "command.acceleration": "acceleration",
            "command.steering_angle": "steering_angle",
            "friction": "friction",
        },
        "initial": {name: f"start.{name}" for name in names[:4]},
        "outputs": {name: name for name in names},
    }
    content = merge(architecture_content("camera_radar"), {"vehicle": {"plant": plant}})
    driven = replace(case, architecture=Architecture.model_validate(content))
    again = engine.run([driven], base_dirs={"camera_radar": tmp_path})
    assert again.length.tolist() == trace.length.tolist()
    assert again["ego"] == pytest.approx(trace["ego"], rel=0.0, abs=1e-9)


SENSORS = [
    ("camera_radar", "motorway/cut_in", "front_radar"),
    ("camera_radar", "motorway/cut_in", "localisation"),
    ("supervised", "motorway/cut_in", "safety_lidar"),
    ("study_camera_radar", "urban/pedestrian_crossing", "front_radar"),
    ("study_lidar_roof", "urban/pedestrian_crossing", "front_lidar"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("architecture", "scenario", "name"), SENSORS)
def test_sensor_delivers_as_inside(
    architecture: str,
    scenario: str,
    name: str,
    imported: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    case = case_of(architecture, scenario)
    with monkeypatch.context() as patch:
        taken = watch(case, patch)
    objects = taken.trace.layout.context.object_ids
    fmu = imported("sensor", name, case)
    for tick, (scene, sensed) in enumerate(zip(taken.scenes, taken.sensed, strict=True)):
        told = {
            f"ego.{column}": float(scene.ego[0, place])
            for place, column in enumerate(signals.EGO_COLUMNS)
        }
        for row, thing in enumerate(objects):
            for place, column in enumerate(signals.OBJECT_COLUMNS):
                told[f"objects.{thing}.{column}"] = float(scene.objects[0, row, place])
        answer = fmu.step(told)
        wanted = values_of(list(parts.measurement_values(name, sensed[name])))
        named = {key.removeprefix(f"{name}."): value for key, value in wanted.items()}
        if sensed[name].points is not None:
            # What is found in the returns of a lidar is no part of what it returns.
            named = {key: v for key, v in named.items() if not key.startswith("detections")}
        require_same(answer, named, tick)
    assert tick > 100


@pytest.mark.slow
def test_parts_side_by_side_are_the_closed_loop(imported: Any) -> None:
    case = case_of()
    trace = engine.run([case])
    architecture = case.architecture
    sensors = {name: imported("sensor", name, case) for name in architecture.sensors}
    channels = {name: imported("channel", name, case) for name in architecture.channels}
    arbiter = imported("arbiter", "", case)
    begin = dict(zip(signals.EGO_COLUMNS[:4], trace["ego"][0, 0].tolist(), strict=False))
    car = imported("plant", "", case, **{f"start.{name}": v for name, v in begin.items()})
    friction = float(trace.layout.context.surroundings.friction[0])
    ego, commands, decided = car.outputs(), dict[str, Any](), dict[str, Any]()
    for tick in range(200):
        require_same(ego, dict(zip(signals.EGO_COLUMNS, trace["ego"][0, tick], strict=True)), tick)
        scene = {f"ego.{name}": value for name, value in ego.items()}
        for row, thing in enumerate(trace.layout.context.object_ids):
            for name, value in zip(
                signals.OBJECT_COLUMNS, trace["objects"][0, tick, row].tolist(), strict=True
            ):
                scene[f"objects.{thing}.{name}"] = value
        told = {
            f"{name}.{key}": value
            for name, sensor in sensors.items()
            for key, value in sensor.step(scene).items()
        }
        told |= {f"channels.{key}": value for key, value in commands.items()}
        told |= {f"switch.{key}": value for key, value in decided.items()}
        answers = {name: channel.step(channel.known(told)) for name, channel in channels.items()}
        commands = {
            f"{n}.{key}": value for n, item in answers.items() for key, value in item.items()
        }
        acting = arbiter.step(arbiter.known(commands))
        decided = {name: acting[name] for name in ("authority", "reason")}
        given = {f"command.{name}": acting[name] for name in ("acceleration", "steering_angle")}
        ego = car.step({**given, "friction": friction})


# --- What needs no run ----------------------------------------------------------------------------


def plant(path: Path, **more: Any) -> Path:
    write_fmu(replace(export_of("plant", "", case_of()), **more), path)
    return path


def test_names_and_units_are_told(imported: Any) -> None:
    case = case_of()
    fmu = imported("arbiter", "", case)
    assert [(item.name, item.unit) for item in fmu.description.modelVariables[1:5]] == [
        ("nominal.acceleration", "m/s2"),
        ("nominal.steering_angle", "rad"),
        ("nominal.stamp", "s"),
        ("nominal.status", None),
    ]
    assert fmu.description.defaultExperiment.stepSize == str(STEP)
    moved = imported("plant", "", case)
    assert [item.name for item in moved.description.modelVariables][4:6] == [
        "start.speed",
        "command.acceleration",
    ]


def test_same_export_has_the_same_bytes(tmp_path: Path) -> None:
    assert plant(tmp_path / "1.fmu").read_bytes() == plant(tmp_path / "2.fmu").read_bytes()


def test_two_in_one_process_and_a_reset_keep_apart(imported: Any) -> None:
    case = case_of()
    one, other = imported("plant", "", case), imported("plant", "", replace(case, step=0.01))
    told = {"command.acceleration": 1.0}
    first = [one.step(told)["speed"] for _ in range(3)]
    assert other.step(told, 0.05)["speed"] != first[0]
    one.reset()
    assert [one.step(told)["speed"] for _ in range(3)] == first


@pytest.mark.parametrize(("time", "size"), [(0.0, 0.03), (0.1, 0.05), (0.0, 0.0)])
def test_step_that_does_not_fit_is_an_error(
    imported: Any, time: float, size: float, capfd: pytest.CaptureFixture[str]
) -> None:
    fmu = imported("plant", "", case_of())
    fmu._time = time
    with pytest.raises(fmpy.fmi1.FMICallException, match=r"status 3 \(error\)"):
        fmu.step({}, size)
    assert "takes steps of 0.05 s" in capfd.readouterr().err
    fmu._time = 0.0
    assert fmu.step({"command.acceleration": 1.0})["speed"] > 0.0


def changed(path: Path, old: bytes, new: bytes) -> Path:
    """Return a copy of an FMU with other content."""
    made = path.with_name("changed.fmu")
    with zipfile.ZipFile(path) as found, zipfile.ZipFile(made, "w") as archive:
        for name in found.namelist():
            content = found.read(name)
            if name.endswith("adeye_part.json"):
                assert old in content
                content = content.replace(old, new)
            archive.writestr(name, content)
    return made


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (f'"adeye":"{__version__}"', '"adeye":"0.0.9"', "this FMU is of adeye 0.0.9"),
        ('"wheelbase":2.9', '"wheelbase":2.8', "not as it was exported"),
    ],
)
def test_other_version_and_changed_content_are_refused(
    old: str, new: str, says: str, tmp_path: Path
) -> None:
    path = changed(plant(tmp_path / "plant.fmu"), old.encode(), new.encode())
    with zipfile.ZipFile(path) as archive:
        text = archive.read(archive.namelist()[0]).decode()
    with pytest.raises(AdeyeError, match=says):
        Export.read(text)
    with pytest.raises(Exception, match="Failed to instantiate"):
        Imported(path, tmp_path / "there")


@pytest.mark.parametrize(
    ("kind", "architecture", "name", "says"),
    [
        ("channel", "camera_radar", "safty", "Did you mean 'safety'"),
        ("sensor", "camera_radar", "front", "there is no sensor 'front'"),
        ("channel", "fmu_controller", "nominal", "of kind fmu, no part of the package"),
        ("plant", "fmu_vehicle", "", "is an FMU already"),
    ],
)
def test_what_cannot_be_exported_is_refused(
    kind: Any, architecture: str, name: str, says: str, tmp_path: Path
) -> None:
    export = export_of(kind, name, case_of(architecture))
    refused(UsageError, write_fmu, export, tmp_path / "part.fmu", says=says)
    assert not list(tmp_path.iterdir())
