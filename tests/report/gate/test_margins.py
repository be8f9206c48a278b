"""Losses of margin: a test for a random sample, every pair for chosen points."""

from typing import Any

import pytest

from adeye.errors import UsageError
from adeye.judge.verdict import Verdict
from adeye.report.gate.baseline import BaselineCase, BaselineCell
from adeye.report.gate.changes import Column, Loss, Tolerances, compare_cells, compare_pairs
from adeye.report.model.part import Margin
from adeye.units import TOLERANCES
from tests.stored import known

NAMES = [f"{number:016x}" for number in range(40)]


def rows(values: list[float | None], letter: str = "P") -> dict[str, BaselineCase]:
    return {
        key: BaselineCase(
            key=key, fault="none", verdicts=letter, margins=(value,),
            robustness=(None if value is None else value / 2.0,),
        )
        for key, value in zip(NAMES, values, strict=False)
    }  # fmt: skip


def compared(  # noqa: PLR0913 - what a comparison takes
    before: list[float | None],
    after: list[float | None],
    *,
    sample: bool = False,
    measures: tuple[str | None, str | None] = ("m gap", "m gap"),
    letter: str = "P",
    tolerance: float = 0.0,
    step: float = 0.0,
) -> Loss | None:
    keys = NAMES[: len(before)]
    return compare_pairs(
        keys,
        (rows(before), Column("FSR-1", 0, measures[0])),
        (rows(after, letter), Column("FSR-1", 0, measures[1])),
        Tolerances({"m": tolerance, "1": tolerance}, {("FSR-1", "gate", "cut_in"): {"m": step}}),
        points={key: number for number, key in enumerate(keys)} if sample else None,
        place=("gate", "cut_in"),
    )


def lost(before: list[float | None], after: list[float | None], **options: Any) -> Loss:
    return known(compared(before, after, **options))


def test_what_is_no_loss_is_none() -> None:
    assert compared([1.0, 2.0], [1.0, 3.0]) is None
    # Neither is rounding, nor a pair without a margin or that was not exercised.
    assert compared([1234.567, 1.0], [1234.566, 0.9999995]) is None
    assert compared([1.0, 1.0], [None, 1.0]) is None
    assert compared([1.0, 1.0], [0.0, 0.0], letter="V") is None


def test_worst_pair_comes_first() -> None:
    loss = lost([5.0, 5.0, 5.0], [4.0, 5.0, 1.0])
    assert loss.keys == (NAMES[2], NAMES[0])
    assert loss.is_regression
    assert "2 of 3 pairs" in loss.text


def test_other_signal_is_compared_by_its_scale() -> None:
    loss = lost([2.0], [1.0], measures=("m gap", "s time_gap"))
    assert "divided by its scale" in loss.text
    assert "most \N{MINUS SIGN}0.50;" in loss.text
    # The step is worth nothing in another unit.
    assert lost([2.0], [1.9], measures=("m gap", "s time_gap"), step=1.0).is_regression


def test_sample_is_tested_over_its_points_and_a_single_loss_is_none() -> None:
    before: list[float | None] = [float(number % 7) for number in range(40)]
    mixed: list[float | None] = [
        (value or 0.0) + (0.5 if number % 2 else -0.5) for number, value in enumerate(before)
    ]
    loss = lost(before, mixed, sample=True)
    assert not loss.is_regression
    assert "drawn points" in loss.text
    assert lost(before, mixed).is_regression
    loss = lost([2.0, 2.0], [1.0, 2.0], sample=True)
    assert loss.is_regression
    assert "too few points" in loss.text


def test_sample_that_lost_everywhere_is_a_regression_beyond_its_tolerance() -> None:
    before: list[float | None] = [float(number % 7) for number in range(40)]
    after: list[float | None] = [
        (value or 0.0) - 0.5 - 0.1 * (number % 3) for number, value in enumerate(before)
    ]
    assert lost(before, after, sample=True).is_regression
    assert not lost(before, after, sample=True, tolerance=0.65).is_regression


def test_tolerance_of_an_fsr_goes_before_that_of_its_unit() -> None:
    tolerances = Tolerances.given({"m/s^2": 0.5, "FSR-1": 0.1})
    assert tolerances.of(("FSR-1", "a", "s"), "m/s²", 1.0) == 0.1
    assert tolerances.of(("FSR-2", "a", "s"), "m/s²", 1.0) == 0.5
    assert tolerances.of(("FSR-2", "a", "s"), "m", 2.0) == 2e-6


