import json
import sqlite3
from typing import Any

import pytest

from adeye.errors import InputError
from adeye.identity import digest
from adeye.store.records import ContentRecord
from adeye.store.repository import Repository
from adeye.store.write.content import concept_record
from tests.store.rows import complete_block

HOSTILE = [
    "'; DROP TABLE run; --",
    '" OR "1"="1',
    "Robert'); DELETE FROM verdict;--",
    "%s %d {} {0} :name ?1 $x @y",
    "\\'; SELECT 1; \\",
    "a\nb\r\nc\td",
    "<script>alert(1)</script>",
    "=cmd|' /C calc'!A0",
    "\u202eabc\u200b",
    "\U0001d6fc \u00e9 e\u0301 \u6f22",
]
PAYLOADS = [f"{text}{end}" for text in HOSTILE for end in [f" {n}" for n in range(20)]]


def test_content_reads_back_and_is_saved_once(repository: Repository) -> None:
    record = ContentRecord("odd", "1", {"b": 1.0, "a": [True, None, "é"]})
    assert repository.save_content("odd", record) == record.digest == digest(record.content)
    assert repository.save_content("odd", record) == record.digest
    assert repository.content("odd", record.digest) == record.content
    assert repository.info().rows["odd"] == 1


def test_unknown_content_is_an_input_error(repository: Repository) -> None:
    with pytest.raises(InputError, match="there is none"):
        repository.content("concept", "0" * 64)


@pytest.mark.slow
def test_two_hundred_hostile_texts_read_back_as_data(repository: Repository) -> None:
    assert len(PAYLOADS) == 200
    for text in PAYLOADS:
        record = ContentRecord(text, text, {"text": [text]})
        key = repository.save_content("scenario", record)
        stored = repository.content("scenario", key)
        assert digest(stored) == key
    assert repository.info().rows["scenario"] == 200
    assert repository.verify() == ()


@pytest.mark.slow
def test_hostile_texts_in_results_read_back_as_data(repository: Repository, example: Any) -> None:
    plan = repository.plan_campaign(example.record(), example.cases(len(PAYLOADS)), block_size=500)
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    runs = [
        example.run(
            case,
            outcome_detail=text,
            outcome_channel=text,
            events=[example.run(case).events[0].__class__(0.0, text, text, text)],
        )
        for case, text in zip(block.cases, PAYLOADS, strict=True)
    ]
    assert complete_block(repository, block, runs)
    for case, text in zip(block.cases, PAYLOADS, strict=True):
        stored = repository.run_row(case.result_digest)
        assert stored is not None
        assert stored.row["outcome_detail"] == stored.row["outcome_channel"] == text
        assert stored.events[0].text == text
    assert repository.verify() == ()


def test_concept_is_saved_with_all_its_parts(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    concept = example.concept()
    key = repository.save_concept(concept)
    assert key == concept_record(concept).digest == repository.save_concept(concept)
    goal = raw.execute("SELECT id, asil, ftti_s FROM safety_goal").fetchall()
    assert goal == [("SG1", "D", 1.5)]
    measures = dict(raw.execute("SELECT id, measure FROM fsr").fetchall())
    assert measures == {
        "FSR1": "always(gap >= 2)",
        "FSR2": "min_ttc_s >= 1.0",
        "FSR3": "always(gap >= 2)",
    }
    assert raw.execute("SELECT asil FROM hazardous_event").fetchall() == [("D",)]
    assert raw.execute("SELECT valid_until FROM assumption").fetchall() == [("2030-01-01",)]
    assert len(raw.execute("SELECT * FROM allocation").fetchall()) == 3
    content = raw.execute("SELECT content FROM fsr WHERE id = 'FSR3'").fetchone()[0]
    assert json.loads(content)["applies"] == "outside"


def test_upper_bound_reads_as_at_most(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    from adeye.spec.concept import MetricBound

    first = example.requirements[0]
    bound = MetricBound(metric="impact_speed_mps", at_most=0.0)
    example.requirements = (first.model_copy(update={"formula": None, "bound": bound}),)
    repository.save_concept(example.concept())
    assert raw.execute("SELECT measure FROM fsr").fetchall() == [("impact_speed_mps <= 0.0",)]
