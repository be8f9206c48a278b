-- Schema 0005 for SQLite. A line of two dashes stands between statements.

--

DROP VIEW v_check_older_version

--

DROP VIEW v_check_outside_odd

--

DROP VIEW v_check_stale_evidence

--

DROP VIEW v_check_not_applicable_in_gate

--

DROP VIEW v_check_orphan_scenario

--

DROP VIEW v_check_hazard_without_scenario

--

DROP VIEW v_check_response_beyond_budget

--

DROP VIEW v_check_emergency_operation

--

DROP VIEW v_check_expired_waiver

--

DROP VIEW v_check_common_cause

--

DROP VIEW v_check_illegal_decomposition

--

DROP VIEW v_check_hazard_asil

--

DROP VIEW v_element_causes

--

DROP VIEW v_fsr_goals

--

DROP VIEW v_goal_asil

--

DROP VIEW v_goal_events

--

DROP VIEW v_hazard_asil

--

DROP VIEW v_coverage

--

DROP VIEW v_architecture_pairs

--

DROP VIEW v_gate

--

DROP VIEW v_fsr_status

--

DROP VIEW v_runs

--

DROP VIEW v_verdicts

--

CREATE TABLE ledger (
	number INTEGER NOT NULL, 
	place INTEGER NOT NULL, 
	table_name TEXT NOT NULL, 
	is_last BOOLEAN NOT NULL, 
	row_count INTEGER NOT NULL, 
	total VARCHAR(32) NOT NULL, 
	detail TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_ledger PRIMARY KEY (number, place)
)

--

