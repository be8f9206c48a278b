"""What channels share: hand-made architectures, and the tables against the code of the package."""

import ast
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import pytest

from adeye.analysis import dependence
from adeye.simulate.channels.factory import make_channel
from adeye.spec.architecture import Architecture, targets_of
from adeye.spec.concept import Element
from adeye.spec.load import load_odd
from adeye.spec.quantity import SI
from tests.project import ROOT

MOUNT = {"x": 2.0, "y": 0.0, "z": 0.5}
SENSORS: dict[str, dict[str, Any]] = {
    "camera": {"kind": "camera", "mount": MOUNT, "field_of_view": 0.6, "range": 100.0},
    "radar": {"kind": "radar", "mount": MOUNT, "field_of_view": 0.6, "range": 100.0},
    "pose": {"kind": "localisation"},
    "gnss": {"kind": "gnss"},
    "truth": {"kind": "ground_truth"},
}
FILE = "./planner.py"


@cache
def vehicle() -> dict[str, Any]:
    """Read the vehicle of the shipped candidate, once: its whole ODD is loaded for that."""
    odd = load_odd(ROOT / "odd/motorway_chauffeur.yaml")
    return odd.architectures["camera_radar"].spec.vehicle.model_dump()


def architecture(
    realises: Mapping[str, str] | None = None,
    switch: Mapping[str, Any] | None = None,
    **channels: Mapping[str, Any],
) -> Architecture:
    """Make an architecture of channels; what they link that is a sensor is there."""
    found = {link for item in channels.values() for link in item["links"]} & SENSORS.keys()
    named = realises or {}
    sensors = {name: {**SENSORS[name], "rate": 20.0} for name in sorted(found or {"truth"})}
    parts = {
        kind: {name: {**item, "realises": named.get(name)} for name, item in items.items()}
        for kind, items in (("sensors", sensors), ("channels", channels))
    }
    order = {"priority": list(channels), "default": list(channels)[-1], **(switch or {})}
    made = {
        "architecture": "made",
        "title": "made by hand",
        "vehicle": vehicle(),
        **parts,
        "switch": {"policy": "fixed_priority", **order},
    }
    return Architecture.model_validate(made, context=SI)


def nominal(*links: str) -> dict[str, Any]:
    return {"kind": "nominal", "links": links}


def safety(*links: str, stop: str = "in_lane") -> dict[str, Any]:
    return {"kind": "safety", "links": links, "parameters": {"stop": stop}}


def plugin(*links: str, kind: str = f"{FILE}:Planner", **more: Any) -> dict[str, Any]:
    return {"kind": kind, "links": links, **more}


def process(*links: str, command: Sequence[str] = ("python3", "./drive.py")) -> dict[str, Any]:
    return {"kind": "process", "links": links, "parameters": {"command": command}}


def elements(**resources: Sequence[str]) -> list[Element]:
    return [
        Element(id=name, kind="other", text=name, asil_capability="D", resources=tuple(items))
        for name, items in resources.items()
    ]


def only(made: Architecture, concept: Sequence[Element] = ()) -> dependence.ChannelPair:
    (pair,) = dependence.dependencies(made, concept).pairs
    return pair


def named(pair: dependence.ChannelPair, kind: str) -> list[str]:
    return [item.what for item in pair.shared if item.kind == kind]


def test_channels_without_a_common_sensor_share_map_switch_and_vehicle() -> None:
    pair = only(architecture(a=plugin("camera"), b=process("radar")))
    assert [item.kind for item in pair.shared] == ["map", "switch", "vehicle"]
    assert "who has own code may not read it" in pair.shared[0].how
    assert pair.shared[0].targets == ()


def test_common_sensor_is_told_apart_from_common_ego_estimate() -> None:
    links = ("camera", "pose", "truth", "gnss")
    pair = only(architecture(a=safety(*links), b=nominal("radar", *links)))
    assert named(pair, "sensor") == ["camera"]
    assert sorted(named(pair, "ego_estimate")) == ["gnss", "pose", "truth"]
    hows = {item.what: item.how for item in pair.shared}
    assert hows["truth"].endswith("know of objects and the ego")
    assert hows["pose"].endswith("know of the ego")


