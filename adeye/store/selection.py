"""What a campaign selects: its identity, and its cases on their way to the database.

A campaign's id is known only after its last case, and every row of the selection begins with it.
So the columns wait in a temporary file; what is counted on the way is small.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections import Counter
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import repeat
from typing import TYPE_CHECKING, Any

from adeye.store.encoding import json_text
from adeye.store.matching import CaseGroups

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from typing import TextIO

    from adeye.store.planned import PlannedCases


class SelectionHash:
    """Identity of a selection, fed case by case in the order of the ordinals."""

    def __init__(self, odd_digest: str, concept_digest: str, gate: str, judging: str) -> None:
        """Begin with what the campaign says about all its cases."""
        self._hash = hashlib.sha256(json_text([odd_digest, concept_digest, gate, judging]).encode())
        self.count = 0

    def add(self, values: Iterable[Any]) -> None:
        """Add a case: digests of test case and result, scenario, architecture, inside, point."""
        self.add_all([map(str, values)])

    def add_all(self, cases: Iterable[Iterable[str]]) -> None:
        """Add cases in the order of their ordinals, each as for ``add``."""
        # No text of a database has a NUL, no JSON a line feed.
        lines = list(map("\0".join, cases))
        text = "\n".join(lines) + "\n"
        self._hash.update(text.encode("utf-8", "surrogatepass"))
        self.count += len(lines)

    @property
    def campaign_id(self) -> str:
        """The first 128 bits in hex."""
        return self._hash.hexdigest()[:32]


@dataclass(frozen=True)
class SelectedCases:
    """Consecutive cases of a selection that share scenario and architecture.

    Attributes:
        first: Ordinal of the first.
        scenario: Id of the scenario in the ODD.
        architecture: Id of the architecture.
        inside: Whether each lies inside the ODD, 1 or 0.
        test_cases: Their digests.
        results: Digests that their results must have.
        points: Swept values, as JSON.
    """

    first: int
    scenario: str
    architecture: str
    inside: list[int]
    test_cases: list[str]
    results: list[str]
    points: list[str]

    @classmethod
    def of(cls, part: PlannedCases, first: int) -> SelectedCases:
        """Take planned test cases, the first of which has an ordinal."""
        return cls(
            first,
            part.scenario,
            part.architecture,
            list(map(int, part.inside_odd)),
            list(part.test_cases),
            part.engine.result_digests(part.test_cases),
            list(part.points),
        )

    def identities(self) -> Iterable[tuple[str, ...]]:
        """Give what identifies each of them in the selection."""
        names = repeat(self.scenario), repeat(self.architecture)
        # The names have no end.
        return zip(
            self.test_cases, self.results, *names, map(str, self.inside), self.points, strict=False
        )


class Selection:
    """The cases of a selection, kept in a file until its identity is known.

    Attributes:
        identity: Over all that was added.
        counted: Cases by architecture, scenario and whether they lie inside the ODD.
        ends: Ordinals behind the last case of each stretch of one structure and one shape of JSON.
        groups: Cases by their names and faults, and which of them are pairs.
    """

    def __init__(self, identity: SelectionHash, file: TextIO) -> None:
        """Begin with no case."""
        self.identity = identity
        self.counted: Counter[tuple[str, str, bool]] = Counter()
        self.ends: list[int] = []
        self.groups = CaseGroups()
        self._alike: object = None
        self._file = file

    @classmethod
    @contextmanager
    def begin(cls, identity: SelectionHash) -> Iterator[Selection]:
        """Open the file; it is gone at the end."""
        with tempfile.TemporaryFile("w+", encoding="utf-8", newline="\n") as file:
            yield cls(identity, file)

    def add(self, part: PlannedCases) -> None:
        """Add test cases in the order of their ordinals."""
        selected = SelectedCases.of(part, self.identity.count)
        self.identity.add_all(selected.identities())
        for inside, count in Counter(selected.inside).items():
            self.counted[part.architecture, part.scenario, bool(inside)] += count
        self.groups.add(part.scenario, part.architecture, part.fault_entry, part.situations)
        alike = (part.structure, *_shape(part.parameters), None, *_shape(part.points))
        if alike != self._alike:
            self.ends.append(self.identity.count)
            self._alike = alike
        self.ends[-1] = self.identity.count
        inside_text = "".join(map(str, selected.inside))
        self._file.write(
            json.dumps([selected.first, part.scenario, part.architecture, inside_text])
        )
        for column in (selected.test_cases, selected.results, selected.points):
            self._file.write("\n" + "\0".join(column))
        self._file.write("\n")

    def parts(self) -> Iterator[SelectedCases]:
        """Give everything that was added, in its order."""
        self._file.seek(0)
        while line := self._file.readline():
            first, scenario, architecture, inside = json.loads(line)
            columns = [self._file.readline().rstrip("\n").split("\0") for _ in range(3)]
            yield SelectedCases(first, scenario, architecture, list(map(int, inside)), *columns)


def _shape(column: Sequence[str]) -> Iterator[tuple[str, type]]:
    """Names and types of a JSON object; those of the first tell them of all."""
    for name, value in json.loads(column[0]).items():
        yield name, type(value)
