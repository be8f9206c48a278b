"""Channels of an architecture, and reference drivers by their names."""

import shutil
from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from adeye import api
from adeye.campaign.studies.preventability import reference_architecture
from adeye.errors import SourceLocation, SpecError
from adeye.kernel.reference_drivers import reactions as reference_parameters
from adeye.selftest.bench import DB, DRIVING, Bench, Edit
from adeye.simulate.channels.safety import supervisor as supervising
from adeye.spec import channels
from adeye.spec.channels import SafetyChannel
from adeye.spec.load import load_architecture, load_odd, shipped
from adeye.spec.sensors import PluginSensor
from adeye.spec.supervisor import KINDS, Counter, Supervisor
from tests.refusals import refused
from tests.stored import stored

TABLES = stored("definitions")


# --- A reference driver as an architecture ------------------------------------------------------

CHANNEL: TypeAdapter[Any] = TypeAdapter(channels.Channel)


def test_kind_chooses_the_model() -> None:
    for kind, model in (
        ("nominal", channels.NominalChannel),
        ("safety", channels.SafetyChannel),
        ("trajectory", channels.TrajectoryChannel),
        ("./mine.py:Planner", channels.PluginChannel),
    ):
        assert type(CHANNEL.validate_python({"kind": kind})) is model


def test_policy_channel_names_its_policy() -> None:
    content = {"kind": "policy", "parameters": {"policy": "./mine.py:drive", "nearest": 3}}
    channel = CHANNEL.validate_python(content)
    assert type(channel) is channels.PolicyChannel
    assert channel.parameters.nearest == 3


def test_process_channel_names_its_program_and_what_stops_it() -> None:
    parameters = {"command": ["./drive", "--fast"], "values": {"gain": 2}, "run_deadline": "1 min"}
    channel = CHANNEL.validate_python({"kind": "process", "parameters": parameters})
    assert type(channel) is channels.ProcessChannel
    assert channel.parameters.command == ("./drive", "--fast")
    assert (channel.parameters.run_deadline, channel.parameters.step_deadline) == (60.0, 2.0)
    assert channel.parameters.limits.processes == 16


def test_code_of_the_user_is_told_what_its_identity_holds() -> None:
    written = ({"b": -0.0, "a": "e\u0301"}, {"a": "\u00e9", "b": 0.0})
    told = set()
    for free in written:
        command = ["./e\u0301.py", free["a"]]
        program = channels.ProcessParameters.model_validate({"command": command, "values": free})
        plugin = CHANNEL.validate_python({"kind": "./mine.py:Planner", "parameters": free})
        sensor = {"kind": "./mine.py:Eye", "rate": "20 Hz", "parameters": free}
        sensor["mount"] = {"x": f"{free['b']} m"}
        told.add(repr((program, plugin, PluginSensor.model_validate(sensor))))
    assert len(told) == 1
    assert program.command == ("./e\u0301.py", "\u00e9")


def test_channels_with_code_of_the_user_may_name_the_files_that_it_reads() -> None:
    for content in (
        {"kind": "policy", "parameters": {"policy": "./mine.py:drive"}},
        {"kind": "./mine.py:Planner"},
    ):
        assert CHANNEL.validate_python({**content, "files": ["net.bin"]}).files == ("net.bin",)


def test_parameters_of_the_trajectory_channel_have_units() -> None:
    parameters = {"rear_sight": "80 m", "max_jerk": "10 m/s^3", "weight_lane_change": 2}
    channel = CHANNEL.validate_python({"kind": "trajectory", "parameters": parameters})
    assert channel.parameters.rear_sight == 80.0
    assert channel.parameters.max_jerk == 10.0


def test_impossible_channel_is_refused() -> None:
    for content in TABLES["impossible channel is refused"]:
        refused(ValidationError, CHANNEL.validate_python, content)


@pytest.mark.parametrize(("window", "fits"), [(0, True), (2, False), (3, True), (30, True)])
def test_window_of_confirmation_has_room_for_the_hits(window: int, *, fits: bool) -> None:
    content = {"confirm_hits": 3, "confirm_window": window}
    if fits:
        assert channels.NominalParameters.model_validate(content).confirm_window == window
        return
    with pytest.raises(ValidationError, match="3 detections never come in 2 samples"):
        channels.NominalParameters.model_validate(content)


