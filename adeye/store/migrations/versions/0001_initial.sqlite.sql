-- Schema 0001 for SQLite. A line of two dashes stands between statements.

--

CREATE TABLE odd (
	digest VARCHAR(64) NOT NULL,
	id TEXT NOT NULL,
	version TEXT NOT NULL,
	content TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_odd PRIMARY KEY (digest)
)

--

CREATE TABLE scenario (
	digest VARCHAR(64) NOT NULL,
	id TEXT NOT NULL,
	version TEXT NOT NULL,
	content TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_scenario PRIMARY KEY (digest)
)

--

CREATE TABLE architecture (
	digest VARCHAR(64) NOT NULL,
	id TEXT NOT NULL,
	version TEXT NOT NULL,
	content TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_architecture PRIMARY KEY (digest)
)

--

CREATE TABLE concept (
	digest VARCHAR(64) NOT NULL,
	id TEXT NOT NULL,
	version TEXT NOT NULL,
	content TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_concept PRIMARY KEY (digest)
)

--

CREATE TABLE hazardous_event (
	concept_digest VARCHAR(64) NOT NULL,
	id TEXT NOT NULL,
	severity TEXT NOT NULL,
	exposure TEXT NOT NULL,
	controllability TEXT NOT NULL,
	asil TEXT,
	content TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_hazardous_event PRIMARY KEY (concept_digest, id),
	CONSTRAINT fk_hazardous_event_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE safety_goal (
	concept_digest VARCHAR(64) NOT NULL,
	id TEXT NOT NULL,
	asil TEXT NOT NULL,
	ftti_s FLOAT NOT NULL,
	safe_state TEXT NOT NULL,
	text TEXT NOT NULL,
	content TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_safety_goal PRIMARY KEY (concept_digest, id),
	CONSTRAINT fk_safety_goal_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE fsr (
	concept_digest VARCHAR(64) NOT NULL,
	id TEXT NOT NULL,
	asil TEXT NOT NULL,
	mandatory BOOLEAN NOT NULL,
	min_exercised INTEGER NOT NULL,
	text TEXT NOT NULL,
	measure TEXT NOT NULL,
	threshold_source TEXT NOT NULL,
	content TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_fsr PRIMARY KEY (concept_digest, id),
	CONSTRAINT fk_fsr_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE element (
	concept_digest VARCHAR(64) NOT NULL,
	id TEXT NOT NULL,
	kind TEXT NOT NULL,
	asil_capability TEXT NOT NULL,
	legacy BOOLEAN NOT NULL,
	text TEXT NOT NULL,
	content TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_element PRIMARY KEY (concept_digest, id),
	CONSTRAINT fk_element_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE assumption (
	concept_digest VARCHAR(64) NOT NULL,
	id TEXT NOT NULL,
	owner TEXT NOT NULL,
	valid_until TEXT NOT NULL,
	text TEXT NOT NULL,
	content TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_assumption PRIMARY KEY (concept_digest, id),
	CONSTRAINT fk_assumption_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE test_case (
	digest VARCHAR(64) NOT NULL,
	situation_digest VARCHAR(64) NOT NULL,
	scenario_digest VARCHAR(64) NOT NULL,
	architecture_digest VARCHAR(64) NOT NULL,
	fault_entry TEXT NOT NULL,
	faults TEXT NOT NULL,
	parameters TEXT NOT NULL,
	replicate INTEGER NOT NULL,
	seed BIGINT NOT NULL,
	step_s FLOAT NOT NULL,
	odd_digest VARCHAR(64) NOT NULL,
	point_index INTEGER NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_test_case PRIMARY KEY (digest),
	CONSTRAINT fk_test_case_scenario_digest FOREIGN KEY(scenario_digest) REFERENCES scenario (digest),
	CONSTRAINT fk_test_case_architecture_digest FOREIGN KEY(architecture_digest) REFERENCES architecture (digest),
	CONSTRAINT fk_test_case_odd_digest FOREIGN KEY(odd_digest) REFERENCES odd (digest)
)

--

CREATE INDEX ix_test_case_situation_digest ON test_case (situation_digest)

--

CREATE TABLE campaign (
	number INTEGER NOT NULL,
	id VARCHAR(32) NOT NULL,
	created_at TEXT NOT NULL,
	odd_id TEXT NOT NULL,
	odd_digest VARCHAR(64) NOT NULL,
	concept_digest VARCHAR(64) NOT NULL,
	title TEXT NOT NULL,
	planned INTEGER NOT NULL,
	factors TEXT NOT NULL,
	gate TEXT NOT NULL,
	units TEXT NOT NULL,
	judging TEXT NOT NULL,
	judging_hash VARCHAR(64) NOT NULL,
	provenance TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_campaign PRIMARY KEY (number),
	CONSTRAINT uq_campaign_id UNIQUE (id),
	CONSTRAINT fk_campaign_odd_digest FOREIGN KEY(odd_digest) REFERENCES odd (digest),
	CONSTRAINT fk_campaign_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE allocation (
	concept_digest VARCHAR(64) NOT NULL,
	fsr_id TEXT NOT NULL,
	element_id TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_allocation PRIMARY KEY (concept_digest, fsr_id, element_id),
	CONSTRAINT fk_allocation_concept_digest_fsr_id FOREIGN KEY(concept_digest, fsr_id) REFERENCES fsr (concept_digest, id),
	CONSTRAINT fk_allocation_concept_digest_element_id FOREIGN KEY(concept_digest, element_id) REFERENCES element (concept_digest, id)
)

--

CREATE TABLE campaign_case (
	campaign_id VARCHAR(32) NOT NULL,
	ordinal INTEGER NOT NULL,
	test_case_digest VARCHAR(64) NOT NULL,
	result_digest VARCHAR(64) NOT NULL,
	scenario TEXT NOT NULL,
	architecture TEXT NOT NULL,
	inside_odd BOOLEAN NOT NULL,
	point TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_campaign_case PRIMARY KEY (campaign_id, ordinal),
	CONSTRAINT fk_campaign_case_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id),
	CONSTRAINT fk_campaign_case_test_case_digest FOREIGN KEY(test_case_digest) REFERENCES test_case (digest)
)

--

CREATE INDEX ix_campaign_case_test_case_digest_campaign_id ON campaign_case (test_case_digest, campaign_id)

--

CREATE INDEX ix_campaign_case_result_digest ON campaign_case (result_digest)

--

CREATE TABLE campaign_fsr (
	campaign_id VARCHAR(32) NOT NULL,
	fsr_id TEXT NOT NULL,
	architecture TEXT NOT NULL,
	scenario TEXT NOT NULL,
	fsr_digest VARCHAR(64) NOT NULL,
	asil TEXT NOT NULL,
	mandatory BOOLEAN NOT NULL,
	min_exercised INTEGER NOT NULL,
	applies TEXT NOT NULL,
	in_gate BOOLEAN NOT NULL,
	applicable BOOLEAN NOT NULL,
	reason TEXT,
	waived_until TEXT,
	planned INTEGER NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_campaign_fsr PRIMARY KEY (campaign_id, fsr_id, architecture, scenario),
	CONSTRAINT ck_campaign_fsr_applies CHECK (applies = 'inside' OR applies = 'outside' OR applies = 'everywhere'),
	CONSTRAINT fk_campaign_fsr_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TABLE work (
	id INTEGER NOT NULL,
	campaign_id VARCHAR(32) NOT NULL,
	kind TEXT NOT NULL,
	from_ordinal INTEGER NOT NULL,
	to_ordinal INTEGER NOT NULL,
	state TEXT NOT NULL,
	owner TEXT,
	attempt INTEGER NOT NULL,
	failures INTEGER NOT NULL,
	until TEXT,
	until_boot_s FLOAT,
	detail TEXT,
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

CREATE TABLE run (
	number INTEGER NOT NULL,
	result_digest VARCHAR(64) NOT NULL,
	test_case_digest VARCHAR(64) NOT NULL,
	backend TEXT NOT NULL,
	variant TEXT NOT NULL,
	numerics_version INTEGER NOT NULL,
	plugins_digest TEXT NOT NULL,
	outcome TEXT NOT NULL,
	outcome_channel TEXT,
	outcome_detail TEXT,
	trace_rows INTEGER NOT NULL,
	duration_s FLOAT NOT NULL,
	trace_digest VARCHAR(32) NOT NULL,
	realised BOOLEAN NOT NULL,
	end_reason TEXT NOT NULL,
	machine_dependent BOOLEAN NOT NULL,
	result_hash VARCHAR(64) NOT NULL,
	executed_by TEXT NOT NULL,
	executed_at TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_run PRIMARY KEY (number),
	CONSTRAINT uq_run_result_digest UNIQUE (result_digest),
	CONSTRAINT fk_run_test_case_digest FOREIGN KEY(test_case_digest) REFERENCES test_case (digest)
)

--

CREATE TABLE metric (
	run_number INTEGER NOT NULL,
	contact FLOAT,
	contact_status TEXT NOT NULL,
	contact_time_s FLOAT,
	contact_actor TEXT,
	impact_speed_mps FLOAT,
	impact_speed_mps_status TEXT NOT NULL,
	impact_speed_mps_time_s FLOAT,
	impact_speed_mps_actor TEXT,
	min_distance_m FLOAT,
	min_distance_m_status TEXT NOT NULL,
	min_distance_m_time_s FLOAT,
	min_distance_m_actor TEXT,
	min_ttc_s FLOAT,
	min_ttc_s_status TEXT NOT NULL,
	min_ttc_s_time_s FLOAT,
	min_ttc_s_actor TEXT,
	min_time_headway_s FLOAT,
	min_time_headway_s_status TEXT NOT NULL,
	min_time_headway_s_time_s FLOAT,
	min_time_headway_s_actor TEXT,
	max_drac_mps2 FLOAT,
	max_drac_mps2_status TEXT NOT NULL,
	max_drac_mps2_time_s FLOAT,
	max_drac_mps2_actor TEXT,
	max_required_deceleration_mps2 FLOAT,
	max_required_deceleration_mps2_status TEXT NOT NULL,
	max_required_deceleration_mps2_time_s FLOAT,
	max_required_deceleration_mps2_actor TEXT,
	rss_violation_s FLOAT,
	rss_violation_s_status TEXT NOT NULL,
	rss_violation_s_time_s FLOAT,
	rss_violation_s_actor TEXT,
	fault_to_safe_state_s FLOAT,
	fault_to_safe_state_s_status TEXT NOT NULL,
	fault_to_safe_state_s_time_s FLOAT,
	fault_to_safe_state_s_actor TEXT,
	max_jerk_mps3 FLOAT,
	max_jerk_mps3_status TEXT NOT NULL,
	max_jerk_mps3_time_s FLOAT,
	max_jerk_mps3_actor TEXT,
	max_deceleration_mps2 FLOAT,
	max_deceleration_mps2_status TEXT NOT NULL,
	max_deceleration_mps2_time_s FLOAT,
	max_deceleration_mps2_actor TEXT,
	max_lane_offset_m FLOAT,
	max_lane_offset_m_status TEXT NOT NULL,
	max_lane_offset_m_time_s FLOAT,
	max_lane_offset_m_actor TEXT,
	first_detection_distance_m FLOAT,
	first_detection_distance_m_status TEXT NOT NULL,
	first_detection_distance_m_time_s FLOAT,
	first_detection_distance_m_actor TEXT,
	takeover_time_s FLOAT,
	takeover_time_s_status TEXT NOT NULL,
	takeover_time_s_time_s FLOAT,
	takeover_time_s_actor TEXT,
	standstill_gap_m FLOAT,
	standstill_gap_m_status TEXT NOT NULL,
	standstill_gap_m_time_s FLOAT,
	standstill_gap_m_actor TEXT,
	detection_latency_s FLOAT,
	detection_latency_s_status TEXT NOT NULL,
	detection_latency_s_time_s FLOAT,
	detection_latency_s_actor TEXT,
	missed_time_s FLOAT,
	missed_time_s_status TEXT NOT NULL,
	missed_time_s_time_s FLOAT,
	missed_time_s_actor TEXT,
	false_track_time_s FLOAT,
	false_track_time_s_status TEXT NOT NULL,
	false_track_time_s_time_s FLOAT,
	false_track_time_s_actor TEXT,
	range_error_rms_m FLOAT,
	range_error_rms_m_status TEXT NOT NULL,
	range_error_rms_m_time_s FLOAT,
	range_error_rms_m_actor TEXT,
	position_error_p95_m FLOAT,
	position_error_p95_m_status TEXT NOT NULL,
	position_error_p95_m_time_s FLOAT,
	position_error_p95_m_actor TEXT,
	rear_detection_margin_m FLOAT,
	rear_detection_margin_m_status TEXT NOT NULL,
	rear_detection_margin_m_time_s FLOAT,
	rear_detection_margin_m_actor TEXT,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_metric PRIMARY KEY (run_number),
	CONSTRAINT ck_metric_contact CHECK (CASE contact_status WHEN 'value' THEN contact IS NOT NULL WHEN 'no_conflict' THEN contact IS NULL WHEN 'not_applicable' THEN contact IS NULL WHEN 'undefined' THEN contact IS NULL WHEN 'incomplete' THEN contact IS NULL WHEN 'error' THEN contact IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_impact_speed_mps CHECK (CASE impact_speed_mps_status WHEN 'value' THEN impact_speed_mps IS NOT NULL WHEN 'no_conflict' THEN impact_speed_mps IS NULL WHEN 'not_applicable' THEN impact_speed_mps IS NULL WHEN 'undefined' THEN impact_speed_mps IS NULL WHEN 'incomplete' THEN impact_speed_mps IS NULL WHEN 'error' THEN impact_speed_mps IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_min_distance_m CHECK (CASE min_distance_m_status WHEN 'value' THEN min_distance_m IS NOT NULL WHEN 'no_conflict' THEN min_distance_m IS NULL WHEN 'not_applicable' THEN min_distance_m IS NULL WHEN 'undefined' THEN min_distance_m IS NULL WHEN 'incomplete' THEN min_distance_m IS NULL WHEN 'error' THEN min_distance_m IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_min_ttc_s CHECK (CASE min_ttc_s_status WHEN 'value' THEN min_ttc_s IS NOT NULL WHEN 'no_conflict' THEN min_ttc_s IS NULL WHEN 'not_applicable' THEN min_ttc_s IS NULL WHEN 'undefined' THEN min_ttc_s IS NULL WHEN 'incomplete' THEN min_ttc_s IS NULL WHEN 'error' THEN min_ttc_s IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_min_time_headway_s CHECK (CASE min_time_headway_s_status WHEN 'value' THEN min_time_headway_s IS NOT NULL WHEN 'no_conflict' THEN min_time_headway_s IS NULL WHEN 'not_applicable' THEN min_time_headway_s IS NULL WHEN 'undefined' THEN min_time_headway_s IS NULL WHEN 'incomplete' THEN min_time_headway_s IS NULL WHEN 'error' THEN min_time_headway_s IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_max_drac_mps2 CHECK (CASE max_drac_mps2_status WHEN 'value' THEN max_drac_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_drac_mps2 IS NULL WHEN 'not_applicable' THEN max_drac_mps2 IS NULL WHEN 'undefined' THEN max_drac_mps2 IS NULL WHEN 'incomplete' THEN max_drac_mps2 IS NULL WHEN 'error' THEN max_drac_mps2 IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_max_required_deceleration_mps2 CHECK (CASE max_required_deceleration_mps2_status WHEN 'value' THEN max_required_deceleration_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_required_deceleration_mps2 IS NULL WHEN 'not_applicable' THEN max_required_deceleration_mps2 IS NULL WHEN 'undefined' THEN max_required_deceleration_mps2 IS NULL WHEN 'incomplete' THEN max_required_deceleration_mps2 IS NULL WHEN 'error' THEN max_required_deceleration_mps2 IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_rss_violation_s CHECK (CASE rss_violation_s_status WHEN 'value' THEN rss_violation_s IS NOT NULL WHEN 'no_conflict' THEN rss_violation_s IS NULL WHEN 'not_applicable' THEN rss_violation_s IS NULL WHEN 'undefined' THEN rss_violation_s IS NULL WHEN 'incomplete' THEN rss_violation_s IS NULL WHEN 'error' THEN rss_violation_s IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_fault_to_safe_state_s CHECK (CASE fault_to_safe_state_s_status WHEN 'value' THEN fault_to_safe_state_s IS NOT NULL WHEN 'no_conflict' THEN fault_to_safe_state_s IS NULL WHEN 'not_applicable' THEN fault_to_safe_state_s IS NULL WHEN 'undefined' THEN fault_to_safe_state_s IS NULL WHEN 'incomplete' THEN fault_to_safe_state_s IS NULL WHEN 'error' THEN fault_to_safe_state_s IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_max_jerk_mps3 CHECK (CASE max_jerk_mps3_status WHEN 'value' THEN max_jerk_mps3 IS NOT NULL WHEN 'no_conflict' THEN max_jerk_mps3 IS NULL WHEN 'not_applicable' THEN max_jerk_mps3 IS NULL WHEN 'undefined' THEN max_jerk_mps3 IS NULL WHEN 'incomplete' THEN max_jerk_mps3 IS NULL WHEN 'error' THEN max_jerk_mps3 IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_max_deceleration_mps2 CHECK (CASE max_deceleration_mps2_status WHEN 'value' THEN max_deceleration_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_deceleration_mps2 IS NULL WHEN 'not_applicable' THEN max_deceleration_mps2 IS NULL WHEN 'undefined' THEN max_deceleration_mps2 IS NULL WHEN 'incomplete' THEN max_deceleration_mps2 IS NULL WHEN 'error' THEN max_deceleration_mps2 IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_max_lane_offset_m CHECK (CASE max_lane_offset_m_status WHEN 'value' THEN max_lane_offset_m IS NOT NULL WHEN 'no_conflict' THEN max_lane_offset_m IS NULL WHEN 'not_applicable' THEN max_lane_offset_m IS NULL WHEN 'undefined' THEN max_lane_offset_m IS NULL WHEN 'incomplete' THEN max_lane_offset_m IS NULL WHEN 'error' THEN max_lane_offset_m IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_first_detection_distance_m CHECK (CASE first_detection_distance_m_status WHEN 'value' THEN first_detection_distance_m IS NOT NULL WHEN 'no_conflict' THEN first_detection_distance_m IS NULL WHEN 'not_applicable' THEN first_detection_distance_m IS NULL WHEN 'undefined' THEN first_detection_distance_m IS NULL WHEN 'incomplete' THEN first_detection_distance_m IS NULL WHEN 'error' THEN first_detection_distance_m IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_takeover_time_s CHECK (CASE takeover_time_s_status WHEN 'value' THEN takeover_time_s IS NOT NULL WHEN 'no_conflict' THEN takeover_time_s IS NULL WHEN 'not_applicable' THEN takeover_time_s IS NULL WHEN 'undefined' THEN takeover_time_s IS NULL WHEN 'incomplete' THEN takeover_time_s IS NULL WHEN 'error' THEN takeover_time_s IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_standstill_gap_m CHECK (CASE standstill_gap_m_status WHEN 'value' THEN standstill_gap_m IS NOT NULL WHEN 'no_conflict' THEN standstill_gap_m IS NULL WHEN 'not_applicable' THEN standstill_gap_m IS NULL WHEN 'undefined' THEN standstill_gap_m IS NULL WHEN 'incomplete' THEN standstill_gap_m IS NULL WHEN 'error' THEN standstill_gap_m IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_detection_latency_s CHECK (CASE detection_latency_s_status WHEN 'value' THEN detection_latency_s IS NOT NULL WHEN 'no_conflict' THEN detection_latency_s IS NULL WHEN 'not_applicable' THEN detection_latency_s IS NULL WHEN 'undefined' THEN detection_latency_s IS NULL WHEN 'incomplete' THEN detection_latency_s IS NULL WHEN 'error' THEN detection_latency_s IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_missed_time_s CHECK (CASE missed_time_s_status WHEN 'value' THEN missed_time_s IS NOT NULL WHEN 'no_conflict' THEN missed_time_s IS NULL WHEN 'not_applicable' THEN missed_time_s IS NULL WHEN 'undefined' THEN missed_time_s IS NULL WHEN 'incomplete' THEN missed_time_s IS NULL WHEN 'error' THEN missed_time_s IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_false_track_time_s CHECK (CASE false_track_time_s_status WHEN 'value' THEN false_track_time_s IS NOT NULL WHEN 'no_conflict' THEN false_track_time_s IS NULL WHEN 'not_applicable' THEN false_track_time_s IS NULL WHEN 'undefined' THEN false_track_time_s IS NULL WHEN 'incomplete' THEN false_track_time_s IS NULL WHEN 'error' THEN false_track_time_s IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_range_error_rms_m CHECK (CASE range_error_rms_m_status WHEN 'value' THEN range_error_rms_m IS NOT NULL WHEN 'no_conflict' THEN range_error_rms_m IS NULL WHEN 'not_applicable' THEN range_error_rms_m IS NULL WHEN 'undefined' THEN range_error_rms_m IS NULL WHEN 'incomplete' THEN range_error_rms_m IS NULL WHEN 'error' THEN range_error_rms_m IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_position_error_p95_m CHECK (CASE position_error_p95_m_status WHEN 'value' THEN position_error_p95_m IS NOT NULL WHEN 'no_conflict' THEN position_error_p95_m IS NULL WHEN 'not_applicable' THEN position_error_p95_m IS NULL WHEN 'undefined' THEN position_error_p95_m IS NULL WHEN 'incomplete' THEN position_error_p95_m IS NULL WHEN 'error' THEN position_error_p95_m IS NULL ELSE 0 END),
	CONSTRAINT ck_metric_rear_detection_margin_m CHECK (CASE rear_detection_margin_m_status WHEN 'value' THEN rear_detection_margin_m IS NOT NULL WHEN 'no_conflict' THEN rear_detection_margin_m IS NULL WHEN 'not_applicable' THEN rear_detection_margin_m IS NULL WHEN 'undefined' THEN rear_detection_margin_m IS NULL WHEN 'incomplete' THEN rear_detection_margin_m IS NULL WHEN 'error' THEN rear_detection_margin_m IS NULL ELSE 0 END),
	CONSTRAINT fk_metric_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE verdict (
	run_number INTEGER NOT NULL,
	fsr_digest VARCHAR(64) NOT NULL,
	fsr_id TEXT NOT NULL,
	verdict TEXT NOT NULL,
	robustness_low FLOAT,
	robustness_high FLOAT,
	margin FLOAT,
	unit TEXT,
	signal TEXT,
	predicate TEXT,
	time_s FLOAT,
	actor TEXT,
	value FLOAT,
	threshold FLOAT,
	exercised BOOLEAN NOT NULL,
	detail TEXT,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_verdict PRIMARY KEY (run_number, fsr_digest),
	CONSTRAINT ck_verdict_verdict CHECK (verdict = 'PASS' OR verdict = 'FAIL' OR verdict = 'INCONCLUSIVE' OR verdict = 'VACUOUS' OR verdict = 'INVALID' OR verdict = 'ERROR'),
	CONSTRAINT fk_verdict_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)
 WITHOUT ROWID

--

CREATE TABLE event (
	run_number INTEGER NOT NULL,
	seq INTEGER NOT NULL,
	time_s FLOAT NOT NULL,
	kind TEXT NOT NULL,
	subject TEXT,
	text TEXT NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
	CONSTRAINT pk_event PRIMARY KEY (run_number, seq),
	CONSTRAINT fk_event_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)
 WITHOUT ROWID

--

CREATE TABLE tally (
	work_id INTEGER NOT NULL,
	campaign_id VARCHAR(32) NOT NULL,
	fsr_id TEXT NOT NULL,
	fsr_digest VARCHAR(64) NOT NULL,
	architecture TEXT NOT NULL,
	scenario TEXT NOT NULL,
	verdict TEXT NOT NULL,
	runs INTEGER NOT NULL,
	exercised INTEGER NOT NULL,
	worst_robustness FLOAT,
	worst_margin FLOAT,
	worst_unit TEXT,
	worst_result_digest VARCHAR(64) NOT NULL,
	row_hash VARCHAR(32) NOT NULL,
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

CREATE TABLE artifact (
	digest VARCHAR(64) NOT NULL,
	kind TEXT NOT NULL,
	result_digest VARCHAR(64),
	bytes INTEGER NOT NULL,
	created_at TEXT NOT NULL,
	CONSTRAINT pk_artifact PRIMARY KEY (digest),
	CONSTRAINT fk_artifact_result_digest FOREIGN KEY(result_digest) REFERENCES run (result_digest)
)

--

CREATE INDEX ix_artifact_result_digest ON artifact (result_digest)

--

CREATE TRIGGER architecture_no_update BEFORE UPDATE ON architecture
BEGIN SELECT RAISE(ABORT, 'architecture is insert-only'); END

--

CREATE TRIGGER architecture_no_delete BEFORE DELETE ON architecture
BEGIN SELECT RAISE(ABORT, 'architecture is insert-only'); END

--

CREATE TRIGGER concept_no_update BEFORE UPDATE ON concept
BEGIN SELECT RAISE(ABORT, 'concept is insert-only'); END

--

CREATE TRIGGER concept_no_delete BEFORE DELETE ON concept
BEGIN SELECT RAISE(ABORT, 'concept is insert-only'); END

--

CREATE TRIGGER odd_no_update BEFORE UPDATE ON odd
BEGIN SELECT RAISE(ABORT, 'odd is insert-only'); END

--

CREATE TRIGGER odd_no_delete BEFORE DELETE ON odd
BEGIN SELECT RAISE(ABORT, 'odd is insert-only'); END

--

CREATE TRIGGER scenario_no_update BEFORE UPDATE ON scenario
BEGIN SELECT RAISE(ABORT, 'scenario is insert-only'); END

--

CREATE TRIGGER scenario_no_delete BEFORE DELETE ON scenario
BEGIN SELECT RAISE(ABORT, 'scenario is insert-only'); END

--

CREATE TRIGGER assumption_no_update BEFORE UPDATE ON assumption
BEGIN SELECT RAISE(ABORT, 'assumption is insert-only'); END

--

CREATE TRIGGER assumption_no_delete BEFORE DELETE ON assumption
BEGIN SELECT RAISE(ABORT, 'assumption is insert-only'); END

--

CREATE TRIGGER campaign_no_update BEFORE UPDATE ON campaign
BEGIN SELECT RAISE(ABORT, 'campaign is insert-only'); END

--

CREATE TRIGGER campaign_no_delete BEFORE DELETE ON campaign
BEGIN SELECT RAISE(ABORT, 'campaign is insert-only'); END

--

CREATE TRIGGER element_no_update BEFORE UPDATE ON element
BEGIN SELECT RAISE(ABORT, 'element is insert-only'); END

--

CREATE TRIGGER element_no_delete BEFORE DELETE ON element
BEGIN SELECT RAISE(ABORT, 'element is insert-only'); END

--

CREATE TRIGGER fsr_no_update BEFORE UPDATE ON fsr
BEGIN SELECT RAISE(ABORT, 'fsr is insert-only'); END

--

CREATE TRIGGER fsr_no_delete BEFORE DELETE ON fsr
BEGIN SELECT RAISE(ABORT, 'fsr is insert-only'); END

--

CREATE TRIGGER hazardous_event_no_update BEFORE UPDATE ON hazardous_event
BEGIN SELECT RAISE(ABORT, 'hazardous_event is insert-only'); END

--

CREATE TRIGGER hazardous_event_no_delete BEFORE DELETE ON hazardous_event
BEGIN SELECT RAISE(ABORT, 'hazardous_event is insert-only'); END

--

CREATE TRIGGER safety_goal_no_update BEFORE UPDATE ON safety_goal
BEGIN SELECT RAISE(ABORT, 'safety_goal is insert-only'); END

--

CREATE TRIGGER safety_goal_no_delete BEFORE DELETE ON safety_goal
BEGIN SELECT RAISE(ABORT, 'safety_goal is insert-only'); END

--

CREATE TRIGGER test_case_no_update BEFORE UPDATE ON test_case
BEGIN SELECT RAISE(ABORT, 'test_case is insert-only'); END

--

CREATE TRIGGER test_case_no_delete BEFORE DELETE ON test_case
BEGIN SELECT RAISE(ABORT, 'test_case is insert-only'); END

--

CREATE TRIGGER allocation_no_update BEFORE UPDATE ON allocation
BEGIN SELECT RAISE(ABORT, 'allocation is insert-only'); END

--

CREATE TRIGGER allocation_no_delete BEFORE DELETE ON allocation
BEGIN SELECT RAISE(ABORT, 'allocation is insert-only'); END

--

CREATE TRIGGER campaign_case_no_update BEFORE UPDATE ON campaign_case
BEGIN SELECT RAISE(ABORT, 'campaign_case is insert-only'); END

--

CREATE TRIGGER campaign_case_no_delete BEFORE DELETE ON campaign_case
BEGIN SELECT RAISE(ABORT, 'campaign_case is insert-only'); END

--

CREATE TRIGGER campaign_fsr_no_update BEFORE UPDATE ON campaign_fsr
BEGIN SELECT RAISE(ABORT, 'campaign_fsr is insert-only'); END

--

CREATE TRIGGER campaign_fsr_no_delete BEFORE DELETE ON campaign_fsr
BEGIN SELECT RAISE(ABORT, 'campaign_fsr is insert-only'); END

--

CREATE TRIGGER run_no_update BEFORE UPDATE ON run
BEGIN SELECT RAISE(ABORT, 'run is insert-only'); END

--

CREATE TRIGGER run_no_delete BEFORE DELETE ON run
BEGIN SELECT RAISE(ABORT, 'run is insert-only'); END

--

CREATE TRIGGER event_no_update BEFORE UPDATE ON event
BEGIN SELECT RAISE(ABORT, 'event is insert-only'); END

--

CREATE TRIGGER event_no_delete BEFORE DELETE ON event
BEGIN SELECT RAISE(ABORT, 'event is insert-only'); END

--

CREATE TRIGGER metric_no_update BEFORE UPDATE ON metric
BEGIN SELECT RAISE(ABORT, 'metric is insert-only'); END

--

CREATE TRIGGER metric_no_delete BEFORE DELETE ON metric
BEGIN SELECT RAISE(ABORT, 'metric is insert-only'); END

--

CREATE TRIGGER tally_no_update BEFORE UPDATE ON tally
BEGIN SELECT RAISE(ABORT, 'tally is insert-only'); END

--

CREATE TRIGGER tally_no_delete BEFORE DELETE ON tally
BEGIN SELECT RAISE(ABORT, 'tally is insert-only'); END

--

CREATE TRIGGER verdict_no_update BEFORE UPDATE ON verdict
BEGIN SELECT RAISE(ABORT, 'verdict is insert-only'); END

--

CREATE TRIGGER verdict_no_delete BEFORE DELETE ON verdict
BEGIN SELECT RAISE(ABORT, 'verdict is insert-only'); END

--

CREATE VIEW v_verdicts AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    c.result_digest AS run, c.test_case_digest AS test_case, f.fsr_id AS fsr, f.asil, f.mandatory,
    COALESCE(v.verdict, 'NOT_RUN') AS verdict, v.exercised, v.margin, v.unit, v.robustness_low,
    v.robustness_high, v.signal, v.predicate, v.time_s, v.actor, v.value, v.threshold, v.detail
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN campaign_fsr f ON f.campaign_id = c.campaign_id AND f.architecture = c.architecture
    AND f.scenario = c.scenario AND f.applicable
    AND CASE f.applies WHEN 'everywhere' THEN 1 WHEN 'inside' THEN c.inside_odd
        ELSE NOT c.inside_odd END
LEFT JOIN run r ON r.result_digest = c.result_digest
LEFT JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest

--

CREATE VIEW v_runs AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    t.replicate, t.seed, c.inside_odd, t.parameters, c.point, r.result_digest AS run,
    t.digest AS test_case, t.situation_digest AS situation, r.outcome, r.outcome_channel,
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
    (SELECT '{' || COALESCE(group_concat('"' || fsr || '":"' || verdict || '"'), '') || '}'
        FROM (
            SELECT v.fsr, v.verdict FROM v_verdicts v
            WHERE v.campaign = c.campaign_id AND v.ordinal = c.ordinal ORDER BY v.fsr)
        ) AS verdicts
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN run r ON r.result_digest = c.result_digest
JOIN metric m ON m.run_number = r.number

--

CREATE VIEW v_fsr_status AS
WITH counted AS (
    SELECT campaign_id, fsr_id, architecture, scenario, SUM(runs) AS judged,
        SUM(exercised) AS exercised,
        SUM(CASE verdict WHEN 'FAIL' THEN runs ELSE 0 END) AS n_fail,
    SUM(CASE verdict WHEN 'ERROR' THEN runs ELSE 0 END) AS n_error,
    SUM(CASE verdict WHEN 'INVALID' THEN runs ELSE 0 END) AS n_invalid,
    SUM(CASE verdict WHEN 'INCONCLUSIVE' THEN runs ELSE 0 END) AS n_inconclusive,
    SUM(CASE verdict WHEN 'VACUOUS' THEN runs ELSE 0 END) AS n_vacuous,
    SUM(CASE verdict WHEN 'PASS' THEN runs ELSE 0 END) AS n_pass
    FROM tally GROUP BY campaign_id, fsr_id, architecture, scenario),
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
    CASE WHEN NOT f.applicable THEN NULL WHEN f.planned = 0 THEN 'NOT_RUN' WHEN n_fail > 0 THEN 'FAIL' WHEN n_error > 0 THEN 'ERROR' WHEN n_invalid > 0 THEN 'INVALID' WHEN n_inconclusive > 0 THEN 'INCONCLUSIVE' WHEN f.planned > COALESCE(n.judged, 0) THEN 'NOT_RUN' WHEN n_pass >= 1 THEN 'PASS' ELSE 'VACUOUS' END AS verdict
FROM campaign_fsr f
LEFT JOIN counted n ON n.campaign_id = f.campaign_id AND n.fsr_id = f.fsr_id
    AND n.architecture = f.architecture AND n.scenario = f.scenario
LEFT JOIN worst w ON w.campaign_id = f.campaign_id AND w.fsr_id = f.fsr_id
    AND w.architecture = f.architecture AND w.scenario = f.scenario AND w.place = 1

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
    FROM v_fsr_status WHERE mandatory
    GROUP BY campaign, architecture, fsr),
worst AS (
    SELECT campaign, architecture, fsr, worst_margin, unit, worst_robustness, worst_run,
        ROW_NUMBER() OVER (
            PARTITION BY campaign, architecture, fsr
            ORDER BY n_fail > 0 DESC, (worst_robustness IS NULL) = (n_fail = 0),
                worst_robustness, worst_run) AS place
    FROM v_fsr_status WHERE worst_run IS NOT NULL)
SELECT s.*, w.worst_margin, w.unit, w.worst_robustness, w.worst_run,
    CASE WHEN NOT s.applicable THEN CASE WHEN s.in_gate THEN 'ERROR' END WHEN s.planned = 0 THEN 'NOT_RUN' WHEN n_fail > 0 THEN 'FAIL' WHEN n_error > 0 THEN 'ERROR' WHEN n_invalid > 0 THEN 'INVALID' WHEN n_inconclusive > 0 THEN 'INCONCLUSIVE' WHEN s.planned > COALESCE(s.planned - s.n_not_run, 0) THEN 'NOT_RUN' WHEN n_pass >= s.min_exercised THEN 'PASS' ELSE 'VACUOUS' END AS verdict,
    CASE WHEN NOT s.applicable THEN CASE WHEN s.in_gate THEN 'ERROR' END WHEN s.planned = 0 THEN 'NOT_RUN' WHEN n_fail > 0 THEN 'FAIL' WHEN n_error > 0 THEN 'ERROR' WHEN n_pass >= s.min_exercised THEN 'PASS' ELSE 'VACUOUS'
        END AS verdict_waived
FROM summed s
LEFT JOIN worst w ON w.campaign = s.campaign AND w.architecture = s.architecture
    AND w.fsr = s.fsr AND w.place = 1

--

CREATE VIEW v_architecture_pairs AS
WITH pair AS (
    SELECT ca.campaign_id AS campaign, ca.ordinal AS ordinal_a, cb.ordinal AS ordinal_b
    FROM campaign_case ca
    CROSS JOIN test_case ta ON ta.digest = ca.test_case_digest
    CROSS JOIN test_case tb ON tb.situation_digest = ta.situation_digest
        AND tb.fault_entry = ta.fault_entry
    CROSS JOIN campaign_case cb ON cb.test_case_digest = tb.digest
        AND cb.campaign_id = ca.campaign_id AND cb.scenario = ca.scenario
        AND cb.architecture > ca.architecture
    WHERE NOT EXISTS (
        SELECT 1 FROM json_each(ca.point) x JOIN json_each(cb.point) y
            ON y.key = x.key AND y.value IS NOT x.value))
SELECT a.campaign, a.scenario, a.fault_entry, a.situation, a.parameters, a.replicate,
    a.architecture AS architecture_a, b.architecture AS architecture_b, a.point AS point_a,
    b.point AS point_b, a.run AS run_a, b.run AS run_b, a.outcome AS outcome_a,
    b.outcome AS outcome_b,
    a.contact AS contact_a, b.contact AS contact_b, b.contact - a.contact AS contact_difference,
    a.impact_speed_mps AS impact_speed_mps_a, b.impact_speed_mps AS impact_speed_mps_b, b.impact_speed_mps - a.impact_speed_mps AS impact_speed_mps_difference,
    a.min_distance_m AS min_distance_m_a, b.min_distance_m AS min_distance_m_b, b.min_distance_m - a.min_distance_m AS min_distance_m_difference,
    a.min_ttc_s AS min_ttc_s_a, b.min_ttc_s AS min_ttc_s_b, b.min_ttc_s - a.min_ttc_s AS min_ttc_s_difference,
    a.min_time_headway_s AS min_time_headway_s_a, b.min_time_headway_s AS min_time_headway_s_b, b.min_time_headway_s - a.min_time_headway_s AS min_time_headway_s_difference,
    a.max_required_deceleration_mps2 AS max_required_deceleration_mps2_a, b.max_required_deceleration_mps2 AS max_required_deceleration_mps2_b, b.max_required_deceleration_mps2 - a.max_required_deceleration_mps2 AS max_required_deceleration_mps2_difference,
    a.max_deceleration_mps2 AS max_deceleration_mps2_a, b.max_deceleration_mps2 AS max_deceleration_mps2_b, b.max_deceleration_mps2 - a.max_deceleration_mps2 AS max_deceleration_mps2_difference,
    a.rss_violation_s AS rss_violation_s_a, b.rss_violation_s AS rss_violation_s_b, b.rss_violation_s - a.rss_violation_s AS rss_violation_s_difference,
    a.fault_to_safe_state_s AS fault_to_safe_state_s_a, b.fault_to_safe_state_s AS fault_to_safe_state_s_b, b.fault_to_safe_state_s - a.fault_to_safe_state_s AS fault_to_safe_state_s_difference,
    a.verdicts AS verdicts_a, b.verdicts AS verdicts_b
FROM pair p
CROSS JOIN v_runs a ON a.campaign = p.campaign AND a.ordinal = p.ordinal_a
CROSS JOIN v_runs b ON b.campaign = p.campaign AND b.ordinal = p.ordinal_b

--

CREATE VIEW v_coverage AS
SELECT c.campaign_id AS campaign, c.scenario, c.architecture, t.fault_entry,
    COUNT(*) AS planned, COUNT(r.number) AS done,
    SUM(EXISTS (
        SELECT 1 FROM v_verdicts v
        WHERE v.campaign = c.campaign_id AND v.ordinal = c.ordinal AND v.exercised)) AS exercised
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
LEFT JOIN run r ON r.result_digest = c.result_digest
GROUP BY c.campaign_id, c.scenario, c.architecture, t.fault_entry

--

CREATE VIEW v_timeline AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    c.result_digest AS run, e.seq, e.time_s, e.kind, e.subject, e.text
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN run r ON r.result_digest = c.result_digest
JOIN event e ON e.run_number = r.number
