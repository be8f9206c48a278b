"""FMUs as channels: what they are told, what comes of it, and how they fail."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.signals import FAULT, OK, SILENT, ControlCommand
from adeye.simulate.channels.fmu import FmuChannel, wire_channel
from adeye.simulate.channels.policy import EGO_FEATURES, OBJECT_FEATURES
from adeye.spec.channels import EGO_SIGNALS, FmuParameters
from adeye.spec.programs import OBJECT_SIGNALS
from adeye.testing import channel_context, check_channel
from tests.refusals import refused
from tests.simulate.bridges.fmus import Var, build_fmu, cruise
from tests.simulate.channels.perceived import LINKS, SENSORS, shown

LANE = 5.25

WIRED: dict[str, Any] = {
    "file": "./cruise.fmu",
    "inputs": {"speed": "ego.speed", "wanted": "ego.desired_speed"},
    "outputs": {"acceleration": "a", "steering_angle": "delta"},
}


def parameters(**more: Any) -> FmuParameters:
    return FmuParameters.model_validate({**WIRED, **more})


def test_signals_are_in_the_order_of_what_policies_observe() -> None:
    assert list(EGO_SIGNALS) == list(EGO_FEATURES)
    assert list(OBJECT_SIGNALS) == list(OBJECT_FEATURES)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("fmu")
    cruise(made)
    return made


def begun(folder: Path, *given: FmuParameters) -> FmuChannel:
    channel = FmuChannel(folder)
    channel.reset(channel_context(list(given), links=LINKS, sensors=SENSORS, runs=len(given)))
    return channel


def ask(channel: FmuChannel, speeds: list[float], ticks: int = 1) -> list[ControlCommand]:
    answers = []
    for tick in range(ticks):
        time = 0.05 * tick
        ego = [[speed * time, LANE, 0.0, speed] for speed in speeds]
        answers.append(channel.act(shown(ego, time=time, protect=True)))
    channel.close()
    return answers


def test_command_is_what_the_fmu_makes_of_the_signals_in_its_units(folder: Path) -> None:
    given = [parameters(start={"gain": gain}) for gain in (0.4, 1.0)]
    channel = begun(folder, *given)
    context = channel_context(given, links=LINKS, sensors=SENSORS, runs=2)
    (answer,) = ask(channel, [20.0, 25.0])
    wanted = np.minimum(context.desired_speed, context.road.speed_limit)
    assert answer.acceleration == pytest.approx([0.4, 1.0] * (wanted - [20.0, 25.0]), abs=1e-12)
    assert answer.status.tolist() == [OK, OK]
    assert channel.events == [None, None]


def test_jacobi_answers_with_the_inputs_of_the_tick_before(folder: Path) -> None:
    def accelerations(master: str) -> list[float]:
        channel = begun(folder, parameters(master=master, start={"gain": 1.0}))
        found = []
        for tick, speed in enumerate([20.0, 22.0, 24.0]):
            ego = [[speed * 0.05 * tick, LANE, 0.0, speed]]
            answer = channel.act(shown(ego, time=0.05 * tick, protect=True))
            found.append(float(answer.acceleration[0]))
        channel.close()
        return found

    late, early = accelerations("jacobi"), accelerations("gauss_seidel")
    assert late[0] == early[0]
    assert late[1:] == early[:-1]
    assert (np.diff(early) < -0.5).all()


def test_sub_steps_divide_the_period(tmp_path: Path) -> None:
    variables = [Var("speed", "input"), Var("wanted", "input"), Var("a", "output")]
    variables += [Var("delta", "output"), Var("count", "local")]
    law = "if (h > 0) { v[4] += 1; v[3] = h; } v[2] = v[4];"
    build_fmu(tmp_path, "cruise", variables, law)
    answers = ask(begun(tmp_path, parameters(sub_steps=5)), [20.0], 3)
    assert [float(answer.acceleration[0]) for answer in answers] == [0.0, 5.0, 10.0]
    assert answers[-1].steering_angle[0] == pytest.approx(0.01, rel=1e-12)


def test_fmu_without_a_pose_is_not_stepped_and_says_fault(folder: Path) -> None:
    channel = begun(folder, parameters())
    answer = channel.act(shown([[0.0, LANE, 0.0, 20.0]], time=1.0, stamp=-9.0, protect=True))
    channel.close()
    assert answer.status[0] == FAULT
    assert answer.acceleration[0] == 0.0


@pytest.mark.slow
def test_conforms(folder: Path) -> None:
    check_channel(lambda: FmuChannel(folder), parameters())


def test_lead_is_told(tmp_path: Path) -> None:
    variables = [Var("gap", "input"), Var("there", "input"), Var("v", "input")]
    variables += [Var("a", "output"), Var("delta", "output")]
    build_fmu(tmp_path, "cruise", variables, "v[3] = v[0] / 1e3; v[4] = v[1] * 0.1 + v[2] / 1e4;")
    wired = {"gap": "lead.gap", "there": "lead.present", "v": "lead.speed"}
    channel = begun(tmp_path, parameters(inputs=wired, master="gauss_seidel"))
    for tick in range(10):
        time = 0.05 * tick
        seen = shown(
            [[20.0 * time, LANE, 0.0, 20.0]],
            [[50.0 + 10.0 * time, LANE, 0.0, 10.0, 0.0]],
            time=time,
            protect=True,
        )
        answer = channel.act(seen)
        if tick == 0:
            assert answer.acceleration[0] == 1.0
    channel.close()
    assert answer.acceleration[0] == pytest.approx((50.0 - 10.0 * time - 4.9) / 1e3, abs=1e-3)
    assert answer.steering_angle[0] == pytest.approx(0.101, abs=2e-4)


FAILS = {
    "raises_abort": ("if (t > 0.08) abort();", {}, "channel_killed", "SIGABRT"),
    "segfaults": ("if (t > 0.08) *(volatile int*)0 = 1;", {}, "channel_killed", "SIGSEGV"),
    "exits_0": ("if (t > 0.08) exit(0);", {}, "channel_error", "ended with code 0"),
    "exits_3": ("if (t > 0.08) _exit(3);", {}, "channel_error", "ended with code 3"),
    "says_nan": ("if (t > 0.08) v[2] = NAN;", {}, "channel_invalid_output", "acceleration nan"),
    "says_infinity": ("if (t > 0.08) v[3] = 1 / 0.0;", {}, "channel_invalid_output", "steering"),
    "says_error": ("", {"status": "t > 0.08 ? fmi2Error : OK"}, "channel_error", "DoStep failed"),
    "says_fatal": ("", {"status": "t > 0.08 ? fmi2Fatal : OK"}, "channel_error", "DoStep failed"),
    "says_discard": (
        "",
        {"status": "t > 0.08 ? fmi2Discard : OK"},
        "channel_error",
        "DoStep failed",
    ),
    "hangs": ("if (t > 0.08) for (;;) sleep(1);", {}, "channel_timeout", "no answer"),
    "stops_itself": ("if (t > 0.08) raise(SIGSTOP);", {}, "channel_timeout", "no answer"),
    "eats_memory": (
        "if (t > 0.08) for (;;) { char *m = malloc(1 << 26); memset(m, 1, 1 << 26); }",
        {},
        "channel_killed",
        "SIGSEGV",
    ),
}
"""What an FMU does in its third step, what else it is built with, outcome, and what is said."""


@pytest.mark.slow
@pytest.mark.parametrize("name", FAILS)
def test_fmu_that_misbehaves_is_silent_in_its_run_and_no_other(name: str, tmp_path: Path) -> None:
    step, more, outcome, says = FAILS[name]
    cruise(tmp_path, step, name="bad", **more)
    cruise(tmp_path)
    deadline = "2 s" if outcome == "channel_timeout" else "30 s"
    bad = parameters(file="./bad.fmu", step_deadline=deadline, limits={"memory_mib": 1024})
    channel = begun(tmp_path, bad, parameters())
    answers = ask(channel, [20.0, 20.0], 5)
    event, other = channel.events
    assert other is None
    assert event is not None
    assert event.outcome == outcome
    assert says in event.detail
    assert str(tmp_path) not in event.detail
    assert answers[-1].status.tolist() == [SILENT, OK]
    alone = ask(begun(tmp_path, parameters()), [20.0], 5)
    assert [a.acceleration[1] for a in answers] == [a.acceleration[0] for a in alone]


@pytest.mark.slow
@pytest.mark.parametrize(("start", "is_there"), [("20 s", True), ("1.5 s", False)])
def test_first_answer_may_take_as_long_as_the_start(
    start: str, tmp_path: Path, *, is_there: bool
) -> None:
    cruise(tmp_path, "static int begun = 0; if (!begun++) sleep(3);", name="late")
    given = parameters(file="./late.fmu", step_deadline="1.5 s", start_deadline=start)
    channel = begun(tmp_path, given)
    ask(channel, [20.0], 1)
    (event,) = channel.events
    assert (event is None) is is_there


def test_what_an_fmu_prints_is_no_answer(tmp_path: Path) -> None:
    cruise(tmp_path, 'printf("{\\"tick\\":0,\\"values\\":[9,9]}\\n"); fflush(stdout);')
    channel = begun(tmp_path, parameters())
    answers = ask(channel, [20.0], 3)
    assert channel.events == [None]
    assert answers[-1].steering_angle[0] == 0.0


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ({"inputs": {"speed": "lead.gap"}}, "not that of a length"),
        ({"outputs": {"acceleration": "a", "steering_angle": "b"}}, "no variable 'b'"),
        ({"start": {"nothing": 1}}, "no variable 'nothing'"),
        ({"file": "./other.fmu"}, "not there"),
    ],
)
def test_wiring_that_does_not_fit_is_refused(folder: Path, more: Any, says: str) -> None:
    refused(SpecError, wire_channel, parameters(**more), folder, says=says)


def test_unknown_signal_is_refused_with_the_nearest() -> None:
    refused(ValueError, parameters, inputs={"speed": "ego.sped"}, says="Did you mean 'ego.speed'")
