"""Variants of the reference drivers: as a second implementation of them, and no further.

Each difference between the regulation and published code has a name. A driver of that name comes
to what a second implementation of the difference comes to, differs from the regulation in the same
scenes as that, and wherever the name says nothing not in a single bit.
"""

from __future__ import annotations

import os
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.analysis.reference_cases import Question, drive
from adeye.kernel.reference_drivers import reactions as columns
from adeye.kernel.reference_drivers.reactions import EDITIONS, GROUPS, MODELS, VARIANTS
from tests import reference_scenes as second
from tests.driven_scenes import driven
from tests.kernel import test_reference_agreement as agreement

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

Scene = second.CutIn | second.CutOut | second.Braking

STEP = 0.1
HALF = 0.05
"""At a step of 0.1 s the guard is the look at the next tick, and changes nothing."""
# Interpreted, the product is as slow as the second implementation, and a small sample has to do.
SPARSE = 17 if os.environ.get("NUMBA_DISABLE_JIT") else 1
NAMES = {second.CutIn: "cut_in", second.CutOut: "cut_out", second.Braking: "deceleration"}


def narrow_cut_ins() -> list[Scene]:
    return agreement.cut_ins(
        agreement.line(10, 130, 7),
        agreement.line(0.0613, 0.9371, 5),
        agreement.line(1.0137, 89.771, 8),
        agreement.line(0.2, 3.0, 6),
    )


def wide_cut_ins() -> list[Scene]:
    """Return cut-ins from a lane in which 0.3 m inside is not 0.5 m beside."""
    found: list[Scene] = []
    for scene in narrow_cut_ins():
        assert isinstance(scene, second.CutIn)
        found.append(scene._replace(lane=3.75))
    return found


def braked_cut_ins() -> list[Scene]:
    """Return cut-ins in which the fuzzy model brakes hard and is nearly slow enough."""
    return [
        second.CutIn(80.0 * agreement.KMH, 80.0 * agreement.KMH * share, gap, 1.5)
        for share, gap in product((0.2437, 0.2793, 0.3219), agreement.line(30.013, 40.071, 200))
    ]


SCENES: dict[str, Callable[[], list[Scene]]] = {
    "cut-ins": narrow_cut_ins,
    "wide cut-ins": wide_cut_ins,
    "braked cut-ins": braked_cut_ins,
    "cut-outs": lambda: agreement.cut_outs()[::4],
    "leads": lambda: agreement.braking_leads()[::3],
}