def test_sensor_behind_another_channel_is_shared_through_it() -> None:
    made = architecture(
        watch=plugin("channels.fusion", "pose"),
        drive=nominal("camera"),
        fusion=plugin("camera", kind="./fusion.py:Fusion"),
        switch={"priority": ["watch", "drive"], "default": "drive"},
    )
    pair = only(made)
    assert named(pair, "sensor") == ["camera"]
    assert "what watch through fusion and drive know" in pair.shared[0].how


def test_shortest_way_of_a_sensor_is_named() -> None:
    made = architecture(
        a=plugin("channels.far"),
        b=nominal("camera"),
        far=plugin("channels.near", "camera", kind="./far.py:Far"),
        near=plugin("channels.far", "camera", kind="./near.py:Near"),
        switch={"priority": ["a", "b"], "default": "b"},
    )
    assert "what a through far and b know" in only(made).shared[0].how


def test_what_is_behind_the_other_channel_is_one_influence() -> None:
    pair = only(architecture(a=safety("radar", "channels.b", "switch"), b=nominal("camera")))
    assert named(pair, "sensor") == []
    assert named(pair, "influence") == ["b → a", "switch → a"]
    targets = [item.targets for item in pair.shared if item.kind == "influence"]
    assert targets == [("links.a.channels.b",), ("links.a.switch",)]


def test_health_of_a_sensor_of_the_other_is_an_influence_and_of_its_own_none() -> None:
    pair = only(architecture(a=safety("radar", "health.camera"), b=nominal("camera")))
    assert named(pair, "sensor") == []
    (item,) = [item for item in pair.shared if item.kind == "influence"]
    assert item.what == "camera → a"
    assert item.targets == ("links.a.health.camera",)
    own = only(architecture(a=safety("radar", "health.radar"), b=nominal("camera")))
    assert named(own, "influence") == []


def test_resource_of_a_sensor_and_of_a_channel_is_shared_by_all_that_need_it() -> None:
    made = architecture(
        {"camera": "eyes", "a": "guard", "b": "pilot", "radar": "ears"},
        a=safety("radar"),
        b=nominal("camera"),
    )
    concept = elements(eyes=["power_a"], ears=["power_b"], guard=["power_a", "ecu"], pilot=["ecu"])
    pair = only(made, concept)
    found = {item.what: item for item in pair.shared if item.kind == "resource"}
    assert found.keys() == {"power_a", "ecu"}
    assert found["power_a"].targets == ("channels.a", "sensors.camera")
    assert found["ecu"].targets == ("channels.a", "channels.b")
    assert found["power_a"].how == "a for a, camera for b"
    assert pair.unstated == ()


def test_common_element_is_told_unless_it_is_the_common_sensor() -> None:
    realises = {"camera": "front", "radar": "front", "pose": "pose"}
    made = architecture(realises, a=safety("radar", "pose"), b=nominal("camera", "pose"))
    pair = only(made, elements(front=["power"], pose=["power"]))
    assert named(pair, "element") == ["front"]


def test_parts_without_stated_resources_are_named() -> None:
    made = architecture({"camera": "eyes", "b": "pilot"}, a=safety("radar"), b=nominal("camera"))
    pair = only(made, elements(eyes=["power"], pilot=[]))
    assert pair.unstated == ("channels.a", "sensors.radar", "channels.b")


def test_resource_of_the_switch_is_told_with_who_has_it_too() -> None:
    made = architecture(
        {"a": "guard"}, {"realises": "arbiter"}, a=safety("radar"), b=nominal("camera")
    )
    pair = only(made, elements(guard=["ecu", "power"], arbiter=["power", "net"]))
    (switch,) = [item for item in pair.shared if item.kind == "switch"]
    assert switch.how.endswith("it has power in common with a")


