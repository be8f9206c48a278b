"""Who breaks on content is told by the database that holds it, and only then."""

from pathlib import Path

import pytest
from sqlalchemy.exc import NoResultFound

from adeye.errors import InputError, IntegrityError
from adeye.store.evidence.verification import close
from adeye.store.location import Location
from adeye.store.records import Finding


class Stored:
    location = Location.of_file(Path("a.db"))

    def __init__(self, *findings: Finding) -> None:
        self.findings = findings
        self.is_closed = False

    def verify(self) -> tuple[Finding, ...]:
        return self.findings

    def close(self) -> None:
        self.is_closed = True


WRONG = Finding("run", "3", "has another digest")


@pytest.mark.parametrize("raised", [KeyError("gate"), NoResultFound("No row was found")])
def test_unforeseen_error_on_altered_content_names_the_row(raised: Exception) -> None:
    stored = Stored(WRONG)
    with pytest.raises(IntegrityError, match="run 3: has another digest") as caught:
        close(stored, raised)
    assert caught.value.__cause__ is raised
    assert stored.is_closed


@pytest.mark.parametrize("raised", [None, InputError("no run"), KeyboardInterrupt()])
def test_errors_in_words_stay(raised: object) -> None:
    stored = Stored(WRONG)
    close(stored, raised)
    assert stored.is_closed


def test_error_on_sound_content_stays() -> None:
    stored = Stored()
    close(stored, KeyError("gate"))
    assert stored.is_closed


def test_cause_of_an_error_is_looked_for_once() -> None:
    error = KeyError("gate")
    close(Stored(), error)
    close(Stored(WRONG), error)
