"""Faults: onsets, targets, what is no fault, those of vehicle, channels and switch."""

from typing import Any, get_args

import pytest
import yaml
from pydantic import ValidationError

from adeye.spec.architecture import Architecture
from adeye.spec.fault import FAULT, MODELS, Late, idle_faults, model_of
from adeye.spec.fault_base import LONGEST_LAG, Fault, Onset
from adeye.spec.load import shipped
from adeye.spec.quantity import SI
from tests.refusals import refused
from tests.stored import stored

TABLES = stored("definitions")


# --- Faults: the model fits the target, the onset is one, and identity is what is executed --------

OUT: dict[str, Any] = {
    "id": "camera_out",
    "target": "sensors.front_camera",
    "model": "drop_out",
    "onset": {"at": "2 s"},
    "duration": "500 ms",
}


def test_times_are_in_seconds_and_a_duration_may_be_left_out() -> None:
    fault = FAULT.validate_python(OUT)
    assert (fault.onset.at, fault.duration, fault.target_id) == (2.0, 0.5, "front_camera")
    assert FAULT.validate_python({k: v for k, v in OUT.items() if k != "duration"}).duration is None


def test_what_is_no_fault_is_refused() -> None:
    for changes, said in TABLES["what is no fault is refused"]:
        refused(ValidationError, FAULT.validate_python, {**OUT, **changes}, says=said)


def test_stored_fault_reads_back() -> None:
    triggered = FAULT.validate_python({**OUT, "onset": {"when": "lead.gap < 20 m"}})
    stored = triggered.model_dump(mode="json")
    assert FAULT.validate_python(stored, context=SI) == triggered


def test_identity_of_a_fault_that_comes_once_is_what_it_was_and_its_text_no_part_of_it() -> None:
    for text in ({}, {"text": "cable broken"}):
        assert FAULT.validate_python({**OUT, **text}).executable() == {
            **OUT,
            "onset": {"at": 2.0, "when": None},
            "duration": 0.5,
        }
    again = FAULT.validate_python({**OUT, "every": "2 s", "times": 3}).executable()
    assert (again["every"], again["times"]) == (2.0, 3)


def test_name_of_a_model_is_one_for_each_kind_of_target() -> None:
    names = [(port, model_of(model)) for model in MODELS for port in model.fits]
    assert len(names) == len(set(names))


# --- What every fault has, whatever its model -----------------------------------------------------


def test_onset_keeps_the_one_way_that_it_is_given_in_si() -> None:
    onset = Onset.model_validate({"between": ["500 ms", "2 s"]})
    assert (onset.at, onset.when, onset.between) == (None, None, (0.5, 2.0))


def test_port_and_id_are_parts_of_the_target() -> None:
    fault = read("links.safety.channels.nominal", "drop")
    assert (fault.port, fault.target_id) == ("links", "safety.channels.nominal")


@pytest.mark.parametrize("model", MODELS)
def test_every_model_says_what_it_is_and_what_it_is_for(model: type[Fault]) -> None:
    assert model.__doc__
    assert model.fits
    assert len(get_args(model.model_fields["model"].annotation)) == 1


def test_onset_is_one_of_three_and_in_order() -> None:
    for onset in ({}, {"at": "1 s", "when": "time >= 1 s"}, {"between": ["2 s", "1 s"]}):
        refused(ValidationError, Onset.model_validate, onset)


# --- What comes late or stands still: of links, channels and actuators alike ----------------------


def read(target: str, model: str, **more: Any) -> Any:
    content = {"id": "a", "target": target, "model": model, "onset": {"at": "1 s"}}
    return FAULT.validate_python({**content, **more})


def test_values_are_in_si_and_have_their_defaults() -> None:
    for target in ("links.nominal.front", "actuators.brake"):
        assert read(target, "delay", by="250 ms").by == 0.25
    bias = read("channels.nominal", "bias", steering_angle="180 deg")
    assert bias.steering_angle == pytest.approx(3.14159265)
    assert bias.acceleration == 0.0
    assert read("links.safety.switch", "reorder", by="100 ms").by == 0.1
    assert read("hooks.nominal", "map_shifted", offset="-50 cm").offset == -0.5
    # Everything is lost unless a share is given.
    drop = read("links.nominal.front", "drop")
    assert (drop.probability, drop.burst) == (1.0, 1)
    late = read("switch", "late", delay="200 ms")
    assert isinstance(late, Late)
    assert (late.delay, late.port, late.target_id) == (0.2, "switch", "")


def test_delay_that_is_none_is_refused() -> None:
    for by in ("-1 s", f"{LONGEST_LAG + 1} s", "2 m"):
        refused(ValidationError, read, "actuators.brake", "delay", by=by, says="by")


def test_stuck_is_of_channels_and_actuators() -> None:
    assert read("channels.nominal", "stuck").port == "channels"
    assert read("actuators.steering", "stuck").port == "actuators"
    with pytest.raises(ValidationError, match="stuck is a fault of channels or actuators"):
        read("sensors.front", "stuck")


# --- Faults of channels, links and insides: values in SI, defaults, and what is refused -----------


def test_what_is_no_such_fault_is_refused() -> None:
    for target, model, more, said in TABLES["what is no such fault is refused"]:
        refused(ValidationError, read, target, model, **more, says=said)


# --- Faults of the switch: how late, and of nothing else ------------------------------------------


