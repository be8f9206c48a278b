"""Columns of an export: those of the views, with the units that their names promise."""

import sqlite3
from pathlib import Path

import pytest

from adeye.campaign.plan import SUFFIXES
from adeye.judge.metrics import METRICS
from adeye.store.read.export import RUNS, SUFFIX_UNITS, TABLES, metric_columns, unit_of
from adeye.store.tables import METRIC_IDS
from adeye.units import UNITS

AS_COLUMNS = {"parameters", "point", "verdicts"}
"""What ``v_runs`` has as JSON."""


@pytest.mark.parametrize("name", TABLES)
def test_columns_are_those_of_the_view(tmp_path: Path, empty: bytes, name: str) -> None:
    path = tmp_path / "adeye.db"
    path.write_bytes(empty)
    table = TABLES[name]
    connection = sqlite3.connect(path)
    of_view = [row[1] for row in connection.execute(f"PRAGMA table_info({table.view})")]
    connection.close()
    added = metric_columns() if table is RUNS else ()
    assert [item.name for item in (*table.columns, *added)] == [
        column for column in of_view if table is not RUNS or column not in AS_COLUMNS
    ]
    assert set(table.order) < set(of_view)


def test_suffix_of_a_parameter_is_the_si_unit_of_its_dimension() -> None:
    for dimension, suffix in SUFFIXES.items():
        unit = UNITS[SUFFIX_UNITS[suffix]]
        assert (unit.exponents, unit.numerator, unit.denominator) == (*dimension.value[:1], 1, 1)


@pytest.mark.parametrize("name", METRIC_IDS)
def test_unit_of_a_metric_is_that_of_its_definition(name: str) -> None:
    unit = METRICS[name].unit
    assert unit_of(name) == ("" if unit == "1" else unit)
    by_name = {item.name: item for item in metric_columns()}
    assert by_name[name].unit == unit_of(name)
    assert by_name[name].text == METRICS[name].text
    assert by_name[f"{name}_time_s"].unit == "s"


def test_word_that_is_a_unit_alone_has_none() -> None:
    assert (unit_of("s"), unit_of("m"), unit_of("fsr_status")) == ("", "", "")
