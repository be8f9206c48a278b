"""Statements that a query must survive: harmful, endless, oversized, and made of their words."""

import random  # noqa: TID251 - seeded, of tests
from collections.abc import Iterator

from tests.stored import stored

ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
GROWING = (
    "WITH RECURSIVE g(s) AS (SELECT 'aaaaaaaaaaaaaaaa' UNION ALL SELECT s || s FROM g LIMIT 40) "
)

STATEMENTS: dict[str, list[str]] = stored("hostile_sql")
DENIED = STATEMENTS["denied"]
CUT = STATEMENTS["cut"]
TOO_BIG = [
    "GROWING SELECT length(max(s)) FROM g",
    "SELECT " + "(" * 300 + "1" + ")" * 300,
    "SELECT 1" + " + 1" * 300,
    "SELECT 1" + " UNION ALL SELECT 1" * 60,
    "SELECT '" + "a" * 200_000 + "'",
    "SELECT 'a' LIKE '" + "%a" * 200 + "'",
    "SELECT 1; DELETE FROM run",
    "SELECT 1; SELECT 2",
    "",
    "-- nothing",
    "/* SELECT 1 */",
    "EXPLAIN",
    "SELEC 1",
    "SELECT nothing FROM v_runs",
    "SELECT 1\x00; DROP TABLE run",
    "SELECT ?",
    "VACUUM INTO 'copy.db'",
    "SELECT :nothing",
    "GROWING SELECT quote(max(s)) || quote(max(s)) || quote(max(s)) || quote(max(s)) FROM g",
    "SELECT json_valid('" + "[" * 90_000 + "') + json_array_length('" + "[" * 90_000 + "')",
]
LARGE = (
    "WITH RECURSIVE g(s) AS (SELECT 'aaaaaaaaaaaaaaaa' UNION ALL SELECT s || s FROM g LIMIT 16), "
    "large(s) AS MATERIALIZED (SELECT max(s) FROM g)"
)
TOO_MUCH = [
    # One row of a thousand columns of half a megabyte, as texts and as bytes.
    "LARGE SELECT s" + ", s" * 990 + " FROM large",
    "LARGE, b(b) AS MATERIALIZED (SELECT CAST(s AS BLOB) FROM large) SELECT b"
    + ", b" * 990
    + " FROM b",
    # Many rows of one, handed over, and kept inside.
    "LARGE, n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 5000) "
    "SELECT s || i FROM large, n",
    "LARGE, n(s, i) AS (SELECT s, 1 FROM large UNION SELECT s || '', i + 1 FROM n) "
    "SELECT count(*) FROM n",
]
ALLOWED = STATEMENTS["allowed"]

_WORDS = """
SELECT SELECT SELECT * 1 'a' NULL FROM WHERE AND OR ( ) , ; -- /* */ = < || . " ? :a @b $c [ ] `
x'00' INSERT INTO run VALUES UPDATE SET DELETE DROP TABLE VIEW TRIGGER INDEX CREATE TEMP VIRTUAL
USING fts5 ALTER ADD COLUMN RENAME TO REPLACE ATTACH 'stolen.db' AS DETACH PRAGMA journal_mode
writable_schema query_only VACUUM ANALYZE REINDEX BEGIN COMMIT ROLLBACK SAVEPOINT RELEASE EXPLAIN
QUERY PLAN WITH RECURSIVE n(i) UNION ALL EXCEPT GROUP BY ORDER LIMIT HAVING JOIN LEFT CROSS ON
v_runs v_verdicts work campaign verdict sqlite_master pragma_table_info('run') json_each('[1]')
load_extension('x') writefile('w','x') randomblob(9) zeroblob(9) printf('%d',1) edit('x')
fts3_tokenizer('x') count(*) max(1) group_concat('a') CAST LIKE GLOB MATCH REGEXP IN EXISTS CASE
WHEN THEN ELSE END OVER () RETURNING state state='done' rowid IF NOT
"""
WORDS = (*_WORDS.split(), "\x00")
_HARMFUL = (
    *DENIED,
    "VACUUM INTO 'copy.db'",
    "SELECT 1; DROP TABLE work",
    "INSERT INTO work DEFAULT VALUES",
    "CREATE TABLE t AS SELECT * FROM run",
    "DROP VIEW v_gate",
    "UPDATE work SET owner = owner",
)


def written_out(sql: str) -> str:
    """Write the beginnings of statements out."""
    return sql.replace("ENDLESS", ENDLESS).replace("GROWING", GROWING).replace("LARGE", LARGE)


def statements(count: int) -> Iterator[str]:
    """Make statements: words in any order; harmful and allowed ones with other words in places."""
    generator = random.Random(7)  # noqa: S311 - of tests
    for number in range(count):
        if number % 3 == 0:
            yield " ".join(generator.choices(WORDS, k=generator.randint(1, 12)))
            continue
        chosen = generator.choice(_HARMFUL if number % 3 == 1 else ALLOWED)
        words = written_out(chosen).split(" ")
        for _ in range(generator.randint(0, 2)):
            place = generator.randrange(len(words))
            end = place + generator.randint(0, 1)
            words[place:end] = generator.choices(WORDS, k=generator.randint(0, 2))
            words = words or ["SELECT"]
        yield " ".join(words)
