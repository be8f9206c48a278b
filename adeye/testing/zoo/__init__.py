"""The zoo: channels that misbehave, and the outcome that a run with each of them must have.

A conformance test for what contains channels: whatever a channel does, its run gets the outcome
that says so, and no bit of another run changes. ``ANIMALS`` are one program, ``program.py``;
``values.animal`` says which one it is. ``OBJECTS`` and ``HERDS`` are plug-ins in Python, the two
classes of ``plugin.py``; they have a parameter ``animal``. The product imports nothing of it. Begin
with ``ANIMALS``.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.simulate.channels.guard import ERROR, INVALID_OUTPUT, KILLED, TIMEOUT

if TYPE_CHECKING:
    from collections.abc import Mapping

COMPLETED: Final = "completed"
PROGRAM: Final = Path(__file__).with_name("program.py")
PLUGIN: Final = Path(__file__).with_name("plugin.py")
STEP_DEADLINE_S: Final = 2.0
"""Long enough for an honest program on a busy machine, short enough to wait for."""


@dataclass(frozen=True, slots=True)
class Animal:
    """One way to misbehave.

    Attributes:
        outcome: What the run's outcome must be.
        detail: A part of the words that must say why; empty for a run that is completed.
        is_machine_dependent: Whether its result must be marked so.
        parameters: What it needs beside the usual.
    """

    outcome: str
    detail: str = ""
    is_machine_dependent: bool = False
    parameters: Mapping[str, Any] = field(default_factory=dict)


def _hanging(detail: str = "no answer until its deadline") -> Animal:
    return Animal(TIMEOUT, detail, is_machine_dependent=True)


ANIMALS: Final[Mapping[str, Animal]] = {
    # It ends, or is ended.
    "raises": Animal(ERROR, "ended with code 1 without an answer: RuntimeError: no track"),
    "leaves": Animal(ERROR, "ended with code 0 without an answer"),
    "fails_at_once": Animal(ERROR, "ended with code 1 without an answer: no licence"),
    "segfaults": Animal(KILLED, "ended by SIGSEGV"),
    "aborts": Animal(KILLED, "ended by SIGABRT"),
    "kills_its_group": Animal(KILLED, "ended by SIGKILL", is_machine_dependent=True),
    # It hangs.
    "hangs_in_python": _hanging(),
    "hangs_in_c": _hanging(),
    "sleeps": _hanging(),
    "stops_itself": _hanging(),
    "ignores_sigterm": _hanging(),
    "never_says_hello": _hanging(),
    "closes_its_output": _hanging("closed its output"),
    "says_half_a_line_and_waits": _hanging("a part of a line"),
    # It takes too much.
    "forks": Animal(
        KILLED,
        "more processes",
        is_machine_dependent=True,
        parameters={"limits": {"processes": 8}, "step_deadline": "20 s"},
    ),
    "leaks_memory": Animal(ERROR, "MemoryError", parameters={"limits": {"memory_mib": 256}}),
    "opens_files": Animal(ERROR, "Too many open files"),
    "fills_the_disk": Animal(ERROR, "File too large", parameters={"limits": {"file_mib": 4}}),
    "fills_its_output": Animal(INVALID_OUTPUT, "a line of more than 65536 bytes"),
    "talks_without_end": Animal(INVALID_OUTPUT, "it answers tick"),
    "fills_its_error_output": Animal(COMPLETED),
    "burns_the_processor": Animal(
        KILLED,
        "ended by SIGXCPU",
        is_machine_dependent=True,
        parameters={"limits": {"cpu_time": "1 s"}, "step_deadline": "20 s"},
    ),
    # It answers nonsense.
    "says_nan": Animal(INVALID_OUTPUT, "is no line of JSON"),
    "says_infinity": Animal(INVALID_OUTPUT, "is no line of JSON"),
    "says_too_large_a_number": Animal(INVALID_OUTPUT, "acceleration inf is no finite number"),
    "says_a_list": Animal(INVALID_OUTPUT, "acceleration [0.1, 0.1] is no finite number"),
    "says_a_text": Animal(INVALID_OUTPUT, "acceleration '0.1' is no finite number"),
    "says_unknown_status": Animal(INVALID_OUTPUT, "status 'fine' is none of ok"),
    "says_no_json": Animal(INVALID_OUTPUT, "'turn left' is no line of JSON"),
    "says_a_nest": Animal(INVALID_OUTPUT, "is no line of JSON"),
    "says_half_a_line": Animal(INVALID_OUTPUT, "a part of a line, then it ended"),
    "says_another_version": Animal(INVALID_OUTPUT, "not 'adeye/channel@1'"),
    # It answers somebody else, another time, or with claims.
    "claims_a_safe_state": Animal(INVALID_OUTPUT, "there is no key 'safe_state'"),
    "answers_for_another_channel": Animal(INVALID_OUTPUT, "there is no key 'channel'"),
    "answers_the_future": Animal(INVALID_OUTPUT, "it answers tick 6, not 5"),
    "answers_the_past": Animal(INVALID_OUTPUT, "it answers tick 2, not 5"),
    "answers_without_tick": Animal(INVALID_OUTPUT, "there is no key 'seen'"),
    "answers_twice": Animal(INVALID_OUTPUT, "it answers tick 5, not 6"),
    # It is wrong, late or curious within the rules: what comes of it, the requirements judge.
    "says_minus_zero": Animal(COMPLETED),
    "says_degrees": Animal(COMPLETED),
    "says_too_much": Animal(COMPLETED),
    "freezes": Animal(COMPLETED),
    "answers_late": Animal(COMPLETED),
    "leaves_a_daemon": Animal(COMPLETED),
    "snoops": Animal(COMPLETED),
    "reads_the_clock": Animal(COMPLETED),
}
"""Every animal by its name."""

_NOT_FINITE: Final = Animal(INVALID_OUTPUT, "not finite numbers")
_HARMLESS: Final = Animal(COMPLETED)

OBJECTS: Final[Mapping[str, Animal]] = {
    # It ends, or tries to end what asks it.
    "fails_at_once": Animal(ERROR, "RuntimeError: no licence"),
    "leaves_at_once": Animal(ERROR, "SystemExit: 3"),
    "raises": Animal(ERROR, "RuntimeError: no track"),
    "leaves": Animal(ERROR, "SystemExit: 0"),
    "is_cancelled": Animal(ERROR, "CancelledError"),
    "ends_a_generator": Animal(ERROR, "GeneratorExit"),
    "stops_an_iteration": Animal(ERROR, "StopIteration"),
    "recurses": Animal(ERROR, "RecursionError"),
    "asserts": Animal(ERROR, "AssertionError"),
    "runs_out_of_memory": Animal(ERROR, "MemoryError"),
    "raises_a_huge_text": Animal(ERROR, "RuntimeError: xxxx"),
    "raises_what_no_text_is": Animal(ERROR, "RuntimeError: \\ud800\\0"),
    "raises_what_cannot_be_said": Animal(ERROR, "it cannot say what it is"),
    # It answers nonsense.
    "returns_nothing": Animal(INVALID_OUTPUT, "act() returned NoneType"),
    "returns_one_number": Animal(INVALID_OUTPUT, "act() returned float"),
    "returns_three_numbers": Animal(INVALID_OUTPUT, "act() returned 3 values"),
    "returns_a_text": Animal(INVALID_OUTPUT, "act() returned str"),
    "returns_texts": _NOT_FINITE,
    "returns_nan": _NOT_FINITE,
    "returns_infinity": _NOT_FINITE,
    "returns_a_huge_integer": _NOT_FINITE,
    "returns_truth_values": _NOT_FINITE,
    "returns_complex_numbers": _NOT_FINITE,
    "returns_nested_lists": _NOT_FINITE,
    "returns_an_endless_tuple": Animal(INVALID_OUTPUT, "act() returned 1000000000 values"),
    "returns_what_cannot_be_shown": Animal(ERROR, "RuntimeError"),
    "returns_an_unknown_status": Animal(INVALID_OUTPUT, "status 99 is none of"),
    "returns_a_status_in_words": Animal(INVALID_OUTPUT, "status 'ok' is none of"),
    "returns_too_much": _HARMLESS,
    # It changes what is not its own.
    "takes_over_its_observation": Animal(ERROR, "FrozenInstanceError"),
    "writes_into_its_estimate": _HARMLESS,
    "writes_into_it_later": _HARMLESS,
    "writes_into_detections": _HARMLESS,
    "forgets_its_links": _HARMLESS,
    "prints": _HARMLESS,
    "closes_its_streams": _HARMLESS,
    "turns_warnings_into_errors": _HARMLESS,
    "turns_numpy_strict": _HARMLESS,
    "seeds_what_is_global": _HARMLESS,
    "starts_a_thread": _HARMLESS,
    "asks_a_child": _HARMLESS,
    "leaves_a_child_that_sleeps": _HARMLESS,
    "ends_a_child": _HARMLESS,
}
"""Every animal that is a Python object for each run, by its name."""

HERDS: Final[Mapping[str, Animal]] = {
    "fails_at_once": Animal(ERROR, "RuntimeError: no licence"),
    "raises": Animal(ERROR, "RuntimeError: no track"),
    "leaves": Animal(ERROR, "SystemExit: 0"),
    "is_cancelled": Animal(ERROR, "CancelledError"),
    "returns_nothing": Animal(INVALID_OUTPUT, "act() returned NoneType, not ControlCommand"),
    "returns_lists": Animal(INVALID_OUTPUT, "acceleration is list, not an array"),
    "returns_none_for_a_status": Animal(INVALID_OUTPUT, "status is NoneType, not an array"),
    "returns_too_few_runs": Animal(INVALID_OUTPUT, "acceleration is float64 of shape (1,)"),
    "returns_columns": Animal(INVALID_OUTPUT, "acceleration is float64 of shape (2, 1)"),
    "returns_texts": Animal(INVALID_OUTPUT, "steering_angle is <U"),
    "returns_objects": Animal(INVALID_OUTPUT, "steering_angle is object"),
    "returns_a_status_in_parts": Animal(INVALID_OUTPUT, "status is float64"),
    "returns_nan": Animal(INVALID_OUTPUT, "is no finite number"),
    "returns_an_unknown_status": Animal(INVALID_OUTPUT, "status is none of"),
    "returns_a_ragged_plan": Animal(INVALID_OUTPUT, "plan is float64 of shape (1, 3)"),
    "claims_monitors": Animal(INVALID_OUTPUT, "monitors is bool of shape (1, 1, 2)"),
    "writes_into_its_estimate": Animal(ERROR, "read-only"),
    "returns_too_much": _HARMLESS,
    "returns_half_floats": _HARMLESS,
    "answers_the_future": _HARMLESS,
    "answers_for_another_channel": _HARMLESS,
    "writes_into_it_by_force": _HARMLESS,
    "ends_the_runs": _HARMLESS,
    "writes_into_the_command_of_another": _HARMLESS,
    "writes_into_its_answer_later": _HARMLESS,
    "returns_one_array_for_all": _HARMLESS,
    "prints": _HARMLESS,
}
"""Every animal that is a channel on a batch of two runs, by its name."""

FROM_TICK: Final = 5
"""Observation from which they misbehave."""


def settle(folder: Path) -> str:
    """Put the program and the plug-ins of the zoo into the folder of an architecture.

    The plug-ins are ``./zoo_plugin.py:One`` and ``./zoo_plugin.py:Herd``.

    Returns:
        Name of the program.
    """
    shutil.copyfile(PROGRAM, folder / "zoo.py")
    shutil.copyfile(PLUGIN, folder / "zoo_plugin.py")
    return "./zoo.py"


def parameters(name: str = "", *, program: str = "./zoo.py") -> dict[str, Any]:
    """Return the parameters of a channel of ``kind: process`` that is an animal.

    Args:
        name: Of the animal; without, it behaves.
        program: As ``settle`` returned it.
    """
    animal = ANIMALS[name] if name else Animal(COMPLETED)
    return {
        "command": ["python3", "-I", "-S", "-B", program],
        "values": {"animal": name, "from_tick": FROM_TICK},
        "start_deadline": "5 s",
        "step_deadline": f"{STEP_DEADLINE_S:g} s",
        **animal.parameters,
    }
