-- Schema 0005 for PostgreSQL. A line of two dashes stands between statements.

--

CREATE FUNCTION json_each(document text, path text DEFAULT '$')
RETURNS TABLE (key text, value text, type text) LANGUAGE sql IMMUTABLE PARALLEL SAFE AS $body$
WITH part AS (
    SELECT p.j, json_typeof(p.j) AS kind FROM (
        SELECT CASE path WHEN '$' THEN document::json
            ELSE document::json -> substr(path, 3) END AS j) p),
member AS (
    SELECT m.key, m.value FROM part,
        json_each(CASE part.kind WHEN 'object' THEN part.j ELSE '{}' END) m
    UNION ALL
    SELECT (a.place - 1)::text, a.value FROM part,
        json_array_elements(CASE part.kind WHEN 'array' THEN part.j ELSE '[]' END)
            WITH ORDINALITY AS a(value, place)
    UNION ALL
    SELECT NULL, part.j FROM part WHERE part.kind NOT IN ('object', 'array'))
SELECT member.key,
    CASE WHEN json_typeof(member.value) <> 'boolean' THEN member.value #>> '{}'
        WHEN member.value::text = 'true' THEN '1' ELSE '0' END,
    CASE json_typeof(member.value) WHEN 'string' THEN 'text' WHEN 'boolean' THEN member.value::text
        WHEN 'number' THEN CASE WHEN member.value::text ~ '[.eE]' THEN 'real' ELSE 'integer' END
        ELSE json_typeof(member.value) END
FROM member
$body$

--

CREATE FUNCTION insert_only() RETURNS trigger LANGUAGE plpgsql AS $body$
BEGIN
    RAISE EXCEPTION '% is insert-only', TG_TABLE_NAME;
END
$body$

--

CREATE TABLE architecture (
	digest VARCHAR(64) COLLATE "C" NOT NULL, 
	id TEXT COLLATE "C" NOT NULL, 
	version TEXT COLLATE "C" NOT NULL, 
	content TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_architecture PRIMARY KEY (digest)
)

--

CREATE TABLE concept (
	digest VARCHAR(64) COLLATE "C" NOT NULL, 
	id TEXT COLLATE "C" NOT NULL, 
	version TEXT COLLATE "C" NOT NULL, 
	content TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_concept PRIMARY KEY (digest)
)

--

CREATE TABLE ledger (
	number INTEGER NOT NULL, 
	place INTEGER NOT NULL, 
	table_name TEXT COLLATE "C" NOT NULL, 
	is_last SMALLINT NOT NULL, 
	row_count INTEGER NOT NULL, 
	total VARCHAR(32) NOT NULL, 
	detail TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_ledger PRIMARY KEY (number, place)
)

--

CREATE TABLE odd (
	digest VARCHAR(64) COLLATE "C" NOT NULL, 
	id TEXT COLLATE "C" NOT NULL, 
	version TEXT COLLATE "C" NOT NULL, 
	content TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_odd PRIMARY KEY (digest)
)

--

CREATE TABLE scenario (
	digest VARCHAR(64) COLLATE "C" NOT NULL, 
	id TEXT COLLATE "C" NOT NULL, 
	version TEXT COLLATE "C" NOT NULL, 
	content TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_scenario PRIMARY KEY (digest)
)

--

CREATE TABLE uid_set (
	digest VARCHAR(64) COLLATE "C" NOT NULL, 
	uids TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_uid_set PRIMARY KEY (digest)
)

--