WHERE: dict[tuple[str, str], dict[str, int]] = {
    ("jrc-guard", "reg157"): {"cut-outs": 20, "leads": 50},
    ("jrc-lateral", "reg157"): {"wide cut-ins": 10},
    ("jrc-release", "reg157"): {"cut-outs": 20},
    ("jrc-raw-acceleration", "fsm"): {"braked cut-ins": 2},
    ("jrc-ttc-end", "cc"): {"cut-ins": 20},
    ("jrc-coasting", "cc"): {"cut-ins": 20, "cut-outs": 20, "leads": 20},
    ("jrc-perception", "cc"): {"cut-ins": 20, "cut-outs": 20, "leads": 20},
    ("jrc-no-emergency", "cc"): {"cut-ins": 20},
    ("jrc-rss-lateral", "rss"): {"cut-ins": 5},
    ("jrc-beside", "cc"): {"cut-ins": 1},
    ("jrc-beside", "fsm"): {"cut-ins": 1},
    ("jrc-beside", "rss"): {"cut-ins": 1},
    ("jrc-beside", "reg157"): {"cut-ins": 1},
    ("jrc-lead", "cc"): {"leads": 20},
    ("jrc-lead", "reg157"): {"cut-outs": 20, "leads": 20},
    ("jrc-distance", "rss"): {"cut-outs": 10, "leads": 5},
    ("jrc-distance", "reg157"): {"cut-outs": 20, "leads": 20},
    ("jrc-first-step", "cc"): {"cut-outs": 5, "leads": 1},
    ("jrc-first-step", "fsm"): {"cut-ins": 5, "cut-outs": 5, "leads": 1},
    ("jrc-first-step", "rss"): {"cut-ins": 5, "cut-outs": 5, "leads": 1},
    ("jrc-first-step", "reg157"): {"cut-outs": 5, "leads": 1},
    ("esmini-gravity", "cc"): {"cut-ins": 20, "cut-outs": 20, "leads": 20},
    ("esmini-reaction", "reg157"): {"cut-ins": 20, "cut-outs": 20, "leads": 20},
    ("esmini-perception", "cc"): {"cut-ins": 20},
    ("jrc", "cc"): {"cut-ins": 20, "cut-outs": 20, "leads": 20},
    ("jrc", "fsm"): {"cut-ins": 1},
    ("jrc", "rss"): {"cut-ins": 10, "cut-outs": 10},
    ("jrc", "reg157"): {"cut-ins": 20, "cut-outs": 20, "leads": 20},
    ("esmini", "cc"): {"cut-ins": 20, "cut-outs": 20, "leads": 20},
    ("esmini", "fsm"): {"braked cut-ins": 2},
    ("esmini", "rss"): {"cut-ins": 5},
    ("esmini", "reg157"): {"cut-ins": 20, "cut-outs": 20, "leads": 20},
    ("eu-2022-1426", "reg157"): {"cut-ins": 20, "cut-outs": 20, "leads": 20},
}
"""By name and model: scenes in which the outcome changes, and in how many at least."""


def singles(name: str) -> frozenset[str]:
    return GROUPS.get(name, frozenset({name}))


def ours(
    scenes: Sequence[Scene], model: str, name: str | None, step: float = STEP
) -> list[second.Outcome]:
    """Return what comes of scenes of one kind by a variant or edition of the product."""
    question = Question(
        scene=NAMES[type(scenes[0])],
        models=(model,),
        edition=name if name is not None and name in EDITIONS else "r157-01",
        variant=() if name is None or name in EDITIONS else (name,),
        step=step,
    )
    return [agreement.outcome_of(row) for row in drive(agreement.table_of(scenes), question, model)]


def theirs(
    scenes: Sequence[Scene], model: str, name: str | None, step: float = STEP
) -> list[second.Outcome]:
    variant = frozenset() if name is None else singles(name)
    return second.outcomes((list(scenes), model, step), variant)


def test_every_name_is_tested_for_the_models_that_it_says() -> None:
    assert {name for name, _ in WHERE} == {*VARIANTS, *GROUPS, "eu-2022-1426"}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "model"), WHERE)
def test_variant_is_that_of_the_second_implementation(name: str, model: str) -> None:
    step = HALF if name == "jrc-guard" else STEP
    for kind, least in WHERE[name, model].items():
        scenes = SCENES[kind]()[::SPARSE]
        found, expected = ours(scenes, model, name, step), theirs(scenes, model, name, step)
        text, other_text = ours(scenes, model, None, step), theirs(scenes, model, None, step)
        variant = singles(name)
        wrong, unlike, changed = [], [], 0
        for k, scene in enumerate(scenes):
            agrees = agreement.is_same(found[k], expected[k])
            if not agrees and not agreement.is_at_the_boundary(
                scene, model, step, found[k], variant
            ):
                wrong.append((scene, found[k], expected[k]))
            is_changed = not agreement.is_same(found[k], text[k])
            changed += is_changed
            # Where both agree, both tell the same scenes from the regulation's.
            is_known = agrees and agreement.is_same(text[k], other_text[k])
            if is_known and is_changed == agreement.is_same(expected[k], other_text[k]):
                unlike.append(scene)
        assert wrong == [], kind
        assert unlike == [], kind
        assert changed >= least // SPARSE, (kind, changed)


