"""Contents and concepts in the database, hostile texts among them."""

import json

import pytest

from adeye.errors import IntegrityError
from adeye.identity import digest
from adeye.store.records import ContentRecord
from adeye.store.repository import Repository
from adeye.store.write.content import concept_record
from tests.store.conftest import Store

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
    with pytest.raises(IntegrityError, match="concept 000000000000 is gone"):
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
def test_hostile_texts_in_results_read_back_as_data(store: Store) -> None:
    plan = store.plan(store.example.cases(len(PAYLOADS)), block_size=500)
    block = store.claim(plan.campaign)
    runs = [
        store.example.run(
            case,
            outcome_detail=text,
            outcome_channel=text,
            events=[store.example.run(case).events[0].__class__(0.0, text, text, text)],
        )
        for case, text in zip(block.cases, PAYLOADS, strict=True)
    ]
    assert store.complete(block, runs)
    for case, text in zip(block.cases, PAYLOADS, strict=True):
        stored = store.run(case.result_digest)
        assert stored.row["outcome_detail"] == stored.row["outcome_channel"] == text
        assert stored.events[0].text == text
    assert store.repository.verify() == ()


def test_concept_is_saved_with_all_its_parts(store: Store) -> None:
    concept = store.example.concept()
    key = store.repository.save_concept(concept)
    assert key == concept_record(concept).digest == store.repository.save_concept(concept)
    goal = store.rows("SELECT id, asil, ftti_s FROM safety_goal")
    assert goal == [("SG1", "D", 1.5)]
    measures = dict(store.rows("SELECT id, measure FROM fsr"))
    assert measures == {
        "FSR1": "always(gap >= 2)",
        "FSR2": "min_ttc_s >= 1.0",
        "FSR3": "always(gap >= 2)",
    }
    assert store.rows("SELECT asil FROM hazardous_event") == [("D",)]
    assert store.rows("SELECT valid_until FROM assumption") == [("2030-01-01",)]
    assert len(store.rows("SELECT * FROM allocation")) == 3
    content = store.raw.execute("SELECT content FROM fsr WHERE id = 'FSR3'").fetchone()[0]
    assert json.loads(content)["applies"] == "outside"


def test_upper_bound_reads_as_at_most(store: Store) -> None:
    from adeye.spec.concept import MetricBound

    first = store.example.requirements[0]
    bound = MetricBound(metric="impact_speed_mps", at_most=0.0)
    store.example.requirements = (first.model_copy(update={"formula": None, "bound": bound}),)
    store.repository.save_concept(store.example.concept())
    assert store.rows("SELECT measure FROM fsr") == [("impact_speed_mps <= 0.0",)]