def test_what_is_no_late_switch_is_refused() -> None:
    for target, delay, said in (
        ("switch", "-1 s", "greater than or equal to 0"),
        ("switch", "1 m", "is not a time"),
        ("channels.nominal", "1 s", "late is a fault of switch"),
    ):
        refused(ValidationError, read, target, "late", delay=delay, says=said)


# --- Faults that change nothing: of no size, masked, on what nobody looks at, in no entry ---------

CANDIDATE = yaml.safe_load((shipped("odd") / "architectures/camera_radar.yaml").read_text("utf-8"))


def fault(model: str, target: str = "sensors.front_radar", **more: Any) -> Any:
    return read(target, model, **{"id": model, "onset": {"at": "2 s"}, **more})


def architecture(**changes: Any) -> Architecture:
    content = {name: item for name, item in CANDIDATE.items() if name != "extends"}
    return Architecture.model_validate({**content, **changes})


def idle(*faults: Any, of: Architecture | None = None) -> dict[str, str]:
    return dict(idle_faults([item.id for item in faults], [(faults, of or architecture())]))


@pytest.mark.parametrize(("nothing", "something"), TABLES["fault of no size is named"])
def test_fault_of_no_size_is_named(nothing: dict[str, Any], something: dict[str, Any]) -> None:
    model = nothing["model"]
    assert "changes nothing" in idle(fault(**nothing))[model]
    assert idle(fault(**{**nothing, **something})) == {}


def test_size_of_rounding_is_read_as_none() -> None:
    for nothing, _ in TABLES["fault of no size is named"]:
        none = fault(**nothing)
        for name, size in ((name, size) for sizes in none.neutral for name, size in sizes.items()):
            if isinstance(size, float) and getattr(none, name) == size:
                content = {**none.model_dump(), name: size + 1e-12}
                assert FAULT.validate_python(content, context=SI) == none, name


def test_sizes_are_fields_of_their_models() -> None:
    for model in MODELS:
        for sizes in model.neutral:
            assert sizes.keys() <= model.model_fields.keys()


@pytest.mark.parametrize(
    ("silencer", "other", "is_masked"), TABLES["fault is masked while its target is silent"]
)
@pytest.mark.parametrize("is_first", [True, False])
def test_fault_is_masked_while_its_target_is_silent(
    silencer: dict[str, Any], other: dict[str, Any], *, is_masked: bool, is_first: bool
) -> None:
    pair = (
        fault("drop_out", **silencer),
        fault("bias", signal="x", size="1 m", **{"target": "sensors.front_radar", **other}),
    )
    found = idle(*(pair if is_first else pair[::-1]))
    assert ("masked by drop_out" in found.get("bias", "")) is is_masked
    assert "drop_out" not in found


def test_of_two_silencers_one_is_masked() -> None:
    assert list(idle(fault("drop_out"), fault("power_loss"))) == ["power_loss"]


def test_silent_channel_hides_what_is_wrong_inside_but_not_its_lies() -> None:
    silent = fault("silent", "channels.nominal")
    assert idle(silent, fault("heartbeat_lies", "channels.nominal")) == {}
    found = idle(silent, fault("planner_frozen", "hooks.nominal"))
    assert "masked by silent" in found["planner_frozen"]


def test_silent_channel_hides_what_it_is_shown_but_not_what_others_see_of_it() -> None:
    silent = fault("silent", "channels.nominal")
    assert "masked by silent" in idle(silent, fault("drop", "links.nominal.front_radar"))["drop"]
    assert idle(silent, fault("drop", "links.safety.channels.nominal")) == {}


@pytest.mark.parametrize(
    ("target", "first", "then"), TABLES["fault is masked by one that replaces what it changed"]
)
def test_fault_is_masked_by_one_that_replaces_what_it_changed(
    target: str, first: tuple[str, dict[str, Any]], then: tuple[str, dict[str, Any]]
) -> None:
    signal = {"signal": "x"} if target.startswith("sensors.") else {}
    one = fault(first[0], target, **signal, **first[1], id="one")
    other = fault(then[0], target, **signal, **then[1], id="other")
    assert "masked by other, which replaces" in idle(one, other)["one"]
    brief = other.model_copy(update={"duration": 1.0})
    assert idle(one, brief) == {}
    if signal:
        elsewhere = fault(then[0], target, signal="y", id="other", value="9 m")
        assert idle(one, elsewhere) == {}


def test_fault_on_what_nobody_looks_at_is_named() -> None:
    channels = {**CANDIDATE["channels"]}
    alone = {"policy": "stuck", "priority": ["nominal"], "default": "nominal"}
    nominal = {**channels["nominal"], "links": ["localisation", "health.front_camera"]}
    bare = architecture(channels={**channels, "nominal": nominal}, switch=alone)
    lost, silent = fault("drop_out"), fault("silent", "channels.safety")
    found = idle(lost, silent, fault("late", "switch", delay="1 s"), of=bare)
    assert "which no channel" in found["drop_out"]
    assert "no channel that acts" in found["silent"]
    assert "one channel only" in found["late"]
    assert idle(fault("drop_out", "sensors.front_camera"), of=bare) == {}
    assert idle(lost, silent) == {}


def test_fault_of_no_entry_is_named() -> None:
    assert idle_faults(["a"], []) == [("a", "is injected in no test case")]
