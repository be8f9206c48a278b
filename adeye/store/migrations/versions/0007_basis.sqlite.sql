-- Schema 0007 for SQLite. A line of two dashes stands between statements.

--

CREATE TABLE uid_set (
	digest VARCHAR(64) NOT NULL, 
	uids TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_uid_set PRIMARY KEY (digest)
)

--

CREATE TABLE basis (
	run_number INTEGER NOT NULL, 
	version INTEGER NOT NULL, 
	uid_set_digest VARCHAR(64) NOT NULL, 
	by_contact BOOLEAN NOT NULL, 
	invalid TEXT, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_basis PRIMARY KEY (run_number, version), 
	CONSTRAINT fk_basis_run_number FOREIGN KEY(run_number) REFERENCES run (number), 
	CONSTRAINT fk_basis_uid_set_digest FOREIGN KEY(uid_set_digest) REFERENCES uid_set (digest)
)

--

CREATE TABLE extreme (
	run_number INTEGER NOT NULL, 
	measure TEXT NOT NULL, 
	version INTEGER NOT NULL, 
	value FLOAT, 
	time_s FLOAT, 
	actor TEXT, 
	samples TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_extreme PRIMARY KEY (run_number, measure, version), 
	CONSTRAINT fk_extreme_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)
 WITHOUT ROWID

--

CREATE TABLE kept_trace (
	run_number INTEGER NOT NULL, 
	file TEXT NOT NULL, 
	place INTEGER NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_kept_trace PRIMARY KEY (run_number, file), 
	CONSTRAINT fk_kept_trace_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TRIGGER uid_set_no_update BEFORE UPDATE ON uid_set
BEGIN SELECT RAISE(ABORT, 'uid_set is insert-only'); END

--

CREATE TRIGGER uid_set_no_delete BEFORE DELETE ON uid_set
BEGIN SELECT RAISE(ABORT, 'uid_set is insert-only'); END

--

CREATE TRIGGER basis_no_update BEFORE UPDATE ON basis
BEGIN SELECT RAISE(ABORT, 'basis is insert-only'); END

--

CREATE TRIGGER basis_no_delete BEFORE DELETE ON basis
BEGIN SELECT RAISE(ABORT, 'basis is insert-only'); END

--

CREATE TRIGGER extreme_no_update BEFORE UPDATE ON extreme
BEGIN SELECT RAISE(ABORT, 'extreme is insert-only'); END

--

CREATE TRIGGER extreme_no_delete BEFORE DELETE ON extreme
BEGIN SELECT RAISE(ABORT, 'extreme is insert-only'); END

--

CREATE TRIGGER kept_trace_no_update BEFORE UPDATE ON kept_trace
BEGIN SELECT RAISE(ABORT, 'kept_trace is insert-only'); END

--

CREATE TRIGGER kept_trace_no_delete BEFORE DELETE ON kept_trace
BEGIN SELECT RAISE(ABORT, 'kept_trace is insert-only'); END
