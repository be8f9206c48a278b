import numpy as np

from adeye.kernel.random import normal, owner_id, uniform
from adeye.simulate.faults.injector import Draws, InjectorContext
from tests.simulate.faults.streams import CONTEXT, RUNS, streams

OWNER = np.uint64(owner_id("fault/tested"))


def draws(owner: np.uint64 = OWNER) -> Draws:
    return Draws(InjectorContext([], CONTEXT, 0.05, owner))


def test_draw_is_named_by_seed_owner_sample_and_index() -> None:
    made = draws()
    item = streams()["truth"][0]
    item.fresh[:] = [True, False, True]
    made.count(item)
    made.count(item)
    indices = np.array([[0, 5]] * RUNS)
    for run, number in enumerate((2, 0, 2)):
        seed = CONTEXT.stream_seeds[run]
        for place, index in enumerate((0, 5)):
            assert made.uniforms(indices)[run, place] == uniform(seed, OWNER, number, index)
            assert made.normals(indices)[run, place] == normal(seed, OWNER, number, index)


def test_sample_that_is_shown_again_has_the_same_draws() -> None:
    made = draws()
    before = made.shares(3)
    item = streams()["truth"][0].copy()
    item.fresh[:] = False
    made.count(item)
    assert made.shares(3).tolist() == before.tolist()
    item.fresh[:] = True
    made.count(item)
    assert not set(made.shares(3)) & set(before)


def test_every_fault_has_its_own() -> None:
    other = np.uint64(owner_id("fault/other"))
    assert not set(draws().shares(0)) & set(draws(other).shares(0))