def test_tolerance_for_nothing_is_refused() -> None:
    with pytest.raises(UsageError, match=r"'km' is neither.*There are: FSR-1, FSR-2, m\.$"):
        Tolerances({"km": 1.0}).check(["FSR-2", "FSR-1", "FSR-2"], ["m", "m"])


def test_loss_is_a_regression_only_beyond_what_the_step_is_worth() -> None:
    loss = lost([1.0, 2.0], [0.95, 1.91], step=0.1)
    assert not loss.is_regression
    assert "the step is worth 0.10 m, so nothing is known to be lost" in loss.text
    loss = lost([1.0, 2.0], [0.95, 1.89], step=0.1)
    assert loss.is_regression
    assert "the step is worth 0.10 m" in loss.text
    # A larger tolerance goes before the step.
    assert not known(compared([1.0], [0.6], tolerance=0.5, step=0.1)).is_regression


def test_step_counts_for_its_own_place_only() -> None:
    steps = {("FSR-1", "gate", "cut_in"): {"m": 0.2}}
    tolerances = Tolerances({"m": 0.05}, steps)
    assert tolerances.of(("FSR-1", "gate", "cut_in"), "m", 1.0) == 0.2
    assert tolerances.of(("FSR-1", "other", "cut_in"), "m", 1.0) == 0.05
    assert tolerances.of(("FSR-2", "gate", "cut_in"), "m", 1.0) == 0.05


def test_worst_margin_of_a_cell_may_lose_what_the_step_is_worth() -> None:
    was, has = (
        BaselineCell(
            fsr="FSR-1",
            architecture="gate",
            scenario="cut_in",
            verdict=Verdict.PASS,
            counts={Verdict.PASS: 1},
            exercised=1,
            margin=Margin(value=value, unit="m"),
        )
        for value in (1.0, 0.9)
    )
    steps = {("FSR-1", "gate", "cut_in"): {"m": 0.2}}
    assert compare_cells(was, has, Tolerances())
    assert compare_cells(was, has, Tolerances({}, steps)) == ""


def test_what_the_gate_tolerates_goes_behind_what_was_asked_for_and_is_told() -> None:
    usual = Tolerances().of_gate({"m": 0.5})
    assert usual.of(("FSR-1", "a", "s"), "m", 1.0) == 0.5
    assert usual.of(("FSR-1", "a", "s"), "m/s²", 1.0) == TOLERANCES["m/s^2"]
    asked = Tolerances.given({"FSR-1": 0.1, "m": 0.2}).of_gate({"m": 0.5})
    assert asked.of(("FSR-1", "a", "s"), "m", 1.0) == 0.1
    assert asked.of(("FSR-2", "a", "s"), "m", 1.0) == 0.2
    assert Tolerances().of_gate({"m": 0}).of(("FSR-1", "a", "s"), "m", 1.0) == 1e-6


def test_loss_of_some_micrometres_is_a_note_that_names_it() -> None:
    def told(loss: float, tolerances: Tolerances) -> Loss | None:
        then = rows([1.0, 1.0]), Column("FSR-1", 0, "m gap")
        now = rows([1.0, 1.0 - loss]), Column("FSR-1", 0, "m gap")
        return compare_pairs(
            NAMES[:2], then, now, tolerances, points=None, place=("gate", "cut_in")
        )

    tiny = known(told(8e-6, Tolerances().of_gate({})))
    assert not tiny.is_regression
    assert tiny.keys == (NAMES[1],)
    assert "lost in 1 of 2 pairs" in tiny.text
    assert "which is tolerated: up to 0.010 m" in tiny.text
    assert known(told(0.02, Tolerances().of_gate({}))).is_regression
    assert known(told(8e-6, Tolerances())).is_regression
    # Rounding of the baseline is nothing at all.
    assert told(1e-7, Tolerances().of_gate({})) is None
    named = known(told(6.0, Tolerances({"m": 9.0}).of_gate({})))
    assert (named.is_regression, named.text.rpartition(": ")[2]) == (False, "up to 9.00 m")
