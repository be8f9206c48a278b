"""Channels of an architecture, and reference drivers by their names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from adeye import api
from adeye.campaign.studies.preventability import reference_architecture
from adeye.errors import SourceLocation, SpecError
from adeye.kernel.reference_drivers import drivers as reference_parameters
from adeye.selftest.bench import DB, DRIVING, Bench, Edit
from adeye.spec.channels import (
    EDITIONS,
    MODELS,
    VARIANTS,
    Channel,
    NominalChannel,
    NominalParameters,
    PluginChannel,
    PolicyChannel,
    ProcessChannel,
    ReferenceName,
    SafetyChannel,
    SafetyParameters,
    StopRatings,
    TrajectoryChannel,
    read_name,
)
from adeye.spec.load import load_architecture, load_odd, shipped
from tests.stored import stored

TABLES = stored("definitions")


# --- A reference driver as an architecture ------------------------------------------------------

CHANNEL: TypeAdapter[Any] = TypeAdapter(Channel)


@pytest.mark.parametrize(
    ("kind", "model"),
    [
        ("nominal", NominalChannel),
        ("safety", SafetyChannel),
        ("trajectory", TrajectoryChannel),
        ("./mine.py:Planner", PluginChannel),
    ],
)
def test_kind_chooses_the_model(kind: str, model: type) -> None:
    assert type(CHANNEL.validate_python({"kind": kind})) is model


def test_policy_channel_names_its_policy() -> None:
    content = {"kind": "policy", "parameters": {"policy": "./mine.py:drive", "nearest": 3}}
    channel = CHANNEL.validate_python(content)
    assert type(channel) is PolicyChannel
    assert channel.parameters.nearest == 3


def test_process_channel_names_its_program_and_what_stops_it() -> None:
    parameters = {"command": ["./drive", "--fast"], "values": {"gain": 2}, "run_deadline": "1 min"}
    channel = CHANNEL.validate_python({"kind": "process", "parameters": parameters})
    assert type(channel) is ProcessChannel
    assert channel.parameters.command == ("./drive", "--fast")
    assert (channel.parameters.run_deadline, channel.parameters.step_deadline) == (60.0, 2.0)
    assert channel.parameters.limits.processes == 16


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


@pytest.mark.parametrize("content", TABLES["impossible channel is refused"])
def test_impossible_channel_is_refused(content: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        CHANNEL.validate_python(content)


@pytest.mark.parametrize(("window", "fits"), [(0, True), (2, False), (3, True), (30, True)])
def test_window_of_confirmation_has_room_for_the_hits(window: int, *, fits: bool) -> None:
    content = {"confirm_hits": 3, "confirm_window": window}
    if fits:
        assert NominalParameters.model_validate(content).confirm_window == window
        return
    with pytest.raises(ValidationError, match="3 detections never come in 2 samples"):
        NominalParameters.model_validate(content)


def test_what_a_planned_stop_reads_is_no_part_of_the_identity_where_it_is_left_out() -> None:
    content = SafetyParameters().model_dump(mode="json")
    assert set(content) == {
        *("staleness", "confirm", "heal", "stop_deceleration", "emergency_deceleration"),
        *("danger_threshold", "max_command", "max_lane_offset", "lateral_margin"),
    }
    assert (
        SafetyParameters(stop="in_lane", ratings=StopRatings()).model_dump(mode="json") == content
    )
    planned = SafetyParameters(stop="planned", ratings=StopRatings(fast_lane=6))
    added = planned.model_dump(mode="json")
    assert added["stop"] == "planned"
    assert added["ratings"]["fast_lane"] == 6
    assert SafetyParameters.model_validate(added, context={"si": True}) == planned


@pytest.mark.parametrize(("parameters", "match"), TABLES["wrong stop is refused"])
def test_wrong_stop_is_refused(parameters: dict[str, Any], match: str) -> None:
    with pytest.raises(ValidationError, match=match):
        SafetyParameters.model_validate(parameters)


def test_way_of_stopping_is_structure_because_of_its_monitor() -> None:
    planned = SafetyChannel(kind="safety", parameters=SafetyParameters(stop="planned"))
    assert (planned.stop, SafetyChannel(kind="safety").stop) == ("planned", "in_lane")
    assert "stop" in SafetyChannel.STRUCTURE


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
    assert set(MODELS) == set(reference_parameters.MODELS)
    assert set(EDITIONS) == set(reference_parameters.EDITIONS)
    assert set(VARIANTS) == {*reference_parameters.VARIANTS, *reference_parameters.GROUPS}


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("reference:cc", ReferenceName("cc")),
        ("reference:fsm@r157", ReferenceName("fsm", "r157")),
        ("reference:cc+jrc", ReferenceName("cc", "r157-01", ("jrc",))),
        (
            "reference:reg157@eu-2022-1426+jrc-guard+jrc-lateral",
            ReferenceName("reg157", "eu-2022-1426", ("jrc-guard", "jrc-lateral")),
        ),
        ("architectures/reference_cc.yaml", None),
    ],
)
def test_name_is_read(text: str, name: ReferenceName | None) -> None:
    assert read_name(text, WHERE) == name


@pytest.mark.parametrize(
    ("text", "said"), TABLES["name that means nothing is refused at its place"]
)
def test_name_that_means_nothing_is_refused_at_its_place(odd: Any, text: str, said: str) -> None:
    with pytest.raises(SpecError) as caught:
        odd(text)
    assert said in str(caught.value)
    assert "odd.yaml:5:17" in str(caught.value)
    assert caught.value.exit_code == 2


def test_driver_drives_the_car_of_the_first_file(odd: Any) -> None:
    files = odd("reference:cc", "lidar.yaml", "camera_radar.yaml")
    lidar, driver = (files.architectures[name].spec for name in ("lidar", "reference_cc"))
    assert lidar.vehicle.length > 5.0
    assert driver.vehicle == lidar.vehicle.model_copy(update={"acceleration_lag": 0.0})
    assert list(files.architectures) == ["reference_cc", "lidar", "camera_radar"]


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