def test_three_channels_make_three_pairs_in_the_order_of_priority() -> None:
    channels = {"a": safety("radar"), "b": nominal("camera"), "c": plugin("pose")}
    pairs = dependence.dependencies(architecture(**channels), ()).pairs
    assert [f"{pair.first}{pair.second}" for pair in pairs] == ["ab", "ac", "bc"]
    without = architecture(switch={"priority": ["a", "b"], "default": "b"}, **channels)
    assert len(dependence.dependencies(without, ()).pairs) == 1
    assert dependence.dependencies(architecture(a=nominal("camera", "pose")), ()).pairs == ()


def test_code_from_outside_is_shared_if_it_is_one_file_or_package() -> None:
    for one, other, code in (
        (plugin(), plugin(kind="./sub/../planner.py:Other"), ["planner.py"]),
        (plugin(), plugin(kind="./other.py:Planner"), []),
        (plugin(kind="maker.a:A"), plugin(kind="maker.b:B"), ["maker"]),
        (plugin(files=["net.bin"]), plugin(kind="./o.py:O", files=["./net.bin"]), ["net.bin"]),
        (process(), process(), ["python3", "drive.py"]),
        (process(), process(command=["./drive.py"]), ["drive.py"]),
        (process(command=["./a"]), process(command=["./b"]), []),
    ):
        made = architecture(a={**one, "links": ["camera"]}, b={**other, "links": ["radar"]})
        assert named(only(made), "code") == code


def test_who_has_own_code_may_share_more_than_is_seen() -> None:
    for other in (plugin("radar"), process("radar")):
        assert only(architecture(a=nominal("camera"), b=other)).unread == ("b",)
    assert only(architecture(a=plugin("camera"), b=process("radar"))).unread == ("a", "b")
    assert only(architecture(a=safety("camera"), b=nominal("radar"))).unread == ()


def test_policies_of_one_file_share_it_and_what_tracks_for_them() -> None:
    policy = {"kind": "policy", "parameters": {"policy": "./net.py:drive"}}
    made = architecture(a={**policy, "links": ["camera"]}, b={**policy, "links": ["radar"]})
    assert "net.py" in named(only(made), "code")
    assert "simulate/channels/perception/step.py" in named(only(made), "code")


def test_common_tracking_is_tried_by_hooks_where_both_have_them_and_other_code_by_a_command() -> (
    None
):
    def tried(made: Architecture) -> dict[str, tuple[tuple[str, ...], str]]:
        return {item.what: (item.targets, item.model) for item in only(made).shared}

    command = (("channels.a", "channels.b"), "plausible_but_wrong")
    code = tried(architecture(a=safety("camera"), b=nominal("radar")))
    assert code[dependence.PERCEPTION] == (("hooks.a", "hooks.b"), "tracks_lost")
    assert code["kernel/road.py"] == command
    policy = {"kind": "policy", "parameters": {"policy": "./net.py:drive"}, "links": ["radar"]}
    assert tried(architecture(a=safety("camera"), b=policy))[dependence.PERCEPTION] == command


def test_planned_stop_shares_more_code_with_the_trajectory_channel_than_the_one_in_the_lane() -> (
    None
):
    def shared(stop: str) -> set[str]:
        drive = {"kind": "trajectory", "links": ["camera"]}
        return set(named(only(architecture(a=safety("radar", stop=stop), b=drive)), "code"))

    trajectory = "simulate/channels/trajectory/"
    more = {"kernel/profiles.py", f"{trajectory}cost.py", f"{trajectory}channel.py"}
    assert shared("planned") - shared("in_lane") == more


@pytest.mark.parametrize(
    "made",
    [
        architecture(a=safety("camera", "channels.b", "switch"), b=nominal("camera", "pose")),
        architecture(a=plugin("camera"), b=process("camera")),
        architecture({"a": "x", "b": "x"}, a=safety("truth"), b=plugin("truth", "channels.a")),
    ],
    ids=["built_in", "outside", "mixed"],
)  # fmt: skip
def test_every_target_exists_and_kinds_are_in_order(made: Architecture) -> None:
    pair = only(made, elements(x=["power"]))
    known = targets_of(made)
    for item in pair.shared:
        assert set(item.targets) <= set(known)
    places = [list(dependence.WORDS).index(item.kind) for item in pair.shared]
    assert places == sorted(places)
    assert dependence.dependencies(made, elements(x=["power"])).count == len(pair.shared)


