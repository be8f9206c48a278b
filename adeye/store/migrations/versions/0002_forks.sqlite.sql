-- Schema 0002 for SQLite. A line of two dashes stands between statements.

--

CREATE TABLE chain (
	run_number INTEGER NOT NULL,
	every_rows INTEGER NOT NULL,
	links TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_chain PRIMARY KEY (run_number),
	CONSTRAINT fk_chain_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE fork (
	result_digest VARCHAR(64) NOT NULL,
	test_case_digest VARCHAR(64) NOT NULL,
	origin_digest VARCHAR(64) NOT NULL,
	from_tick INTEGER NOT NULL,
	authority TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_fork PRIMARY KEY (result_digest),
	CONSTRAINT fk_fork_result_digest FOREIGN KEY(result_digest) REFERENCES run (result_digest),
	CONSTRAINT fk_fork_test_case_digest FOREIGN KEY(test_case_digest) REFERENCES test_case (digest),
	CONSTRAINT fk_fork_origin_digest FOREIGN KEY(origin_digest) REFERENCES run (result_digest)
)

--

CREATE INDEX ix_fork_origin_digest ON fork (origin_digest)

--

CREATE INDEX ix_fork_test_case_digest ON fork (test_case_digest)

--

CREATE TRIGGER chain_no_update BEFORE UPDATE ON chain
BEGIN SELECT RAISE(ABORT, 'chain is insert-only'); END

--

CREATE TRIGGER chain_no_delete BEFORE DELETE ON chain
BEGIN SELECT RAISE(ABORT, 'chain is insert-only'); END

--

CREATE TRIGGER fork_no_update BEFORE UPDATE ON fork
BEGIN SELECT RAISE(ABORT, 'fork is insert-only'); END

--

CREATE TRIGGER fork_no_delete BEFORE DELETE ON fork
BEGIN SELECT RAISE(ABORT, 'fork is insert-only'); END