CREATE TABLE assumption (
	concept_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	id TEXT COLLATE "C" NOT NULL, 
	owner TEXT COLLATE "C" NOT NULL, 
	valid_until TEXT COLLATE "C" NOT NULL, 
	text TEXT COLLATE "C" NOT NULL, 
	content TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_assumption PRIMARY KEY (concept_digest, id), 
	CONSTRAINT fk_assumption_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE campaign (
	number SERIAL NOT NULL, 
	id VARCHAR(32) COLLATE "C" NOT NULL, 
	created_at TEXT COLLATE "C" NOT NULL, 
	odd_id TEXT COLLATE "C" NOT NULL, 
	odd_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	concept_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	title TEXT COLLATE "C" NOT NULL, 
	planned INTEGER NOT NULL, 
	factors TEXT COLLATE "C" NOT NULL, 
	gate TEXT COLLATE "C" NOT NULL, 
	units TEXT COLLATE "C" NOT NULL, 
	judging TEXT COLLATE "C" NOT NULL, 
	judging_hash VARCHAR(64) COLLATE "C" NOT NULL, 
	provenance TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_campaign PRIMARY KEY (number), 
	CONSTRAINT uq_campaign_id UNIQUE (id), 
	CONSTRAINT fk_campaign_odd_digest FOREIGN KEY(odd_digest) REFERENCES odd (digest), 
	CONSTRAINT fk_campaign_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE decomposition (
	concept_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	id TEXT COLLATE "C" NOT NULL, 
	scheme TEXT COLLATE "C" NOT NULL, 
	independence TEXT COLLATE "C" NOT NULL, 
	content TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_decomposition PRIMARY KEY (concept_digest, id), 
	CONSTRAINT fk_decomposition_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE dependent_failure (
	concept_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	id TEXT COLLATE "C" NOT NULL, 
	owner TEXT COLLATE "C" NOT NULL, 
	valid_until TEXT COLLATE "C" NOT NULL, 
	argument TEXT COLLATE "C" NOT NULL, 
	content TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_dependent_failure PRIMARY KEY (concept_digest, id), 
	CONSTRAINT fk_dependent_failure_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE element (
	concept_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	id TEXT COLLATE "C" NOT NULL, 
	kind TEXT COLLATE "C" NOT NULL, 
	asil_capability TEXT COLLATE "C" NOT NULL, 
	legacy SMALLINT NOT NULL, 
	text TEXT COLLATE "C" NOT NULL, 
	content TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_element PRIMARY KEY (concept_digest, id), 
	CONSTRAINT fk_element_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE fsr (
	concept_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	id TEXT COLLATE "C" NOT NULL, 
	asil TEXT COLLATE "C" NOT NULL, 
	mandatory SMALLINT NOT NULL, 
	min_exercised INTEGER NOT NULL, 
	text TEXT COLLATE "C" NOT NULL, 
	measure TEXT COLLATE "C" NOT NULL, 
	threshold_source TEXT COLLATE "C" NOT NULL, 
	content TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_fsr PRIMARY KEY (concept_digest, id), 
	CONSTRAINT fk_fsr_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE hazardous_event (
	concept_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	id TEXT COLLATE "C" NOT NULL, 
	severity TEXT COLLATE "C" NOT NULL, 
	exposure TEXT COLLATE "C" NOT NULL, 
	controllability TEXT COLLATE "C" NOT NULL, 
	asil TEXT COLLATE "C", 
	content TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_hazardous_event PRIMARY KEY (concept_digest, id), 
	CONSTRAINT fk_hazardous_event_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE safety_goal (
	concept_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	id TEXT COLLATE "C" NOT NULL, 
	asil TEXT COLLATE "C" NOT NULL, 
	ftti_s FLOAT NOT NULL, 
	safe_state TEXT COLLATE "C" NOT NULL, 
	text TEXT COLLATE "C" NOT NULL, 
	content TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_safety_goal PRIMARY KEY (concept_digest, id), 
	CONSTRAINT fk_safety_goal_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE test_case (
	digest VARCHAR(64) COLLATE "C" NOT NULL, 
	situation_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	scenario_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	architecture_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	fault_entry TEXT COLLATE "C" NOT NULL, 
	faults TEXT COLLATE "C" NOT NULL, 
	parameters TEXT COLLATE "C" NOT NULL, 
	replicate INTEGER NOT NULL, 
	seed BIGINT NOT NULL, 
	step_s FLOAT NOT NULL, 
	odd_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	point_index INTEGER NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_test_case PRIMARY KEY (digest), 
	CONSTRAINT fk_test_case_scenario_digest FOREIGN KEY(scenario_digest) REFERENCES scenario (digest), 
	CONSTRAINT fk_test_case_architecture_digest FOREIGN KEY(architecture_digest) REFERENCES architecture (digest), 
	CONSTRAINT fk_test_case_odd_digest FOREIGN KEY(odd_digest) REFERENCES odd (digest)
)

--

CREATE INDEX ix_test_case_situation_digest ON test_case (situation_digest)

--

CREATE TABLE allocation (
	concept_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	fsr_id TEXT COLLATE "C" NOT NULL, 
	element_id TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_allocation PRIMARY KEY (concept_digest, fsr_id, element_id), 
	CONSTRAINT fk_allocation_concept_digest_fsr_id FOREIGN KEY(concept_digest, fsr_id) REFERENCES fsr (concept_digest, id), 
	CONSTRAINT fk_allocation_concept_digest_element_id FOREIGN KEY(concept_digest, element_id) REFERENCES element (concept_digest, id)
)

--

CREATE TABLE campaign_case (
	campaign_id VARCHAR(32) COLLATE "C" NOT NULL, 
	ordinal INTEGER NOT NULL, 
	test_case_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	result_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	scenario TEXT COLLATE "C" NOT NULL, 
	architecture TEXT COLLATE "C" NOT NULL, 
	inside_odd SMALLINT NOT NULL, 
	point TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_campaign_case PRIMARY KEY (campaign_id, ordinal), 
	CONSTRAINT fk_campaign_case_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id), 
	CONSTRAINT fk_campaign_case_test_case_digest FOREIGN KEY(test_case_digest) REFERENCES test_case (digest)
)

--

CREATE INDEX ix_campaign_case_result_digest ON campaign_case (result_digest)

--

CREATE INDEX ix_campaign_case_test_case_digest_campaign_id ON campaign_case (test_case_digest, campaign_id)

--

CREATE TABLE campaign_fsr (
	campaign_id VARCHAR(32) COLLATE "C" NOT NULL, 
	fsr_id TEXT COLLATE "C" NOT NULL, 
	architecture TEXT COLLATE "C" NOT NULL, 
	scenario TEXT COLLATE "C" NOT NULL, 
	fsr_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	asil TEXT COLLATE "C" NOT NULL, 
	mandatory SMALLINT NOT NULL, 
	min_exercised INTEGER NOT NULL, 
	applies TEXT COLLATE "C" NOT NULL, 
	in_gate SMALLINT NOT NULL, 
	applicable SMALLINT NOT NULL, 
	reason TEXT COLLATE "C", 
	waived_until TEXT COLLATE "C", 
	planned INTEGER NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_campaign_fsr PRIMARY KEY (campaign_id, fsr_id, architecture, scenario), 
	CONSTRAINT ck_campaign_fsr_applies CHECK (applies = 'inside' OR applies = 'outside' OR applies = 'everywhere'), 
	CONSTRAINT fk_campaign_fsr_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TABLE campaign_root (
	campaign_id VARCHAR(32) NOT NULL, 
	leaves INTEGER NOT NULL, 
	root VARCHAR(64) COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_campaign_root PRIMARY KEY (campaign_id), 
	CONSTRAINT fk_campaign_root_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TABLE campaign_use (
	number SERIAL NOT NULL, 
	campaign_id VARCHAR(32) COLLATE "C" NOT NULL, 
	at TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_campaign_use PRIMARY KEY (number), 
	CONSTRAINT fk_campaign_use_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TABLE case_count (
	campaign_id VARCHAR(32) COLLATE "C" NOT NULL, 
	scenario TEXT COLLATE "C" NOT NULL, 
	architecture TEXT COLLATE "C" NOT NULL, 
	fault_entry TEXT COLLATE "C" NOT NULL, 
	planned INTEGER NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_case_count PRIMARY KEY (campaign_id, scenario, architecture, fault_entry), 
	CONSTRAINT fk_case_count_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TABLE case_match (
	campaign_id VARCHAR(32) COLLATE "C" NOT NULL, 
	first_ordinal INTEGER NOT NULL, 
	ordinal INTEGER NOT NULL, 
	fault_entry TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_case_match PRIMARY KEY (campaign_id, first_ordinal, ordinal), 
	CONSTRAINT fk_case_match_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TABLE certificate (
	number INTEGER NOT NULL, 
	campaign_id VARCHAR(32) NOT NULL, 
	at TEXT COLLATE "C" NOT NULL, 
	tool TEXT COLLATE "C" NOT NULL, 
	class TEXT COLLATE "C" NOT NULL, 
	executed INTEGER NOT NULL, 
	asked INTEGER NOT NULL, 
	sampled INTEGER NOT NULL, 
	machine_dependent INTEGER NOT NULL, 
	conditions TEXT COLLATE "C" NOT NULL, 
	findings TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_certificate PRIMARY KEY (number), 
	CONSTRAINT ck_certificate_class CHECK (class = 'portable' OR class = 'same platform'), 
	CONSTRAINT ck_certificate_sampled CHECK (sampled BETWEEN 1 AND executed), 
	CONSTRAINT fk_certificate_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TABLE decomposition_child (
	concept_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	fsr_id TEXT COLLATE "C" NOT NULL, 
	child_id TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_decomposition_child PRIMARY KEY (concept_digest, fsr_id, child_id), 
	CONSTRAINT fk_decomposition_child_concept_digest_fsr_id FOREIGN KEY(concept_digest, fsr_id) REFERENCES decomposition (concept_digest, id), 
	CONSTRAINT fk_decomposition_child_concept_digest_child_id FOREIGN KEY(concept_digest, child_id) REFERENCES fsr (concept_digest, id)
)

--

CREATE TABLE element_relation (
	concept_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	element_id TEXT COLLATE "C" NOT NULL, 
	kind TEXT COLLATE "C" NOT NULL, 
	name TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_element_relation PRIMARY KEY (concept_digest, element_id, kind, name), 
	CONSTRAINT fk_element_relation_concept_digest_element_id FOREIGN KEY(concept_digest, element_id) REFERENCES element (concept_digest, id), 
	CONSTRAINT ck_element_relation_kind CHECK (kind = 'resource' OR kind = 'software' OR kind = 'supplier' OR kind = 'provides' OR kind = 'consumes')
)

--

CREATE TABLE run (
	number SERIAL NOT NULL, 
	result_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	test_case_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	backend TEXT COLLATE "C" NOT NULL, 
	variant TEXT COLLATE "C" NOT NULL, 
	numerics_version INTEGER NOT NULL, 
	plugins_digest TEXT COLLATE "C" NOT NULL, 
	outcome TEXT COLLATE "C" NOT NULL, 
	outcome_channel TEXT COLLATE "C", 
	outcome_detail TEXT COLLATE "C", 
	trace_rows INTEGER NOT NULL, 
	duration_s FLOAT NOT NULL, 
	trace_digest VARCHAR(32) COLLATE "C" NOT NULL, 
	realised SMALLINT NOT NULL, 
	end_reason TEXT COLLATE "C" NOT NULL, 
	machine_dependent SMALLINT NOT NULL, 
	result_hash VARCHAR(64) COLLATE "C" NOT NULL, 
	executed_by TEXT COLLATE "C" NOT NULL, 
	executed_at TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_run PRIMARY KEY (number), 
	CONSTRAINT uq_run_result_digest UNIQUE (result_digest), 
	CONSTRAINT fk_run_test_case_digest FOREIGN KEY(test_case_digest) REFERENCES test_case (digest)
)

--

CREATE TABLE session (
	number INTEGER NOT NULL, 
	campaign_id VARCHAR(32) NOT NULL, 
	at TEXT COLLATE "C" NOT NULL, 
	who TEXT COLLATE "C" NOT NULL, 
	host TEXT COLLATE "C" NOT NULL, 
	tool TEXT COLLATE "C" NOT NULL, 
	packages_digest TEXT COLLATE "C" NOT NULL, 
	cpu TEXT COLLATE "C" NOT NULL, 
	provenance TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_session PRIMARY KEY (number), 
	CONSTRAINT fk_session_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE INDEX ix_session_campaign_id ON session (campaign_id)

--

CREATE TABLE uncertainty (
	campaign_id VARCHAR(32) COLLATE "C" NOT NULL, 
	scenario TEXT COLLATE "C" NOT NULL, 
	architecture TEXT COLLATE "C" NOT NULL, 
	kind TEXT COLLATE "C" NOT NULL, 
	name TEXT COLLATE "C" NOT NULL, 
	unit TEXT COLLATE "C" NOT NULL, 
	sampled INTEGER NOT NULL, 
	pairs INTEGER NOT NULL, 
	p95 FLOAT, 
	largest FLOAT, 
	uncertainty FLOAT, 
	differing INTEGER NOT NULL, 
	changes TEXT COLLATE "C" NOT NULL, 
	fsr_digest VARCHAR(64) COLLATE "C", 
	judged_digest VARCHAR(64) COLLATE "C", 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_uncertainty PRIMARY KEY (campaign_id, scenario, architecture, kind, name, unit), 
	CONSTRAINT ck_uncertainty_kind CHECK (kind = 'metric' OR kind = 'fsr'), 
	CONSTRAINT ck_uncertainty_pairs CHECK (pairs BETWEEN 0 AND sampled), 
	CONSTRAINT ck_uncertainty_p95 CHECK ((pairs = 0) = (p95 IS NULL)), 
	CONSTRAINT ck_uncertainty_judged CHECK ((kind = 'fsr') = (judged_digest IS NOT NULL)), 
	CONSTRAINT fk_uncertainty_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TABLE work (
	id SERIAL NOT NULL, 
	campaign_id VARCHAR(32) COLLATE "C" NOT NULL, 
	kind TEXT COLLATE "C" NOT NULL, 
	from_ordinal INTEGER NOT NULL, 
	to_ordinal INTEGER NOT NULL, 
	state TEXT COLLATE "C" NOT NULL, 
	owner TEXT COLLATE "C", 
	attempt INTEGER NOT NULL, 
	failures INTEGER NOT NULL, 
	until TEXT COLLATE "C", 
	until_boot_s FLOAT, 
	detail TEXT COLLATE "C", 
	CONSTRAINT pk_work PRIMARY KEY (id), 
	CONSTRAINT ck_work_kind CHECK (kind = 'execute' OR kind = 'judge' OR kind = 'reused'), 
	CONSTRAINT ck_work_state CHECK (state = 'pending' OR state = 'leased' OR state = 'done' OR state = 'quarantined'), 
	CONSTRAINT ck_work_range CHECK (from_ordinal < to_ordinal), 
	CONSTRAINT ck_work_owner CHECK ((state = 'leased') = (owner IS NOT NULL)), 
	CONSTRAINT fk_work_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE INDEX ix_work_campaign_id_state ON work (campaign_id, state)

--

CREATE TABLE artifact (
	digest VARCHAR(64) COLLATE "C" NOT NULL, 
	kind TEXT COLLATE "C" NOT NULL, 
	result_digest VARCHAR(64) COLLATE "C", 
	bytes INTEGER NOT NULL, 
	created_at TEXT COLLATE "C" NOT NULL, 
	CONSTRAINT pk_artifact PRIMARY KEY (digest), 
	CONSTRAINT fk_artifact_result_digest FOREIGN KEY(result_digest) REFERENCES run (result_digest)
)

--

CREATE INDEX ix_artifact_result_digest ON artifact (result_digest)

--

CREATE TABLE basis (
	run_number INTEGER NOT NULL, 
	version INTEGER NOT NULL, 
	uid_set_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	by_contact SMALLINT NOT NULL, 
	invalid TEXT COLLATE "C", 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_basis PRIMARY KEY (run_number, version), 
	CONSTRAINT fk_basis_run_number FOREIGN KEY(run_number) REFERENCES run (number), 
	CONSTRAINT fk_basis_uid_set_digest FOREIGN KEY(uid_set_digest) REFERENCES uid_set (digest)
)

--

CREATE TABLE benchmark (
	result_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	model TEXT COLLATE "C" NOT NULL, 
	edition TEXT COLLATE "C" NOT NULL, 
	version INTEGER NOT NULL, 
	drive_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_benchmark PRIMARY KEY (result_digest, model, edition, version), 
	CONSTRAINT fk_benchmark_result_digest FOREIGN KEY(result_digest) REFERENCES run (result_digest), 
	CONSTRAINT fk_benchmark_drive_digest FOREIGN KEY(drive_digest) REFERENCES run (result_digest)
)

--

CREATE INDEX ix_benchmark_drive_digest ON benchmark (drive_digest)

--

CREATE TABLE case_run (
	campaign_id VARCHAR(32) COLLATE "C" NOT NULL, 
	ordinal INTEGER NOT NULL, 
	run_number INTEGER NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_case_run PRIMARY KEY (campaign_id, ordinal), 
	CONSTRAINT fk_case_run_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id), 
	CONSTRAINT fk_case_run_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE case_tally (
	work_id INTEGER NOT NULL, 
	campaign_id VARCHAR(32) COLLATE "C" NOT NULL, 
	scenario TEXT COLLATE "C" NOT NULL, 
	architecture TEXT COLLATE "C" NOT NULL, 
	fault_entry TEXT COLLATE "C" NOT NULL, 
	runs INTEGER NOT NULL, 
	exercised INTEGER NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_case_tally PRIMARY KEY (work_id, scenario, architecture, fault_entry), 
	CONSTRAINT ck_case_tally_exercised CHECK (exercised BETWEEN 0 AND runs), 
	CONSTRAINT fk_case_tally_work_id FOREIGN KEY(work_id) REFERENCES work (id), 
	CONSTRAINT fk_case_tally_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE INDEX ix_case_tally_campaign_id ON case_tally (campaign_id)

--

CREATE TABLE chain (
	run_number INTEGER NOT NULL, 
	every_rows INTEGER NOT NULL, 
	links TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_chain PRIMARY KEY (run_number), 
	CONSTRAINT fk_chain_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE criticality (
	run_number INTEGER NOT NULL, 
	min_time_gap_s FLOAT, 
	min_time_gap_s_status TEXT COLLATE "C" NOT NULL, 
	min_time_gap_s_time_s FLOAT, 
	min_time_gap_s_actor TEXT COLLATE "C", 
	min_mttc_s FLOAT, 
	min_mttc_s_status TEXT COLLATE "C" NOT NULL, 
	min_mttc_s_time_s FLOAT, 
	min_mttc_s_actor TEXT COLLATE "C", 
	min_ettc_s FLOAT, 
	min_ettc_s_status TEXT COLLATE "C" NOT NULL, 
	min_ettc_s_time_s FLOAT, 
	min_ettc_s_actor TEXT COLLATE "C", 
	max_mdrac_mps2 FLOAT, 
	max_mdrac_mps2_status TEXT COLLATE "C" NOT NULL, 
	max_mdrac_mps2_time_s FLOAT, 
	max_mdrac_mps2_actor TEXT COLLATE "C", 
	max_dst_mps2 FLOAT, 
	max_dst_mps2_status TEXT COLLATE "C" NOT NULL, 
	max_dst_mps2_time_s FLOAT, 
	max_dst_mps2_actor TEXT COLLATE "C", 
	min_mtc FLOAT, 
	min_mtc_status TEXT COLLATE "C" NOT NULL, 
	min_mtc_time_s FLOAT, 
	min_mtc_actor TEXT COLLATE "C", 
	min_psd FLOAT, 
	min_psd_status TEXT COLLATE "C" NOT NULL, 
	min_psd_time_s FLOAT, 
	min_psd_actor TEXT COLLATE "C", 
	max_btn FLOAT, 
	max_btn_status TEXT COLLATE "C" NOT NULL, 
	max_btn_time_s FLOAT, 
	max_btn_actor TEXT COLLATE "C", 
	max_stn FLOAT, 
	max_stn_status TEXT COLLATE "C" NOT NULL, 
	max_stn_time_s FLOAT, 
	max_stn_actor TEXT COLLATE "C", 
	min_ttb_s FLOAT, 
	min_ttb_s_status TEXT COLLATE "C" NOT NULL, 
	min_ttb_s_time_s FLOAT, 
	min_ttb_s_actor TEXT COLLATE "C", 
	min_tts_s FLOAT, 
	min_tts_s_status TEXT COLLATE "C" NOT NULL, 
	min_tts_s_time_s FLOAT, 
	min_tts_s_actor TEXT COLLATE "C", 
	min_ttk_s FLOAT, 
	min_ttk_s_status TEXT COLLATE "C" NOT NULL, 
	min_ttk_s_time_s FLOAT, 
	min_ttk_s_actor TEXT COLLATE "C", 
	min_ttr_s FLOAT, 
	min_ttr_s_status TEXT COLLATE "C" NOT NULL, 
	min_ttr_s_time_s FLOAT, 
	min_ttr_s_actor TEXT COLLATE "C", 
	tet_s FLOAT, 
	tet_s_status TEXT COLLATE "C" NOT NULL, 
	tet_s_time_s FLOAT, 
	tet_s_actor TEXT COLLATE "C", 
	tit_s2 FLOAT, 
	tit_s2_status TEXT COLLATE "C" NOT NULL, 
	tit_s2_time_s FLOAT, 
	tit_s2_actor TEXT COLLATE "C", 
	tet_share FLOAT, 
	tet_share_status TEXT COLLATE "C" NOT NULL, 
	tet_share_time_s FLOAT, 
	tet_share_actor TEXT COLLATE "C", 
	tit_mean_s FLOAT, 
	tit_mean_s_status TEXT COLLATE "C" NOT NULL, 
	tit_mean_s_time_s FLOAT, 
	tit_mean_s_actor TEXT COLLATE "C", 
	crash_potential FLOAT, 
	crash_potential_status TEXT COLLATE "C" NOT NULL, 
	crash_potential_time_s FLOAT, 
	crash_potential_actor TEXT COLLATE "C", 
	time_to_accident_s FLOAT, 
	time_to_accident_s_status TEXT COLLATE "C" NOT NULL, 
	time_to_accident_s_time_s FLOAT, 
	time_to_accident_s_actor TEXT COLLATE "C", 
	min_rss_ratio FLOAT, 
	min_rss_ratio_status TEXT COLLATE "C" NOT NULL, 
	min_rss_ratio_time_s FLOAT, 
	min_rss_ratio_actor TEXT COLLATE "C", 
	rss_response_violation_s FLOAT, 
	rss_response_violation_s_status TEXT COLLATE "C" NOT NULL, 
	rss_response_violation_s_time_s FLOAT, 
	rss_response_violation_s_actor TEXT COLLATE "C", 
	min_ttc_2d_s FLOAT, 
	min_ttc_2d_s_status TEXT COLLATE "C" NOT NULL, 
	min_ttc_2d_s_time_s FLOAT, 
	min_ttc_2d_s_actor TEXT COLLATE "C", 
	min_wttc_s FLOAT, 
	min_wttc_s_status TEXT COLLATE "C" NOT NULL, 
	min_wttc_s_time_s FLOAT, 
	min_wttc_s_actor TEXT COLLATE "C", 
	min_dce_m FLOAT, 
	min_dce_m_status TEXT COLLATE "C" NOT NULL, 
	min_dce_m_time_s FLOAT, 
	min_dce_m_actor TEXT COLLATE "C", 
	min_ttce_s FLOAT, 
	min_ttce_s_status TEXT COLLATE "C" NOT NULL, 
	min_ttce_s_time_s FLOAT, 
	min_ttce_s_actor TEXT COLLATE "C", 
	min_pet_s FLOAT, 
	min_pet_s_status TEXT COLLATE "C" NOT NULL, 
	min_pet_s_time_s FLOAT, 
	min_pet_s_actor TEXT COLLATE "C", 
	pet_overlap_s FLOAT, 
	pet_overlap_s_status TEXT COLLATE "C" NOT NULL, 
	pet_overlap_s_time_s FLOAT, 
	pet_overlap_s_actor TEXT COLLATE "C", 
	max_encroachment_time_s FLOAT, 
	max_encroachment_time_s_status TEXT COLLATE "C" NOT NULL, 
	max_encroachment_time_s_time_s FLOAT, 
	max_encroachment_time_s_actor TEXT COLLATE "C", 
	min_predicted_pet_s FLOAT, 
	min_predicted_pet_s_status TEXT COLLATE "C" NOT NULL, 
	min_predicted_pet_s_time_s FLOAT, 
	min_predicted_pet_s_actor TEXT COLLATE "C", 
	min_rear_ttc_s FLOAT, 
	min_rear_ttc_s_status TEXT COLLATE "C" NOT NULL, 
	min_rear_ttc_s_time_s FLOAT, 
	min_rear_ttc_s_actor TEXT COLLATE "C", 
	max_follower_deceleration_mps2 FLOAT, 
	max_follower_deceleration_mps2_status TEXT COLLATE "C" NOT NULL, 
	max_follower_deceleration_mps2_time_s FLOAT, 
	max_follower_deceleration_mps2_actor TEXT COLLATE "C", 
	delta_v_mps FLOAT, 
	delta_v_mps_status TEXT COLLATE "C" NOT NULL, 
	delta_v_mps_time_s FLOAT, 
	delta_v_mps_actor TEXT COLLATE "C", 
	other_delta_v_mps FLOAT, 
	other_delta_v_mps_status TEXT COLLATE "C" NOT NULL, 
	other_delta_v_mps_time_s FLOAT, 
	other_delta_v_mps_actor TEXT COLLATE "C", 
	fatality_probability FLOAT, 
	fatality_probability_status TEXT COLLATE "C" NOT NULL, 
	fatality_probability_time_s FLOAT, 
	fatality_probability_actor TEXT COLLATE "C", 
	max_acceleration_mps2 FLOAT, 
	max_acceleration_mps2_status TEXT COLLATE "C" NOT NULL, 
	max_acceleration_mps2_time_s FLOAT, 
	max_acceleration_mps2_actor TEXT COLLATE "C", 
	max_lateral_acceleration_mps2 FLOAT, 
	max_lateral_acceleration_mps2_status TEXT COLLATE "C" NOT NULL, 
	max_lateral_acceleration_mps2_time_s FLOAT, 
	max_lateral_acceleration_mps2_actor TEXT COLLATE "C", 
	max_total_jerk_mps3 FLOAT, 
	max_total_jerk_mps3_status TEXT COLLATE "C" NOT NULL, 
	max_total_jerk_mps3_time_s FLOAT, 
	max_total_jerk_mps3_actor TEXT COLLATE "C", 
	max_yaw_rate_radps FLOAT, 
	max_yaw_rate_radps_status TEXT COLLATE "C" NOT NULL, 
	max_yaw_rate_radps_time_s FLOAT, 
	max_yaw_rate_radps_actor TEXT COLLATE "C", 
	max_yaw_acceleration_radps2 FLOAT, 
	max_yaw_acceleration_radps2_status TEXT COLLATE "C" NOT NULL, 
	max_yaw_acceleration_radps2_time_s FLOAT, 
	max_yaw_acceleration_radps2_actor TEXT COLLATE "C", 
	uncomfortable_time_s FLOAT, 
	uncomfortable_time_s_status TEXT COLLATE "C" NOT NULL, 
	uncomfortable_time_s_time_s FLOAT, 
	uncomfortable_time_s_actor TEXT COLLATE "C", 
	contact_at_fault FLOAT, 
	contact_at_fault_status TEXT COLLATE "C" NOT NULL, 
	contact_at_fault_time_s FLOAT, 
	contact_at_fault_actor TEXT COLLATE "C", 
	distance_to_safe_state_m FLOAT, 
	distance_to_safe_state_m_status TEXT COLLATE "C" NOT NULL, 
	distance_to_safe_state_m_time_s FLOAT, 
	distance_to_safe_state_m_actor TEXT COLLATE "C", 
	max_acceleration_disagreement_mps2 FLOAT, 
	max_acceleration_disagreement_mps2_status TEXT COLLATE "C" NOT NULL, 
	max_acceleration_disagreement_mps2_time_s FLOAT, 
	max_acceleration_disagreement_mps2_actor TEXT COLLATE "C", 
	max_steering_disagreement_rad FLOAT, 
	max_steering_disagreement_rad_status TEXT COLLATE "C" NOT NULL, 
	max_steering_disagreement_rad_time_s FLOAT, 
	max_steering_disagreement_rad_actor TEXT COLLATE "C", 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_criticality PRIMARY KEY (run_number), 
	CONSTRAINT ck_criticality_min_time_gap_s CHECK (CASE min_time_gap_s_status WHEN 'value' THEN min_time_gap_s IS NOT NULL WHEN 'no_conflict' THEN min_time_gap_s IS NULL WHEN 'not_applicable' THEN min_time_gap_s IS NULL WHEN 'undefined' THEN min_time_gap_s IS NULL WHEN 'incomplete' THEN min_time_gap_s IS NULL WHEN 'error' THEN min_time_gap_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_mttc_s CHECK (CASE min_mttc_s_status WHEN 'value' THEN min_mttc_s IS NOT NULL WHEN 'no_conflict' THEN min_mttc_s IS NULL WHEN 'not_applicable' THEN min_mttc_s IS NULL WHEN 'undefined' THEN min_mttc_s IS NULL WHEN 'incomplete' THEN min_mttc_s IS NULL WHEN 'error' THEN min_mttc_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_ettc_s CHECK (CASE min_ettc_s_status WHEN 'value' THEN min_ettc_s IS NOT NULL WHEN 'no_conflict' THEN min_ettc_s IS NULL WHEN 'not_applicable' THEN min_ettc_s IS NULL WHEN 'undefined' THEN min_ettc_s IS NULL WHEN 'incomplete' THEN min_ettc_s IS NULL WHEN 'error' THEN min_ettc_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_mdrac_mps2 CHECK (CASE max_mdrac_mps2_status WHEN 'value' THEN max_mdrac_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_mdrac_mps2 IS NULL WHEN 'not_applicable' THEN max_mdrac_mps2 IS NULL WHEN 'undefined' THEN max_mdrac_mps2 IS NULL WHEN 'incomplete' THEN max_mdrac_mps2 IS NULL WHEN 'error' THEN max_mdrac_mps2 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_dst_mps2 CHECK (CASE max_dst_mps2_status WHEN 'value' THEN max_dst_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_dst_mps2 IS NULL WHEN 'not_applicable' THEN max_dst_mps2 IS NULL WHEN 'undefined' THEN max_dst_mps2 IS NULL WHEN 'incomplete' THEN max_dst_mps2 IS NULL WHEN 'error' THEN max_dst_mps2 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_mtc CHECK (CASE min_mtc_status WHEN 'value' THEN min_mtc IS NOT NULL WHEN 'no_conflict' THEN min_mtc IS NULL WHEN 'not_applicable' THEN min_mtc IS NULL WHEN 'undefined' THEN min_mtc IS NULL WHEN 'incomplete' THEN min_mtc IS NULL WHEN 'error' THEN min_mtc IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_psd CHECK (CASE min_psd_status WHEN 'value' THEN min_psd IS NOT NULL WHEN 'no_conflict' THEN min_psd IS NULL WHEN 'not_applicable' THEN min_psd IS NULL WHEN 'undefined' THEN min_psd IS NULL WHEN 'incomplete' THEN min_psd IS NULL WHEN 'error' THEN min_psd IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_btn CHECK (CASE max_btn_status WHEN 'value' THEN max_btn IS NOT NULL WHEN 'no_conflict' THEN max_btn IS NULL WHEN 'not_applicable' THEN max_btn IS NULL WHEN 'undefined' THEN max_btn IS NULL WHEN 'incomplete' THEN max_btn IS NULL WHEN 'error' THEN max_btn IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_stn CHECK (CASE max_stn_status WHEN 'value' THEN max_stn IS NOT NULL WHEN 'no_conflict' THEN max_stn IS NULL WHEN 'not_applicable' THEN max_stn IS NULL WHEN 'undefined' THEN max_stn IS NULL WHEN 'incomplete' THEN max_stn IS NULL WHEN 'error' THEN max_stn IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_ttb_s CHECK (CASE min_ttb_s_status WHEN 'value' THEN min_ttb_s IS NOT NULL WHEN 'no_conflict' THEN min_ttb_s IS NULL WHEN 'not_applicable' THEN min_ttb_s IS NULL WHEN 'undefined' THEN min_ttb_s IS NULL WHEN 'incomplete' THEN min_ttb_s IS NULL WHEN 'error' THEN min_ttb_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_tts_s CHECK (CASE min_tts_s_status WHEN 'value' THEN min_tts_s IS NOT NULL WHEN 'no_conflict' THEN min_tts_s IS NULL WHEN 'not_applicable' THEN min_tts_s IS NULL WHEN 'undefined' THEN min_tts_s IS NULL WHEN 'incomplete' THEN min_tts_s IS NULL WHEN 'error' THEN min_tts_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_ttk_s CHECK (CASE min_ttk_s_status WHEN 'value' THEN min_ttk_s IS NOT NULL WHEN 'no_conflict' THEN min_ttk_s IS NULL WHEN 'not_applicable' THEN min_ttk_s IS NULL WHEN 'undefined' THEN min_ttk_s IS NULL WHEN 'incomplete' THEN min_ttk_s IS NULL WHEN 'error' THEN min_ttk_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_ttr_s CHECK (CASE min_ttr_s_status WHEN 'value' THEN min_ttr_s IS NOT NULL WHEN 'no_conflict' THEN min_ttr_s IS NULL WHEN 'not_applicable' THEN min_ttr_s IS NULL WHEN 'undefined' THEN min_ttr_s IS NULL WHEN 'incomplete' THEN min_ttr_s IS NULL WHEN 'error' THEN min_ttr_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_tet_s CHECK (CASE tet_s_status WHEN 'value' THEN tet_s IS NOT NULL WHEN 'no_conflict' THEN tet_s IS NULL WHEN 'not_applicable' THEN tet_s IS NULL WHEN 'undefined' THEN tet_s IS NULL WHEN 'incomplete' THEN tet_s IS NULL WHEN 'error' THEN tet_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_tit_s2 CHECK (CASE tit_s2_status WHEN 'value' THEN tit_s2 IS NOT NULL WHEN 'no_conflict' THEN tit_s2 IS NULL WHEN 'not_applicable' THEN tit_s2 IS NULL WHEN 'undefined' THEN tit_s2 IS NULL WHEN 'incomplete' THEN tit_s2 IS NULL WHEN 'error' THEN tit_s2 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_tet_share CHECK (CASE tet_share_status WHEN 'value' THEN tet_share IS NOT NULL WHEN 'no_conflict' THEN tet_share IS NULL WHEN 'not_applicable' THEN tet_share IS NULL WHEN 'undefined' THEN tet_share IS NULL WHEN 'incomplete' THEN tet_share IS NULL WHEN 'error' THEN tet_share IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_tit_mean_s CHECK (CASE tit_mean_s_status WHEN 'value' THEN tit_mean_s IS NOT NULL WHEN 'no_conflict' THEN tit_mean_s IS NULL WHEN 'not_applicable' THEN tit_mean_s IS NULL WHEN 'undefined' THEN tit_mean_s IS NULL WHEN 'incomplete' THEN tit_mean_s IS NULL WHEN 'error' THEN tit_mean_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_crash_potential CHECK (CASE crash_potential_status WHEN 'value' THEN crash_potential IS NOT NULL WHEN 'no_conflict' THEN crash_potential IS NULL WHEN 'not_applicable' THEN crash_potential IS NULL WHEN 'undefined' THEN crash_potential IS NULL WHEN 'incomplete' THEN crash_potential IS NULL WHEN 'error' THEN crash_potential IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_time_to_accident_s CHECK (CASE time_to_accident_s_status WHEN 'value' THEN time_to_accident_s IS NOT NULL WHEN 'no_conflict' THEN time_to_accident_s IS NULL WHEN 'not_applicable' THEN time_to_accident_s IS NULL WHEN 'undefined' THEN time_to_accident_s IS NULL WHEN 'incomplete' THEN time_to_accident_s IS NULL WHEN 'error' THEN time_to_accident_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_rss_ratio CHECK (CASE min_rss_ratio_status WHEN 'value' THEN min_rss_ratio IS NOT NULL WHEN 'no_conflict' THEN min_rss_ratio IS NULL WHEN 'not_applicable' THEN min_rss_ratio IS NULL WHEN 'undefined' THEN min_rss_ratio IS NULL WHEN 'incomplete' THEN min_rss_ratio IS NULL WHEN 'error' THEN min_rss_ratio IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_rss_response_violation_s CHECK (CASE rss_response_violation_s_status WHEN 'value' THEN rss_response_violation_s IS NOT NULL WHEN 'no_conflict' THEN rss_response_violation_s IS NULL WHEN 'not_applicable' THEN rss_response_violation_s IS NULL WHEN 'undefined' THEN rss_response_violation_s IS NULL WHEN 'incomplete' THEN rss_response_violation_s IS NULL WHEN 'error' THEN rss_response_violation_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_ttc_2d_s CHECK (CASE min_ttc_2d_s_status WHEN 'value' THEN min_ttc_2d_s IS NOT NULL WHEN 'no_conflict' THEN min_ttc_2d_s IS NULL WHEN 'not_applicable' THEN min_ttc_2d_s IS NULL WHEN 'undefined' THEN min_ttc_2d_s IS NULL WHEN 'incomplete' THEN min_ttc_2d_s IS NULL WHEN 'error' THEN min_ttc_2d_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_wttc_s CHECK (CASE min_wttc_s_status WHEN 'value' THEN min_wttc_s IS NOT NULL WHEN 'no_conflict' THEN min_wttc_s IS NULL WHEN 'not_applicable' THEN min_wttc_s IS NULL WHEN 'undefined' THEN min_wttc_s IS NULL WHEN 'incomplete' THEN min_wttc_s IS NULL WHEN 'error' THEN min_wttc_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_dce_m CHECK (CASE min_dce_m_status WHEN 'value' THEN min_dce_m IS NOT NULL WHEN 'no_conflict' THEN min_dce_m IS NULL WHEN 'not_applicable' THEN min_dce_m IS NULL WHEN 'undefined' THEN min_dce_m IS NULL WHEN 'incomplete' THEN min_dce_m IS NULL WHEN 'error' THEN min_dce_m IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_ttce_s CHECK (CASE min_ttce_s_status WHEN 'value' THEN min_ttce_s IS NOT NULL WHEN 'no_conflict' THEN min_ttce_s IS NULL WHEN 'not_applicable' THEN min_ttce_s IS NULL WHEN 'undefined' THEN min_ttce_s IS NULL WHEN 'incomplete' THEN min_ttce_s IS NULL WHEN 'error' THEN min_ttce_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_pet_s CHECK (CASE min_pet_s_status WHEN 'value' THEN min_pet_s IS NOT NULL WHEN 'no_conflict' THEN min_pet_s IS NULL WHEN 'not_applicable' THEN min_pet_s IS NULL WHEN 'undefined' THEN min_pet_s IS NULL WHEN 'incomplete' THEN min_pet_s IS NULL WHEN 'error' THEN min_pet_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_pet_overlap_s CHECK (CASE pet_overlap_s_status WHEN 'value' THEN pet_overlap_s IS NOT NULL WHEN 'no_conflict' THEN pet_overlap_s IS NULL WHEN 'not_applicable' THEN pet_overlap_s IS NULL WHEN 'undefined' THEN pet_overlap_s IS NULL WHEN 'incomplete' THEN pet_overlap_s IS NULL WHEN 'error' THEN pet_overlap_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_encroachment_time_s CHECK (CASE max_encroachment_time_s_status WHEN 'value' THEN max_encroachment_time_s IS NOT NULL WHEN 'no_conflict' THEN max_encroachment_time_s IS NULL WHEN 'not_applicable' THEN max_encroachment_time_s IS NULL WHEN 'undefined' THEN max_encroachment_time_s IS NULL WHEN 'incomplete' THEN max_encroachment_time_s IS NULL WHEN 'error' THEN max_encroachment_time_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_predicted_pet_s CHECK (CASE min_predicted_pet_s_status WHEN 'value' THEN min_predicted_pet_s IS NOT NULL WHEN 'no_conflict' THEN min_predicted_pet_s IS NULL WHEN 'not_applicable' THEN min_predicted_pet_s IS NULL WHEN 'undefined' THEN min_predicted_pet_s IS NULL WHEN 'incomplete' THEN min_predicted_pet_s IS NULL WHEN 'error' THEN min_predicted_pet_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_min_rear_ttc_s CHECK (CASE min_rear_ttc_s_status WHEN 'value' THEN min_rear_ttc_s IS NOT NULL WHEN 'no_conflict' THEN min_rear_ttc_s IS NULL WHEN 'not_applicable' THEN min_rear_ttc_s IS NULL WHEN 'undefined' THEN min_rear_ttc_s IS NULL WHEN 'incomplete' THEN min_rear_ttc_s IS NULL WHEN 'error' THEN min_rear_ttc_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_follower_deceleration_mps2 CHECK (CASE max_follower_deceleration_mps2_status WHEN 'value' THEN max_follower_deceleration_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_follower_deceleration_mps2 IS NULL WHEN 'not_applicable' THEN max_follower_deceleration_mps2 IS NULL WHEN 'undefined' THEN max_follower_deceleration_mps2 IS NULL WHEN 'incomplete' THEN max_follower_deceleration_mps2 IS NULL WHEN 'error' THEN max_follower_deceleration_mps2 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_delta_v_mps CHECK (CASE delta_v_mps_status WHEN 'value' THEN delta_v_mps IS NOT NULL WHEN 'no_conflict' THEN delta_v_mps IS NULL WHEN 'not_applicable' THEN delta_v_mps IS NULL WHEN 'undefined' THEN delta_v_mps IS NULL WHEN 'incomplete' THEN delta_v_mps IS NULL WHEN 'error' THEN delta_v_mps IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_other_delta_v_mps CHECK (CASE other_delta_v_mps_status WHEN 'value' THEN other_delta_v_mps IS NOT NULL WHEN 'no_conflict' THEN other_delta_v_mps IS NULL WHEN 'not_applicable' THEN other_delta_v_mps IS NULL WHEN 'undefined' THEN other_delta_v_mps IS NULL WHEN 'incomplete' THEN other_delta_v_mps IS NULL WHEN 'error' THEN other_delta_v_mps IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_fatality_probability CHECK (CASE fatality_probability_status WHEN 'value' THEN fatality_probability IS NOT NULL WHEN 'no_conflict' THEN fatality_probability IS NULL WHEN 'not_applicable' THEN fatality_probability IS NULL WHEN 'undefined' THEN fatality_probability IS NULL WHEN 'incomplete' THEN fatality_probability IS NULL WHEN 'error' THEN fatality_probability IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_acceleration_mps2 CHECK (CASE max_acceleration_mps2_status WHEN 'value' THEN max_acceleration_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_acceleration_mps2 IS NULL WHEN 'not_applicable' THEN max_acceleration_mps2 IS NULL WHEN 'undefined' THEN max_acceleration_mps2 IS NULL WHEN 'incomplete' THEN max_acceleration_mps2 IS NULL WHEN 'error' THEN max_acceleration_mps2 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_lateral_acceleration_mps2 CHECK (CASE max_lateral_acceleration_mps2_status WHEN 'value' THEN max_lateral_acceleration_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_lateral_acceleration_mps2 IS NULL WHEN 'not_applicable' THEN max_lateral_acceleration_mps2 IS NULL WHEN 'undefined' THEN max_lateral_acceleration_mps2 IS NULL WHEN 'incomplete' THEN max_lateral_acceleration_mps2 IS NULL WHEN 'error' THEN max_lateral_acceleration_mps2 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_total_jerk_mps3 CHECK (CASE max_total_jerk_mps3_status WHEN 'value' THEN max_total_jerk_mps3 IS NOT NULL WHEN 'no_conflict' THEN max_total_jerk_mps3 IS NULL WHEN 'not_applicable' THEN max_total_jerk_mps3 IS NULL WHEN 'undefined' THEN max_total_jerk_mps3 IS NULL WHEN 'incomplete' THEN max_total_jerk_mps3 IS NULL WHEN 'error' THEN max_total_jerk_mps3 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_yaw_rate_radps CHECK (CASE max_yaw_rate_radps_status WHEN 'value' THEN max_yaw_rate_radps IS NOT NULL WHEN 'no_conflict' THEN max_yaw_rate_radps IS NULL WHEN 'not_applicable' THEN max_yaw_rate_radps IS NULL WHEN 'undefined' THEN max_yaw_rate_radps IS NULL WHEN 'incomplete' THEN max_yaw_rate_radps IS NULL WHEN 'error' THEN max_yaw_rate_radps IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_yaw_acceleration_radps2 CHECK (CASE max_yaw_acceleration_radps2_status WHEN 'value' THEN max_yaw_acceleration_radps2 IS NOT NULL WHEN 'no_conflict' THEN max_yaw_acceleration_radps2 IS NULL WHEN 'not_applicable' THEN max_yaw_acceleration_radps2 IS NULL WHEN 'undefined' THEN max_yaw_acceleration_radps2 IS NULL WHEN 'incomplete' THEN max_yaw_acceleration_radps2 IS NULL WHEN 'error' THEN max_yaw_acceleration_radps2 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_uncomfortable_time_s CHECK (CASE uncomfortable_time_s_status WHEN 'value' THEN uncomfortable_time_s IS NOT NULL WHEN 'no_conflict' THEN uncomfortable_time_s IS NULL WHEN 'not_applicable' THEN uncomfortable_time_s IS NULL WHEN 'undefined' THEN uncomfortable_time_s IS NULL WHEN 'incomplete' THEN uncomfortable_time_s IS NULL WHEN 'error' THEN uncomfortable_time_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_contact_at_fault CHECK (CASE contact_at_fault_status WHEN 'value' THEN contact_at_fault IS NOT NULL WHEN 'no_conflict' THEN contact_at_fault IS NULL WHEN 'not_applicable' THEN contact_at_fault IS NULL WHEN 'undefined' THEN contact_at_fault IS NULL WHEN 'incomplete' THEN contact_at_fault IS NULL WHEN 'error' THEN contact_at_fault IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_distance_to_safe_state_m CHECK (CASE distance_to_safe_state_m_status WHEN 'value' THEN distance_to_safe_state_m IS NOT NULL WHEN 'no_conflict' THEN distance_to_safe_state_m IS NULL WHEN 'not_applicable' THEN distance_to_safe_state_m IS NULL WHEN 'undefined' THEN distance_to_safe_state_m IS NULL WHEN 'incomplete' THEN distance_to_safe_state_m IS NULL WHEN 'error' THEN distance_to_safe_state_m IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_acceleration_disagreement_mps2 CHECK (CASE max_acceleration_disagreement_mps2_status WHEN 'value' THEN max_acceleration_disagreement_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_acceleration_disagreement_mps2 IS NULL WHEN 'not_applicable' THEN max_acceleration_disagreement_mps2 IS NULL WHEN 'undefined' THEN max_acceleration_disagreement_mps2 IS NULL WHEN 'incomplete' THEN max_acceleration_disagreement_mps2 IS NULL WHEN 'error' THEN max_acceleration_disagreement_mps2 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_criticality_max_steering_disagreement_rad CHECK (CASE max_steering_disagreement_rad_status WHEN 'value' THEN max_steering_disagreement_rad IS NOT NULL WHEN 'no_conflict' THEN max_steering_disagreement_rad IS NULL WHEN 'not_applicable' THEN max_steering_disagreement_rad IS NULL WHEN 'undefined' THEN max_steering_disagreement_rad IS NULL WHEN 'incomplete' THEN max_steering_disagreement_rad IS NULL WHEN 'error' THEN max_steering_disagreement_rad IS NULL ELSE FALSE END), 
	CONSTRAINT fk_criticality_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE event (
	run_number INTEGER NOT NULL, 
	seq INTEGER NOT NULL, 
	time_s FLOAT NOT NULL, 
	kind TEXT COLLATE "C" NOT NULL, 
	subject TEXT COLLATE "C", 
	text TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_event PRIMARY KEY (run_number, seq), 
	CONSTRAINT fk_event_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE extreme (
	run_number INTEGER NOT NULL, 
	measure TEXT COLLATE "C" NOT NULL, 
	version INTEGER NOT NULL, 
	value FLOAT, 
	time_s FLOAT, 
	actor TEXT COLLATE "C", 
	samples TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_extreme PRIMARY KEY (run_number, measure, version), 
	CONSTRAINT fk_extreme_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE fork (
	result_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	test_case_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	origin_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	from_tick INTEGER NOT NULL, 
	authority TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
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

CREATE TABLE half_step (
	result_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	test_case_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	origin_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_half_step PRIMARY KEY (result_digest), 
	CONSTRAINT fk_half_step_result_digest FOREIGN KEY(result_digest) REFERENCES run (result_digest), 
	CONSTRAINT fk_half_step_test_case_digest FOREIGN KEY(test_case_digest) REFERENCES test_case (digest)
)

--

CREATE INDEX ix_half_step_origin_digest ON half_step (origin_digest)

--

CREATE INDEX ix_half_step_test_case_digest ON half_step (test_case_digest)

--

CREATE TABLE injection (
	result_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	version INTEGER NOT NULL, 
	fault_s FLOAT, 
	effect_s FLOAT, 
	deviation_s FLOAT, 
	detect_s FLOAT, 
	switch_s FLOAT, 
	brake_s FLOAT, 
	emergency_s FLOAT, 
	safe_s FLOAT, 
	violation_s FLOAT, 
	fdti_s FLOAT, 
	frti_s FLOAT, 
	fhti_s FLOAT, 
	eoti_s FLOAT, 
	ftti_s FLOAT, 
	fault_free_violation_s FLOAT, 
	class TEXT COLLATE "C" NOT NULL, 
	without_mechanism TEXT COLLATE "C" NOT NULL, 
	twins TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_injection PRIMARY KEY (result_digest, version), 
	CONSTRAINT ck_injection_class CHECK (class = 'not_activated' OR class = 'masked' OR class = 'detected_in_time' OR class = 'detected_late' OR class = 'undetected_no_violation' OR class = 'undetected_violation'), 
	CONSTRAINT fk_injection_result_digest FOREIGN KEY(result_digest) REFERENCES run (result_digest)
)

--

CREATE TABLE kept_trace (
	run_number INTEGER NOT NULL, 
	file TEXT COLLATE "C" NOT NULL, 
	place INTEGER NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_kept_trace PRIMARY KEY (run_number, file), 
	CONSTRAINT fk_kept_trace_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE metric (
	run_number INTEGER NOT NULL, 
	contact FLOAT, 
	contact_status TEXT COLLATE "C" NOT NULL, 
	contact_time_s FLOAT, 
	contact_actor TEXT COLLATE "C", 
	impact_speed_mps FLOAT, 
	impact_speed_mps_status TEXT COLLATE "C" NOT NULL, 
	impact_speed_mps_time_s FLOAT, 
	impact_speed_mps_actor TEXT COLLATE "C", 
	min_distance_m FLOAT, 
	min_distance_m_status TEXT COLLATE "C" NOT NULL, 
	min_distance_m_time_s FLOAT, 
	min_distance_m_actor TEXT COLLATE "C", 
	min_ttc_s FLOAT, 
	min_ttc_s_status TEXT COLLATE "C" NOT NULL, 
	min_ttc_s_time_s FLOAT, 
	min_ttc_s_actor TEXT COLLATE "C", 
	min_time_headway_s FLOAT, 
	min_time_headway_s_status TEXT COLLATE "C" NOT NULL, 
	min_time_headway_s_time_s FLOAT, 
	min_time_headway_s_actor TEXT COLLATE "C", 
	max_drac_mps2 FLOAT, 
	max_drac_mps2_status TEXT COLLATE "C" NOT NULL, 
	max_drac_mps2_time_s FLOAT, 
	max_drac_mps2_actor TEXT COLLATE "C", 
	max_required_deceleration_mps2 FLOAT, 
	max_required_deceleration_mps2_status TEXT COLLATE "C" NOT NULL, 
	max_required_deceleration_mps2_time_s FLOAT, 
	max_required_deceleration_mps2_actor TEXT COLLATE "C", 
	rss_violation_s FLOAT, 
	rss_violation_s_status TEXT COLLATE "C" NOT NULL, 
	rss_violation_s_time_s FLOAT, 
	rss_violation_s_actor TEXT COLLATE "C", 
	fault_to_safe_state_s FLOAT, 
	fault_to_safe_state_s_status TEXT COLLATE "C" NOT NULL, 
	fault_to_safe_state_s_time_s FLOAT, 
	fault_to_safe_state_s_actor TEXT COLLATE "C", 
	max_jerk_mps3 FLOAT, 
	max_jerk_mps3_status TEXT COLLATE "C" NOT NULL, 
	max_jerk_mps3_time_s FLOAT, 
	max_jerk_mps3_actor TEXT COLLATE "C", 
	max_deceleration_mps2 FLOAT, 
	max_deceleration_mps2_status TEXT COLLATE "C" NOT NULL, 
	max_deceleration_mps2_time_s FLOAT, 
	max_deceleration_mps2_actor TEXT COLLATE "C", 
	max_lane_offset_m FLOAT, 
	max_lane_offset_m_status TEXT COLLATE "C" NOT NULL, 
	max_lane_offset_m_time_s FLOAT, 
	max_lane_offset_m_actor TEXT COLLATE "C", 
	first_detection_distance_m FLOAT, 
	first_detection_distance_m_status TEXT COLLATE "C" NOT NULL, 
	first_detection_distance_m_time_s FLOAT, 
	first_detection_distance_m_actor TEXT COLLATE "C", 
	takeover_time_s FLOAT, 
	takeover_time_s_status TEXT COLLATE "C" NOT NULL, 
	takeover_time_s_time_s FLOAT, 
	takeover_time_s_actor TEXT COLLATE "C", 
	standstill_gap_m FLOAT, 
	standstill_gap_m_status TEXT COLLATE "C" NOT NULL, 
	standstill_gap_m_time_s FLOAT, 
	standstill_gap_m_actor TEXT COLLATE "C", 
	detection_latency_s FLOAT, 
	detection_latency_s_status TEXT COLLATE "C" NOT NULL, 
	detection_latency_s_time_s FLOAT, 
	detection_latency_s_actor TEXT COLLATE "C", 
	missed_time_s FLOAT, 
	missed_time_s_status TEXT COLLATE "C" NOT NULL, 
	missed_time_s_time_s FLOAT, 
	missed_time_s_actor TEXT COLLATE "C", 
	false_track_time_s FLOAT, 
	false_track_time_s_status TEXT COLLATE "C" NOT NULL, 
	false_track_time_s_time_s FLOAT, 
	false_track_time_s_actor TEXT COLLATE "C", 
	range_error_rms_m FLOAT, 
	range_error_rms_m_status TEXT COLLATE "C" NOT NULL, 
	range_error_rms_m_time_s FLOAT, 
	range_error_rms_m_actor TEXT COLLATE "C", 
	position_error_p95_m FLOAT, 
	position_error_p95_m_status TEXT COLLATE "C" NOT NULL, 
	position_error_p95_m_time_s FLOAT, 
	position_error_p95_m_actor TEXT COLLATE "C", 
	rear_detection_margin_m FLOAT, 
	rear_detection_margin_m_status TEXT COLLATE "C" NOT NULL, 
	rear_detection_margin_m_time_s FLOAT, 
	rear_detection_margin_m_actor TEXT COLLATE "C", 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_metric PRIMARY KEY (run_number), 
	CONSTRAINT ck_metric_contact CHECK (CASE contact_status WHEN 'value' THEN contact IS NOT NULL WHEN 'no_conflict' THEN contact IS NULL WHEN 'not_applicable' THEN contact IS NULL WHEN 'undefined' THEN contact IS NULL WHEN 'incomplete' THEN contact IS NULL WHEN 'error' THEN contact IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_impact_speed_mps CHECK (CASE impact_speed_mps_status WHEN 'value' THEN impact_speed_mps IS NOT NULL WHEN 'no_conflict' THEN impact_speed_mps IS NULL WHEN 'not_applicable' THEN impact_speed_mps IS NULL WHEN 'undefined' THEN impact_speed_mps IS NULL WHEN 'incomplete' THEN impact_speed_mps IS NULL WHEN 'error' THEN impact_speed_mps IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_min_distance_m CHECK (CASE min_distance_m_status WHEN 'value' THEN min_distance_m IS NOT NULL WHEN 'no_conflict' THEN min_distance_m IS NULL WHEN 'not_applicable' THEN min_distance_m IS NULL WHEN 'undefined' THEN min_distance_m IS NULL WHEN 'incomplete' THEN min_distance_m IS NULL WHEN 'error' THEN min_distance_m IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_min_ttc_s CHECK (CASE min_ttc_s_status WHEN 'value' THEN min_ttc_s IS NOT NULL WHEN 'no_conflict' THEN min_ttc_s IS NULL WHEN 'not_applicable' THEN min_ttc_s IS NULL WHEN 'undefined' THEN min_ttc_s IS NULL WHEN 'incomplete' THEN min_ttc_s IS NULL WHEN 'error' THEN min_ttc_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_min_time_headway_s CHECK (CASE min_time_headway_s_status WHEN 'value' THEN min_time_headway_s IS NOT NULL WHEN 'no_conflict' THEN min_time_headway_s IS NULL WHEN 'not_applicable' THEN min_time_headway_s IS NULL WHEN 'undefined' THEN min_time_headway_s IS NULL WHEN 'incomplete' THEN min_time_headway_s IS NULL WHEN 'error' THEN min_time_headway_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_max_drac_mps2 CHECK (CASE max_drac_mps2_status WHEN 'value' THEN max_drac_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_drac_mps2 IS NULL WHEN 'not_applicable' THEN max_drac_mps2 IS NULL WHEN 'undefined' THEN max_drac_mps2 IS NULL WHEN 'incomplete' THEN max_drac_mps2 IS NULL WHEN 'error' THEN max_drac_mps2 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_max_required_deceleration_mps2 CHECK (CASE max_required_deceleration_mps2_status WHEN 'value' THEN max_required_deceleration_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_required_deceleration_mps2 IS NULL WHEN 'not_applicable' THEN max_required_deceleration_mps2 IS NULL WHEN 'undefined' THEN max_required_deceleration_mps2 IS NULL WHEN 'incomplete' THEN max_required_deceleration_mps2 IS NULL WHEN 'error' THEN max_required_deceleration_mps2 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_rss_violation_s CHECK (CASE rss_violation_s_status WHEN 'value' THEN rss_violation_s IS NOT NULL WHEN 'no_conflict' THEN rss_violation_s IS NULL WHEN 'not_applicable' THEN rss_violation_s IS NULL WHEN 'undefined' THEN rss_violation_s IS NULL WHEN 'incomplete' THEN rss_violation_s IS NULL WHEN 'error' THEN rss_violation_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_fault_to_safe_state_s CHECK (CASE fault_to_safe_state_s_status WHEN 'value' THEN fault_to_safe_state_s IS NOT NULL WHEN 'no_conflict' THEN fault_to_safe_state_s IS NULL WHEN 'not_applicable' THEN fault_to_safe_state_s IS NULL WHEN 'undefined' THEN fault_to_safe_state_s IS NULL WHEN 'incomplete' THEN fault_to_safe_state_s IS NULL WHEN 'error' THEN fault_to_safe_state_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_max_jerk_mps3 CHECK (CASE max_jerk_mps3_status WHEN 'value' THEN max_jerk_mps3 IS NOT NULL WHEN 'no_conflict' THEN max_jerk_mps3 IS NULL WHEN 'not_applicable' THEN max_jerk_mps3 IS NULL WHEN 'undefined' THEN max_jerk_mps3 IS NULL WHEN 'incomplete' THEN max_jerk_mps3 IS NULL WHEN 'error' THEN max_jerk_mps3 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_max_deceleration_mps2 CHECK (CASE max_deceleration_mps2_status WHEN 'value' THEN max_deceleration_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_deceleration_mps2 IS NULL WHEN 'not_applicable' THEN max_deceleration_mps2 IS NULL WHEN 'undefined' THEN max_deceleration_mps2 IS NULL WHEN 'incomplete' THEN max_deceleration_mps2 IS NULL WHEN 'error' THEN max_deceleration_mps2 IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_max_lane_offset_m CHECK (CASE max_lane_offset_m_status WHEN 'value' THEN max_lane_offset_m IS NOT NULL WHEN 'no_conflict' THEN max_lane_offset_m IS NULL WHEN 'not_applicable' THEN max_lane_offset_m IS NULL WHEN 'undefined' THEN max_lane_offset_m IS NULL WHEN 'incomplete' THEN max_lane_offset_m IS NULL WHEN 'error' THEN max_lane_offset_m IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_first_detection_distance_m CHECK (CASE first_detection_distance_m_status WHEN 'value' THEN first_detection_distance_m IS NOT NULL WHEN 'no_conflict' THEN first_detection_distance_m IS NULL WHEN 'not_applicable' THEN first_detection_distance_m IS NULL WHEN 'undefined' THEN first_detection_distance_m IS NULL WHEN 'incomplete' THEN first_detection_distance_m IS NULL WHEN 'error' THEN first_detection_distance_m IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_takeover_time_s CHECK (CASE takeover_time_s_status WHEN 'value' THEN takeover_time_s IS NOT NULL WHEN 'no_conflict' THEN takeover_time_s IS NULL WHEN 'not_applicable' THEN takeover_time_s IS NULL WHEN 'undefined' THEN takeover_time_s IS NULL WHEN 'incomplete' THEN takeover_time_s IS NULL WHEN 'error' THEN takeover_time_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_standstill_gap_m CHECK (CASE standstill_gap_m_status WHEN 'value' THEN standstill_gap_m IS NOT NULL WHEN 'no_conflict' THEN standstill_gap_m IS NULL WHEN 'not_applicable' THEN standstill_gap_m IS NULL WHEN 'undefined' THEN standstill_gap_m IS NULL WHEN 'incomplete' THEN standstill_gap_m IS NULL WHEN 'error' THEN standstill_gap_m IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_detection_latency_s CHECK (CASE detection_latency_s_status WHEN 'value' THEN detection_latency_s IS NOT NULL WHEN 'no_conflict' THEN detection_latency_s IS NULL WHEN 'not_applicable' THEN detection_latency_s IS NULL WHEN 'undefined' THEN detection_latency_s IS NULL WHEN 'incomplete' THEN detection_latency_s IS NULL WHEN 'error' THEN detection_latency_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_missed_time_s CHECK (CASE missed_time_s_status WHEN 'value' THEN missed_time_s IS NOT NULL WHEN 'no_conflict' THEN missed_time_s IS NULL WHEN 'not_applicable' THEN missed_time_s IS NULL WHEN 'undefined' THEN missed_time_s IS NULL WHEN 'incomplete' THEN missed_time_s IS NULL WHEN 'error' THEN missed_time_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_false_track_time_s CHECK (CASE false_track_time_s_status WHEN 'value' THEN false_track_time_s IS NOT NULL WHEN 'no_conflict' THEN false_track_time_s IS NULL WHEN 'not_applicable' THEN false_track_time_s IS NULL WHEN 'undefined' THEN false_track_time_s IS NULL WHEN 'incomplete' THEN false_track_time_s IS NULL WHEN 'error' THEN false_track_time_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_range_error_rms_m CHECK (CASE range_error_rms_m_status WHEN 'value' THEN range_error_rms_m IS NOT NULL WHEN 'no_conflict' THEN range_error_rms_m IS NULL WHEN 'not_applicable' THEN range_error_rms_m IS NULL WHEN 'undefined' THEN range_error_rms_m IS NULL WHEN 'incomplete' THEN range_error_rms_m IS NULL WHEN 'error' THEN range_error_rms_m IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_position_error_p95_m CHECK (CASE position_error_p95_m_status WHEN 'value' THEN position_error_p95_m IS NOT NULL WHEN 'no_conflict' THEN position_error_p95_m IS NULL WHEN 'not_applicable' THEN position_error_p95_m IS NULL WHEN 'undefined' THEN position_error_p95_m IS NULL WHEN 'incomplete' THEN position_error_p95_m IS NULL WHEN 'error' THEN position_error_p95_m IS NULL ELSE FALSE END), 
	CONSTRAINT ck_metric_rear_detection_margin_m CHECK (CASE rear_detection_margin_m_status WHEN 'value' THEN rear_detection_margin_m IS NOT NULL WHEN 'no_conflict' THEN rear_detection_margin_m IS NULL WHEN 'not_applicable' THEN rear_detection_margin_m IS NULL WHEN 'undefined' THEN rear_detection_margin_m IS NULL WHEN 'incomplete' THEN rear_detection_margin_m IS NULL WHEN 'error' THEN rear_detection_margin_m IS NULL ELSE FALSE END), 
	CONSTRAINT fk_metric_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE seal (
	run_number INTEGER NOT NULL, 
	number INTEGER NOT NULL, 
	run_sum BIGINT NOT NULL, 
	metric_sum BIGINT NOT NULL, 
	timing_sum BIGINT NOT NULL, 
	criticality_sum BIGINT NOT NULL, 
	verdict_sum BIGINT NOT NULL, 
	event_sum BIGINT NOT NULL, 
	chain_sum BIGINT NOT NULL, 
	basis_sum BIGINT NOT NULL, 
	extreme_sum BIGINT NOT NULL, 
	kept_trace_sum BIGINT NOT NULL, 
	plugin_sum BIGINT NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_seal PRIMARY KEY (run_number, number), 
	CONSTRAINT fk_seal_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE tally (
	work_id INTEGER NOT NULL, 
	campaign_id VARCHAR(32) COLLATE "C" NOT NULL, 
	fsr_id TEXT COLLATE "C" NOT NULL, 
	fsr_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	architecture TEXT COLLATE "C" NOT NULL, 
	scenario TEXT COLLATE "C" NOT NULL, 
	verdict TEXT COLLATE "C" NOT NULL, 
	runs INTEGER NOT NULL, 
	exercised INTEGER NOT NULL, 
	worst_robustness FLOAT, 
	worst_margin FLOAT, 
	worst_unit TEXT COLLATE "C", 
	worst_result_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_tally PRIMARY KEY (work_id, fsr_id, architecture, scenario, verdict), 
	CONSTRAINT ck_tally_verdict CHECK (verdict = 'PASS' OR verdict = 'FAIL' OR verdict = 'INCONCLUSIVE' OR verdict = 'VACUOUS' OR verdict = 'INVALID' OR verdict = 'ERROR'), 
	CONSTRAINT ck_tally_exercised CHECK (exercised BETWEEN 0 AND runs), 
	CONSTRAINT fk_tally_work_id FOREIGN KEY(work_id) REFERENCES work (id), 
	CONSTRAINT fk_tally_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id), 
	CONSTRAINT fk_tally_worst_result_digest FOREIGN KEY(worst_result_digest) REFERENCES run (result_digest)
)

--

CREATE INDEX ix_tally_campaign_id ON tally (campaign_id)

--

CREATE TABLE timing (
	run_number INTEGER NOT NULL, 
	fault_detection_time_s FLOAT, 
	fault_detection_time_s_status TEXT COLLATE "C" NOT NULL, 
	fault_detection_time_s_time_s FLOAT, 
	fault_detection_time_s_actor TEXT COLLATE "C", 
	fault_reaction_time_s FLOAT, 
	fault_reaction_time_s_status TEXT COLLATE "C" NOT NULL, 
	fault_reaction_time_s_time_s FLOAT, 
	fault_reaction_time_s_actor TEXT COLLATE "C", 
	fault_handling_time_s FLOAT, 
	fault_handling_time_s_status TEXT COLLATE "C" NOT NULL, 
	fault_handling_time_s_time_s FLOAT, 
	fault_handling_time_s_actor TEXT COLLATE "C", 
	emergency_operation_time_s FLOAT, 
	emergency_operation_time_s_status TEXT COLLATE "C" NOT NULL, 
	emergency_operation_time_s_time_s FLOAT, 
	emergency_operation_time_s_actor TEXT COLLATE "C", 
	nominal_availability FLOAT, 
	nominal_availability_status TEXT COLLATE "C" NOT NULL, 
	nominal_availability_time_s FLOAT, 
	nominal_availability_actor TEXT COLLATE "C", 
	takeovers FLOAT, 
	takeovers_status TEXT COLLATE "C" NOT NULL, 
	takeovers_time_s FLOAT, 
	takeovers_actor TEXT COLLATE "C", 
	trips FLOAT, 
	trips_status TEXT COLLATE "C" NOT NULL, 
	trips_time_s FLOAT, 
	trips_actor TEXT COLLATE "C", 
	stop_rating FLOAT, 
	stop_rating_status TEXT COLLATE "C" NOT NULL, 
	stop_rating_time_s FLOAT, 
	stop_rating_actor TEXT COLLATE "C", 
	stop_regret FLOAT, 
	stop_regret_status TEXT COLLATE "C" NOT NULL, 
	stop_regret_time_s FLOAT, 
	stop_regret_actor TEXT COLLATE "C", 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_timing PRIMARY KEY (run_number), 
	CONSTRAINT ck_timing_fault_detection_time_s CHECK (CASE fault_detection_time_s_status WHEN 'value' THEN fault_detection_time_s IS NOT NULL WHEN 'no_conflict' THEN fault_detection_time_s IS NULL WHEN 'not_applicable' THEN fault_detection_time_s IS NULL WHEN 'undefined' THEN fault_detection_time_s IS NULL WHEN 'incomplete' THEN fault_detection_time_s IS NULL WHEN 'error' THEN fault_detection_time_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_timing_fault_reaction_time_s CHECK (CASE fault_reaction_time_s_status WHEN 'value' THEN fault_reaction_time_s IS NOT NULL WHEN 'no_conflict' THEN fault_reaction_time_s IS NULL WHEN 'not_applicable' THEN fault_reaction_time_s IS NULL WHEN 'undefined' THEN fault_reaction_time_s IS NULL WHEN 'incomplete' THEN fault_reaction_time_s IS NULL WHEN 'error' THEN fault_reaction_time_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_timing_fault_handling_time_s CHECK (CASE fault_handling_time_s_status WHEN 'value' THEN fault_handling_time_s IS NOT NULL WHEN 'no_conflict' THEN fault_handling_time_s IS NULL WHEN 'not_applicable' THEN fault_handling_time_s IS NULL WHEN 'undefined' THEN fault_handling_time_s IS NULL WHEN 'incomplete' THEN fault_handling_time_s IS NULL WHEN 'error' THEN fault_handling_time_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_timing_emergency_operation_time_s CHECK (CASE emergency_operation_time_s_status WHEN 'value' THEN emergency_operation_time_s IS NOT NULL WHEN 'no_conflict' THEN emergency_operation_time_s IS NULL WHEN 'not_applicable' THEN emergency_operation_time_s IS NULL WHEN 'undefined' THEN emergency_operation_time_s IS NULL WHEN 'incomplete' THEN emergency_operation_time_s IS NULL WHEN 'error' THEN emergency_operation_time_s IS NULL ELSE FALSE END), 
	CONSTRAINT ck_timing_nominal_availability CHECK (CASE nominal_availability_status WHEN 'value' THEN nominal_availability IS NOT NULL WHEN 'no_conflict' THEN nominal_availability IS NULL WHEN 'not_applicable' THEN nominal_availability IS NULL WHEN 'undefined' THEN nominal_availability IS NULL WHEN 'incomplete' THEN nominal_availability IS NULL WHEN 'error' THEN nominal_availability IS NULL ELSE FALSE END), 
	CONSTRAINT ck_timing_takeovers CHECK (CASE takeovers_status WHEN 'value' THEN takeovers IS NOT NULL WHEN 'no_conflict' THEN takeovers IS NULL WHEN 'not_applicable' THEN takeovers IS NULL WHEN 'undefined' THEN takeovers IS NULL WHEN 'incomplete' THEN takeovers IS NULL WHEN 'error' THEN takeovers IS NULL ELSE FALSE END), 
	CONSTRAINT ck_timing_trips CHECK (CASE trips_status WHEN 'value' THEN trips IS NOT NULL WHEN 'no_conflict' THEN trips IS NULL WHEN 'not_applicable' THEN trips IS NULL WHEN 'undefined' THEN trips IS NULL WHEN 'incomplete' THEN trips IS NULL WHEN 'error' THEN trips IS NULL ELSE FALSE END), 
	CONSTRAINT ck_timing_stop_rating CHECK (CASE stop_rating_status WHEN 'value' THEN stop_rating IS NOT NULL WHEN 'no_conflict' THEN stop_rating IS NULL WHEN 'not_applicable' THEN stop_rating IS NULL WHEN 'undefined' THEN stop_rating IS NULL WHEN 'incomplete' THEN stop_rating IS NULL WHEN 'error' THEN stop_rating IS NULL ELSE FALSE END), 
	CONSTRAINT ck_timing_stop_regret CHECK (CASE stop_regret_status WHEN 'value' THEN stop_regret IS NOT NULL WHEN 'no_conflict' THEN stop_regret IS NULL WHEN 'not_applicable' THEN stop_regret IS NULL WHEN 'undefined' THEN stop_regret IS NULL WHEN 'incomplete' THEN stop_regret IS NULL WHEN 'error' THEN stop_regret IS NULL ELSE FALSE END), 
	CONSTRAINT fk_timing_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE verdict (
	run_number INTEGER NOT NULL, 
	fsr_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	fsr_id TEXT COLLATE "C" NOT NULL, 
	verdict TEXT COLLATE "C" NOT NULL, 
	robustness_low FLOAT, 
	robustness_high FLOAT, 
	margin FLOAT, 
	unit TEXT COLLATE "C", 
	signal TEXT COLLATE "C", 
	predicate TEXT COLLATE "C", 
	time_s FLOAT, 
	actor TEXT COLLATE "C", 
	value FLOAT, 
	threshold FLOAT, 
	exercised SMALLINT NOT NULL, 
	detail TEXT COLLATE "C", 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_verdict PRIMARY KEY (run_number, fsr_digest), 
	CONSTRAINT ck_verdict_verdict CHECK (verdict = 'PASS' OR verdict = 'FAIL' OR verdict = 'INCONCLUSIVE' OR verdict = 'VACUOUS' OR verdict = 'INVALID' OR verdict = 'ERROR'), 
	CONSTRAINT fk_verdict_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE withdrawal (
	number INTEGER NOT NULL, 
	result_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	at TEXT COLLATE "C" NOT NULL, 
	author TEXT COLLATE "C" NOT NULL, 
	reason TEXT COLLATE "C" NOT NULL, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_withdrawal PRIMARY KEY (number), 
	CONSTRAINT fk_withdrawal_result_digest FOREIGN KEY(result_digest) REFERENCES run (result_digest)
)

--

CREATE INDEX ix_withdrawal_result_digest ON withdrawal (result_digest)

--

CREATE TABLE takeover (
	fork_digest VARCHAR(64) COLLATE "C" NOT NULL, 
	version INTEGER NOT NULL, 
	class TEXT COLLATE "C" NOT NULL, 
	takeover_s FLOAT, 
	violation_s FLOAT, 
	fork_violation_s FLOAT, 
	row_hash VARCHAR(32) COLLATE "C" NOT NULL, 
	CONSTRAINT pk_takeover PRIMARY KEY (fork_digest, version), 
	CONSTRAINT ck_takeover_class CHECK (class = 'needed_and_done' OR class = 'late' OR class = 'spurious' OR class = 'missed' OR class = 'not_needed'), 
	CONSTRAINT fk_takeover_fork_digest FOREIGN KEY(fork_digest) REFERENCES fork (result_digest)
)

--

CREATE TRIGGER architecture_no_update BEFORE UPDATE ON architecture
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER architecture_no_delete BEFORE DELETE ON architecture
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER architecture_no_truncate BEFORE TRUNCATE ON architecture
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER concept_no_update BEFORE UPDATE ON concept
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER concept_no_delete BEFORE DELETE ON concept
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER concept_no_truncate BEFORE TRUNCATE ON concept
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER ledger_no_update BEFORE UPDATE ON ledger
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER ledger_no_delete BEFORE DELETE ON ledger
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER ledger_no_truncate BEFORE TRUNCATE ON ledger
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER odd_no_update BEFORE UPDATE ON odd
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER odd_no_delete BEFORE DELETE ON odd
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER odd_no_truncate BEFORE TRUNCATE ON odd
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER scenario_no_update BEFORE UPDATE ON scenario
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER scenario_no_delete BEFORE DELETE ON scenario
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER scenario_no_truncate BEFORE TRUNCATE ON scenario
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER uid_set_no_update BEFORE UPDATE ON uid_set
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER uid_set_no_delete BEFORE DELETE ON uid_set
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER uid_set_no_truncate BEFORE TRUNCATE ON uid_set
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER assumption_no_update BEFORE UPDATE ON assumption
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER assumption_no_delete BEFORE DELETE ON assumption
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER assumption_no_truncate BEFORE TRUNCATE ON assumption
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_no_update BEFORE UPDATE ON campaign
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_no_delete BEFORE DELETE ON campaign
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_no_truncate BEFORE TRUNCATE ON campaign
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER decomposition_no_update BEFORE UPDATE ON decomposition
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER decomposition_no_delete BEFORE DELETE ON decomposition
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER decomposition_no_truncate BEFORE TRUNCATE ON decomposition
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER dependent_failure_no_update BEFORE UPDATE ON dependent_failure
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER dependent_failure_no_delete BEFORE DELETE ON dependent_failure
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER dependent_failure_no_truncate BEFORE TRUNCATE ON dependent_failure
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER element_no_update BEFORE UPDATE ON element
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER element_no_delete BEFORE DELETE ON element
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER element_no_truncate BEFORE TRUNCATE ON element
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER fsr_no_update BEFORE UPDATE ON fsr
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER fsr_no_delete BEFORE DELETE ON fsr
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER fsr_no_truncate BEFORE TRUNCATE ON fsr
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER hazardous_event_no_update BEFORE UPDATE ON hazardous_event
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER hazardous_event_no_delete BEFORE DELETE ON hazardous_event
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER hazardous_event_no_truncate BEFORE TRUNCATE ON hazardous_event
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER safety_goal_no_update BEFORE UPDATE ON safety_goal
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER safety_goal_no_delete BEFORE DELETE ON safety_goal
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER safety_goal_no_truncate BEFORE TRUNCATE ON safety_goal
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER test_case_no_update BEFORE UPDATE ON test_case
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER test_case_no_delete BEFORE DELETE ON test_case
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER test_case_no_truncate BEFORE TRUNCATE ON test_case
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER allocation_no_update BEFORE UPDATE ON allocation
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER allocation_no_delete BEFORE DELETE ON allocation
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER allocation_no_truncate BEFORE TRUNCATE ON allocation
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_case_no_update BEFORE UPDATE ON campaign_case
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_case_no_delete BEFORE DELETE ON campaign_case
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_case_no_truncate BEFORE TRUNCATE ON campaign_case
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_fsr_no_update BEFORE UPDATE ON campaign_fsr
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_fsr_no_delete BEFORE DELETE ON campaign_fsr
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_fsr_no_truncate BEFORE TRUNCATE ON campaign_fsr
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_root_no_update BEFORE UPDATE ON campaign_root
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_root_no_delete BEFORE DELETE ON campaign_root
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_root_no_truncate BEFORE TRUNCATE ON campaign_root
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_use_no_update BEFORE UPDATE ON campaign_use
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_use_no_delete BEFORE DELETE ON campaign_use
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER campaign_use_no_truncate BEFORE TRUNCATE ON campaign_use
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER case_count_no_update BEFORE UPDATE ON case_count
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER case_count_no_delete BEFORE DELETE ON case_count
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER case_count_no_truncate BEFORE TRUNCATE ON case_count
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER case_match_no_update BEFORE UPDATE ON case_match
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER case_match_no_delete BEFORE DELETE ON case_match
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER case_match_no_truncate BEFORE TRUNCATE ON case_match
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER certificate_no_update BEFORE UPDATE ON certificate
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER certificate_no_delete BEFORE DELETE ON certificate
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER certificate_no_truncate BEFORE TRUNCATE ON certificate
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER decomposition_child_no_update BEFORE UPDATE ON decomposition_child
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER decomposition_child_no_delete BEFORE DELETE ON decomposition_child
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER decomposition_child_no_truncate BEFORE TRUNCATE ON decomposition_child
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER element_relation_no_update BEFORE UPDATE ON element_relation
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER element_relation_no_delete BEFORE DELETE ON element_relation
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER element_relation_no_truncate BEFORE TRUNCATE ON element_relation
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER run_no_update BEFORE UPDATE ON run
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER run_no_delete BEFORE DELETE ON run
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER run_no_truncate BEFORE TRUNCATE ON run
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER session_no_update BEFORE UPDATE ON session
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER session_no_delete BEFORE DELETE ON session
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER session_no_truncate BEFORE TRUNCATE ON session
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER uncertainty_no_update BEFORE UPDATE ON uncertainty
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER uncertainty_no_delete BEFORE DELETE ON uncertainty
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER uncertainty_no_truncate BEFORE TRUNCATE ON uncertainty
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER basis_no_update BEFORE UPDATE ON basis
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER basis_no_delete BEFORE DELETE ON basis
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER basis_no_truncate BEFORE TRUNCATE ON basis
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER benchmark_no_update BEFORE UPDATE ON benchmark
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER benchmark_no_delete BEFORE DELETE ON benchmark
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER benchmark_no_truncate BEFORE TRUNCATE ON benchmark
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER case_run_no_update BEFORE UPDATE ON case_run
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER case_run_no_delete BEFORE DELETE ON case_run
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER case_run_no_truncate BEFORE TRUNCATE ON case_run
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER case_tally_no_update BEFORE UPDATE ON case_tally
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER case_tally_no_delete BEFORE DELETE ON case_tally
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER case_tally_no_truncate BEFORE TRUNCATE ON case_tally
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER chain_no_update BEFORE UPDATE ON chain
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER chain_no_delete BEFORE DELETE ON chain
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER chain_no_truncate BEFORE TRUNCATE ON chain
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER criticality_no_update BEFORE UPDATE ON criticality
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER criticality_no_delete BEFORE DELETE ON criticality
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER criticality_no_truncate BEFORE TRUNCATE ON criticality
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER event_no_update BEFORE UPDATE ON event
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER event_no_delete BEFORE DELETE ON event
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER event_no_truncate BEFORE TRUNCATE ON event
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER extreme_no_update BEFORE UPDATE ON extreme
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER extreme_no_delete BEFORE DELETE ON extreme
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER extreme_no_truncate BEFORE TRUNCATE ON extreme
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER fork_no_update BEFORE UPDATE ON fork
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER fork_no_delete BEFORE DELETE ON fork
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER fork_no_truncate BEFORE TRUNCATE ON fork
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER half_step_no_update BEFORE UPDATE ON half_step
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER half_step_no_delete BEFORE DELETE ON half_step
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER half_step_no_truncate BEFORE TRUNCATE ON half_step
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER injection_no_update BEFORE UPDATE ON injection
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER injection_no_delete BEFORE DELETE ON injection
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER injection_no_truncate BEFORE TRUNCATE ON injection
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER kept_trace_no_update BEFORE UPDATE ON kept_trace
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER kept_trace_no_delete BEFORE DELETE ON kept_trace
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER kept_trace_no_truncate BEFORE TRUNCATE ON kept_trace
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER metric_no_update BEFORE UPDATE ON metric
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER metric_no_delete BEFORE DELETE ON metric
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER metric_no_truncate BEFORE TRUNCATE ON metric
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER seal_no_update BEFORE UPDATE ON seal
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER seal_no_delete BEFORE DELETE ON seal
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER seal_no_truncate BEFORE TRUNCATE ON seal
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER tally_no_update BEFORE UPDATE ON tally
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER tally_no_delete BEFORE DELETE ON tally
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER tally_no_truncate BEFORE TRUNCATE ON tally
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER timing_no_update BEFORE UPDATE ON timing
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER timing_no_delete BEFORE DELETE ON timing
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER timing_no_truncate BEFORE TRUNCATE ON timing
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER verdict_no_update BEFORE UPDATE ON verdict
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER verdict_no_delete BEFORE DELETE ON verdict
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER verdict_no_truncate BEFORE TRUNCATE ON verdict
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER withdrawal_no_update BEFORE UPDATE ON withdrawal
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER withdrawal_no_delete BEFORE DELETE ON withdrawal
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER withdrawal_no_truncate BEFORE TRUNCATE ON withdrawal
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER takeover_no_update BEFORE UPDATE ON takeover
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER takeover_no_delete BEFORE DELETE ON takeover
FOR EACH ROW EXECUTE FUNCTION insert_only()

--

CREATE TRIGGER takeover_no_truncate BEFORE TRUNCATE ON takeover
FOR EACH STATEMENT EXECUTE FUNCTION insert_only()

--

CREATE VIEW v_verdicts AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    c.result_digest AS run, c.test_case_digest AS test_case, f.fsr_id AS fsr, f.asil, f.mandatory,
    COALESCE(v.verdict, 'NOT_RUN') AS verdict, v.exercised, v.margin, v.unit, v.robustness_low,
    v.robustness_high, v.signal, v.predicate, v.time_s, v.actor, v.value, v.threshold, v.detail
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN campaign_fsr f ON f.campaign_id = c.campaign_id AND f.architecture = c.architecture
    AND f.scenario = c.scenario AND f.applicable = 1
    AND f.applies IN ('everywhere', CASE c.inside_odd WHEN 1 THEN 'inside' ELSE 'outside' END)
LEFT JOIN run r ON r.result_digest = c.result_digest
LEFT JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest

--

COMMENT ON VIEW v_verdicts IS 'a83908406b41b760834d6d84e3a5a32e6ac3bd7017c845266a6f35f5db4e9e03'

--

CREATE VIEW v_runs AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    t.replicate, t.seed, c.inside_odd, t.parameters, c.point, c.result_digest AS run,
    c.test_case_digest AS test_case, t.situation_digest AS situation, r.outcome, r.outcome_channel,
    r.outcome_detail, r.realised, r.end_reason, r.duration_s, r.backend, r.trace_digest,
    r.machine_dependent, r.executed_at,
    m.contact, m.contact_status, m.contact_time_s, m.contact_actor,
    m.impact_speed_mps, m.impact_speed_mps_status, m.impact_speed_mps_time_s, m.impact_speed_mps_actor,
    m.min_distance_m, m.min_distance_m_status, m.min_distance_m_time_s, m.min_distance_m_actor,
    m.min_ttc_s, m.min_ttc_s_status, m.min_ttc_s_time_s, m.min_ttc_s_actor,
    m.min_time_headway_s, m.min_time_headway_s_status, m.min_time_headway_s_time_s, m.min_time_headway_s_actor,
    m.max_drac_mps2, m.max_drac_mps2_status, m.max_drac_mps2_time_s, m.max_drac_mps2_actor,
    m.max_required_deceleration_mps2, m.max_required_deceleration_mps2_status, m.max_required_deceleration_mps2_time_s, m.max_required_deceleration_mps2_actor,
    m.rss_violation_s, m.rss_violation_s_status, m.rss_violation_s_time_s, m.rss_violation_s_actor,
    m.fault_to_safe_state_s, m.fault_to_safe_state_s_status, m.fault_to_safe_state_s_time_s, m.fault_to_safe_state_s_actor,
    m.max_jerk_mps3, m.max_jerk_mps3_status, m.max_jerk_mps3_time_s, m.max_jerk_mps3_actor,
    m.max_deceleration_mps2, m.max_deceleration_mps2_status, m.max_deceleration_mps2_time_s, m.max_deceleration_mps2_actor,
    m.max_lane_offset_m, m.max_lane_offset_m_status, m.max_lane_offset_m_time_s, m.max_lane_offset_m_actor,
    m.first_detection_distance_m, m.first_detection_distance_m_status, m.first_detection_distance_m_time_s, m.first_detection_distance_m_actor,
    m.takeover_time_s, m.takeover_time_s_status, m.takeover_time_s_time_s, m.takeover_time_s_actor,
    m.standstill_gap_m, m.standstill_gap_m_status, m.standstill_gap_m_time_s, m.standstill_gap_m_actor,
    m.detection_latency_s, m.detection_latency_s_status, m.detection_latency_s_time_s, m.detection_latency_s_actor,
    m.missed_time_s, m.missed_time_s_status, m.missed_time_s_time_s, m.missed_time_s_actor,
    m.false_track_time_s, m.false_track_time_s_status, m.false_track_time_s_time_s, m.false_track_time_s_actor,
    m.range_error_rms_m, m.range_error_rms_m_status, m.range_error_rms_m_time_s, m.range_error_rms_m_actor,
    m.position_error_p95_m, m.position_error_p95_m_status, m.position_error_p95_m_time_s, m.position_error_p95_m_actor,
    m.rear_detection_margin_m, m.rear_detection_margin_m_status, m.rear_detection_margin_m_time_s, m.rear_detection_margin_m_actor,
    n.fault_detection_time_s, n.fault_detection_time_s_status, n.fault_detection_time_s_time_s, n.fault_detection_time_s_actor,
    n.fault_reaction_time_s, n.fault_reaction_time_s_status, n.fault_reaction_time_s_time_s, n.fault_reaction_time_s_actor,
    n.fault_handling_time_s, n.fault_handling_time_s_status, n.fault_handling_time_s_time_s, n.fault_handling_time_s_actor,
    n.emergency_operation_time_s, n.emergency_operation_time_s_status, n.emergency_operation_time_s_time_s, n.emergency_operation_time_s_actor,
    n.nominal_availability, n.nominal_availability_status, n.nominal_availability_time_s, n.nominal_availability_actor,
    n.takeovers, n.takeovers_status, n.takeovers_time_s, n.takeovers_actor,
    n.trips, n.trips_status, n.trips_time_s, n.trips_actor,
    n.stop_rating, n.stop_rating_status, n.stop_rating_time_s, n.stop_rating_actor,
    n.stop_regret, n.stop_regret_status, n.stop_regret_time_s, n.stop_regret_actor,
    k.min_time_gap_s, k.min_time_gap_s_status, k.min_time_gap_s_time_s, k.min_time_gap_s_actor,
    k.min_mttc_s, k.min_mttc_s_status, k.min_mttc_s_time_s, k.min_mttc_s_actor,
    k.min_ettc_s, k.min_ettc_s_status, k.min_ettc_s_time_s, k.min_ettc_s_actor,
    k.max_mdrac_mps2, k.max_mdrac_mps2_status, k.max_mdrac_mps2_time_s, k.max_mdrac_mps2_actor,
    k.max_dst_mps2, k.max_dst_mps2_status, k.max_dst_mps2_time_s, k.max_dst_mps2_actor,
    k.min_mtc, k.min_mtc_status, k.min_mtc_time_s, k.min_mtc_actor,
    k.min_psd, k.min_psd_status, k.min_psd_time_s, k.min_psd_actor,
    k.max_btn, k.max_btn_status, k.max_btn_time_s, k.max_btn_actor,
    k.max_stn, k.max_stn_status, k.max_stn_time_s, k.max_stn_actor,
    k.min_ttb_s, k.min_ttb_s_status, k.min_ttb_s_time_s, k.min_ttb_s_actor,
    k.min_tts_s, k.min_tts_s_status, k.min_tts_s_time_s, k.min_tts_s_actor,
    k.min_ttk_s, k.min_ttk_s_status, k.min_ttk_s_time_s, k.min_ttk_s_actor,
    k.min_ttr_s, k.min_ttr_s_status, k.min_ttr_s_time_s, k.min_ttr_s_actor,
    k.tet_s, k.tet_s_status, k.tet_s_time_s, k.tet_s_actor,
    k.tit_s2, k.tit_s2_status, k.tit_s2_time_s, k.tit_s2_actor,
    k.tet_share, k.tet_share_status, k.tet_share_time_s, k.tet_share_actor,
    k.tit_mean_s, k.tit_mean_s_status, k.tit_mean_s_time_s, k.tit_mean_s_actor,
    k.crash_potential, k.crash_potential_status, k.crash_potential_time_s, k.crash_potential_actor,
    k.time_to_accident_s, k.time_to_accident_s_status, k.time_to_accident_s_time_s, k.time_to_accident_s_actor,
    k.min_rss_ratio, k.min_rss_ratio_status, k.min_rss_ratio_time_s, k.min_rss_ratio_actor,
    k.rss_response_violation_s, k.rss_response_violation_s_status, k.rss_response_violation_s_time_s, k.rss_response_violation_s_actor,
    k.min_ttc_2d_s, k.min_ttc_2d_s_status, k.min_ttc_2d_s_time_s, k.min_ttc_2d_s_actor,
    k.min_wttc_s, k.min_wttc_s_status, k.min_wttc_s_time_s, k.min_wttc_s_actor,
    k.min_dce_m, k.min_dce_m_status, k.min_dce_m_time_s, k.min_dce_m_actor,
    k.min_ttce_s, k.min_ttce_s_status, k.min_ttce_s_time_s, k.min_ttce_s_actor,
    k.min_pet_s, k.min_pet_s_status, k.min_pet_s_time_s, k.min_pet_s_actor,
    k.pet_overlap_s, k.pet_overlap_s_status, k.pet_overlap_s_time_s, k.pet_overlap_s_actor,
    k.max_encroachment_time_s, k.max_encroachment_time_s_status, k.max_encroachment_time_s_time_s, k.max_encroachment_time_s_actor,
    k.min_predicted_pet_s, k.min_predicted_pet_s_status, k.min_predicted_pet_s_time_s, k.min_predicted_pet_s_actor,
    k.min_rear_ttc_s, k.min_rear_ttc_s_status, k.min_rear_ttc_s_time_s, k.min_rear_ttc_s_actor,
    k.max_follower_deceleration_mps2, k.max_follower_deceleration_mps2_status, k.max_follower_deceleration_mps2_time_s, k.max_follower_deceleration_mps2_actor,
    k.delta_v_mps, k.delta_v_mps_status, k.delta_v_mps_time_s, k.delta_v_mps_actor,
    k.other_delta_v_mps, k.other_delta_v_mps_status, k.other_delta_v_mps_time_s, k.other_delta_v_mps_actor,
    k.fatality_probability, k.fatality_probability_status, k.fatality_probability_time_s, k.fatality_probability_actor,
    k.max_acceleration_mps2, k.max_acceleration_mps2_status, k.max_acceleration_mps2_time_s, k.max_acceleration_mps2_actor,
    k.max_lateral_acceleration_mps2, k.max_lateral_acceleration_mps2_status, k.max_lateral_acceleration_mps2_time_s, k.max_lateral_acceleration_mps2_actor,
    k.max_total_jerk_mps3, k.max_total_jerk_mps3_status, k.max_total_jerk_mps3_time_s, k.max_total_jerk_mps3_actor,
    k.max_yaw_rate_radps, k.max_yaw_rate_radps_status, k.max_yaw_rate_radps_time_s, k.max_yaw_rate_radps_actor,
    k.max_yaw_acceleration_radps2, k.max_yaw_acceleration_radps2_status, k.max_yaw_acceleration_radps2_time_s, k.max_yaw_acceleration_radps2_actor,
    k.uncomfortable_time_s, k.uncomfortable_time_s_status, k.uncomfortable_time_s_time_s, k.uncomfortable_time_s_actor,
    k.contact_at_fault, k.contact_at_fault_status, k.contact_at_fault_time_s, k.contact_at_fault_actor,
    k.distance_to_safe_state_m, k.distance_to_safe_state_m_status, k.distance_to_safe_state_m_time_s, k.distance_to_safe_state_m_actor,
    k.max_acceleration_disagreement_mps2, k.max_acceleration_disagreement_mps2_status, k.max_acceleration_disagreement_mps2_time_s, k.max_acceleration_disagreement_mps2_actor,
    k.max_steering_disagreement_rad, k.max_steering_disagreement_rad_status, k.max_steering_disagreement_rad_time_s, k.max_steering_disagreement_rad_actor,
    (
    SELECT '{' || COALESCE(group_concat('"' || fsr || '":"' || verdict || '"', ','), '') || '}'
    FROM (
        SELECT v.fsr, v.verdict FROM v_verdicts v
        WHERE v.campaign = c.campaign_id AND v.ordinal = c.ordinal ORDER BY v.fsr) judged
    ) AS verdicts
FROM campaign_case c
LEFT JOIN case_run o ON o.campaign_id = c.campaign_id AND o.ordinal = c.ordinal
JOIN metric m ON m.run_number = COALESCE(o.run_number, (
    SELECT x.number FROM run x WHERE x.result_digest = c.result_digest))
JOIN run r ON r.number = m.run_number
LEFT JOIN timing n ON n.run_number = m.run_number
LEFT JOIN criticality k ON k.run_number = m.run_number
LEFT JOIN test_case t ON t.digest = c.test_case_digest

--

COMMENT ON VIEW v_runs IS 'c497175b64afe47d5b781941e982b68e3fc66e612abaf7ea18f86fb81e104915'

--

CREATE VIEW v_fsr_status AS
WITH withdrawn AS (
    SELECT c.campaign_id, f.fsr_id, c.architecture, c.scenario, v.verdict, -1 AS runs,
        0 - v.exercised AS exercised
    FROM (SELECT DISTINCT result_digest FROM withdrawal) x
    CROSS JOIN campaign_case c ON c.result_digest = x.result_digest
    CROSS JOIN work b ON b.campaign_id = c.campaign_id AND b.from_ordinal <= c.ordinal
        AND b.to_ordinal > c.ordinal AND b.state = 'done'
    CROSS JOIN campaign_fsr f ON f.campaign_id = c.campaign_id AND f.architecture = c.architecture
    AND f.scenario = c.scenario AND f.applicable = 1
    AND f.applies IN ('everywhere', CASE c.inside_odd WHEN 1 THEN 'inside' ELSE 'outside' END)
    CROSS JOIN run r ON r.result_digest = c.result_digest
    CROSS JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest),
counted AS (
    SELECT campaign_id, fsr_id, architecture, scenario, SUM(runs) AS judged,
        SUM(exercised) AS exercised,
        SUM(CASE verdict WHEN 'FAIL' THEN runs ELSE 0 END) AS n_fail,
    SUM(CASE verdict WHEN 'ERROR' THEN runs ELSE 0 END) AS n_error,
    SUM(CASE verdict WHEN 'INVALID' THEN runs ELSE 0 END) AS n_invalid,
    SUM(CASE verdict WHEN 'INCONCLUSIVE' THEN runs ELSE 0 END) AS n_inconclusive,
    SUM(CASE verdict WHEN 'VACUOUS' THEN runs ELSE 0 END) AS n_vacuous,
    SUM(CASE verdict WHEN 'PASS' THEN runs ELSE 0 END) AS n_pass
    FROM (
        SELECT campaign_id, fsr_id, architecture, scenario, verdict, runs, exercised FROM tally
        UNION ALL SELECT * FROM withdrawn) told
    GROUP BY campaign_id, fsr_id, architecture, scenario),
worst AS (
    SELECT campaign_id, fsr_id, architecture, scenario, worst_margin, worst_robustness,
        worst_unit, worst_result_digest, ROW_NUMBER() OVER (
            PARTITION BY campaign_id, fsr_id, architecture, scenario
            ORDER BY verdict = 'FAIL' DESC, (worst_robustness IS NULL) = (verdict <> 'FAIL'), worst_robustness, worst_result_digest) AS place
    FROM tally WHERE verdict IN ('FAIL', 'PASS', 'INCONCLUSIVE'))
SELECT f.campaign_id AS campaign, f.fsr_id AS fsr, f.architecture, f.scenario, f.asil,
    f.mandatory, f.in_gate, f.applicable, f.reason, f.min_exercised, f.waived_until, f.planned,
    COALESCE(n.n_fail, 0) AS n_fail,
    COALESCE(n.n_error, 0) AS n_error,
    COALESCE(n.n_invalid, 0) AS n_invalid,
    COALESCE(n.n_inconclusive, 0) AS n_inconclusive,
    COALESCE(n.n_vacuous, 0) AS n_vacuous,
    COALESCE(n.n_pass, 0) AS n_pass,
    f.planned - COALESCE(n.judged, 0) AS n_not_run, COALESCE(n.exercised, 0) AS exercised,
    w.worst_margin, w.worst_unit AS unit, w.worst_robustness, w.worst_result_digest AS worst_run,
    CASE WHEN f.applicable = 0 THEN NULL WHEN f.planned = 0 THEN 'NOT_RUN' WHEN n_fail > 0 THEN 'FAIL' WHEN n_error > 0 THEN 'ERROR' WHEN n_invalid > 0 THEN 'INVALID' WHEN n_inconclusive > 0 THEN 'INCONCLUSIVE' WHEN f.planned > COALESCE(n.judged, 0) THEN 'NOT_RUN' WHEN n_pass >= 1 THEN 'PASS' ELSE 'VACUOUS' END AS verdict
FROM campaign_fsr f
LEFT JOIN counted n ON n.campaign_id = f.campaign_id AND n.fsr_id = f.fsr_id
    AND n.architecture = f.architecture AND n.scenario = f.scenario
LEFT JOIN worst w ON w.campaign_id = f.campaign_id AND w.fsr_id = f.fsr_id
    AND w.architecture = f.architecture AND w.scenario = f.scenario AND w.place = 1

--

COMMENT ON VIEW v_fsr_status IS 'f327e3635b4556f3d1f37780c0b8132ff4a9b2c692a134a548093f168bc2cfac'

--

CREATE VIEW v_gate AS
WITH summed AS (
    SELECT campaign, architecture, fsr, MAX(asil) AS asil, MAX(in_gate) AS in_gate,
        MAX(applicable) AS applicable, MAX(reason) AS reason,
        MAX(min_exercised) AS min_exercised, MAX(waived_until) AS waived_until,
        SUM(planned) AS planned,
        SUM(n_fail) AS n_fail,
    SUM(n_error) AS n_error,
    SUM(n_invalid) AS n_invalid,
    SUM(n_inconclusive) AS n_inconclusive,
    SUM(n_vacuous) AS n_vacuous,
    SUM(n_pass) AS n_pass,
        SUM(n_not_run) AS n_not_run, SUM(exercised) AS exercised
    FROM v_fsr_status WHERE mandatory = 1
    GROUP BY campaign, architecture, fsr),
worst AS (
    SELECT campaign, architecture, fsr, worst_margin, unit, worst_robustness, worst_run,
        ROW_NUMBER() OVER (
            PARTITION BY campaign, architecture, fsr
            ORDER BY n_fail > 0 DESC, (worst_robustness IS NULL) = (n_fail = 0),
                worst_robustness, worst_run) AS place
    FROM v_fsr_status WHERE worst_run IS NOT NULL)
SELECT s.*, w.worst_margin, w.unit, w.worst_robustness, w.worst_run,
    CASE WHEN s.applicable = 0 THEN CASE WHEN s.in_gate = 1 THEN 'ERROR' END WHEN s.planned = 0 THEN 'NOT_RUN' WHEN n_fail > 0 THEN 'FAIL' WHEN n_error > 0 THEN 'ERROR' WHEN n_invalid > 0 THEN 'INVALID' WHEN n_inconclusive > 0 THEN 'INCONCLUSIVE' WHEN s.planned > COALESCE(s.planned - s.n_not_run, 0) THEN 'NOT_RUN' WHEN n_pass >= s.min_exercised THEN 'PASS' ELSE 'VACUOUS' END AS verdict,
    CASE WHEN s.applicable = 0 THEN CASE WHEN s.in_gate = 1 THEN 'ERROR' END WHEN s.planned = 0 THEN 'NOT_RUN' WHEN n_fail > 0 THEN 'FAIL' WHEN n_error > 0 THEN 'ERROR' WHEN n_pass >= s.min_exercised THEN 'PASS' ELSE 'VACUOUS'
        END AS verdict_waived
FROM summed s
LEFT JOIN worst w ON w.campaign = s.campaign AND w.architecture = s.architecture
    AND w.fsr = s.fsr AND w.place = 1

--

COMMENT ON VIEW v_gate IS '6d28968380169dffd212aaa6c464e070d9a27031dfbfe626fb03e3ae82b0099c'

--

CREATE VIEW v_architecture_pairs AS
SELECT a.campaign_id AS campaign, ca.scenario, a.fault_entry,
    (SELECT t.situation_digest FROM test_case t WHERE t.digest = ca.test_case_digest) AS situation,
    (SELECT t.parameters FROM test_case t WHERE t.digest = ca.test_case_digest) AS parameters,
    (SELECT t.replicate FROM test_case t WHERE t.digest = ca.test_case_digest) AS replicate,
    ca.architecture AS architecture_a, cb.architecture AS architecture_b, ca.point AS point_a,
    cb.point AS point_b, ca.result_digest AS run_a, cb.result_digest AS run_b,
    (SELECT r.outcome FROM run r WHERE r.number = ma.run_number) AS outcome_a,
    (SELECT r.outcome FROM run r WHERE r.number = mb.run_number) AS outcome_b,
    ma.contact AS contact_a, mb.contact AS contact_b, mb.contact - ma.contact AS contact_difference,
    ma.impact_speed_mps AS impact_speed_mps_a, mb.impact_speed_mps AS impact_speed_mps_b, mb.impact_speed_mps - ma.impact_speed_mps AS impact_speed_mps_difference,
    ma.min_distance_m AS min_distance_m_a, mb.min_distance_m AS min_distance_m_b, mb.min_distance_m - ma.min_distance_m AS min_distance_m_difference,
    ma.min_ttc_s AS min_ttc_s_a, mb.min_ttc_s AS min_ttc_s_b, mb.min_ttc_s - ma.min_ttc_s AS min_ttc_s_difference,
    ma.min_time_headway_s AS min_time_headway_s_a, mb.min_time_headway_s AS min_time_headway_s_b, mb.min_time_headway_s - ma.min_time_headway_s AS min_time_headway_s_difference,
    ma.max_required_deceleration_mps2 AS max_required_deceleration_mps2_a, mb.max_required_deceleration_mps2 AS max_required_deceleration_mps2_b, mb.max_required_deceleration_mps2 - ma.max_required_deceleration_mps2 AS max_required_deceleration_mps2_difference,
    ma.max_deceleration_mps2 AS max_deceleration_mps2_a, mb.max_deceleration_mps2 AS max_deceleration_mps2_b, mb.max_deceleration_mps2 - ma.max_deceleration_mps2 AS max_deceleration_mps2_difference,
    ma.rss_violation_s AS rss_violation_s_a, mb.rss_violation_s AS rss_violation_s_b, mb.rss_violation_s - ma.rss_violation_s AS rss_violation_s_difference,
    ma.fault_to_safe_state_s AS fault_to_safe_state_s_a, mb.fault_to_safe_state_s AS fault_to_safe_state_s_b, mb.fault_to_safe_state_s - ma.fault_to_safe_state_s AS fault_to_safe_state_s_difference,
    (
    SELECT '{' || COALESCE(group_concat('"' || fsr || '":"' || verdict || '"', ','), '') || '}'
    FROM (
        SELECT v.fsr, v.verdict FROM v_verdicts v
        WHERE v.campaign = ca.campaign_id AND v.ordinal = ca.ordinal ORDER BY v.fsr) judged
    ) AS verdicts_a, (
    SELECT '{' || COALESCE(group_concat('"' || fsr || '":"' || verdict || '"', ','), '') || '}'
    FROM (
        SELECT v.fsr, v.verdict FROM v_verdicts v
        WHERE v.campaign = cb.campaign_id AND v.ordinal = cb.ordinal ORDER BY v.fsr) judged
    ) AS verdicts_b
FROM case_match a
CROSS JOIN case_match b ON b.campaign_id = a.campaign_id AND b.first_ordinal = a.first_ordinal
    AND b.ordinal <> a.ordinal
CROSS JOIN campaign_case ca ON ca.campaign_id = a.campaign_id AND ca.ordinal = a.ordinal
CROSS JOIN campaign_case cb ON cb.campaign_id = b.campaign_id AND cb.ordinal = b.ordinal
LEFT JOIN case_run oa ON oa.campaign_id = ca.campaign_id AND oa.ordinal = ca.ordinal
LEFT JOIN case_run ob ON ob.campaign_id = cb.campaign_id AND ob.ordinal = cb.ordinal
JOIN metric ma ON ma.run_number = COALESCE(oa.run_number, (
    SELECT x.number FROM run x WHERE x.result_digest = ca.result_digest))
JOIN metric mb ON mb.run_number = COALESCE(ob.run_number, (
    SELECT x.number FROM run x WHERE x.result_digest = cb.result_digest))
WHERE cb.architecture > ca.architecture
    AND (cb.point = ca.point OR NOT EXISTS (
        SELECT 1 FROM json_each(ca.point) x JOIN json_each(cb.point) y
            ON y.key = x.key AND (y.value <> x.value OR (y.value IS NULL) <> (x.value IS NULL))))

--

COMMENT ON VIEW v_architecture_pairs IS '39a93321b8b37c82c505a1aecfb00503e5762e1ba8539f92d1a5db8292220d7b'

--

CREATE VIEW v_coverage AS
SELECT campaign, scenario, architecture, fault_entry, SUM(planned) AS planned, SUM(done) AS done,
    SUM(exercised) AS exercised
FROM (
    SELECT campaign_id AS campaign, scenario, architecture, fault_entry, planned, 0 AS done,
        0 AS exercised
    FROM case_count
    UNION ALL
    SELECT campaign_id, scenario, architecture, fault_entry, 0, runs, exercised
    FROM case_tally
    UNION ALL
    SELECT c.campaign_id, c.scenario, c.architecture, t.fault_entry, 0, 1,
        CASE WHEN EXISTS (
            SELECT 1 FROM campaign_fsr f
            JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
            WHERE f.campaign_id = c.campaign_id AND f.architecture = c.architecture
    AND f.scenario = c.scenario AND f.applicable = 1
    AND f.applies IN ('everywhere', CASE c.inside_odd WHEN 1 THEN 'inside' ELSE 'outside' END) AND v.exercised = 1) THEN 1 ELSE 0 END
    FROM work w
    JOIN campaign_case c ON c.campaign_id = w.campaign_id
        AND c.ordinal >= w.from_ordinal AND c.ordinal < w.to_ordinal
    JOIN run r ON r.result_digest = c.result_digest
    JOIN test_case t ON t.digest = c.test_case_digest
    WHERE w.state <> 'done') counted
GROUP BY campaign, scenario, architecture, fault_entry

--

COMMENT ON VIEW v_coverage IS 'ee130aa4addf487a7b824141b6106cd14f4266f4bad1bef38c7ad667fe4225f3'

--

CREATE VIEW v_timeline AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    c.result_digest AS run, e.seq, e.time_s, e.kind, e.subject, e.text
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN run r ON r.result_digest = c.result_digest
JOIN event e ON e.run_number = r.number

--

COMMENT ON VIEW v_timeline IS 'a5a3bb889c4dd7c76029bb9682bceee2b77f5bc9e1ab95de1616623a2dbf5af4'

--

CREATE VIEW v_faults AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    c.result_digest AS run, i.class, i.fdti_s, i.frti_s, i.fhti_s, i.eoti_s, i.ftti_s,
    i.ftti_s - i.fhti_s AS margin_s,
    i.fault_s, i.effect_s, i.deviation_s, i.detect_s, i.switch_s, i.brake_s, i.emergency_s, i.safe_s, i.violation_s,
    i.fault_free_violation_s, i.without_mechanism, i.twins
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN injection i ON i.result_digest = c.result_digest
WHERE i.version = (SELECT MAX(x.version) FROM injection x
    WHERE x.result_digest = i.result_digest)

--

COMMENT ON VIEW v_faults IS 'b848283e8f8c1c6d2f9da9c2c25e3a99f0152c90ec4e7e94818acd7c61840a2b'

--

CREATE VIEW v_forks AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    f.origin_digest AS run, f.result_digest AS fork, f.authority, f.from_tick,
    f.from_tick * t.step_s AS from_time_s, o.class, o.takeover_s, o.violation_s,
    o.fork_violation_s, r.outcome, r.end_reason, r.duration_s
FROM fork f
JOIN run r ON r.result_digest = f.result_digest
JOIN campaign_case c ON c.result_digest = f.origin_digest
JOIN test_case t ON t.digest = c.test_case_digest
LEFT JOIN takeover o ON o.fork_digest = f.result_digest AND o.version = (
    SELECT MAX(x.version) FROM takeover x WHERE x.fork_digest = f.result_digest)

--

COMMENT ON VIEW v_forks IS '5d8e9abc14114bc1eef311696eb56b91f51d72c5cccc9ec1def1155491208369'

--

CREATE VIEW v_hazard_asil AS
SELECT e.concept_digest AS concept, e.id AS event,
    CASE WHEN e.severity NOT IN ('S0', 'S1', 'S2', 'S3')
        OR e.exposure NOT IN ('E0', 'E1', 'E2', 'E3', 'E4')
        OR e.controllability NOT IN ('C0', 'C1', 'C2', 'C3') THEN 'unknown'
    WHEN e.severity = 'S0' OR e.exposure = 'E0' OR e.controllability = 'C0' THEN NULL
    ELSE CASE CAST(substr(e.severity, 2) AS INTEGER) + CAST(substr(e.exposure, 2) AS INTEGER)
            + CAST(substr(e.controllability, 2) AS INTEGER)
        WHEN 10 THEN 'D' WHEN 9 THEN 'C' WHEN 8 THEN 'B' WHEN 7 THEN 'A' ELSE 'QM' END
    END AS asil
FROM hazardous_event e

--

COMMENT ON VIEW v_hazard_asil IS 'b123f74092b93fb97f1e926886b5adece9fce65f231c941ef281df5f5851b382'

--

CREATE VIEW v_goal_events AS
SELECT g.concept_digest AS concept, g.id AS goal, j.value AS event
FROM safety_goal g JOIN json_each(g.content, '$.hazardous_events') j ON TRUE

--

COMMENT ON VIEW v_goal_events IS 'c5bdbf5a8f8c9f2efb05c2425ed811eeb37d0ea87e0597ae9aeb008035950644'

--

CREATE VIEW v_goal_asil AS
SELECT concept, goal, MAX(rank) AS rank
FROM (
    SELECT g.concept_digest AS concept, g.id AS goal, CASE substr(g.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END AS rank FROM safety_goal g
    UNION ALL
    SELECT v.concept, v.goal, CASE substr(e.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END FROM v_goal_events v
    JOIN v_hazard_asil e ON e.concept = v.concept AND e.event = v.event) x
GROUP BY concept, goal

--

COMMENT ON VIEW v_goal_asil IS 'f61fcd8a9b5af0d1c7b9ed9921311a768c823569cb7158223d216ef917d2f734'

--

CREATE VIEW v_fsr_goals AS
SELECT f.concept_digest AS concept, f.id AS fsr, j.value AS goal,
    (SELECT CAST(value AS DOUBLE PRECISION) FROM json_each(f.content, '$.fdti')) AS fdti_s,
    (SELECT CAST(value AS DOUBLE PRECISION) FROM json_each(f.content, '$.frti')) AS frti_s,
    (SELECT CAST(value AS DOUBLE PRECISION) FROM json_each(f.content, '$.emergency_operation_interval'))
        AS emergency_operation_s
FROM fsr f JOIN json_each(f.content, '$.goals') j ON TRUE

--

COMMENT ON VIEW v_fsr_goals IS 'b7714e83f59a449329071fab9137fec21b76c2d80f5b95e643b55855eb0e6148'

--

CREATE VIEW v_element_causes AS
WITH RECURSIVE edge(concept, source, kind, name) AS (
    SELECT r.concept_digest, r.element_id,
        CASE WHEN r.kind = 'resource' AND e.id IS NOT NULL THEN 'element' ELSE r.kind END, r.name
    FROM element_relation r
    LEFT JOIN element e ON e.concept_digest = r.concept_digest AND e.id = r.name
    WHERE r.kind IN ('resource', 'software', 'supplier')
    UNION ALL
    SELECT r.concept_digest, r.element_id, 'element', p.element_id
    FROM element_relation r
    JOIN element_relation p ON p.concept_digest = r.concept_digest AND p.kind = 'provides'
        AND p.name = r.name
    WHERE r.kind = 'consumes'),
above(concept, element, kind, name) AS (
    SELECT concept_digest, id, 'element' || substr(id, 1, 0), id FROM element
    UNION
    SELECT a.concept, a.element, x.kind, x.name
    FROM above a JOIN edge x ON x.concept = a.concept AND x.source = a.name
    WHERE a.kind = 'element')
SELECT concept, element, kind, name FROM above

--

COMMENT ON VIEW v_element_causes IS '4d327f67cf5225195266ad467ddf9f046e162f807c96a38e31934e2ad0b6c343'

--

CREATE VIEW v_fsr_causes AS
SELECT DISTINCT a.concept_digest AS concept, a.fsr_id AS fsr, x.kind, x.name
FROM allocation a
JOIN v_element_causes x ON x.concept = a.concept_digest AND x.element = a.element_id

--

COMMENT ON VIEW v_fsr_causes IS 'edb5fa8c12518b8b2a0f533d75c40445136bfb938417f948e9b52b6e601f2204'

--

CREATE VIEW v_case_counts AS
SELECT k.campaign_id AS campaign, k.scenario, k.architecture, k.inside_odd, COUNT(*) AS planned,
    COUNT(r.number) AS results
FROM campaign_case k LEFT JOIN run r ON r.result_digest = k.result_digest
GROUP BY k.campaign_id, k.scenario, k.architecture, k.inside_odd

--

COMMENT ON VIEW v_case_counts IS '4bf94e57773aadff3c3336dc23bb278dabc62d1a809c4233fd6eebb1a8544e46'

--

CREATE VIEW v_check_hazard_asil AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    e.severity || ' ' || e.exposure || ' ' || e.controllability || ' give '
        || COALESCE(h.asil, 'no ASIL') || ', the event has ' || COALESCE(e.asil, 'none') AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
JOIN v_hazard_asil h ON h.concept = e.concept_digest AND h.event = e.id
WHERE COALESCE(h.asil, '') <> COALESCE(e.asil, '')

--

COMMENT ON VIEW v_check_hazard_asil IS '7a2a73844034235da4a9281024b5fb8959ec4cc4ef9daf1f50dc1c098fb826a6'

--

CREATE VIEW v_check_hazard_without_goal AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    'ASIL ' || e.asil || ', and no safety goal is against it' AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
WHERE e.asil <> 'QM' AND NOT EXISTS (
    SELECT 1 FROM v_goal_events g WHERE g.concept = e.concept_digest AND g.event = e.id)

--

COMMENT ON VIEW v_check_hazard_without_goal IS '5d814957ebbcd28dc4f89a2298f8c64a803d377cbddf1d14aab3b7e7dbde413b'

--

CREATE VIEW v_check_goal_asil AS
SELECT c.id AS campaign, 'safety_goal' AS part, g.id,
    'has ASIL ' || g.asil || ', its event ' || e.event || ' has ' || e.asil AS detail
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
JOIN v_goal_events v ON v.concept = g.concept_digest AND v.goal = g.id
JOIN (
    SELECT h.concept, h.event, CASE h.asil WHEN 'unknown' THEN x.asil ELSE h.asil END AS asil
    FROM v_hazard_asil h
    JOIN hazardous_event x ON x.concept_digest = h.concept AND x.id = h.event) e
    ON e.concept = v.concept AND e.event = v.event
WHERE CASE substr(g.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END < CASE substr(e.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END

--

COMMENT ON VIEW v_check_goal_asil IS 'db6e3c05c5c5191a94982214481217955d24077ef825fe6fcf2b78a4c4f038f5'

--

CREATE VIEW v_check_goal_without_fsr AS
SELECT c.id AS campaign, 'safety_goal' AS part, g.id,
    'ASIL ' || g.asil || ', and no requirement serves it' AS detail
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM v_fsr_goals s WHERE s.concept = g.concept_digest AND s.goal = g.id)

--

COMMENT ON VIEW v_check_goal_without_fsr IS 'bf3cf89f1f005ed8fd528b5045653dca16572fafee0c83669c7d5486a8c91036'

--

CREATE VIEW v_check_asil_lost AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'has ASIL ' || f.asil || ', its goal ' || g.goal || ' has ' || CASE g.rank WHEN 0 THEN 'QM' WHEN 1 THEN 'A' WHEN 2 THEN 'B' WHEN 3 THEN 'C' WHEN 4 THEN 'D' ELSE 'none' END AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN fsr f ON f.concept_digest = s.concept AND f.id = s.fsr
JOIN v_goal_asil g ON g.concept = s.concept AND g.goal = s.goal
WHERE CASE substr(f.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END < g.rank AND NOT EXISTS (
    SELECT 1 FROM decomposition_child x
    JOIN v_fsr_goals p ON p.concept = x.concept_digest AND p.fsr = x.fsr_id AND p.goal = s.goal
    WHERE x.concept_digest = f.concept_digest AND x.child_id = f.id)

--

COMMENT ON VIEW v_check_asil_lost IS '94238ae17fc2345f9f4e8215625714d2e441ffd683e888748d592ad0a0d4d6a9'

--

CREATE VIEW v_check_fsr_without_allocation AS
SELECT c.id AS campaign, 'fsr' AS part, f.id, 'no element has to meet it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM allocation a WHERE a.concept_digest = f.concept_digest AND a.fsr_id = f.id)

--

COMMENT ON VIEW v_check_fsr_without_allocation IS 'a6795ee56b98b5af142c622b496392f5f05090a3af349ef5ff954c164e60d410'

--

CREATE VIEW v_check_fsr_without_measure AS
SELECT c.id AS campaign, 'fsr' AS part, f.id, 'nothing measures it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE f.measure NOT GLOB '*[^ ]*'

--

COMMENT ON VIEW v_check_fsr_without_measure IS '66ddee29d5f61f29ba91394ae342e9ccd27986db0bc1187c4bed64855526b405'

--

CREATE VIEW v_check_threshold_without_source AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'nobody says where ' || f.measure || ' comes from' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE f.threshold_source NOT GLOB '*[^ ?.!-]*' OR lower(f.threshold_source) IN
    ('tbd', 'tbd.', 'tbc', 'tbc.', 'todo', 'todo.', 'n/a', 'na', 'none', 'none.', 'unknown',
    'unknown.')

--

COMMENT ON VIEW v_check_threshold_without_source IS '7aa1a5c79cef796d113701bf64ea06a2742bfb129849444a63a104ec075b6498'

--

CREATE VIEW v_check_element_capability AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'ASIL ' || f.asil || ' on ' || e.id || ', which is capable of ' || e.asil_capability AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
JOIN allocation a ON a.concept_digest = f.concept_digest AND a.fsr_id = f.id
JOIN element e ON e.concept_digest = a.concept_digest AND e.id = a.element_id
WHERE CASE substr(e.asil_capability, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END < CASE substr(f.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END

--

COMMENT ON VIEW v_check_element_capability IS '838c1475b8fb25a21bc2af76ac4e0cbc73767952ce79a233e81fce61d4344c77'

--

CREATE VIEW v_check_illegal_decomposition AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    p.asil || ' into ' || COALESCE(k.children, 'nothing') || ' for a goal of ASIL '
        || g.asil AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
JOIN fsr p ON p.concept_digest = d.concept_digest AND p.id = d.id
LEFT JOIN (
    SELECT x.concept_digest, x.fsr_id, COUNT(*) AS n, SUM(CASE substr(f.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END) AS total,
        MIN(CASE substr(f.asil, length(f.asil) - 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END) AS least, MAX(CASE substr(f.asil, length(f.asil) - 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END) AS most,
        group_concat(f.asil, ' and ') AS children
    FROM decomposition_child x
    JOIN fsr f ON f.concept_digest = x.concept_digest AND f.id = x.child_id
    GROUP BY x.concept_digest, x.fsr_id) k
    ON k.concept_digest = d.concept_digest AND k.fsr_id = d.id
LEFT JOIN (
    SELECT s.concept, s.fsr, MAX(CASE substr(g.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END) AS rank, MAX(g.asil) AS asil
    FROM v_fsr_goals s JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
    WHERE g.asil <> 'QM'
    GROUP BY s.concept, s.fsr) g ON g.concept = d.concept_digest AND g.fsr = d.id
WHERE COALESCE(k.n, 0) <> 2 OR k.total <> CASE substr(p.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END OR CASE substr(p.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END < 1
    OR COALESCE(k.least, -8) <> COALESCE(g.rank, -8)
    OR COALESCE(k.most, -8) <> COALESCE(g.rank, -8)

--

COMMENT ON VIEW v_check_illegal_decomposition IS '11b8639829261f28c463131477b3b4645291cf5f8631ae4bc5ec525dc17bf92c'

--

CREATE VIEW v_check_decomposition_elements AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    x.child_id || ' has no element that the other child does without' AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
JOIN decomposition_child x ON x.concept_digest = d.concept_digest AND x.fsr_id = d.id
WHERE NOT EXISTS (
    SELECT 1 FROM allocation a
    WHERE a.concept_digest = x.concept_digest AND a.fsr_id = x.child_id AND NOT EXISTS (
        SELECT 1 FROM decomposition_child y
        JOIN allocation b ON b.concept_digest = y.concept_digest AND b.fsr_id = y.child_id
        WHERE y.concept_digest = x.concept_digest AND y.fsr_id = x.fsr_id
            AND y.child_id <> x.child_id AND b.element_id = a.element_id))

--

COMMENT ON VIEW v_check_decomposition_elements IS '23068bba4bb0a51e23534ea5c1de4840012a5c02e945661e50d03da1c065bb68'

--

CREATE VIEW v_check_independence_argument AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    'nobody says why ' || d.scheme || ' are independent' AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
WHERE d.independence NOT GLOB '*[^ ]*'

--

COMMENT ON VIEW v_check_independence_argument IS '772667b37abcbda51bc1a454b7bab2d68f3fe27b0edb6221fb6537374bc43fd9'

--

CREATE VIEW v_check_independence_unknown AS
SELECT DISTINCT c.id AS campaign, 'element' AS part, a.element_id AS id,
    'states no resources, and ' || x.child_id || ' of ' || d.id || ' rests on it' AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
JOIN decomposition_child x ON x.concept_digest = d.concept_digest AND x.fsr_id = d.id
JOIN allocation a ON a.concept_digest = x.concept_digest AND a.fsr_id = x.child_id
WHERE NOT EXISTS (
    SELECT 1 FROM element_relation r
    WHERE r.concept_digest = a.concept_digest AND r.element_id = a.element_id
        AND r.kind = 'resource')

--

COMMENT ON VIEW v_check_independence_unknown IS 'e542831a2142f71158842de58d666ca58ea6fd6e954083f0dcd306c303009167'

--

CREATE VIEW v_check_common_cause AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    x.child_id || ' and ' || y.child_id || ' share ' || a.kind || ' ' || a.name AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
JOIN decomposition_child x ON x.concept_digest = d.concept_digest AND x.fsr_id = d.id
JOIN decomposition_child y ON y.concept_digest = x.concept_digest AND y.fsr_id = x.fsr_id
    AND y.child_id > x.child_id
JOIN v_fsr_causes a ON a.concept = x.concept_digest AND a.fsr = x.child_id
JOIN v_fsr_causes b ON b.concept = a.concept AND b.fsr = y.child_id AND b.kind = a.kind
    AND b.name = a.name
WHERE NOT EXISTS (
    SELECT 1 FROM json_each(d.content, '$.dfa') n
    JOIN dependent_failure w ON w.concept_digest = d.concept_digest AND w.id = n.value
    JOIN json_each(w.content, '$.covers') v ON TRUE
    WHERE v.value = a.name)

--

COMMENT ON VIEW v_check_common_cause IS '1a675ccc363b35941b01a57b9991c4bf92edfaf03c49cde1f6cbb9c7dacab334'

--

CREATE VIEW v_check_expired_dfa AS
SELECT c.id AS campaign, 'dependent_failure' AS part, w.id,
    'was valid until ' || w.valid_until AS detail
FROM campaign c
JOIN dependent_failure w ON w.concept_digest = c.concept_digest
WHERE w.valid_until < date('now')

--

COMMENT ON VIEW v_check_expired_dfa IS 'd5abd2d530342d2a43ff49da3319dc3161e7a1f88b68a45db70d7febd7d8c3e9'

--

CREATE VIEW v_check_expired_assumption AS
SELECT c.id AS campaign, 'assumption' AS part, a.id,
    'was valid until ' || a.valid_until || ', of ' || a.owner AS detail
FROM campaign c
JOIN assumption a ON a.concept_digest = c.concept_digest
WHERE a.valid_until < date('now')

--

COMMENT ON VIEW v_check_expired_assumption IS '11a6e8bf370489f07ef3a425dc8a3ea9472f60b07ede635afc1835ce50c297bf'

--

CREATE VIEW v_check_expired_waiver AS
SELECT c.id AS campaign, 'waiver' AS part, r.value AS id,
    'expired on ' || u.value AS detail
FROM campaign c
JOIN concept k ON k.digest = c.concept_digest
JOIN json_each(k.content, '$.waivers') w ON TRUE
JOIN json_each(w.value, '$.requirement') r ON TRUE
JOIN json_each(w.value, '$.expires') u ON TRUE
WHERE u.value < date('now')

--

COMMENT ON VIEW v_check_expired_waiver IS '97760e47fb889f67de663377391c56872a0a754f5a1ecb2324a8061eef4a50bf'

--

CREATE VIEW v_check_fhti_budget AS
SELECT c.id AS campaign, 'fsr' AS part, s.fsr AS id,
    'FDTI ' || s.fdti_s || ' s and FRTI ' || s.frti_s || ' s exceed the ' || g.ftti_s
        || ' s of ' || g.id AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
WHERE s.fdti_s + s.frti_s > g.ftti_s + 1e-9
UNION ALL
SELECT c.id, 'safety_goal', g.id, 'FDTI ' || b.fdti_s || ' s and FRTI ' || b.frti_s
    || ' s of its requirements exceed its ' || g.ftti_s || ' s'
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
JOIN (
    SELECT concept, goal, COALESCE(MAX(CASE WHEN frti_s IS NULL THEN fdti_s END), 0.0) AS fdti_s,
        COALESCE(MAX(CASE WHEN fdti_s IS NULL THEN frti_s END), 0.0) AS frti_s
    FROM v_fsr_goals GROUP BY concept, goal) b
    ON b.concept = g.concept_digest AND b.goal = g.id
WHERE b.fdti_s + b.frti_s > g.ftti_s + 1e-9

--

COMMENT ON VIEW v_check_fhti_budget IS 'e34267fef23d0c751bcbdcc4706a96132f14eb402d7de0d66edb7e49e38378a4'

--

CREATE VIEW v_check_emergency_operation AS
SELECT c.id AS campaign, 'fsr' AS part, s.fsr AS id,
    'emergency operation of ' || s.emergency_operation_s || ' s, and ' || g.id || ' tolerates '
        || COALESCE((SELECT CAST(value AS DOUBLE PRECISION) FROM json_each(g.content, '$.eotti')) || ' s', 'none')
        AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
WHERE s.emergency_operation_s
    > COALESCE((SELECT CAST(value AS DOUBLE PRECISION) FROM json_each(g.content, '$.eotti')), 0.0) + 1e-9

--

COMMENT ON VIEW v_check_emergency_operation IS '7a593dd619e8696739477209904979de00f368ea75b4614ef099195323713ca7'

--

CREATE VIEW v_check_response_beyond_budget AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'the formula gives ' || CASE w.type WHEN 'text' THEN 'unbounded time'
        ELSE w.value || ' s' END || ' to respond, fdti and frti give '
        || b.budget_s || ' s' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
JOIN json_each(f.content, '$.response_s') w ON TRUE
JOIN (
    SELECT DISTINCT concept, fsr, COALESCE(fdti_s, 0.0) + COALESCE(frti_s, 0.0) AS budget_s
    FROM v_fsr_goals WHERE COALESCE(fdti_s, frti_s) IS NOT NULL) b
    ON b.concept = f.concept_digest AND b.fsr = f.id
WHERE CASE w.type WHEN 'text' THEN 1e9 ELSE CAST(w.value AS DOUBLE PRECISION) END > b.budget_s + 1e-9

--

COMMENT ON VIEW v_check_response_beyond_budget IS '273dd7548abe0875eed48faac8fd212485a112404c2f9f81bc017b92b58dde56'

--

CREATE VIEW v_check_fsr_without_scenario AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'no planned test case judges it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM campaign_fsr p
    WHERE p.campaign_id = c.id AND p.fsr_id = f.id AND p.planned > 0)

--

COMMENT ON VIEW v_check_fsr_without_scenario IS '81b5327aff076d7f16dc45c05a94e566de78af0fd61cf15726bb9c7077df7a6f'

--

CREATE VIEW v_check_hazard_without_scenario AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    'no requirement of its goals is judged in ' || l.value AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
JOIN json_each(e.content, '$.scenarios') l ON TRUE
WHERE NOT EXISTS (
    SELECT 1 FROM v_goal_events g
    JOIN v_fsr_goals s ON s.concept = g.concept AND s.goal = g.goal
    JOIN campaign_fsr p ON p.campaign_id = c.id AND p.fsr_id = s.fsr AND p.scenario = l.value
    WHERE g.concept = e.concept_digest AND g.event = e.id AND p.planned > 0)
UNION ALL
SELECT c.id, 'hazardous_event', e.id, 'no requirement of its goals is judged anywhere'
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
WHERE e.asil <> 'QM' AND NOT EXISTS (SELECT 1 FROM json_each(e.content, '$.scenarios'))
    AND EXISTS (
        SELECT 1 FROM v_goal_events g JOIN v_fsr_goals s ON s.concept = g.concept
            AND s.goal = g.goal
        WHERE g.concept = e.concept_digest AND g.event = e.id)
    AND NOT EXISTS (
        SELECT 1 FROM v_goal_events g
        JOIN v_fsr_goals s ON s.concept = g.concept AND s.goal = g.goal
        JOIN campaign_fsr p ON p.campaign_id = c.id AND p.fsr_id = s.fsr
        WHERE g.concept = e.concept_digest AND g.event = e.id AND p.planned > 0)

--

COMMENT ON VIEW v_check_hazard_without_scenario IS '41b5bb920a1edfb23a096eb9c34d933583fdaace5f2f1cf41509394465ec85ac'

--

CREATE VIEW v_check_orphan_scenario AS
SELECT DISTINCT c.id AS campaign, 'scenario' AS part, n.value AS id,
    'no requirement is judged in it' AS detail
FROM campaign c
JOIN json_each(c.factors) x ON TRUE
JOIN json_each(x.value, '$.scenario') n ON TRUE
WHERE NOT EXISTS (
    SELECT 1 FROM campaign_fsr p
    WHERE p.campaign_id = c.id AND p.scenario = n.value AND p.planned > 0)

--

COMMENT ON VIEW v_check_orphan_scenario IS '0ee42cc684ac1cf74c995c59e1d34f4d47307d0803073c9eb8c5f66a4c6d6bc4'

--

CREATE VIEW v_check_not_applicable_in_gate AS
SELECT DISTINCT p.campaign_id AS campaign, 'fsr' AS part, p.fsr_id AS id,
    'not applicable to ' || p.architecture || ': ' || COALESCE(p.reason, 'no reason') AS detail
FROM campaign_fsr p
WHERE p.in_gate = 1 AND p.mandatory = 1 AND p.applicable = 0

--

COMMENT ON VIEW v_check_not_applicable_in_gate IS '402919523618d84c7e6e649a0b358f37fc0e69ac125a8a1e058130b922820093'

--

CREATE VIEW v_check_not_run AS
SELECT campaign, 'scenario' AS part, scenario AS id,
    SUM(planned - results) || ' of ' || SUM(planned) || ' test cases of ' || architecture
        || ' have no result' AS detail
FROM v_case_counts
GROUP BY campaign, scenario, architecture
HAVING SUM(results) < SUM(planned)

--

COMMENT ON VIEW v_check_not_run IS '6d245ed7384ab9c713bbc2e348bdf8abec6fb864ea4a59e4f15b64fc24d4a4cc'

--

CREATE VIEW v_check_stale_evidence AS
SELECT s.campaign_id AS campaign, 'fsr' AS part, s.fsr_id AS id,
    (SUM(s.results) - SUM(COALESCE(j.runs, 0))) || ' of ' || SUM(s.results)
        || ' results are not judged by it' AS detail
FROM (SELECT f.campaign_id, f.fsr_id, f.architecture, f.scenario, SUM(n.results) AS results
    FROM campaign_fsr f
    JOIN v_case_counts n ON n.campaign = f.campaign_id AND n.scenario = f.scenario
        AND n.architecture = f.architecture
        AND f.applies IN ('everywhere', CASE n.inside_odd WHEN 1 THEN 'inside' ELSE 'outside' END)
    WHERE f.applicable = 1
    GROUP BY f.campaign_id, f.fsr_id, f.architecture, f.scenario) s
LEFT JOIN (SELECT campaign_id, fsr_id, architecture, scenario, SUM(runs) AS runs
    FROM tally GROUP BY campaign_id, fsr_id, architecture, scenario) j ON j.campaign_id = s.campaign_id AND j.fsr_id = s.fsr_id
    AND j.architecture = s.architecture AND j.scenario = s.scenario
WHERE s.results > COALESCE(j.runs, 0)
GROUP BY s.campaign_id, s.fsr_id

--

COMMENT ON VIEW v_check_stale_evidence IS 'd48d0ebe0e396f14513e7f67baecc19ae0bb6585d22e657ee7ee088a7c18071c'

--

CREATE VIEW v_check_outside_odd AS
SELECT j.campaign_id AS campaign, 'fsr' AS part, j.fsr_id AS id,
    SUM(j.runs - COALESCE(s.planned, 0)) || ' runs too many are counted in ' || j.scenario
        AS detail
FROM (SELECT campaign_id, fsr_id, architecture, scenario, SUM(runs) AS runs
    FROM tally GROUP BY campaign_id, fsr_id, architecture, scenario) j
LEFT JOIN (SELECT f.campaign_id, f.fsr_id, f.architecture, f.scenario, SUM(n.planned) AS planned
    FROM campaign_fsr f
    JOIN v_case_counts n ON n.campaign = f.campaign_id AND n.scenario = f.scenario
        AND n.architecture = f.architecture
        AND f.applies IN ('everywhere', CASE n.inside_odd WHEN 1 THEN 'inside' ELSE 'outside' END)
    WHERE f.applicable = 1
    GROUP BY f.campaign_id, f.fsr_id, f.architecture, f.scenario) s ON s.campaign_id = j.campaign_id AND s.fsr_id = j.fsr_id
    AND s.architecture = j.architecture AND s.scenario = j.scenario
WHERE j.runs > COALESCE(s.planned, 0)
GROUP BY j.campaign_id, j.fsr_id, j.scenario

--

COMMENT ON VIEW v_check_outside_odd IS '0052435cdc74f5db1d508e56586194016eb04226b9f9a25e0c823d23ea22fb95'

--

CREATE VIEW v_check_older_version AS
SELECT k.campaign_id AS campaign, 'architecture' AS part, k.architecture AS id,
    COUNT(*) || ' runs are of numerics version ' || r.numerics_version || ', the newest is of '
        || (SELECT MAX(numerics_version) FROM run) AS detail
FROM campaign_case k JOIN run r ON r.result_digest = k.result_digest
WHERE r.numerics_version < (SELECT MAX(numerics_version) FROM run)
GROUP BY k.campaign_id, k.architecture, r.numerics_version
UNION ALL
SELECT k.campaign_id, 'architecture', k.architecture,
    COUNT(*) || ' runs were made before the code of its plug-ins changed'
FROM campaign_case k
JOIN run r ON r.result_digest = k.result_digest
JOIN test_case t ON t.digest = r.test_case_digest
JOIN (
    SELECT y.architecture_digest, MAX(x.number) AS number
    FROM run x JOIN test_case y ON y.digest = x.test_case_digest
    GROUP BY y.architecture_digest) n ON n.architecture_digest = t.architecture_digest
JOIN run last ON last.number = n.number
WHERE r.plugins_digest <> last.plugins_digest
GROUP BY k.campaign_id, k.architecture

--

COMMENT ON VIEW v_check_older_version IS 'bce7ab966ad178cd99e6bdaee691c46fb9fa336a5f1369fadbb48f27508b5a60'

--

CREATE VIEW v_check_vacuous_fsr AS
SELECT campaign_id AS campaign, 'fsr' AS part, fsr_id AS id,
    'exercised in none of ' || SUM(runs) || ' runs' AS detail
FROM tally
GROUP BY campaign_id, fsr_id
HAVING SUM(exercised) = 0

--

COMMENT ON VIEW v_check_vacuous_fsr IS '24fb75e42f74ff1af28405f5f9b9984d07cccdd12b5a4be7b66d7635340cdc09'

--

CREATE VIEW v_check AS
SELECT 'hazard_asil' AS rule, campaign, part, id, detail FROM v_check_hazard_asil
UNION ALL
SELECT 'hazard_without_goal' AS rule, campaign, part, id, detail FROM v_check_hazard_without_goal
UNION ALL
SELECT 'goal_asil' AS rule, campaign, part, id, detail FROM v_check_goal_asil
UNION ALL
SELECT 'goal_without_fsr' AS rule, campaign, part, id, detail FROM v_check_goal_without_fsr
UNION ALL
SELECT 'asil_lost' AS rule, campaign, part, id, detail FROM v_check_asil_lost
UNION ALL
SELECT 'fsr_without_allocation' AS rule, campaign, part, id, detail FROM v_check_fsr_without_allocation
UNION ALL
SELECT 'fsr_without_measure' AS rule, campaign, part, id, detail FROM v_check_fsr_without_measure
UNION ALL
SELECT 'threshold_without_source' AS rule, campaign, part, id, detail FROM v_check_threshold_without_source
UNION ALL
SELECT 'element_capability' AS rule, campaign, part, id, detail FROM v_check_element_capability
UNION ALL
SELECT 'illegal_decomposition' AS rule, campaign, part, id, detail FROM v_check_illegal_decomposition
UNION ALL
SELECT 'decomposition_elements' AS rule, campaign, part, id, detail FROM v_check_decomposition_elements
UNION ALL
SELECT 'independence_argument' AS rule, campaign, part, id, detail FROM v_check_independence_argument
UNION ALL
SELECT 'independence_unknown' AS rule, campaign, part, id, detail FROM v_check_independence_unknown
UNION ALL
SELECT 'common_cause' AS rule, campaign, part, id, detail FROM v_check_common_cause
UNION ALL
SELECT 'expired_dfa' AS rule, campaign, part, id, detail FROM v_check_expired_dfa
UNION ALL
SELECT 'expired_assumption' AS rule, campaign, part, id, detail FROM v_check_expired_assumption
UNION ALL
SELECT 'expired_waiver' AS rule, campaign, part, id, detail FROM v_check_expired_waiver
UNION ALL
SELECT 'fhti_budget' AS rule, campaign, part, id, detail FROM v_check_fhti_budget
UNION ALL
SELECT 'emergency_operation' AS rule, campaign, part, id, detail FROM v_check_emergency_operation
UNION ALL
SELECT 'response_beyond_budget' AS rule, campaign, part, id, detail FROM v_check_response_beyond_budget
UNION ALL
SELECT 'fsr_without_scenario' AS rule, campaign, part, id, detail FROM v_check_fsr_without_scenario
UNION ALL
SELECT 'hazard_without_scenario' AS rule, campaign, part, id, detail FROM v_check_hazard_without_scenario
UNION ALL
SELECT 'orphan_scenario' AS rule, campaign, part, id, detail FROM v_check_orphan_scenario
UNION ALL
SELECT 'not_applicable_in_gate' AS rule, campaign, part, id, detail FROM v_check_not_applicable_in_gate
UNION ALL
SELECT 'not_run' AS rule, campaign, part, id, detail FROM v_check_not_run
UNION ALL
SELECT 'stale_evidence' AS rule, campaign, part, id, detail FROM v_check_stale_evidence
UNION ALL
SELECT 'outside_odd' AS rule, campaign, part, id, detail FROM v_check_outside_odd
UNION ALL
SELECT 'older_version' AS rule, campaign, part, id, detail FROM v_check_older_version
UNION ALL
SELECT 'vacuous_fsr' AS rule, campaign, part, id, detail FROM v_check_vacuous_fsr

--

COMMENT ON VIEW v_check IS 'acbba94c939c735e3e2871a0d8579b91388d49e95cad78ecd5d64a288a0d3821'

--

CREATE VIEW v_campaigns AS
SELECT number, id AS campaign, odd_id AS odd, title, planned, created_at,
    ROW_NUMBER() OVER (ORDER BY COALESCE((
        SELECT MAX(u.number) FROM campaign_use u WHERE u.campaign_id = campaign.id), 0) DESC,
        number DESC) AS recency
FROM campaign

--

COMMENT ON VIEW v_campaigns IS 'cb6c6260de98b325ebc1719cce8043fb459380fbfb768cc52c3eba445d53efab'

--

CREATE VIEW v_uncertainty AS
SELECT campaign_id AS campaign, scenario, architecture, kind, name, unit, sampled, pairs, p95,
    largest, uncertainty, differing, changes
FROM uncertainty

--

COMMENT ON VIEW v_uncertainty IS '2918e9dc046df8e35929e84545a37aac1c652afcba5a9f37f249913de674924f'

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

--

COMMENT ON VIEW v_preventability IS '30b4aaa54acfdb71573e87e95bb14326a6886dcae2e6c65e53699581e462f00d'