def test_shipped_candidate_shares_no_sensor_ego_estimate_or_resource() -> None:
    files = load_odd(ROOT / "odd/motorway_chauffeur.yaml")
    pair = only(files.architectures["camera_radar"].spec, files.concept.spec.elements)
    for kind in ("sensor", "ego_estimate", "resource", "element"):
        assert pair.count(kind) == 0, kind
    assert named(pair, "influence") == ["nominal → safety", "switch → safety"]
    assert pair.unstated == ()


# --- the tables against the code ------------------------------------------------------------------

MODULES = {
    "nominal": "adeye.simulate.channels.nominal",
    "safety": "adeye.simulate.channels.safety.in_lane",
    dependence.PLANNED: "adeye.simulate.channels.safety.planned_stop",
    "trajectory": "adeye.simulate.channels.trajectory.channel",
    "policy": "adeye.simulate.channels.policy",
    "process": "adeye.simulate.channels.process.channel",
    "fmu": "adeye.simulate.channels.fmu",
}
NO_CAUSE = {
    # Imported for its records, names or constants only.
    ("policy", "simulate/channels/driving.py"),
    ("fmu", "simulate/channels/driving.py"),
    ("fmu", "kernel/profiles.py"),
    ("trajectory", "simulate/channels/corridor.py"),
    ("nominal", "kernel/profiles.py"),
    ("safety", "kernel/profiles.py"),
    # What it is told of the road comes from the record that compiled stages ask, too.
    ("process", "kernel/road.py"),
}
BESIDE = {"hooks", "links", "guard", "scalar", "process.channel", "process.protocol"}
"""Modules of channels that decide nothing: they contain, show and disturb."""


def module_of(code: str) -> str:
    return f"adeye.{code.removesuffix('.py').replace('/', '.')}"


@cache
def imported(module: str) -> frozenset[str]:
    """Follow the imports of a module within the package, but not what only types need."""
    seen: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        path = ROOT / f"{name.replace('.', '/')}.py"
        if name in seen or not path.is_file():
            continue
        seen.add(name)
        waiting += [
            name
            for node in ast.parse(path.read_text("utf-8")).body
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("adeye.")
            for name in (str(node.module), *(f"{node.module}.{item.name}" for item in node.names))
        ]
    return frozenset(seen)


@pytest.mark.parametrize("kind", MODULES)
def test_table_of_code_is_that_of_the_imports(kind: str) -> None:
    used = imported(MODULES[kind])
    for code, (_, kinds) in dependence.BUILT_IN_CODE.items():
        is_imported = module_of(code) in used and (kind, code) not in NO_CAUSE
        assert is_imported == (kind in kinds), code


@pytest.mark.slow
def test_every_module_of_several_channels_is_in_the_table_or_behind_one_that_is() -> None:
    channels = "adeye.simulate.channels."
    # What plans is used with what predicts, by the same channels.
    listed = {f"{channels}trajectory.planner"}.union(
        *(imported(module_of(c)) for c in dependence.BUILT_IN_CODE)
    )
    users = Counter(name for module in MODULES.values() for name in imported(module))
    unlisted = {
        name.removeprefix(channels)
        for name, count in users.items()
        if count > 1 and name not in listed and name.startswith(channels)
    }
    unlisted = {name for name in unlisted if not name.startswith("safety")}
    assert unlisted == BESIDE & unlisted


def test_hooked_channels_are_those_that_offer_the_hooks() -> None:
    for kind in ("nominal", "safety", "trajectory"):
        hooks = getattr(make_channel(kind, ROOT), "hooks", ())
        assert (kind in dependence.HOOKED) == {"map_shifted", "tracks_lost"}.issubset(hooks)


def test_ego_estimate_is_of_the_sensors_that_have_no_body_of_their_own() -> None:
    assert set(dependence.EGO_ESTIMATE) == {"localisation", "ground_truth", "gnss", "imu"}
