"""What of a statement is let through to a server: words and functions, whatever their spelling."""

import pytest

from adeye.errors import InputError
from adeye.store.read.query import checked, tokens_of

ALLOWED = [
    "SELECT count(*), avg(x) FILTER (WHERE x > 1) FROM v_runs WHERE a IN (1, 2) AND NOT (b)",
    "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i FROM n LIMIT 3",
    "WITH a AS MATERIALIZED (SELECT 1), b(x) AS NOT MATERIALIZED (VALUES (1)) SELECT * FROM b",
    "SELECT row_number() OVER (PARTITION BY a ORDER BY b) FROM v_runs",
    "SELECT CAST(x AS numeric(10, 2)), x::text, 'it''s; -- a text (', \"odd name\" FROM t",
    "SELECT key, value FROM v_runs, json_each(parameters) AS j(key, value, type)",
    "SELECT pg_catalog.lower(a), adeye.json_each(b) FROM t -- the end; DROP TABLE run",
    "(SELECT 1) UNION (SELECT 2);",
    "VALUES (1, 2), (3, 4)",
    "EXPLAIN SELECT * FROM v_gate WHERE campaign = :campaign",
    "SELECT percentile_cont(0.5) WITHIN GROUP (ORDER BY x) FROM t",
]
REFUSED = [
    "SELECT pg_sleep(1)",
    "SELECT PG_SLEEP (1)",
    "SELECT pg_sleep\n-- so\n(1)",
    'SELECT "pg_sleep"(1)',
    "SELECT pg_catalog.pg_sleep(1)",
    'SELECT "pg_catalog"."pg_sleep"(1)',
    "SELECT public.lower('a')",
    "SELECT 1 FROM pg_sleep(1) AS (a int)",
    "SELECT 1 FROM dblink('x', 'DROP TABLE run') AS (a int)",
    "SELECT 1 FROM dblink('x', 'DROP TABLE run') AS t(a int)",
    "SELECT set_config('role', 'none', false)",
    "SELECT pg_read_file('/etc/passwd')",
    "SELECT lo_import('/etc/passwd')",
    "SELECT pg_terminate_backend(1)",
    "SELECT pg_advisory_lock(1)",
    "SELECT query_to_xml('DROP TABLE run', true, true, '')",
    "SELECT repeat('x', 1000000000)",
    "SELECT * FROM generate_series(1, 1000000000)",
    "SELECT DISTINCT ON (a) pg_sleep(1) FROM t",
    'SELECT U&"pg\\005Fsleep"(1)',
    "SELECT E'\\'; DROP TABLE run; --'",
    "SELECT $$a$$",
    "SELECT $a$ ' $a$",
    "SELECT 1 /* SELECT 2 */",
    "SELECT 1\x00",
    "SELECT 'open",
    "SELECT 1; SELECT 2",
    "COPY run TO PROGRAM 'sh'",
    "DO 'BEGIN END'",
    "CALL x()",
    "SET ROLE postgres",
    "INSERT INTO work DEFAULT VALUES",
    ";",
    "",
    "-- nothing",
    "SELECT 1) AS one, (SELECT 2",
    "SELECT 1)",
    "(SELECT 1",
]


@pytest.mark.parametrize("sql", ALLOWED)
def test_reading_passes(sql: str) -> None:
    tokens = checked(sql)
    assert [token.text for token in tokens if sql[token.start :].startswith(token.text)] == [
        token.text for token in tokens
    ]


@pytest.mark.parametrize("sql", REFUSED)
def test_everything_else_is_refused(sql: str) -> None:
    with pytest.raises(InputError, match="query: "):
        checked(sql)


def test_text_and_name_hide_no_statement() -> None:
    kinds = [token.kind for token in tokens_of("""SELECT ';' AS ";" , a::text, :b -- ;""")]
    assert kinds == [
        "word", "text", "word", "quoted", "sign", "word", "sign", "word", "sign", "parameter"
    ]  # fmt: skip
