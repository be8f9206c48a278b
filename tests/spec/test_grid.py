"""Settings of the grid as users write them."""

from pathlib import Path
from typing import Any

import jsonschema
import pytest
from pydantic import ValidationError

from adeye.errors import SpecError
from adeye.kernel.stops import CONTACT, DEFAULT_RULES, RULE_NAMES
from adeye.spec.channels import StopRatings
from adeye.spec.grid import ADEYE_COSTS, CellCosts, GridSettings, rating_costs
from adeye.spec.load import load_grid
from adeye.spec.schema import schema
from tests.refusals import refused
from tests.stored import known


def test_settings_are_read_with_units() -> None:
    rules = [{"layer": "time_to_occupancy", "up_to": 2, "add": 10}]
    costs = {"default": 50, "places": {"hard_shoulder": 5}, "rules": rules}
    content = {"width": "20 m", "cell": "25 cm", "costs": {**costs, "outside": 99, "blocked": 90}}
    settings = GridSettings.model_validate(content)
    assert (settings.width, settings.ahead, settings.cell) == (20.0, 50.0, 0.25)
    table = dict(zip(RULE_NAMES, known(settings.costs).table(), strict=True))
    assert (table["hard_shoulder"], table["fast_lane"]) == (5.0, 50.0)


def test_window_without_sense_is_refused() -> None:
    for content, what in (
        ({"cell": "0.05 m", "ahead": "500 m", "width": "200 m"}, "at most 1000000"),
        ({"cell": "0 m"}, "greater than or equal to 0.05"),
        ({"wide": "3 m"}, "Extra inputs"),
    ):
        refused(ValidationError, GridSettings.model_validate, content, says=what)


def test_limit_and_value_are_told_as_the_value_is_written(tmp_path: Path) -> None:
    (path := tmp_path / "cells.yaml").write_text("cell: 0 m\n")
    refused(SpecError, load_grid, path, says="1:7: cell: must be at least 0.05 m ('0 m').")


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"places": {"kerb": 3}}, "'kerb' is no kind of place; allowed: refuge"),
        ({"rules": [{"layer": "static"}]}, "either `set` or `add`"),
        ({"rules": [{"layer": "static", "set": 1, "add": 1}]}, "either `set` or `add`"),
        ({"rules": [{"layer": "static", "set": 1, "above": 2, "up_to": 1}]}, "no value is above 2"),
        ({"rules": [{"layer": "height", "set": 1}]}, "'static'"),
        ({"default": -1}, "greater than or equal to 0"),
    ],
)
def test_costs_without_sense_are_refused(change: dict[str, Any], what: str) -> None:
    with pytest.raises(ValidationError, match=what):
        CellCosts.model_validate({"default": 1, "outside": 1, "blocked": 1} | change)


def test_ratings_are_costs_in_which_the_occupied_counts_as_contact() -> None:
    costs = rating_costs(StopRatings())
    assert costs.table() == list(DEFAULT_RULES)
    assert {rule.set for rule in costs.rules} == {CONTACT}
    assert costs.outside == costs.blocked == CONTACT


def test_beside_the_road_on_the_left_is_blocked_for_adeye() -> None:
    (add,) = [rule.add for rule in ADEYE_COSTS.rules if rule.layer == "left_of_ego"]
    assert add is not None
    assert ADEYE_COSTS.default + add == ADEYE_COSTS.blocked


def test_mistake_in_a_file_is_shown_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "cells.yaml"
    path.write_text("width: 20 m\ncosts:\n  default: 5\n  outside: 9\n  blocked: 9\n  rulez: []\n")
    refused(SpecError, load_grid, path, says=r"cells.yaml:6:3.*no key 'rulez'")


def test_file_extends_another(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("width: 20 m\ncell: 1 m\n")
    (tmp_path / "b.yaml").write_text("extends: a.yaml\ncell: 2 m\n")
    settings = load_grid(tmp_path / "b.yaml").spec
    assert (settings.width, settings.cell) == (20.0, 2.0)
    jsonschema.validate({"extends": "a.yaml", "cell": "2 m"}, schema("grid"))
    refused(jsonschema.ValidationError, jsonschema.validate, {"cel": "2 m"}, schema("grid"))
