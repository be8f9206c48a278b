"""Which table a metric stands in: what is part of result hashes never grows."""

from adeye.identity import digest
from adeye.store import tables
from adeye.store.metric_ids import FIRST_METRIC_IDS, METRIC_IDS, TIMING_IDS


def test_every_metric_stands_in_one_table() -> None:
    assert (*FIRST_METRIC_IDS, *TIMING_IDS) == METRIC_IDS
    assert not set(FIRST_METRIC_IDS) & set(TIMING_IDS)
    for table, ids in ((tables.metric, FIRST_METRIC_IDS), (tables.timing, TIMING_IDS)):
        assert [column.name for column in table.columns][1:-1:4] == list(ids)


def test_metrics_in_result_hashes_are_those_of_the_first_schema() -> None:
    assert digest(list(FIRST_METRIC_IDS)) == RECORDED


RECORDED = "07962e33f5440c95de8ab04f4cff4860f7b93917639ef768558644f06e5c6d47"