def test_what_a_planned_stop_reads_is_no_part_of_the_identity_where_it_is_left_out() -> None:
    content = channels.SafetyParameters().model_dump(mode="json")
    assert set(content) == {
        *("staleness", "confirm", "heal", "stop_deceleration", "emergency_deceleration"),
        *("danger_threshold", "max_command", "max_lane_offset", "lateral_margin"),
    }
    assert (
        channels.SafetyParameters(stop="in_lane", ratings=channels.StopRatings()).model_dump(
            mode="json"
        )
        == content
    )
    planned = channels.SafetyParameters(stop="planned", ratings=channels.StopRatings(fast_lane=6))
    added = planned.model_dump(mode="json")
    assert added["stop"] == "planned"
    assert added["ratings"]["fast_lane"] == 6
    assert channels.SafetyParameters.model_validate(added, context={"si": True}) == planned


def test_wrong_stop_is_refused() -> None:
    for parameters, match in TABLES["wrong stop is refused"]:
        refused(ValidationError, channels.SafetyParameters.model_validate, parameters, says=match)


def test_way_of_stopping_is_structure_because_of_its_monitor() -> None:
    planned = channels.SafetyChannel(
        kind="safety", parameters=channels.SafetyParameters(stop="planned")
    )
    assert (planned.stop, channels.SafetyChannel(kind="safety").stop) == ("planned", "in_lane")
    assert "stop" in channels.SafetyChannel.STRUCTURE


# --- Names of reference drivers, and the architectures that they stand for ------------------------

WHERE = SourceLocation("odd.yaml", 9, 17)
ODD = """\
odd: bench
scenarios:
  - use: cut_in
step: {step}
architectures: [{names}]
concept: concept.yaml
"""
FILES = shipped("odd")


@pytest.fixture
def odd(tmp_path: Path) -> Any:
    """Return a function that loads an ODD with architectures of these names."""
    concept = (FILES / "concepts" / "motorway_chauffeur.yaml").read_text("utf-8")
    (tmp_path / "concept.yaml").write_text(concept, encoding="utf-8")
    for name in ("lidar", "camera_radar", "reference_cc"):
        text = (FILES / "architectures" / f"{name}.yaml").read_text("utf-8")
        if name == "lidar":
            assert text.count("length: 4.") == 1
            text = text.replace("length: 4.", "length: 5.")
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")

    def load(*names: str, step: str = "0.05 s") -> Any:
        listed = ", ".join(f"'{name}'" for name in names)
        text = ODD.format(names=listed, step=step)
        (tmp_path / "odd.yaml").write_text(text, encoding="utf-8")
        return load_odd(tmp_path / "odd.yaml")

    return load


def test_names_are_those_that_the_models_have() -> None:
    assert set(channels.MODELS) == set(reference_parameters.MODELS)
    assert set(channels.EDITIONS) == set(reference_parameters.EDITIONS)
    assert set(channels.VARIANTS) == {*reference_parameters.VARIANTS, *reference_parameters.GROUPS}


def test_name_is_read() -> None:
    long = "reference:reg157@eu-2022-1426+jrc-guard+jrc-lateral"
    for text, name in (
        ("reference:cc", channels.ReferenceName("cc")),
        ("reference:fsm@r157", channels.ReferenceName("fsm", "r157")),
        ("reference:cc+jrc", channels.ReferenceName("cc", "r157-01", ("jrc",))),
        (long, channels.ReferenceName("reg157", "eu-2022-1426", ("jrc-guard", "jrc-lateral"))),
        ("architectures/reference_cc.yaml", None),
    ):
        assert channels.read_name(text, WHERE) == name


def test_name_that_means_nothing_is_refused_at_its_place(odd: Any) -> None:
    for text, said in TABLES["name that means nothing is refused at its place"]:
        caught = refused(SpecError, odd, text, says=said)
        assert "odd.yaml:5:17" in str(caught)
        assert caught.exit_code == 2


