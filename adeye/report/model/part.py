"""The small records that summaries and replays are both made of."""

import ast
import inspect
from collections.abc import Callable, Iterable, Iterator
from functools import wraps
from itertools import pairwise
from textwrap import dedent
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from adeye.judge.verdict import Verdict

Id = Annotated[str, Field(min_length=1)]
Count = Annotated[int, Field(ge=0)]
Asil = Literal["QM", "A", "B", "C", "D"]


class Part(BaseModel):
    """A frozen record of a report; a number that is not finite has no place in it."""

    model_config = ConfigDict(
        defer_build=True,
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
    )

    @classmethod
    def of(cls, source: object, **others: Any) -> Self:
        """Return a record with what something has under the names of its fields, and with the rest.

        Args:
            source: Is asked for every field that is not given.
            others: What it does not have, or has in another form.

        Raises:
            AttributeError: A field is neither given nor there; none keeps its default unsaid.
        """
        asked = [name for name in cls.model_fields if name not in others]
        return cls(**{name: getattr(source, name) for name in asked}, **others)

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Describe each field by the text below it.

        Only who asks for a schema waits for the sources to be read; pydantic can do it, too, but
        does so whenever a class is imported.
        """
        made = handler(core)
        properties = handler.resolve_ref_schema(made).get("properties", {})
        for name, text in _texts_of_fields(cls):
            if name in properties:
                properties[name].setdefault("description", text)
        return made


def _texts_of_fields(kind: type[BaseModel]) -> Iterator[tuple[str, str]]:
    (tree,) = ast.parse(dedent(inspect.getsource(kind))).body
    assert isinstance(tree, ast.ClassDef)
    for field, below in pairwise(tree.body):
        match field, below:
            case ast.AnnAssign(target=ast.Name(name)), ast.Expr(ast.Constant(str(text))):
                yield name, inspect.cleandoc(text)


def agrees(check: Callable[[Any], Iterable[str]]) -> Any:
    """Make the validator of a record from a method that tells where it contradicts itself.

    Args:
        check: Gives the message of each contradiction; the first one is the error.
    """

    @wraps(check)
    def validated(record: Any) -> Any:
        for contradiction in check(record):
            raise ValueError(contradiction)
        return record

    return model_validator(mode="after")(validated)


class Label(Part):
    """A name and a value, both ready for people."""

    label: str
    value: str


class Place(Part):
    """A place in a file of the user, counted from 1."""

    path: str
    line: Annotated[int, Field(ge=1)]
    column: Annotated[int, Field(ge=1)]

    def __str__(self) -> str:
        """Write it as ``path:line``."""
        return f"{self.path}:{self.line}"


class Command(Part):
    """A command line and what it reproduces."""

    text: str
    """What it reproduces."""
    command: str


class Margin(Part):
    """Distance to the threshold, positive where the FSR holds."""

    value: float
    """In the unit of the binding predicate's signal."""
    unit: str
    robustness: float | None = None
    """The same divided by the signal's scale; comparable between signals."""


class Binding(Part):
    """The predicate that a margin comes from, at one time of one run."""

    predicate: str
    """As it was written."""
    signal: str
    time_s: float | None = None
    """None where the trace ended before."""
    obligation_time_s: float | None = None
    """When the obligation began that it decides."""
    actor: str | None = None
    value: bool | float | str | None = None
    threshold: bool | float | str | None = None
    difference: float | None = None
    unit: str = ""
    note: str = ""
    """Why there is no value, such as "no conflict" or "ended by contact"."""


class RunVerdict(Part):
    """The verdict of one FSR on one run."""

    fsr: Id
    verdict: Verdict
    margin: Margin | None = None
    binding: Binding | None = None
    note: str = ""
