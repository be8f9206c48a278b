"""Which test cases of a campaign are executed now: a shard, what -k names, what failed last.

Whatever is chosen, it is a part of the same campaign, and what is not chosen stays NOT_RUN.

>>> Keyword.parse("cut_in and not (legacy or gap=30)").text
'cut_in and not (legacy or gap=30)'
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from adeye.errors import UsageError
from adeye.store.write.planning import block_bounds
from adeye.sweep.values import quantity_or_text

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from adeye.signals import Bools
    from adeye.store.records import Plan
    from adeye.store.write.queue import NamedCase, Queue

    _Test = Callable[["_Names"], bool]

# --- Which test cases of a campaign are executed now: a shard, what -k names, what failed last ----

MOST_SHARDS: Final = 10_000


@dataclass(frozen=True, slots=True)
class Shard:
    """One of several parts that a campaign is divided into, whatever machine executes it.

    Attributes:
        number: From 1.
        of: How many there are.
    """

    number: int
    of: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read ``2/3``.

        Raises:
            UsageError: It is not a number and a count, or there is no such shard.
        """
        found = re.fullmatch(r"([0-9]{1,5})/([0-9]{1,5})", text.strip())
        if found is None or not 1 <= int(found[1]) <= int(found[2]) <= MOST_SHARDS:
            raise UsageError(
                f"--shard is {text!r}",
                remedy=f"Write which of how many, such as 2/3: from 1/n to n/n, n up to "
                f"{MOST_SHARDS:,}.",
            )
        return cls(int(found[1]), int(found[2]))

    def ordinals(self, planned: Plan, block_size: int) -> Bools:
        """Tell which test cases are of it: every so manieth block, by the plan alone.

        Args:
            planned: The plan.
            block_size: Most test cases in a block.

        Returns:
            (N,) for each ordinal.
        """
        chosen = np.zeros(planned.planned, dtype=np.bool_)
        for place, (first, end) in enumerate(block_bounds(planned.ends, block_size)):
            if place % self.of == self.number - 1:
                chosen[first:end] = True
        return chosen


@dataclass(frozen=True, slots=True)
class PartTags:
    """Tags of what a campaign is made of.

    Attributes:
        scenarios: By the id in the ODD, text by name.
        architectures: The same.
    """

    scenarios: Mapping[str, Mapping[str, str]]
    architectures: Mapping[str, Mapping[str, str]]

    def of(self, case: NamedCase) -> tuple[tuple[str, str], ...]:
        """Return name and text of those of a test case."""
        return (
            *self.scenarios.get(case.scenario, {}).items(),
            *self.architectures.get(case.architecture, {}).items(),
        )


NO_TAGS: Final = PartTags({}, {})


@dataclass(frozen=True, slots=True)
class Choice:
    """What of a campaign is executed; all of these at once.

    Attributes:
        shard: A part of the blocks; None for all.
        keyword: What the names of a test case must be; None for any.
        last_failed: Only what has no result and failed or was not executed the last time.
    """

    shard: Shard | None = None
    keyword: Keyword | None = None
    last_failed: bool = False

    @property
    def is_everything(self) -> bool:
        """Whether nothing is left out."""
        return self == Choice()

    @property
    def text(self) -> str:
        """The options, for people."""
        parts = [
            self.shard and f"--shard {self.shard.number}/{self.shard.of}",
            self.keyword and f"-k {self.keyword.text!r}",
            self.last_failed and "--last-failed",
        ]
        return " ".join(part for part in parts if part)

    def ordinals(
        self, queue: Queue, planned: Plan, block_size: int, tags: PartTags = NO_TAGS
    ) -> Bools | None:
        """Tell which test cases are chosen.

        Args:
            queue: Of the database.
            planned: The plan, which is saved.
            block_size: Most test cases in a block.
            tags: Of its scenarios and architectures.

        Returns:
            (N,) for each ordinal; None for all.
        """
        if self.is_everything:
            return None
        chosen = np.ones(planned.planned, dtype=np.bool_)
        if self.shard is not None:
            chosen &= self.shard.ordinals(planned, block_size)
        if self.keyword is not None:
            for ordinal, case, _ in queue.cases(planned.campaign):
                chosen[ordinal] &= self.keyword.matches(case, tags)
        if self.last_failed:
            chosen &= failed_last(queue, planned)
        return chosen


def failed_last(queue: Queue, planned: Plan) -> Bools:
    """Tell which test cases failed the last time that they were executed, or never were.

    A test case with a result in this campaign is what that says. One without is looked up by its
    names in the earlier campaigns of the ODD, the last one first: its content may be another one by
    now, which is why it has no result. It failed if a mandatory FSR has a FAIL or an ERROR.

    Args:
        queue: Of the database.
        planned: The plan, which is saved.

    Returns:
        (N,) for each ordinal.
    """
    chosen = np.zeros(planned.planned, dtype=np.bool_)
    chosen[sorted(queue.failed(planned.campaign))] = True
    unknown = {
        case: ordinal for ordinal, case, has_result in queue.cases(planned.campaign)
        if not has_result
    }  # fmt: skip
    for earlier in queue.earlier(planned.campaign):
        if not unknown:
            break
        failed = queue.failed(earlier)
        for ordinal, case, has_result in queue.cases(earlier):
            if has_result and case in unknown:
                chosen[unknown.pop(case)] = ordinal in failed
    chosen[sorted(unknown.values())] = True
    return chosen


# --- Expressions that choose test cases by their names: words joined by ``and``, ``or`` and
# ``not``.

