-- Schema 0008 for SQLite. A line of two dashes stands between statements.

--

CREATE TABLE benchmark (
	result_digest VARCHAR(64) NOT NULL, 
	model TEXT NOT NULL, 
	edition TEXT NOT NULL, 
	version INTEGER NOT NULL, 
	drive_digest VARCHAR(64) NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_benchmark PRIMARY KEY (result_digest, model, edition, version), 
	CONSTRAINT fk_benchmark_result_digest FOREIGN KEY(result_digest) REFERENCES run (result_digest), 
	CONSTRAINT fk_benchmark_drive_digest FOREIGN KEY(drive_digest) REFERENCES run (result_digest)
)

--

CREATE INDEX ix_benchmark_drive_digest ON benchmark (drive_digest)

--

CREATE TRIGGER benchmark_no_update BEFORE UPDATE ON benchmark
BEGIN SELECT RAISE(ABORT, 'benchmark is insert-only'); END

--

CREATE TRIGGER benchmark_no_delete BEFORE DELETE ON benchmark
BEGIN SELECT RAISE(ABORT, 'benchmark is insert-only'); END

--

CREATE VIEW v_preventability AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    b.result_digest AS run, b.model, b.edition, b.drive_digest AS drive, m.contact,
    r.realised, m.impact_speed_mps, n.contact AS drive_contact, d.realised AS drive_realised,
    n.impact_speed_mps AS drive_impact_speed_mps
FROM benchmark b
JOIN run r ON r.result_digest = b.result_digest
JOIN metric m ON m.run_number = r.number
JOIN run d ON d.result_digest = b.drive_digest
JOIN metric n ON n.run_number = d.number
JOIN campaign_case c ON c.result_digest = b.result_digest
JOIN test_case t ON t.digest = c.test_case_digest
WHERE b.version = (SELECT MAX(x.version) FROM benchmark x
    WHERE x.result_digest = b.result_digest AND x.model = b.model AND x.edition = b.edition)
