"""Look at SQL that a person typed before a server sees it: which words, which functions.

This is the second line behind the rights of the reading role and the read-only transaction of
``server_query``: a function that only reads can still wait, lock, or change a setting.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from adeye.errors import InputError

_FUNCTION_NAMES: Final = """
abs acos asin atan atan2 avg bool_and bool_or cbrt ceil ceiling char_length coalesce concat
concat_ws corr cos count covar_pop covar_samp cume_dist date_part date_trunc degrees dense_rank
div exp extract first_value floor greatest initcap json_array_length json_each json_typeof lag
last_value lead least left length ln log log10 lower ltrim max min mod nth_value ntile nullif
percent_rank percentile_cont percentile_disc pi position pow power radians rank regr_intercept
regr_r2 regr_slope right round row_number rtrim sign sin sqrt starts_with stddev stddev_pop
stddev_samp string_agg strpos substr substring sum tan to_char trim trunc upper var_pop var_samp
variance width_bucket
"""
_KEYWORDS: Final = """
all and any as between by case cast char decimal distinct else end except exists filter float
from full group having in inner intersect into interval is join lateral left like limit
materialized not numeric offset on or order outer over partition precision recursive right
select some then time timestamp union using values varchar when where window with within
"""
FUNCTIONS: Final = frozenset(_FUNCTION_NAMES.split())
"""Functions that neither wait nor change anything nor make much of little."""

_BEFORE_BRACKETS: Final = frozenset(_KEYWORDS.split())
_FIRST: Final = frozenset({"select", "with", "values", "table", "explain"})
_BODIES: Final = frozenset({"select", "with", "values", "table", "("})
_SCHEMAS: Final = frozenset({"adeye", "pg_catalog"})

_TOKEN: Final = re.compile(
    r"""
    (?P<blank>\s+|--[^\n]*)
    |(?P<text>'(?:[^']|'')*')
    |(?P<quoted>"(?:[^"]|"")+")
    |(?P<parameter>(?<!:):[A-Za-z_]\w*)
    |(?P<word>[^\W\d][\w$]*)
    |(?P<number>(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)
    |(?P<sign>::|[-+*/<>=~!@\#%^&|`?.,;:()\[\]])
    """,
    re.VERBOSE,
)


class Token(NamedTuple):
    """A piece of a statement and where it begins."""

    kind: str
    text: str
    start: int


def tokens_of(sql: str) -> list[Token]:
    """Split a statement.

    Raises:
        InputError: It has what is not read here: a NUL, a comment with ``/*``, texts with
            backslashes, texts between dollars, names with escapes.
    """
    found: list[Token] = []
    place = 0
    while place < len(sql):
        match = _TOKEN.match(sql, place)
        if match is None:
            raise _refusal(f"{sql[place]!r} cannot be read here")
        kind, text = str(match.lastgroup), match.group()
        place = match.end()
        before = found[-1] if found else None
        if text == "/" and sql[place : place + 1] == "*":
            raise _refusal("comments begin with --")
        if kind in ("text", "quoted") and _is_prefixed(before, sql, match.start()):
            raise _refusal(f"the form {before.text if before else ''}{text[:1]} is not allowed")
        if kind != "blank":
            found.append(Token(kind, text, match.start()))
    return found


def _is_prefixed(before: Token | None, sql: str, start: int) -> bool:
    """Tell whether a word stands at a text, which then is of another form: E'', U&"", B''."""
    if before is None or sql[start - 1].isspace():
        return False
    return before.kind == "word" or before.text == "&"


def checked(sql: str) -> list[Token]:
    """Split one statement that only reads, with nothing but allowed functions.

    Raises:
        InputError: It is another statement, several, or calls another function.
    """
    tokens = tokens_of(sql)
    while tokens and tokens[-1].text == ";":
        tokens.pop()
    if not tokens:
        raise InputError("query: no statement", remedy="Write one SELECT.")
    if any(token.text == ";" for token in tokens):
        raise _refusal("you can only execute one statement")
    first = next((token.text.lower() for token in tokens if token.text != "("), "")
    if first not in _FIRST:
        raise _refusal("only reading is allowed")
    _require_closed(tokens)
    for place, token in enumerate(tokens):
        if token.text == "(" and place and tokens[place - 1].kind in ("word", "quoted"):
            _require_call(tokens, place - 1)
    return tokens


def _require_closed(tokens: list[Token]) -> None:
    """Refuse brackets that do not match: a statement may be put between others."""
    depth = 0
    for token in tokens:
        depth += {"(": 1, ")": -1}.get(token.text, 0)
        if depth < 0:
            break
    if depth:
        raise _refusal("its brackets do not match")


def _require_call(tokens: list[Token], place: int) -> None:
    """Refuse a call of what is not allowed."""
    token = tokens[place]
    name = _name(token)
    before = tokens[place - 1].text if place else ""
    if before == ".":
        if _name(tokens[place - 2]) not in _SCHEMAS or name not in FUNCTIONS:
            raise _refusal(f"function {name}() is not allowed")
        return
    if token.kind == "word" and name in _BEFORE_BRACKETS:
        return
    if before.lower() == "as" or name in FUNCTIONS or _is_common_table(tokens, place):
        return
    raise _refusal(f"function {name}() is not allowed")


def _is_common_table(tokens: list[Token], place: int) -> bool:
    """Tell whether a name with columns is that of a query after WITH: its body follows."""
    depth, end = 0, place + 1
    while end < len(tokens):
        depth += {"(": 1, ")": -1}.get(tokens[end].text, 0)
        end += 1
        if depth == 0:
            break
    rest = [token.text.lower() for token in tokens[end : end + 5]]
    words = [word for word in rest if word not in ("not", "materialized")]
    return words[:2] == ["as", "("] and len(words) > 2 and words[2] in _BODIES


def _name(token: Token) -> str:
    if token.kind == "quoted":
        return token.text[1:-1].replace('""', '"')
    return token.text.lower()


def _refusal(message: str) -> InputError:
    return InputError(f"query: {message}", remedy="Write one SELECT over the views.")