MAX_LENGTH: Final = 1_000
"""Longest expression, in characters."""
MAX_DEPTH: Final = 50
"""Most ``not`` and parentheses inside each other."""

_REMEDY: Final = (
    "Write words joined by and, or, not and parentheses, such as 'cut_in and not gap=30'; "
    "put a word with a space into double quotes."
)
_COMPARES: Final = re.compile(r"[<>]|==|!=")
_TOKEN: Final = re.compile(r'\s*(?:([()])|((?:"[^"]*"|[^\s()"])+))')
_CLOSE: Final = 1e-9
"""Relative difference of two numbers that are the same quantity in different units."""


@dataclass(frozen=True)
class _Names:
    """What words look at in one test case: texts, swept values by name, and tags."""

    texts: tuple[str, ...]
    values: dict[str, Any]
    tags: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Keyword:
    """A parsed expression.

    A word chooses the test cases that have it in the id of the scenario, the architecture or the
    faults, or in ``name=value`` of a swept parameter or a tag, whatever its case. A word
    ``name=value`` asks for exactly that value of that parameter, with or without its unit, or that
    text of a tag; ``scenario``, ``architecture``, ``fault`` and ``replicate`` are names too.

    Attributes:
        text: As written.
    """

    text: str
    _test: _Test

    @classmethod
    def parse(cls, text: str) -> Keyword:
        """Read an expression.

        Raises:
            UsageError: It is empty, too long or nested too deeply, or something is missing in it.
        """
        if len(text) > MAX_LENGTH:
            raise _refuse(text[:40] + "…", f"is longer than {MAX_LENGTH} characters")
        reader = _Reader(text)
        test = reader.either(0)
        if reader.tokens:
            raise _refuse(text, f"has {reader.tokens[0]!r} where and, or or the end is expected")
        return cls(text, test)

    def matches(self, case: NamedCase, tags: PartTags = NO_TAGS) -> bool:
        """Tell whether it chooses a test case.

        Args:
            case: The test case.
            tags: Of the scenarios and architectures of its campaign.
        """
        point = json.loads(case.point)
        own = tags.of(case)
        values: dict[str, Any] = {
            "scenario": case.scenario,
            "architecture": case.architecture,
            "fault": case.fault_entry,
            "replicate": case.replicate,
            **point,
        }
        told = (f"{name}={_written(value)}" for name, value in point.items())
        texts = (case.scenario, case.architecture, case.fault_entry, *told)
        marks = (f"{name}={text}" for name, text in own)
        return self._test(_Names(tuple(text.casefold() for text in (*texts, *marks)), values, own))


class _Reader:
    """Reads tokens from left to right, by one function for each strength of binding."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens: list[str] = []
        place = 0
        while text[place:].strip():
            found = _TOKEN.match(text, place)
            if found is None:
                raise _refuse(text, "has a quote that does not end")
            self.tokens.append(found[1] or found[2])
            place = found.end()

    def either(self, depth: int) -> _Test:
        tests = [self.both(depth)]
        while self._has("or"):
            tests.append(self.both(depth))
        return tests[0] if len(tests) == 1 else lambda names: any(test(names) for test in tests)

    def both(self, depth: int) -> _Test:
        tests = [self.one(depth)]
        while self._has("and"):
            tests.append(self.one(depth))
        return tests[0] if len(tests) == 1 else lambda names: all(test(names) for test in tests)

    def one(self, depth: int) -> _Test:
        if depth > MAX_DEPTH:
            raise _refuse(self.text, f"is nested more than {MAX_DEPTH} deep")
        if self._has("not"):
            inner = self.one(depth + 1)
            return lambda names: not inner(names)
        if self._has("("):
            inner = self.either(depth + 1)
            if not self._has(")"):
                raise _refuse(self.text, "has a parenthesis that does not end")
            return inner
        if not self.tokens or self.tokens[0] in {")", "and", "or"}:
            raise _refuse(self.text, "lacks a word")
        word = self.tokens.pop(0).replace('"', "")
        if _COMPARES.search(word):
            raise _refuse(self.text, f"has {word!r}: a value is asked for as name=value only")
        return _word(word)

    def _has(self, token: str) -> bool:
        if self.tokens[:1] == [token]:
            self.tokens.pop(0)
            return True
        return False


def _word(word: str) -> _Test:
    name, equals, value = word.partition("=")
    if not (equals and name):
        part = word.casefold()
        return lambda names: any(part in text for text in names.texts)
    # Words of the language of expressions, such as true or pi, are no numbers here.
    number = quantity_or_text(value)[0] if any(map(str.isdigit, value)) else value

    def is_asked(names: _Names) -> bool:
        return any(
            _is_same(stored, value, number)
            for key, stored in names.values.items()
            if key == name or key.endswith(f".{name}")
        ) or (name, value.casefold()) in ((key, text.casefold()) for key, text in names.tags)

    return is_asked


def _is_same(stored: object, text: str, number: float | str) -> bool:
    """Compare a swept value with what was written, as a number where both are."""
    if isinstance(stored, bool) or not isinstance(stored, int | float):
        return _written(stored).casefold() == text.casefold()
    return isinstance(number, float) and math.isclose(stored, number, rel_tol=_CLOSE)


def _written(value: object) -> str:
    if isinstance(value, str):
        return value
    return f"{value:g}" if isinstance(value, float) else json.dumps(value)


def _refuse(text: str, why: str) -> UsageError:
    return UsageError(f"-k {text!r} {why}", remedy=_REMEDY)
