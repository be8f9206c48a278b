"""The conformance kit: what is honest passes every case, what misbehaves fails the right one."""

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from adeye.errors import SpecError, UsageError
from adeye.selftest import conformance
from adeye.selftest.conformance import CASES, Conformance, Subject, check, subject_of
from adeye.spec.architecture import Architecture
from adeye.spec.load import load_architecture, shipped
from adeye.testing import zoo
from tests.refusals import refused
from tests.selftest import flawed
from tests.selftest.flawed import FLAWS

CANDIDATE = shipped("odd") / "architectures" / "camera_radar.yaml"

PROGRAMS: Mapping[str, str] = {
    # Whatever an outcome names is found before anything else is tried.
    **{
        name: {"channel_invalid_output": "in_step"}.get(animal.outcome, "answers")
        for name, animal in zoo.ANIMALS.items()
        if animal.outcome != zoo.COMPLETED
    },
    **dict.fromkeys(("never_says_hello", "says_another_version", "fails_at_once"), "begins"),
    "says_degrees": "in_bounds",
    "says_too_much": "in_bounds",
    "reads_the_clock": "repeats",
    "leaves_a_daemon": "ends",
}
"""Which case the animals fail that are programs; the others do nothing that is asked for."""


RECORDED: dict[Any, Any] = {}


@pytest.fixture(autouse=True)
def recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Record once for all: what is shown does not hang on who is asked."""
    record = conformance._stimuli

    def once(subject: Subject, speeds: tuple[float, ...]) -> Any:
        rates = [item.rate for item in subject.architecture.channels.values()]
        key = (subject.channel, *rates, *speeds)
        if key not in RECORDED:
            RECORDED[key] = record(subject, speeds)
        return RECORDED[key]

    monkeypatch.setattr(conformance, "_stimuli", once)
    monkeypatch.setattr(conformance, "PAUSE_S", 0.6)
    monkeypatch.setattr(conformance, "LONG", 600)


def guest(folder: Path, **parameters: Any) -> Subject:
    """Put a program in the place of the nominal channel of the candidate."""
    content = load_architecture(CANDIDATE).content
    nominal = {**content["channels"]["nominal"], "kind": "process", "parameters": parameters}
    channels = {**content["channels"], "nominal": nominal}
    architecture = Architecture.model_validate({**content, "channels": channels})
    return Subject(architecture, "nominal", folder)


def failed(found: Conformance) -> dict[str, str]:
    assert [case.id for case in found.cases] == list(CASES)
    assert found.conforms == all(case.passed is not False for case in found.cases)
    return {case.id: case.reason for case in found.cases if case.passed is False}


def animal(folder: Path, name: str) -> Subject:
    zoo.settle(folder)
    given = zoo.parameters(name)
    if zoo.ANIMALS[name].outcome == zoo.TIMEOUT:  # it is waited for in every case
        given["step_deadline"] = "0.5 s"
    return guest(folder, **given)


@pytest.mark.slow
@pytest.mark.parametrize("name", PROGRAMS)
def test_animal_of_the_zoo_fails_its_case(tmp_path: Path, name: str) -> None:
    found = failed(check(animal(tmp_path, name)))
    assert next(iter(found)) == PROGRAMS[name]
    if zoo.ANIMALS[name].outcome != zoo.COMPLETED:
        assert zoo.ANIMALS[name].detail in found[PROGRAMS[name]]
        assert len(found) == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(zoo.ANIMALS.keys() - PROGRAMS.keys()))
def test_animal_that_does_nothing_wrong_passes(tmp_path: Path, name: str) -> None:
    assert failed(check(animal(tmp_path, name))) == {}


@pytest.mark.slow
@pytest.mark.parametrize("flaw", FLAWS)
def test_flaw_fails_the_case_that_it_is_for_and_no_other(tmp_path: Path, flaw: str) -> None:
    shutil.copy(flawed.__file__, tmp_path / "flawed.py")
    values = {"flaw": flaw, "folder": str(tmp_path)}
    command = ["python3", "-I", "-S", "./flawed.py"]
    case, words = FLAWS[flaw]
    found = failed(check(guest(tmp_path, command=command, values=values)))
    assert list(found) == [case]
    assert words in found[case]


@pytest.mark.slow
def test_built_in_channels_pass_all_that_is_asked_of_them() -> None:
    for name in ("nominal", "safety"):
        found = check(subject_of(CANDIDATE, name))
        assert failed(found) == {}
        assert [case.id for case in found.cases if case.passed is None] == ["ends"]


def test_architecture_without_a_channel_from_outside_needs_a_name() -> None:
    caught = refused(UsageError, subject_of, CANDIDATE, says="no channel from outside")
    assert "nominal, safety" in caught.remedy
    refused(UsageError, subject_of, CANDIDATE, "nomnal", says="no channel 'nomnal'")


def test_rates_that_fit_no_clock_are_refused(tmp_path: Path) -> None:
    made = guest(tmp_path, command=["python3", "./x.py"])
    content = made.architecture.model_dump(mode="json")
    content["channels"]["nominal"]["rate"] = 19.7
    odd = Architecture.model_validate(content, context={"si": True})
    refused(SpecError, check, Subject(odd, "nominal", tmp_path), says="channels.nominal.rate")
