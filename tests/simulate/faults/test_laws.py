"""The laws that every fault of a channel, link, actuator and tyre obeys, whatever its model."""

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
import pytest

from adeye.signals import FAULT, Authority, ControlCommand
from adeye.simulate.faults.schedule import INJECTORS
from adeye.spec.fault import MODELS, model_of
from adeye.testing.sensors import injector, moment, three_objects
from tests.frozen import assert_frozen
from tests.simulate.faults.flows import sample

STEP = 0.05
RUNS, TICKS = 3, 18
ONSETS, ENDS = (5, TICKS, 7), (10, TICKS, 13)
CONTEXT = three_objects()


@dataclass(frozen=True)
class Law:
    """A model with a target, what makes it do something, and what makes it do nothing."""

    model: str
    target: str
    strong: dict[str, Any] = field(default_factory=dict)
    zero: dict[str, Any] | None = None

    def __str__(self) -> str:
        return f"{self.model} of {self.target}"


def links(model: str, strong: dict[str, Any], zero: dict[str, Any]) -> list[Law]:
    carried = ("front", "health.front", "channels.other", "switch")
    return [Law(model, f"links.nominal.{link}", strong, zero) for link in carried]


CHANNEL = "channels.nominal"
BRAKE = "actuators.brake"
LAWS = [
    Law("silent", CHANNEL),
    Law("crash", CHANNEL),
    Law("slow", CHANNEL, {"by": "0.1 s"}, {"by": "0 s"}),
    Law("stuck", CHANNEL),
    Law("bias", CHANNEL, {"acceleration": "1 m/s^2"}, {"steering_angle": "0 rad"}),
    Law("scale", CHANNEL, {"steering_angle": 57.3}, {"steering_angle": 1.0}),
    Law(
        "oscillating",
        CHANNEL,
        {"acceleration": "2 m/s^2", "frequency": "2 Hz"},
        {"acceleration": "0 m/s^2", "frequency": "2 Hz"},
    ),
    Law("plausible_but_wrong", CHANNEL),
    Law("not_a_number", CHANNEL),
    Law("heartbeat_lies", CHANNEL),
    *links("drop", {}, {"probability": 0.0}),
    *links("delay", {"by": "0.1 s"}, {"by": "0 s"}),
    *links("reorder", {"by": "0.1 s"}, {"by": "0.1 s", "probability": 0.0}),
    *links("duplicate", {}, {"probability": 0.0}),
    Law("loss", BRAKE, {"share": 0.5}, {"share": 0.0}),
    Law("fade", BRAKE, {"share": 0.5, "over": "0.2 s"}, {"share": 0.0, "over": "0.2 s"}),
    Law("offset", "actuators.steering", {"steering_angle": "1 deg"}, {"steering_angle": "0 deg"}),
    Law("rate_limit", BRAKE, {"jerk": "1 m/s^3"}, {"jerk": "1e6 m/s^3"}),
    Law("delay", BRAKE, {"by": "0.1 s"}, {"by": "0 s"}),
    Law("stuck", BRAKE),
    Law("friction", "tyres", {"value": 0.2}, {"factor": 1.0}),
]
WITH_ZERO = [law for law in LAWS if law.zero is not None]


def thing(target: str, tick: int, runs: list[int]) -> Any:
    """Return what flows at a tick: other numbers at every tick and in every run."""
    number = np.array([1.0 + 100.0 * run + tick for run in runs])
    count = len(runs)
    whole = number.astype(np.int64)

    if target == "tyres":
        return number / 1000.0
    if target.startswith("actuators"):
        return -number
    if target.endswith("front"):
        item = sample(0.0, runs=count, with_estimate=True)
        item.stamp[:] = STEP * number
        item.detections[:] = number[:, None, None]
        item.source[:] = whole[:, None]
        item.estimate = np.repeat(number[:, None], 13, axis=1)
        return item
    if target.endswith("switch"):
        return Authority(whole, whole + 1)
    plan = np.repeat(np.repeat(number[:, None, None], 3, axis=1), 4, axis=2)
    status = np.full(count, FAULT, dtype=np.int64)
    monitors = np.ones((count, 2, 2), dtype=np.bool_)
    return ControlCommand(target[9:], number, -number, STEP * number, status, plan, monitors)


def bits(item: Any) -> list[bytes]:
    """Return the arrays of a thing row by row, to be compared bit by bit."""
    arrays = (
        [item] if isinstance(item, np.ndarray) else [getattr(item, f.name) for f in fields(item)]
    )
    known = [array for array in arrays if isinstance(array, np.ndarray)]
    return [b"|".join(array[run].tobytes() for array in known) for run in range(len(known[0]))]


