"""Every kind has a class number, a plausible size and a reflectivity."""

from typing import Any, get_args

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.signals import OBJECT_CLASSES
from adeye.simulate.world.formulas import BELOW_ZERO, Formulas, structure
from adeye.simulate.world.objects import (
    DEFAULT_REFLECTIVITY,
    DEFAULT_SIZES,
    class_index,
    class_indices,
)
from adeye.spec.scenario import ActorKind, ObjectKind
from tests.motorway import make_case, make_scenario


def test_default_size_of_every_actor_keeps_the_legal_limits_of_width_and_height() -> None:
    assert set(DEFAULT_SIZES) == set(get_args(ActorKind))
    for kind, (length, width, height) in DEFAULT_SIZES.items():
        assert 0.0 < length <= 12.0, kind
        assert 0.0 < width <= 2.55, kind
        assert 0.0 < height <= 4.0, kind


def test_every_kind_has_a_reflectivity_between_nothing_and_everything() -> None:
    kinds = {*get_args(ActorKind), *get_args(ObjectKind)}
    assert set(DEFAULT_REFLECTIVITY) == kinds
    assert all(0.0 < share <= 1.0 for share in DEFAULT_REFLECTIVITY.values())


def test_every_kind_of_actor_and_object_and_no_other_has_a_class() -> None:
    kinds = (*get_args(ActorKind), *get_args(ObjectKind))
    assert [OBJECT_CLASSES[number] for number in class_indices(kinds)] == list(kinds)
    with pytest.raises(ValueError, match="not in tuple"):
        class_index("hovercraft")


# --- Formulas over a batch: columns in the order of the cases, errors that name the field ---------


def test_a_formula_is_evaluated_for_each_run() -> None:
    scenario = make_scenario(ego={"speed": "ego_speed - 5 m/s"})
    cases = [make_case(scenario, {"ego_speed": speed}) for speed in (10.0, 20.0, 30.0)]
    values = Formulas.of(cases).values("ego.speed", lambda s: s.ego.speed)
    assert values.tolist() == [5.0, 15.0, 25.0]


def test_scenarios_with_overrides_keep_the_order_of_the_cases() -> None:
    plain, wet = make_scenario(), make_scenario(environment={"friction": 0.5})
    cases = [make_case(wet), make_case(plain), make_case(wet)]
    friction = Formulas.of(cases).values("friction", lambda s: s.environment.friction)
    assert friction.tolist() == [0.5, 0.9, 0.5]


def test_a_missing_formula_gives_the_default() -> None:
    formulas = Formulas.of([make_case(make_scenario())] * 2)
    assert formulas.values("ego.offset", lambda s: s.ego.offset, 0.25).tolist() == [0.25, 0.25]


def test_an_undefined_value_is_an_error_that_names_the_field() -> None:
    scenario = make_scenario(ego={"s": "10 m / (gap - 40 m) * 1 m"})
    with pytest.raises(SpecError, match=r"ego\.s: .*not finite"):
        Formulas.of([make_case(scenario)]).values("ego.s", lambda s: s.ego.s)


def test_a_value_at_its_lower_limit_is_refused() -> None:
    formulas = Formulas.of([make_case(make_scenario(world={"road": {"shoulder": "0 m"}}))])
    with pytest.raises(SpecError, match="shoulder: 0 m is not above 0 m"):
        formulas.limited("shoulder", lambda s: s.world.road.shoulder, above=0.0)
    shoulder = formulas.limited("shoulder", lambda s: s.world.road.shoulder, above=BELOW_ZERO)
    assert shoulder.tolist() == [0.0]


def test_scenarios_of_different_structure_do_not_share_a_batch() -> None:
    wide = make_scenario(world={"road": {"lanes": 4}})
    with pytest.raises(SpecError, match="differ in structure"):
        Formulas.of([make_case(make_scenario()), make_case(wide)])


def test_structure_tells_apart_what_cannot_share_arrays_and_no_values() -> None:
    lead = {"kind": "car", "start": {"lane": 1, "s": "1 m", "speed": "1 m/s"}}
    changes: list[dict[str, Any]] = [
        {"horizon": "6 s"},
        {"tail": "3 s"},
        {"ego": {"goal": {"s": "900 m"}}},
        {"actors": {"lead": lead}},
        {"world": {"road": {"kind": "curve", "radius": "500 m"}}},
    ]
    plain = structure(make_scenario())
    assert all(structure(make_scenario(**change)) != plain for change in changes)
    assert structure(make_scenario(environment={"friction": 0.4}, ego={"s": "300 m"})) == plain


def test_columns_are_independent_of_the_batch() -> None:
    scenario = make_scenario(ego={"speed": "sqrt(ego_speed * 1 m/s) * 3"})
    cases = [make_case(scenario, {"ego_speed": speed}) for speed in np.linspace(5.0, 35.0, 7)]
    together = Formulas.of(cases).values("v", lambda s: s.ego.speed)
    alone = [Formulas.of([case]).values("v", lambda s: s.ego.speed)[0] for case in cases]
    assert together.tolist() == alone
