-- Schema 0005 for SQLite. A line of two dashes stands between statements.

--

CREATE TABLE half_step (
	result_digest VARCHAR(64) NOT NULL,
	test_case_digest VARCHAR(64) NOT NULL,
	origin_digest VARCHAR(64) NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_half_step PRIMARY KEY (result_digest),
	CONSTRAINT fk_half_step_result_digest FOREIGN KEY(result_digest) REFERENCES run (result_digest),
	CONSTRAINT fk_half_step_test_case_digest FOREIGN KEY(test_case_digest) REFERENCES test_case (digest)
)

--

CREATE INDEX ix_half_step_origin_digest ON half_step (origin_digest)

--

CREATE INDEX ix_half_step_test_case_digest ON half_step (test_case_digest)

--

CREATE TABLE uncertainty (
	campaign_id VARCHAR(32) NOT NULL,
	scenario TEXT NOT NULL,
	architecture TEXT NOT NULL,
	kind TEXT NOT NULL,
	name TEXT NOT NULL,
	unit TEXT NOT NULL,
	sampled INTEGER NOT NULL,
	pairs INTEGER NOT NULL,
	p95 FLOAT,
	largest FLOAT,
	uncertainty FLOAT,
	differing INTEGER NOT NULL,
	changes TEXT NOT NULL,
	fsr_digest VARCHAR(64),
	judged_digest VARCHAR(64),
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_uncertainty PRIMARY KEY (campaign_id, scenario, architecture, kind, name, unit),
	CONSTRAINT ck_uncertainty_kind CHECK (kind = 'metric' OR kind = 'fsr'),
	CONSTRAINT ck_uncertainty_pairs CHECK (pairs BETWEEN 0 AND sampled),
	CONSTRAINT ck_uncertainty_p95 CHECK ((pairs = 0) = (p95 IS NULL)),
	CONSTRAINT ck_uncertainty_judged CHECK ((kind = 'fsr') = (judged_digest IS NOT NULL)),
	CONSTRAINT fk_uncertainty_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TRIGGER half_step_no_update BEFORE UPDATE ON half_step
BEGIN SELECT RAISE(ABORT, 'half_step is insert-only'); END

--

CREATE TRIGGER half_step_no_delete BEFORE DELETE ON half_step
BEGIN SELECT RAISE(ABORT, 'half_step is insert-only'); END

--

CREATE TRIGGER uncertainty_no_update BEFORE UPDATE ON uncertainty
BEGIN SELECT RAISE(ABORT, 'uncertainty is insert-only'); END

--

CREATE TRIGGER uncertainty_no_delete BEFORE DELETE ON uncertainty
BEGIN SELECT RAISE(ABORT, 'uncertainty is insert-only'); END

--

CREATE VIEW v_uncertainty AS
SELECT campaign_id AS campaign, scenario, architecture, kind, name, unit, sampled, pairs, p95,
    largest, uncertainty, differing, changes
FROM uncertainty