def history(
    law: Law, parameters: dict[str, Any], runs: list[int] | None = None, *, active: bool = True
) -> list[tuple[list[bytes], list[bytes], bool]]:
    """Return what came in and what came out at each tick, and whether it was the same object."""
    chosen = list(range(RUNS)) if runs is None else runs
    context = replace(CONTEXT, stream_seeds=CONTEXT.stream_seeds[chosen])
    made = injector(
        law.model,
        law.target,
        context=context,
        step=STEP,
        parameters=[parameters] * len(chosen),
    )
    seen = []
    for tick in range(TICKS):
        given = thing(law.target, tick, chosen)
        before = bits(given)
        there = np.array([active and ONSETS[run] <= tick < ENDS[run] for run in chosen])
        ages = np.array([(tick - ONSETS[run] + 0.5) * STEP for run in chosen])
        after = made.apply(given, moment(there, time=tick * STEP, age=ages))
        assert bits(given) == before, "what was given has been changed"
        seen.append((before, bits(after), after is given))
    return seen


def test_every_model_of_these_parts_is_tried() -> None:
    tried = {(law.target.split(".")[0], law.model) for law in LAWS}
    ports = {"channels", "links", "actuators", "tyres"}
    assert tried == {key for key in INJECTORS if key[0] in ports}


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_inactive_fault_is_the_very_same_object(law: Law) -> None:
    assert all(same for _, _, same in history(law, law.strong, active=False))
    quiet = [tick for tick in range(TICKS) if not 5 <= tick < 13]
    seen = history(law, law.strong)
    assert all(seen[tick][2] for tick in quiet)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_effect_is_there_from_the_onset_and_only_to_the_end(law: Law) -> None:
    seen = history(law, law.strong)
    for run in range(RUNS):
        changed = [tick for tick, (given, got, _) in enumerate(seen) if given[run] != got[run]]
        if ONSETS[run] == TICKS:
            assert changed == [], "a run without the fault keeps every bit"
        else:
            assert changed[0] == ONSETS[run]
            assert changed[-1] < ENDS[run]


@pytest.mark.parametrize("law", WITH_ZERO, ids=str)
def test_zero_amplitude_changes_no_bit(law: Law) -> None:
    assert law.zero is not None
    assert all(given == got for given, got, _ in history(law, law.zero))


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_run_is_the_same_alone_and_in_a_batch(law: Law) -> None:
    parameters = law.strong
    if law.target.startswith("links") and law.model != "delay":
        parameters = {**parameters, "probability": 0.5}
    together = history(law, parameters)
    for run in range(RUNS):
        alone = history(law, parameters, [run])
        assert [got[0] for _, got, _ in alone] == [got[run] for _, got, _ in together]


def told(item: Any, run: int) -> str:
    """Write the numbers of a thing in a run, of each of its arrays the sum."""
    arrays = (
        [item] if isinstance(item, np.ndarray) else [getattr(item, f.name) for f in fields(item)]
    )
    sums = [np.sum(array[run]) for array in arrays if isinstance(array, np.ndarray)]
    return " ".join(f"{value:.9g}" for value in sums)


def test_what_faults_make_of_numbers_is_frozen() -> None:
    """Each model with its strong parameters, and where chance decides with those of a half."""
    lines = []
    for law in LAWS:
        chance = {"probability": 0.5} if law.target.startswith("links") else {}
        parameters = law.strong | (chance if law.model != "delay" else {})
        made = injector(
            law.model, law.target, context=CONTEXT, step=STEP, parameters=[parameters] * RUNS
        )
        for tick in range(TICKS):
            there = np.array([ONSETS[run] <= tick < ENDS[run] for run in range(RUNS)])
            ages = np.array([(tick - ONSETS[run] + 0.5) * STEP for run in range(RUNS)])
            given = thing(law.target, tick, list(range(RUNS)))
            after = made.apply(given, moment(there, time=tick * STEP, age=ages))
            if tick in {4, 5, 8, 11, 13}:
                lines.append(f"{law} tick {tick}: {told(after, 0)}; {told(after, 2)}")
    assert_frozen("faults.txt", "\n".join([*lines, ""]))


# --- Every model has its injector for every kind of target that it fits, and obeys the laws -------


def test_every_model_has_an_injector_for_each_target_that_it_fits_and_none_is_more() -> None:
    assert all(model.fits for model in MODELS)
    fits = {(port, model_of(model)) for model in MODELS for port in model.fits}
    assert set(INJECTORS) == fits
