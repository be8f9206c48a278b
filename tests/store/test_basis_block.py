"""Choosing runs of a block keeps what belongs to each."""

import numpy as np

from adeye.store.block import BasisBlock, ExtremeBlock
from adeye.store.encoding import Texts


def block() -> BasisBlock:
    extremes = ExtremeBlock(
        run=np.array([0, 1, 1, 3]),
        measure=Texts.of(["least gap", "least gap", "least ttc", "least gap"]),
        value=np.array([1.0, 2.0, 3.0, 4.0]),
        time_s=np.array([0.1, 0.2, 0.3, 0.4]),
        actor=Texts.of(["lead", None, "lead", "cutter"]),
        samples=Texts.of(["a", "b", "c", "d"]),
    )
    return BasisBlock(
        version=1,
        uids={"contact": "adeye:contact@1"},
        by_contact=np.array([True, False, False, True]),
        invalid=Texts.of([None, "not realised", None, None]),
        extremes=extremes,
        files=(("t.npz", 0), None, ("t.npz", 2), ("t.npz", 3)),
    )


def test_chosen_runs_keep_their_samples_under_new_numbers() -> None:
    chosen = block().take(np.array([1, 3]))
    assert chosen.by_contact.tolist() == [False, True]
    assert chosen.invalid.values() == ["not realised", None]
    assert chosen.files == (None, ("t.npz", 3))
    assert chosen.extremes.run.tolist() == [0, 0, 1]
    assert chosen.extremes.samples.values() == ["b", "c", "d"]
    assert chosen.extremes.value.tolist() == [2.0, 3.0, 4.0]


def test_run_without_samples_has_none() -> None:
    assert block().take(np.array([2])).extremes.run.tolist() == []


def test_block_that_keeps_no_trace_has_no_files() -> None:
    whole = block()
    bare = BasisBlock(1, whole.uids, whole.by_contact, whole.invalid, whole.extremes)
    assert bare.take(np.array([0, 2])).files == ()