def bits(scenes: Sequence[Scene], model: str, names: tuple[str, ...]) -> bytes:
    kind = agreement.KINDS[type(scenes[0])]
    made: bytes = driven(
        agreement.table_of(scenes), model, kind=kind, step=STEP, variant=names
    ).tobytes()
    return made


SILENT = sorted(set(product(VARIANTS, MODELS)) - set(WHERE))


@pytest.mark.parametrize(("name", "model"), SILENT)
def test_variant_of_another_model_changes_no_bit(name: str, model: str) -> None:
    for kind in ("cut-ins", "cut-outs", "leads"):
        scenes = SCENES[kind]()[:: 5 * SPARSE]
        assert bits(scenes, model, (name,)) == bits(scenes, model, ())


ELSEWHERE = {
    "cut-ins": [
        *(("jrc-lead", "cc"), ("jrc-lead", "reg157"), ("jrc-lateral", "reg157")),
        *(("jrc-distance", "rss"), ("jrc-distance", "reg157")),
    ],
    "leads": [
        *(("jrc-no-emergency", "cc"), ("jrc-rss-lateral", "rss"), ("jrc-lateral", "reg157")),
        ("esmini-perception", "cc"),
    ],
    "cut-outs": [("esmini-perception", "cc")],
}


@pytest.mark.parametrize("kind", ELSEWHERE)
def test_variant_of_other_scenes_changes_no_bit(kind: str) -> None:
    scenes = SCENES[kind]()[::SPARSE]
    for name, model in ELSEWHERE[kind]:
        assert bits(scenes, model, (name,)) == bits(scenes, model, ()), (name, model)


def test_whole_of_one_program_is_the_sum_of_its_variants() -> None:
    for group, model in product(GROUPS, MODELS):
        scenes = narrow_cut_ins()[:: 7 * SPARSE]
        assert bits(scenes, model, (group,)) == bits(scenes, model, tuple(sorted(GROUPS[group])))


def test_wrong_variant_of_the_second_implementation_is_found() -> None:
    # The comparison must fail where one of the two does not know the difference.
    scenes = narrow_cut_ins()[::3]
    found, text = ours(scenes, "reg157", "esmini-reaction"), theirs(scenes, "reg157", None)
    wrong = [
        scene
        for k, scene in enumerate(scenes)
        if not agreement.is_same(found[k], text[k])
        and not agreement.is_at_the_boundary(scene, "reg157", STEP, found[k])
    ]
    assert len(wrong) > 5


def test_guard_is_the_look_at_the_next_tick_where_that_comes_after_a_tenth_of_a_second() -> None:
    for kind in ("cut-ins", "cut-outs", "leads"):
        scenes = SCENES[kind]()[::SPARSE]
        assert bits(scenes, "reg157", ("jrc-guard",)) == bits(scenes, "reg157", ())


def test_guard_lets_the_rule_brake_up_to_a_tenth_of_a_second_earlier() -> None:
    table = agreement.table_of(narrow_cut_ins()[::SPARSE])
    text, guarded = (
        driven(table, "reg157", step=0.01, variant=variant)[:, columns.R_BRAKING_TIME]
        for variant in ((), ("jrc-guard",))
    )
    both = ~np.isnan(text) & ~np.isnan(guarded)
    earlier = text[both] - guarded[both]
    assert earlier.min() >= -1e-9
    assert earlier.max() <= 0.1 + 1e-9
    assert np.mean(earlier > 0.08) > 0.5


def test_rule_without_reaction_brakes_as_late_and_at_once() -> None:
    table: Any = agreement.table_of(narrow_cut_ins()[::SPARSE])
    text, esmini = (
        driven(table, "reg157", step=0.01, variant=variant)
        for variant in ((), ("esmini-reaction",))
    )
    both = ~np.isnan(text[:, columns.R_BRAKING_TIME]) & ~np.isnan(esmini[:, columns.R_BRAKING_TIME])
    sooner = text[both, columns.R_BRAKING_TIME] - esmini[both, columns.R_BRAKING_TIME]
    assert sooner == pytest.approx(0.35, abs=1e-6)