def test_driver_drives_the_car_of_the_first_file(odd: Any) -> None:
    files = odd("reference:cc", "lidar.yaml", "camera_radar.yaml")
    lidar, driver = (files.architectures[name].spec for name in ("lidar", "reference_cc"))
    assert lidar.vehicle.length > 5.0
    assert driver.vehicle == lidar.vehicle.model_copy(update={"acceleration_lag": 0.0})
    assert list(files.architectures) == ["reference_cc", "lidar", "camera_radar"]


def test_driver_finds_the_fmu_that_moves_the_car_of_the_first_file(
    odd: Any, tmp_path: Path
) -> None:
    shutil.copytree(FILES / "architectures", tmp_path / "elsewhere")
    files = odd("reference:cc", "elsewhere/fmu_vehicle.yaml")
    first, driver = (files.architectures[name] for name in ("fmu_vehicle", "reference_cc"))
    assert driver.spec.vehicle.plant == first.spec.vehicle.plant
    assert driver.path.parent == first.path.parent


def test_driver_alone_drives_the_shipped_car_as_the_shipped_file_does(odd: Any) -> None:
    shipped_one = load_architecture(FILES / "architectures" / "reference_cc.yaml").spec
    alone = odd("reference:cc").architectures["reference_cc"].spec
    assert alone.executable() == shipped_one.executable()


def test_driver_looks_at_every_tick_of_the_odd(odd: Any) -> None:
    made = odd("reference:fsm", step="0.1 s").architectures["reference_fsm"].spec
    assert made.channels["driver"].rate == made.sensors["truth"].rate == 10.0


def test_driver_is_the_one_that_preventability_asks(odd: Any) -> None:
    made = odd("reference:rss@r157", "camera_radar.yaml").architectures["reference_rss_r157"].spec
    vehicle = made.vehicle.model_dump(mode="json") | {"acceleration_lag": 0.4}
    asked = reference_architecture(vehicle, "rss", "r157", 0.05)
    assert made.executable() == asked.executable()


def test_edition_and_variant_reach_the_channel_and_the_id(odd: Any) -> None:
    files = odd("reference:reg157@eu-2022-1426+jrc-guard", "reference:reg157")
    (name, other) = files.architectures
    parameters = files.architectures[name].spec.channels["driver"].parameters
    assert (parameters.edition, parameters.variant) == ("eu-2022-1426", ("jrc-guard",))
    assert (name, other) == ("reference_reg157_eu_2022_1426_jrc_guard", "reference_reg157")


def test_driver_beside_a_file_of_its_id_is_listed_twice(odd: Any) -> None:
    with pytest.raises(SpecError, match="'reference_cc' is listed twice"):
        odd("reference_cc.yaml", "reference:cc")


