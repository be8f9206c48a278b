-- Schema 0003 for SQLite. A line of two dashes stands between statements.

--

CREATE TABLE timing (
	run_number INTEGER NOT NULL, 
	fault_detection_time_s FLOAT, 
	fault_detection_time_s_status TEXT NOT NULL, 
	fault_detection_time_s_time_s FLOAT, 
	fault_detection_time_s_actor TEXT, 
	fault_reaction_time_s FLOAT, 
	fault_reaction_time_s_status TEXT NOT NULL, 
	fault_reaction_time_s_time_s FLOAT, 
	fault_reaction_time_s_actor TEXT, 
	fault_handling_time_s FLOAT, 
	fault_handling_time_s_status TEXT NOT NULL, 
	fault_handling_time_s_time_s FLOAT, 
	fault_handling_time_s_actor TEXT, 
	emergency_operation_time_s FLOAT, 
	emergency_operation_time_s_status TEXT NOT NULL, 
	emergency_operation_time_s_time_s FLOAT, 
	emergency_operation_time_s_actor TEXT, 
	nominal_availability FLOAT, 
	nominal_availability_status TEXT NOT NULL, 
	nominal_availability_time_s FLOAT, 
	nominal_availability_actor TEXT, 
	takeovers FLOAT, 
	takeovers_status TEXT NOT NULL, 
	takeovers_time_s FLOAT, 
	takeovers_actor TEXT, 
	trips FLOAT, 
	trips_status TEXT NOT NULL, 
	trips_time_s FLOAT, 
	trips_actor TEXT, 
	stop_rating FLOAT, 
	stop_rating_status TEXT NOT NULL, 
	stop_rating_time_s FLOAT, 
	stop_rating_actor TEXT, 
	stop_regret FLOAT, 
	stop_regret_status TEXT NOT NULL, 
	stop_regret_time_s FLOAT, 
	stop_regret_actor TEXT, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_timing PRIMARY KEY (run_number), 
	CONSTRAINT ck_timing_fault_detection_time_s CHECK (CASE fault_detection_time_s_status WHEN 'value' THEN fault_detection_time_s IS NOT NULL WHEN 'no_conflict' THEN fault_detection_time_s IS NULL WHEN 'not_applicable' THEN fault_detection_time_s IS NULL WHEN 'undefined' THEN fault_detection_time_s IS NULL WHEN 'incomplete' THEN fault_detection_time_s IS NULL WHEN 'error' THEN fault_detection_time_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_timing_fault_reaction_time_s CHECK (CASE fault_reaction_time_s_status WHEN 'value' THEN fault_reaction_time_s IS NOT NULL WHEN 'no_conflict' THEN fault_reaction_time_s IS NULL WHEN 'not_applicable' THEN fault_reaction_time_s IS NULL WHEN 'undefined' THEN fault_reaction_time_s IS NULL WHEN 'incomplete' THEN fault_reaction_time_s IS NULL WHEN 'error' THEN fault_reaction_time_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_timing_fault_handling_time_s CHECK (CASE fault_handling_time_s_status WHEN 'value' THEN fault_handling_time_s IS NOT NULL WHEN 'no_conflict' THEN fault_handling_time_s IS NULL WHEN 'not_applicable' THEN fault_handling_time_s IS NULL WHEN 'undefined' THEN fault_handling_time_s IS NULL WHEN 'incomplete' THEN fault_handling_time_s IS NULL WHEN 'error' THEN fault_handling_time_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_timing_emergency_operation_time_s CHECK (CASE emergency_operation_time_s_status WHEN 'value' THEN emergency_operation_time_s IS NOT NULL WHEN 'no_conflict' THEN emergency_operation_time_s IS NULL WHEN 'not_applicable' THEN emergency_operation_time_s IS NULL WHEN 'undefined' THEN emergency_operation_time_s IS NULL WHEN 'incomplete' THEN emergency_operation_time_s IS NULL WHEN 'error' THEN emergency_operation_time_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_timing_nominal_availability CHECK (CASE nominal_availability_status WHEN 'value' THEN nominal_availability IS NOT NULL WHEN 'no_conflict' THEN nominal_availability IS NULL WHEN 'not_applicable' THEN nominal_availability IS NULL WHEN 'undefined' THEN nominal_availability IS NULL WHEN 'incomplete' THEN nominal_availability IS NULL WHEN 'error' THEN nominal_availability IS NULL ELSE 0 END), 
	CONSTRAINT ck_timing_takeovers CHECK (CASE takeovers_status WHEN 'value' THEN takeovers IS NOT NULL WHEN 'no_conflict' THEN takeovers IS NULL WHEN 'not_applicable' THEN takeovers IS NULL WHEN 'undefined' THEN takeovers IS NULL WHEN 'incomplete' THEN takeovers IS NULL WHEN 'error' THEN takeovers IS NULL ELSE 0 END), 
	CONSTRAINT ck_timing_trips CHECK (CASE trips_status WHEN 'value' THEN trips IS NOT NULL WHEN 'no_conflict' THEN trips IS NULL WHEN 'not_applicable' THEN trips IS NULL WHEN 'undefined' THEN trips IS NULL WHEN 'incomplete' THEN trips IS NULL WHEN 'error' THEN trips IS NULL ELSE 0 END), 
	CONSTRAINT ck_timing_stop_rating CHECK (CASE stop_rating_status WHEN 'value' THEN stop_rating IS NOT NULL WHEN 'no_conflict' THEN stop_rating IS NULL WHEN 'not_applicable' THEN stop_rating IS NULL WHEN 'undefined' THEN stop_rating IS NULL WHEN 'incomplete' THEN stop_rating IS NULL WHEN 'error' THEN stop_rating IS NULL ELSE 0 END), 
	CONSTRAINT ck_timing_stop_regret CHECK (CASE stop_regret_status WHEN 'value' THEN stop_regret IS NOT NULL WHEN 'no_conflict' THEN stop_regret IS NULL WHEN 'not_applicable' THEN stop_regret IS NULL WHEN 'undefined' THEN stop_regret IS NULL WHEN 'incomplete' THEN stop_regret IS NULL WHEN 'error' THEN stop_regret IS NULL ELSE 0 END), 
	CONSTRAINT fk_timing_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE injection (
	result_digest VARCHAR(64) NOT NULL, 
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
	class TEXT NOT NULL, 
	without_mechanism TEXT NOT NULL, 
	twins TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_injection PRIMARY KEY (result_digest, version), 
	CONSTRAINT ck_injection_class CHECK (class = 'not_activated' OR class = 'masked' OR class = 'detected_in_time' OR class = 'detected_late' OR class = 'undetected_no_violation' OR class = 'undetected_violation'), 
	CONSTRAINT fk_injection_result_digest FOREIGN KEY(result_digest) REFERENCES run (result_digest)
)

--

CREATE TABLE takeover (
	fork_digest VARCHAR(64) NOT NULL, 
	version INTEGER NOT NULL, 
	class TEXT NOT NULL, 
	takeover_s FLOAT, 
	violation_s FLOAT, 
	fork_violation_s FLOAT, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_takeover PRIMARY KEY (fork_digest, version), 
	CONSTRAINT ck_takeover_class CHECK (class = 'needed_and_done' OR class = 'late' OR class = 'spurious' OR class = 'missed' OR class = 'not_needed'), 
	CONSTRAINT fk_takeover_fork_digest FOREIGN KEY(fork_digest) REFERENCES fork (result_digest)
)

--

CREATE TRIGGER timing_no_update BEFORE UPDATE ON timing
BEGIN SELECT RAISE(ABORT, 'timing is insert-only'); END

--

CREATE TRIGGER timing_no_delete BEFORE DELETE ON timing
BEGIN SELECT RAISE(ABORT, 'timing is insert-only'); END

--

CREATE TRIGGER injection_no_update BEFORE UPDATE ON injection
BEGIN SELECT RAISE(ABORT, 'injection is insert-only'); END

--

CREATE TRIGGER injection_no_delete BEFORE DELETE ON injection
BEGIN SELECT RAISE(ABORT, 'injection is insert-only'); END

--

CREATE TRIGGER takeover_no_update BEFORE UPDATE ON takeover
BEGIN SELECT RAISE(ABORT, 'takeover is insert-only'); END

--

CREATE TRIGGER takeover_no_delete BEFORE DELETE ON takeover
BEGIN SELECT RAISE(ABORT, 'takeover is insert-only'); END

--

DROP VIEW v_runs

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
    n.fault_detection_time_s, n.fault_detection_time_s_status, n.fault_detection_time_s_time_s, n.fault_detection_time_s_actor,
    n.fault_reaction_time_s, n.fault_reaction_time_s_status, n.fault_reaction_time_s_time_s, n.fault_reaction_time_s_actor,
    n.fault_handling_time_s, n.fault_handling_time_s_status, n.fault_handling_time_s_time_s, n.fault_handling_time_s_actor,
    n.emergency_operation_time_s, n.emergency_operation_time_s_status, n.emergency_operation_time_s_time_s, n.emergency_operation_time_s_actor,
    n.nominal_availability, n.nominal_availability_status, n.nominal_availability_time_s, n.nominal_availability_actor,
    n.takeovers, n.takeovers_status, n.takeovers_time_s, n.takeovers_actor,
    n.trips, n.trips_status, n.trips_time_s, n.trips_actor,
    n.stop_rating, n.stop_rating_status, n.stop_rating_time_s, n.stop_rating_actor,
    n.stop_regret, n.stop_regret_status, n.stop_regret_time_s, n.stop_regret_actor,
    (SELECT '{' || COALESCE(group_concat('"' || fsr || '":"' || verdict || '"'), '') || '}'
        FROM (
            SELECT v.fsr, v.verdict FROM v_verdicts v
            WHERE v.campaign = c.campaign_id AND v.ordinal = c.ordinal ORDER BY v.fsr)
        ) AS verdicts
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN run r ON r.result_digest = c.result_digest
JOIN metric m ON m.run_number = r.number
LEFT JOIN timing n ON n.run_number = r.number

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