CREATE TABLE campaign_root (
	campaign_id VARCHAR(32) NOT NULL, 
	leaves INTEGER NOT NULL, 
	root VARCHAR(64) NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_campaign_root PRIMARY KEY (campaign_id), 
	CONSTRAINT fk_campaign_root_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TABLE case_count (
	campaign_id VARCHAR(32) NOT NULL, 
	scenario TEXT NOT NULL, 
	architecture TEXT NOT NULL, 
	fault_entry TEXT NOT NULL, 
	planned INTEGER NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_case_count PRIMARY KEY (campaign_id, scenario, architecture, fault_entry), 
	CONSTRAINT fk_case_count_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TABLE case_match (
	campaign_id VARCHAR(32) NOT NULL, 
	first_ordinal INTEGER NOT NULL, 
	ordinal INTEGER NOT NULL, 
	fault_entry TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_case_match PRIMARY KEY (campaign_id, first_ordinal, ordinal), 
	CONSTRAINT fk_case_match_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)
 WITHOUT ROWID

--

CREATE TABLE certificate (
	number INTEGER NOT NULL, 
	campaign_id VARCHAR(32) NOT NULL, 
	at TEXT NOT NULL, 
	tool TEXT NOT NULL, 
	class TEXT NOT NULL, 
	executed INTEGER NOT NULL, 
	asked INTEGER NOT NULL, 
	sampled INTEGER NOT NULL, 
	machine_dependent INTEGER NOT NULL, 
	conditions TEXT NOT NULL, 
	findings TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_certificate PRIMARY KEY (number), 
	CONSTRAINT ck_certificate_class CHECK (class = 'portable' OR class = 'same platform'), 
	CONSTRAINT ck_certificate_sampled CHECK (sampled BETWEEN 1 AND executed), 
	CONSTRAINT fk_certificate_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TABLE session (
	number INTEGER NOT NULL, 
	campaign_id VARCHAR(32) NOT NULL, 
	at TEXT NOT NULL, 
	who TEXT NOT NULL, 
	host TEXT NOT NULL, 
	tool TEXT NOT NULL, 
	packages_digest TEXT NOT NULL, 
	cpu TEXT NOT NULL, 
	provenance TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_session PRIMARY KEY (number), 
	CONSTRAINT fk_session_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE INDEX ix_session_campaign_id ON session (campaign_id)

--

CREATE TABLE case_run (
	campaign_id VARCHAR(32) NOT NULL, 
	ordinal INTEGER NOT NULL, 
	run_number INTEGER NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_case_run PRIMARY KEY (campaign_id, ordinal), 
	CONSTRAINT fk_case_run_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id), 
	CONSTRAINT fk_case_run_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)
 WITHOUT ROWID

--

CREATE TABLE case_tally (
	work_id INTEGER NOT NULL, 
	campaign_id VARCHAR(32) NOT NULL, 
	scenario TEXT NOT NULL, 
	architecture TEXT NOT NULL, 
	fault_entry TEXT NOT NULL, 
	runs INTEGER NOT NULL, 
	exercised INTEGER NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_case_tally PRIMARY KEY (work_id, scenario, architecture, fault_entry), 
	CONSTRAINT ck_case_tally_exercised CHECK (exercised BETWEEN 0 AND runs), 
	CONSTRAINT fk_case_tally_work_id FOREIGN KEY(work_id) REFERENCES work (id), 
	CONSTRAINT fk_case_tally_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE INDEX ix_case_tally_campaign_id ON case_tally (campaign_id)

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
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_seal PRIMARY KEY (run_number, number), 
	CONSTRAINT fk_seal_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TABLE withdrawal (
	number INTEGER NOT NULL, 
	result_digest VARCHAR(64) NOT NULL, 
	at TEXT NOT NULL, 
	author TEXT NOT NULL, 
	reason TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_withdrawal PRIMARY KEY (number), 
	CONSTRAINT fk_withdrawal_result_digest FOREIGN KEY(result_digest) REFERENCES run (result_digest)
)

--

CREATE INDEX ix_withdrawal_result_digest ON withdrawal (result_digest)

--

CREATE TRIGGER ledger_no_update BEFORE UPDATE ON ledger
BEGIN SELECT RAISE(ABORT, 'ledger is insert-only'); END

--

CREATE TRIGGER ledger_no_delete BEFORE DELETE ON ledger
BEGIN SELECT RAISE(ABORT, 'ledger is insert-only'); END

--

CREATE TRIGGER campaign_root_no_update BEFORE UPDATE ON campaign_root
BEGIN SELECT RAISE(ABORT, 'campaign_root is insert-only'); END

--

CREATE TRIGGER campaign_root_no_delete BEFORE DELETE ON campaign_root
BEGIN SELECT RAISE(ABORT, 'campaign_root is insert-only'); END

--

CREATE TRIGGER case_count_no_update BEFORE UPDATE ON case_count
BEGIN SELECT RAISE(ABORT, 'case_count is insert-only'); END

--

CREATE TRIGGER case_count_no_delete BEFORE DELETE ON case_count
BEGIN SELECT RAISE(ABORT, 'case_count is insert-only'); END

--

CREATE TRIGGER case_match_no_update BEFORE UPDATE ON case_match
BEGIN SELECT RAISE(ABORT, 'case_match is insert-only'); END

--

CREATE TRIGGER case_match_no_delete BEFORE DELETE ON case_match
BEGIN SELECT RAISE(ABORT, 'case_match is insert-only'); END

--

CREATE TRIGGER certificate_no_update BEFORE UPDATE ON certificate
BEGIN SELECT RAISE(ABORT, 'certificate is insert-only'); END

--

CREATE TRIGGER certificate_no_delete BEFORE DELETE ON certificate
BEGIN SELECT RAISE(ABORT, 'certificate is insert-only'); END

--

CREATE TRIGGER session_no_update BEFORE UPDATE ON session
BEGIN SELECT RAISE(ABORT, 'session is insert-only'); END

--

CREATE TRIGGER session_no_delete BEFORE DELETE ON session
BEGIN SELECT RAISE(ABORT, 'session is insert-only'); END

--

CREATE TRIGGER case_run_no_update BEFORE UPDATE ON case_run
BEGIN SELECT RAISE(ABORT, 'case_run is insert-only'); END

--

CREATE TRIGGER case_run_no_delete BEFORE DELETE ON case_run
BEGIN SELECT RAISE(ABORT, 'case_run is insert-only'); END

--

CREATE TRIGGER case_tally_no_update BEFORE UPDATE ON case_tally
BEGIN SELECT RAISE(ABORT, 'case_tally is insert-only'); END

--

CREATE TRIGGER case_tally_no_delete BEFORE DELETE ON case_tally
BEGIN SELECT RAISE(ABORT, 'case_tally is insert-only'); END

--

CREATE TRIGGER seal_no_update BEFORE UPDATE ON seal
BEGIN SELECT RAISE(ABORT, 'seal is insert-only'); END

--

CREATE TRIGGER seal_no_delete BEFORE DELETE ON seal
BEGIN SELECT RAISE(ABORT, 'seal is insert-only'); END

--

CREATE TRIGGER withdrawal_no_update BEFORE UPDATE ON withdrawal
BEGIN SELECT RAISE(ABORT, 'withdrawal is insert-only'); END

--

CREATE TRIGGER withdrawal_no_delete BEFORE DELETE ON withdrawal
BEGIN SELECT RAISE(ABORT, 'withdrawal is insert-only'); END

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

CREATE VIEW v_goal_events AS
SELECT g.concept_digest AS concept, g.id AS goal, j.value AS event
FROM safety_goal g JOIN json_each(g.content, '$.hazardous_events') j ON TRUE

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

CREATE VIEW v_fsr_goals AS
SELECT f.concept_digest AS concept, f.id AS fsr, j.value AS goal,
    (SELECT CAST(value AS DOUBLE PRECISION) FROM json_each(f.content, '$.fdti')) AS fdti_s,
    (SELECT CAST(value AS DOUBLE PRECISION) FROM json_each(f.content, '$.frti')) AS frti_s,
    (SELECT CAST(value AS DOUBLE PRECISION) FROM json_each(f.content, '$.emergency_operation_interval'))
        AS emergency_operation_s
FROM fsr f JOIN json_each(f.content, '$.goals') j ON TRUE

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

CREATE VIEW v_check_hazard_asil AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    e.severity || ' ' || e.exposure || ' ' || e.controllability || ' give '
        || COALESCE(h.asil, 'no ASIL') || ', the event has ' || COALESCE(e.asil, 'none') AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
JOIN v_hazard_asil h ON h.concept = e.concept_digest AND h.event = e.id
WHERE COALESCE(h.asil, '') <> COALESCE(e.asil, '')

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

CREATE VIEW v_check_not_applicable_in_gate AS
SELECT DISTINCT p.campaign_id AS campaign, 'fsr' AS part, p.fsr_id AS id,
    'not applicable to ' || p.architecture || ': ' || COALESCE(p.reason, 'no reason') AS detail
FROM campaign_fsr p
WHERE p.in_gate = 1 AND p.mandatory = 1 AND p.applicable = 0

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