@pytest.mark.slow
def test_driver_is_executed_judged_and_replayed_as_any_architecture(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    names = "[architectures/bare.yaml, 'reference:cc', 'reference:fsm+jrc']"
    edits = (Edit(DRIVING, "architectures: [architectures/bare.yaml]", f"architectures: {names}"),)
    assert bench.run(edits).exit_code == 0
    db = bench.settle(edits) / DB
    found = api.results(db=db)
    assert set(found.architecture) == {"bare", "reference_cc", "reference_fsm_jrc"}
    for run in found[found.architecture != "bare"].run:
        assert api.replay(str(run), db=db).identical


# --- What may stand under ``supervisor:``, and what is refused, with its place --------------------

OFF: dict[str, dict[str, Any]] = {"off": {"kind": "off_road"}}
BACKWARDS = {"kind": "odd_exit", "from_s": "9 m", "to_s": "8 m"}


def channel(supervisor: dict[str, Any], *, rate: str = "20 Hz", stop: str = "planned") -> Any:
    parameters = {"stop": stop, "supervisor": supervisor}
    return SafetyChannel.model_validate({"kind": "safety", "rate": rate, "parameters": parameters})


def test_monitor_takes_from_the_common_counter_what_it_does_not_say() -> None:
    monitors = {"a": {"kind": "off_road", "counter": {"fault": 15}}, **OFF}
    counter = {"decrement": 2, "heal": -8}
    made = Supervisor.model_validate({"counter": counter, "monitors": monitors})
    assert made.counter_of("a") == Counter(increment=1, decrement=2, fault=15, heal=-8)
    assert made.counter_of("off") == Counter(increment=1, decrement=2, fault=4, heal=-8)


def test_levels_that_are_not_named_ask_for_the_usual() -> None:
    made = Supervisor.model_validate({"monitors": OFF, "manoeuvres": {"3": "stop"}})
    assert list(made.manoeuvres.values()) == ["continue", "rest_area", "stop", "stop"]


def test_monitors_are_in_the_order_of_their_names() -> None:
    made = Supervisor.model_validate({"monitors": {"b": {"kind": "off_road"}, "a": OFF["off"]}})
    assert list(made.monitors) == ["a", "b"]


def test_content_can_be_stored_and_read_back() -> None:
    made = channel({"monitors": {"x": {"kind": "odd_exit", "max_speed": "30 m/s"}}})
    stored = made.model_dump(mode="json")
    assert SafetyChannel.model_validate(stored, context={"si": True}) == made


def test_safety_channel_without_one_has_its_old_content_and_structure() -> None:
    plain = SafetyChannel.model_validate({"kind": "safety"})
    assert "supervisor" not in plain.model_dump(mode="json")["parameters"]
    assert plain.monitors is None
    assert channel({"monitors": OFF}).monitors == [["off", "off_road", []]]


def test_kernels_know_the_kinds_by_their_place() -> None:
    for name in ("channel_silent", "sensor_silent", "last_safe_stop"):
        assert KINDS[getattr(supervising, name.upper())] == name


def test_wrong_supervisor_is_refused() -> None:
    for supervisor, place, match in (
        ({"monitors": {}}, "monitors", "at least 1 item"),
        ({"monitors": {"a": {"kind": "of_road"}}}, "a", "channel_silent"),
        ({"counter": {"fault": -4}, "monitors": OFF}, "fault", "-4 is not more than -4"),
        ({"monitors": {"a": OFF["off"] | {"counter": {"heal": 4}}}}, "counter", "4 is not more"),
        ({"counter": {"increment": 0}, "monitors": OFF}, "increment", "greater than or equal to 1"),
        ({"counter": {"fault": 1.5}, "monitors": OFF}, "fault", "integer"),
        ({"monitors": {"a": {"kind": "off_road", "level": 5}}}, "level", "less than or equal to 4"),
        ({"monitors": {"mrm_stop": {"kind": "off_road"}}}, "mrm_stop", "another name"),
        ({"monitors": {"a": {"kind": "channel_silent"}}}, "watches", "required"),
        ({"monitors": {"a": {"kind": "sensor_silent", "watches": ["x", "x"]}}}, "1", "twice"),
        ({"monitors": {"a": {"kind": "odd_exit"}}}, "kind", "asks nothing"),
        ({"monitors": {"a": BACKWARDS}}, "to_s", "more than from_s"),
        ({"monitors": OFF, "manoeuvres": {"3": "continue"}}, "3", "milder than 'rest_area'"),
        ({"monitors": OFF, "manoeuvres": {"5": "stop"}}, "5", "'1', '2', '3' or '4'"),
        ({"monitors": OFF, "rate": "8 Hz"}, "rate", "6.66667 Hz and 10 Hz"),
        ({"monitors": OFF, "rate": "30 Hz"}, "rate", "nearest that do are 10 Hz and 20 Hz"),
    ):
        caught = refused(ValidationError, channel, supervisor)
        wrong = caught.errors()
        assert len(wrong) == 1
        assert place in [str(step) for step in wrong[0]["loc"]]
        assert match in wrong[0]["msg"] or match in str(wrong[0])


def test_monitors_that_only_objects_make_fire_are_told() -> None:
    kinds = {"near": "critical_area", "rss": "rss_danger", "path": "object_danger"}
    monitors = {name: {"kind": kind} for name, kind in kinds.items()}
    assert channel({"monitors": monitors | OFF}).object_monitors == ("near", "path", "rss")
    assert SafetyChannel(kind="safety").object_monitors == ("object_danger",)


def test_last_safe_stop_takes_a_planner() -> None:
    last = {"monitors": {"last": {"kind": "last_safe_stop"}}}
    assert channel(last).parameters.supervisor is not None
    refused(ValidationError, channel, last, stop="in_lane", says="takes stop: planned")
