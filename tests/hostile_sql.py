"""Statements that a query must survive: harmful, endless, oversized, and made of their words."""

import random  # noqa: TID251 - seeded, of tests
from collections.abc import Iterator

ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
GROWING = (
    "WITH RECURSIVE g(s) AS (SELECT 'aaaaaaaaaaaaaaaa' UNION ALL SELECT s || s FROM g LIMIT 40) "
)

DENIED = [
    "ATTACH 'stolen.db' AS other",
    "ATTACH ':memory:' AS other",
    "DETACH main",
    "PRAGMA journal_mode = DELETE",
    "PRAGMA query_only = OFF",
    "PRAGMA writable_schema = ON",
    "SELECT * FROM pragma_database_list",
    "INSERT INTO odd VALUES ('a', 'b', 'c', 'd', 'e')",
    "UPDATE work SET state = 'done'",
    "DELETE FROM run",
    "REPLACE INTO run SELECT * FROM run",
    "CREATE TABLE x (y)",
    "CREATE TEMP TABLE x (y)",
    "CREATE VIEW x AS SELECT 1",
    "CREATE VIRTUAL TABLE x USING fts5(y)",
    "DROP TABLE run",
    "DROP TRIGGER run_no_delete",
    "ALTER TABLE run ADD COLUMN x",
    "REINDEX",
    "ANALYZE",
    "BEGIN IMMEDIATE",
    "SAVEPOINT s",
    "COMMIT",
    "WITH x AS (SELECT 1) DELETE FROM run",
    "SELECT load_extension('evil.so')",
    "SELECT randomblob(1000000000)",
    "SELECT zeroblob(1000000000)",
    "SELECT hex(zeroblob(1000000000))",
    "SELECT printf('%.*c', 100000000, 'x')",
    "SELECT format('%.*c', 100000000, 'x')",
    "SELECT replace('aaaa', 'a', 'bbbbbbbb')",
    "SELECT instr('aaaa', 'ab')",
    "SELECT trim('aaaa', 'a')",
    "SELECT readfile('/etc/passwd')",
    "SELECT writefile('x', 'y')",
    "SELECT edit('x')",
    "SELECT fts3_tokenizer('simple')",
    "SELECT sqlite_compileoption_get(1)",
]
CUT = [
    "ENDLESS SELECT length(group_concat(i)) FROM n",
    "ENDLESS SELECT length(json_group_array(i)) FROM n",
    "ENDLESS SELECT count(*) FROM n",
    "ENDLESS SELECT max(i) FROM n WHERE i < 0",
    "ENDLESS SELECT i FROM n ORDER BY i DESC",
    "ENDLESS SELECT group_concat(i) FROM n WHERE i < 0",
    "SELECT count(*) FROM v_runs a, v_runs b, v_runs c, v_runs d, v_runs e, v_runs f, v_runs g",
    "SELECT * FROM run a, run b, run c, run d, run e, run f, run g ORDER BY random(), 1",
]
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
ALLOWED = [
    "SELECT json_extract(verdicts, '$.FSR1') FROM v_runs",
    "SELECT verdicts ->> 'FSR1' FROM v_runs WHERE scenario LIKE 'cut%'",
    "SELECT key, value FROM v_runs, json_each(parameters)",
    "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 5) SELECT * FROM n",
    "SELECT ordinal, lag(ordinal) OVER (ORDER BY ordinal) FROM v_runs",
    "SELECT name FROM sqlite_master WHERE type = 'view'",
    "SELECT iif(1, 2, 3)",  # codespell:ignore iif
    "SELECT * FROM v_gate",
    "SELECT * FROM v_fsr_status",
    "SELECT * FROM v_architecture_pairs",
    "SELECT * FROM v_coverage",
    "SELECT * FROM v_timeline",
    "SELECT * FROM v_verdicts",
    "SELECT * FROM v_runs_cut_in",
    "VALUES (1, 2), (3, 4)",
    "EXPLAIN QUERY PLAN SELECT * FROM run",
]

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
