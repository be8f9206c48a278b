"""Which table a metric stands in: what is part of result hashes never grows."""

from adeye.identity import digest
from adeye.store import tables
from adeye.store.tables import FIRST_METRIC_IDS, METRIC_IDS, TABLES


def test_every_metric_stands_in_one_table() -> None:
    assert tuple(name for ids in TABLES.values() for name in ids) == METRIC_IDS
    assert len(set(METRIC_IDS)) == len(METRIC_IDS)
    for table, ids in TABLES.items():
        columns = [column.name for column in tables.metadata.tables[table].columns]
        assert columns[1:-1:4] == list(ids)


def test_metrics_in_result_hashes_are_those_of_the_first_schema() -> None:
    assert digest(list(FIRST_METRIC_IDS)) == RECORDED


RECORDED = "07962e33f5440c95de8ab04f4cff4860f7b93917639ef768558644f06e5c6d47"
