-- Schema 0004 for SQLite. A line of two dashes stands between statements.

--

CREATE TABLE criticality (
	run_number INTEGER NOT NULL, 
	min_time_gap_s FLOAT, 
	min_time_gap_s_status TEXT NOT NULL, 
	min_time_gap_s_time_s FLOAT, 
	min_time_gap_s_actor TEXT, 
	min_mttc_s FLOAT, 
	min_mttc_s_status TEXT NOT NULL, 
	min_mttc_s_time_s FLOAT, 
	min_mttc_s_actor TEXT, 
	min_ettc_s FLOAT, 
	min_ettc_s_status TEXT NOT NULL, 
	min_ettc_s_time_s FLOAT, 
	min_ettc_s_actor TEXT, 
	max_mdrac_mps2 FLOAT, 
	max_mdrac_mps2_status TEXT NOT NULL, 
	max_mdrac_mps2_time_s FLOAT, 
	max_mdrac_mps2_actor TEXT, 
	max_dst_mps2 FLOAT, 
	max_dst_mps2_status TEXT NOT NULL, 
	max_dst_mps2_time_s FLOAT, 
	max_dst_mps2_actor TEXT, 
	min_mtc FLOAT, 
	min_mtc_status TEXT NOT NULL, 
	min_mtc_time_s FLOAT, 
	min_mtc_actor TEXT, 
	min_psd FLOAT, 
	min_psd_status TEXT NOT NULL, 
	min_psd_time_s FLOAT, 
	min_psd_actor TEXT, 
	max_btn FLOAT, 
	max_btn_status TEXT NOT NULL, 
	max_btn_time_s FLOAT, 
	max_btn_actor TEXT, 
	max_stn FLOAT, 
	max_stn_status TEXT NOT NULL, 
	max_stn_time_s FLOAT, 
	max_stn_actor TEXT, 
	min_ttb_s FLOAT, 
	min_ttb_s_status TEXT NOT NULL, 
	min_ttb_s_time_s FLOAT, 
	min_ttb_s_actor TEXT, 
	min_tts_s FLOAT, 
	min_tts_s_status TEXT NOT NULL, 
	min_tts_s_time_s FLOAT, 
	min_tts_s_actor TEXT, 
	min_ttk_s FLOAT, 
	min_ttk_s_status TEXT NOT NULL, 
	min_ttk_s_time_s FLOAT, 
	min_ttk_s_actor TEXT, 
	min_ttr_s FLOAT, 
	min_ttr_s_status TEXT NOT NULL, 
	min_ttr_s_time_s FLOAT, 
	min_ttr_s_actor TEXT, 
	tet_s FLOAT, 
	tet_s_status TEXT NOT NULL, 
	tet_s_time_s FLOAT, 
	tet_s_actor TEXT, 
	tit_s2 FLOAT, 
	tit_s2_status TEXT NOT NULL, 
	tit_s2_time_s FLOAT, 
	tit_s2_actor TEXT, 
	tet_share FLOAT, 
	tet_share_status TEXT NOT NULL, 
	tet_share_time_s FLOAT, 
	tet_share_actor TEXT, 
	tit_mean_s FLOAT, 
	tit_mean_s_status TEXT NOT NULL, 
	tit_mean_s_time_s FLOAT, 
	tit_mean_s_actor TEXT, 
	crash_potential FLOAT, 
	crash_potential_status TEXT NOT NULL, 
	crash_potential_time_s FLOAT, 
	crash_potential_actor TEXT, 
	time_to_accident_s FLOAT, 
	time_to_accident_s_status TEXT NOT NULL, 
	time_to_accident_s_time_s FLOAT, 
	time_to_accident_s_actor TEXT, 
	min_rss_ratio FLOAT, 
	min_rss_ratio_status TEXT NOT NULL, 
	min_rss_ratio_time_s FLOAT, 
	min_rss_ratio_actor TEXT, 
	rss_response_violation_s FLOAT, 
	rss_response_violation_s_status TEXT NOT NULL, 
	rss_response_violation_s_time_s FLOAT, 
	rss_response_violation_s_actor TEXT, 
	min_ttc_2d_s FLOAT, 
	min_ttc_2d_s_status TEXT NOT NULL, 
	min_ttc_2d_s_time_s FLOAT, 
	min_ttc_2d_s_actor TEXT, 
	min_wttc_s FLOAT, 
	min_wttc_s_status TEXT NOT NULL, 
	min_wttc_s_time_s FLOAT, 
	min_wttc_s_actor TEXT, 
	min_dce_m FLOAT, 
	min_dce_m_status TEXT NOT NULL, 
	min_dce_m_time_s FLOAT, 
	min_dce_m_actor TEXT, 
	min_ttce_s FLOAT, 
	min_ttce_s_status TEXT NOT NULL, 
	min_ttce_s_time_s FLOAT, 
	min_ttce_s_actor TEXT, 
	min_pet_s FLOAT, 
	min_pet_s_status TEXT NOT NULL, 
	min_pet_s_time_s FLOAT, 
	min_pet_s_actor TEXT, 
	pet_overlap_s FLOAT, 
	pet_overlap_s_status TEXT NOT NULL, 
	pet_overlap_s_time_s FLOAT, 
	pet_overlap_s_actor TEXT, 
	max_encroachment_time_s FLOAT, 
	max_encroachment_time_s_status TEXT NOT NULL, 
	max_encroachment_time_s_time_s FLOAT, 
	max_encroachment_time_s_actor TEXT, 
	min_predicted_pet_s FLOAT, 
	min_predicted_pet_s_status TEXT NOT NULL, 
	min_predicted_pet_s_time_s FLOAT, 
	min_predicted_pet_s_actor TEXT, 
	min_rear_ttc_s FLOAT, 
	min_rear_ttc_s_status TEXT NOT NULL, 
	min_rear_ttc_s_time_s FLOAT, 
	min_rear_ttc_s_actor TEXT, 
	max_follower_deceleration_mps2 FLOAT, 
	max_follower_deceleration_mps2_status TEXT NOT NULL, 
	max_follower_deceleration_mps2_time_s FLOAT, 
	max_follower_deceleration_mps2_actor TEXT, 
	delta_v_mps FLOAT, 
	delta_v_mps_status TEXT NOT NULL, 
	delta_v_mps_time_s FLOAT, 
	delta_v_mps_actor TEXT, 
	other_delta_v_mps FLOAT, 
	other_delta_v_mps_status TEXT NOT NULL, 
	other_delta_v_mps_time_s FLOAT, 
	other_delta_v_mps_actor TEXT, 
	fatality_probability FLOAT, 
	fatality_probability_status TEXT NOT NULL, 
	fatality_probability_time_s FLOAT, 
	fatality_probability_actor TEXT, 
	max_acceleration_mps2 FLOAT, 
	max_acceleration_mps2_status TEXT NOT NULL, 
	max_acceleration_mps2_time_s FLOAT, 
	max_acceleration_mps2_actor TEXT, 
	max_lateral_acceleration_mps2 FLOAT, 
	max_lateral_acceleration_mps2_status TEXT NOT NULL, 
	max_lateral_acceleration_mps2_time_s FLOAT, 
	max_lateral_acceleration_mps2_actor TEXT, 
	max_total_jerk_mps3 FLOAT, 
	max_total_jerk_mps3_status TEXT NOT NULL, 
	max_total_jerk_mps3_time_s FLOAT, 
	max_total_jerk_mps3_actor TEXT, 
	max_yaw_rate_radps FLOAT, 
	max_yaw_rate_radps_status TEXT NOT NULL, 
	max_yaw_rate_radps_time_s FLOAT, 
	max_yaw_rate_radps_actor TEXT, 
	max_yaw_acceleration_radps2 FLOAT, 
	max_yaw_acceleration_radps2_status TEXT NOT NULL, 
	max_yaw_acceleration_radps2_time_s FLOAT, 
	max_yaw_acceleration_radps2_actor TEXT, 
	uncomfortable_time_s FLOAT, 
	uncomfortable_time_s_status TEXT NOT NULL, 
	uncomfortable_time_s_time_s FLOAT, 
	uncomfortable_time_s_actor TEXT, 
	contact_at_fault FLOAT, 
	contact_at_fault_status TEXT NOT NULL, 
	contact_at_fault_time_s FLOAT, 
	contact_at_fault_actor TEXT, 
	distance_to_safe_state_m FLOAT, 
	distance_to_safe_state_m_status TEXT NOT NULL, 
	distance_to_safe_state_m_time_s FLOAT, 
	distance_to_safe_state_m_actor TEXT, 
	max_acceleration_disagreement_mps2 FLOAT, 
	max_acceleration_disagreement_mps2_status TEXT NOT NULL, 
	max_acceleration_disagreement_mps2_time_s FLOAT, 
	max_acceleration_disagreement_mps2_actor TEXT, 
	max_steering_disagreement_rad FLOAT, 
	max_steering_disagreement_rad_status TEXT NOT NULL, 
	max_steering_disagreement_rad_time_s FLOAT, 
	max_steering_disagreement_rad_actor TEXT, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_criticality PRIMARY KEY (run_number), 
	CONSTRAINT ck_criticality_min_time_gap_s CHECK (CASE min_time_gap_s_status WHEN 'value' THEN min_time_gap_s IS NOT NULL WHEN 'no_conflict' THEN min_time_gap_s IS NULL WHEN 'not_applicable' THEN min_time_gap_s IS NULL WHEN 'undefined' THEN min_time_gap_s IS NULL WHEN 'incomplete' THEN min_time_gap_s IS NULL WHEN 'error' THEN min_time_gap_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_mttc_s CHECK (CASE min_mttc_s_status WHEN 'value' THEN min_mttc_s IS NOT NULL WHEN 'no_conflict' THEN min_mttc_s IS NULL WHEN 'not_applicable' THEN min_mttc_s IS NULL WHEN 'undefined' THEN min_mttc_s IS NULL WHEN 'incomplete' THEN min_mttc_s IS NULL WHEN 'error' THEN min_mttc_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_ettc_s CHECK (CASE min_ettc_s_status WHEN 'value' THEN min_ettc_s IS NOT NULL WHEN 'no_conflict' THEN min_ettc_s IS NULL WHEN 'not_applicable' THEN min_ettc_s IS NULL WHEN 'undefined' THEN min_ettc_s IS NULL WHEN 'incomplete' THEN min_ettc_s IS NULL WHEN 'error' THEN min_ettc_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_mdrac_mps2 CHECK (CASE max_mdrac_mps2_status WHEN 'value' THEN max_mdrac_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_mdrac_mps2 IS NULL WHEN 'not_applicable' THEN max_mdrac_mps2 IS NULL WHEN 'undefined' THEN max_mdrac_mps2 IS NULL WHEN 'incomplete' THEN max_mdrac_mps2 IS NULL WHEN 'error' THEN max_mdrac_mps2 IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_dst_mps2 CHECK (CASE max_dst_mps2_status WHEN 'value' THEN max_dst_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_dst_mps2 IS NULL WHEN 'not_applicable' THEN max_dst_mps2 IS NULL WHEN 'undefined' THEN max_dst_mps2 IS NULL WHEN 'incomplete' THEN max_dst_mps2 IS NULL WHEN 'error' THEN max_dst_mps2 IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_mtc CHECK (CASE min_mtc_status WHEN 'value' THEN min_mtc IS NOT NULL WHEN 'no_conflict' THEN min_mtc IS NULL WHEN 'not_applicable' THEN min_mtc IS NULL WHEN 'undefined' THEN min_mtc IS NULL WHEN 'incomplete' THEN min_mtc IS NULL WHEN 'error' THEN min_mtc IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_psd CHECK (CASE min_psd_status WHEN 'value' THEN min_psd IS NOT NULL WHEN 'no_conflict' THEN min_psd IS NULL WHEN 'not_applicable' THEN min_psd IS NULL WHEN 'undefined' THEN min_psd IS NULL WHEN 'incomplete' THEN min_psd IS NULL WHEN 'error' THEN min_psd IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_btn CHECK (CASE max_btn_status WHEN 'value' THEN max_btn IS NOT NULL WHEN 'no_conflict' THEN max_btn IS NULL WHEN 'not_applicable' THEN max_btn IS NULL WHEN 'undefined' THEN max_btn IS NULL WHEN 'incomplete' THEN max_btn IS NULL WHEN 'error' THEN max_btn IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_stn CHECK (CASE max_stn_status WHEN 'value' THEN max_stn IS NOT NULL WHEN 'no_conflict' THEN max_stn IS NULL WHEN 'not_applicable' THEN max_stn IS NULL WHEN 'undefined' THEN max_stn IS NULL WHEN 'incomplete' THEN max_stn IS NULL WHEN 'error' THEN max_stn IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_ttb_s CHECK (CASE min_ttb_s_status WHEN 'value' THEN min_ttb_s IS NOT NULL WHEN 'no_conflict' THEN min_ttb_s IS NULL WHEN 'not_applicable' THEN min_ttb_s IS NULL WHEN 'undefined' THEN min_ttb_s IS NULL WHEN 'incomplete' THEN min_ttb_s IS NULL WHEN 'error' THEN min_ttb_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_tts_s CHECK (CASE min_tts_s_status WHEN 'value' THEN min_tts_s IS NOT NULL WHEN 'no_conflict' THEN min_tts_s IS NULL WHEN 'not_applicable' THEN min_tts_s IS NULL WHEN 'undefined' THEN min_tts_s IS NULL WHEN 'incomplete' THEN min_tts_s IS NULL WHEN 'error' THEN min_tts_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_ttk_s CHECK (CASE min_ttk_s_status WHEN 'value' THEN min_ttk_s IS NOT NULL WHEN 'no_conflict' THEN min_ttk_s IS NULL WHEN 'not_applicable' THEN min_ttk_s IS NULL WHEN 'undefined' THEN min_ttk_s IS NULL WHEN 'incomplete' THEN min_ttk_s IS NULL WHEN 'error' THEN min_ttk_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_ttr_s CHECK (CASE min_ttr_s_status WHEN 'value' THEN min_ttr_s IS NOT NULL WHEN 'no_conflict' THEN min_ttr_s IS NULL WHEN 'not_applicable' THEN min_ttr_s IS NULL WHEN 'undefined' THEN min_ttr_s IS NULL WHEN 'incomplete' THEN min_ttr_s IS NULL WHEN 'error' THEN min_ttr_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_tet_s CHECK (CASE tet_s_status WHEN 'value' THEN tet_s IS NOT NULL WHEN 'no_conflict' THEN tet_s IS NULL WHEN 'not_applicable' THEN tet_s IS NULL WHEN 'undefined' THEN tet_s IS NULL WHEN 'incomplete' THEN tet_s IS NULL WHEN 'error' THEN tet_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_tit_s2 CHECK (CASE tit_s2_status WHEN 'value' THEN tit_s2 IS NOT NULL WHEN 'no_conflict' THEN tit_s2 IS NULL WHEN 'not_applicable' THEN tit_s2 IS NULL WHEN 'undefined' THEN tit_s2 IS NULL WHEN 'incomplete' THEN tit_s2 IS NULL WHEN 'error' THEN tit_s2 IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_tet_share CHECK (CASE tet_share_status WHEN 'value' THEN tet_share IS NOT NULL WHEN 'no_conflict' THEN tet_share IS NULL WHEN 'not_applicable' THEN tet_share IS NULL WHEN 'undefined' THEN tet_share IS NULL WHEN 'incomplete' THEN tet_share IS NULL WHEN 'error' THEN tet_share IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_tit_mean_s CHECK (CASE tit_mean_s_status WHEN 'value' THEN tit_mean_s IS NOT NULL WHEN 'no_conflict' THEN tit_mean_s IS NULL WHEN 'not_applicable' THEN tit_mean_s IS NULL WHEN 'undefined' THEN tit_mean_s IS NULL WHEN 'incomplete' THEN tit_mean_s IS NULL WHEN 'error' THEN tit_mean_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_crash_potential CHECK (CASE crash_potential_status WHEN 'value' THEN crash_potential IS NOT NULL WHEN 'no_conflict' THEN crash_potential IS NULL WHEN 'not_applicable' THEN crash_potential IS NULL WHEN 'undefined' THEN crash_potential IS NULL WHEN 'incomplete' THEN crash_potential IS NULL WHEN 'error' THEN crash_potential IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_time_to_accident_s CHECK (CASE time_to_accident_s_status WHEN 'value' THEN time_to_accident_s IS NOT NULL WHEN 'no_conflict' THEN time_to_accident_s IS NULL WHEN 'not_applicable' THEN time_to_accident_s IS NULL WHEN 'undefined' THEN time_to_accident_s IS NULL WHEN 'incomplete' THEN time_to_accident_s IS NULL WHEN 'error' THEN time_to_accident_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_rss_ratio CHECK (CASE min_rss_ratio_status WHEN 'value' THEN min_rss_ratio IS NOT NULL WHEN 'no_conflict' THEN min_rss_ratio IS NULL WHEN 'not_applicable' THEN min_rss_ratio IS NULL WHEN 'undefined' THEN min_rss_ratio IS NULL WHEN 'incomplete' THEN min_rss_ratio IS NULL WHEN 'error' THEN min_rss_ratio IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_rss_response_violation_s CHECK (CASE rss_response_violation_s_status WHEN 'value' THEN rss_response_violation_s IS NOT NULL WHEN 'no_conflict' THEN rss_response_violation_s IS NULL WHEN 'not_applicable' THEN rss_response_violation_s IS NULL WHEN 'undefined' THEN rss_response_violation_s IS NULL WHEN 'incomplete' THEN rss_response_violation_s IS NULL WHEN 'error' THEN rss_response_violation_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_ttc_2d_s CHECK (CASE min_ttc_2d_s_status WHEN 'value' THEN min_ttc_2d_s IS NOT NULL WHEN 'no_conflict' THEN min_ttc_2d_s IS NULL WHEN 'not_applicable' THEN min_ttc_2d_s IS NULL WHEN 'undefined' THEN min_ttc_2d_s IS NULL WHEN 'incomplete' THEN min_ttc_2d_s IS NULL WHEN 'error' THEN min_ttc_2d_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_wttc_s CHECK (CASE min_wttc_s_status WHEN 'value' THEN min_wttc_s IS NOT NULL WHEN 'no_conflict' THEN min_wttc_s IS NULL WHEN 'not_applicable' THEN min_wttc_s IS NULL WHEN 'undefined' THEN min_wttc_s IS NULL WHEN 'incomplete' THEN min_wttc_s IS NULL WHEN 'error' THEN min_wttc_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_dce_m CHECK (CASE min_dce_m_status WHEN 'value' THEN min_dce_m IS NOT NULL WHEN 'no_conflict' THEN min_dce_m IS NULL WHEN 'not_applicable' THEN min_dce_m IS NULL WHEN 'undefined' THEN min_dce_m IS NULL WHEN 'incomplete' THEN min_dce_m IS NULL WHEN 'error' THEN min_dce_m IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_ttce_s CHECK (CASE min_ttce_s_status WHEN 'value' THEN min_ttce_s IS NOT NULL WHEN 'no_conflict' THEN min_ttce_s IS NULL WHEN 'not_applicable' THEN min_ttce_s IS NULL WHEN 'undefined' THEN min_ttce_s IS NULL WHEN 'incomplete' THEN min_ttce_s IS NULL WHEN 'error' THEN min_ttce_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_pet_s CHECK (CASE min_pet_s_status WHEN 'value' THEN min_pet_s IS NOT NULL WHEN 'no_conflict' THEN min_pet_s IS NULL WHEN 'not_applicable' THEN min_pet_s IS NULL WHEN 'undefined' THEN min_pet_s IS NULL WHEN 'incomplete' THEN min_pet_s IS NULL WHEN 'error' THEN min_pet_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_pet_overlap_s CHECK (CASE pet_overlap_s_status WHEN 'value' THEN pet_overlap_s IS NOT NULL WHEN 'no_conflict' THEN pet_overlap_s IS NULL WHEN 'not_applicable' THEN pet_overlap_s IS NULL WHEN 'undefined' THEN pet_overlap_s IS NULL WHEN 'incomplete' THEN pet_overlap_s IS NULL WHEN 'error' THEN pet_overlap_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_encroachment_time_s CHECK (CASE max_encroachment_time_s_status WHEN 'value' THEN max_encroachment_time_s IS NOT NULL WHEN 'no_conflict' THEN max_encroachment_time_s IS NULL WHEN 'not_applicable' THEN max_encroachment_time_s IS NULL WHEN 'undefined' THEN max_encroachment_time_s IS NULL WHEN 'incomplete' THEN max_encroachment_time_s IS NULL WHEN 'error' THEN max_encroachment_time_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_predicted_pet_s CHECK (CASE min_predicted_pet_s_status WHEN 'value' THEN min_predicted_pet_s IS NOT NULL WHEN 'no_conflict' THEN min_predicted_pet_s IS NULL WHEN 'not_applicable' THEN min_predicted_pet_s IS NULL WHEN 'undefined' THEN min_predicted_pet_s IS NULL WHEN 'incomplete' THEN min_predicted_pet_s IS NULL WHEN 'error' THEN min_predicted_pet_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_min_rear_ttc_s CHECK (CASE min_rear_ttc_s_status WHEN 'value' THEN min_rear_ttc_s IS NOT NULL WHEN 'no_conflict' THEN min_rear_ttc_s IS NULL WHEN 'not_applicable' THEN min_rear_ttc_s IS NULL WHEN 'undefined' THEN min_rear_ttc_s IS NULL WHEN 'incomplete' THEN min_rear_ttc_s IS NULL WHEN 'error' THEN min_rear_ttc_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_follower_deceleration_mps2 CHECK (CASE max_follower_deceleration_mps2_status WHEN 'value' THEN max_follower_deceleration_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_follower_deceleration_mps2 IS NULL WHEN 'not_applicable' THEN max_follower_deceleration_mps2 IS NULL WHEN 'undefined' THEN max_follower_deceleration_mps2 IS NULL WHEN 'incomplete' THEN max_follower_deceleration_mps2 IS NULL WHEN 'error' THEN max_follower_deceleration_mps2 IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_delta_v_mps CHECK (CASE delta_v_mps_status WHEN 'value' THEN delta_v_mps IS NOT NULL WHEN 'no_conflict' THEN delta_v_mps IS NULL WHEN 'not_applicable' THEN delta_v_mps IS NULL WHEN 'undefined' THEN delta_v_mps IS NULL WHEN 'incomplete' THEN delta_v_mps IS NULL WHEN 'error' THEN delta_v_mps IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_other_delta_v_mps CHECK (CASE other_delta_v_mps_status WHEN 'value' THEN other_delta_v_mps IS NOT NULL WHEN 'no_conflict' THEN other_delta_v_mps IS NULL WHEN 'not_applicable' THEN other_delta_v_mps IS NULL WHEN 'undefined' THEN other_delta_v_mps IS NULL WHEN 'incomplete' THEN other_delta_v_mps IS NULL WHEN 'error' THEN other_delta_v_mps IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_fatality_probability CHECK (CASE fatality_probability_status WHEN 'value' THEN fatality_probability IS NOT NULL WHEN 'no_conflict' THEN fatality_probability IS NULL WHEN 'not_applicable' THEN fatality_probability IS NULL WHEN 'undefined' THEN fatality_probability IS NULL WHEN 'incomplete' THEN fatality_probability IS NULL WHEN 'error' THEN fatality_probability IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_acceleration_mps2 CHECK (CASE max_acceleration_mps2_status WHEN 'value' THEN max_acceleration_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_acceleration_mps2 IS NULL WHEN 'not_applicable' THEN max_acceleration_mps2 IS NULL WHEN 'undefined' THEN max_acceleration_mps2 IS NULL WHEN 'incomplete' THEN max_acceleration_mps2 IS NULL WHEN 'error' THEN max_acceleration_mps2 IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_lateral_acceleration_mps2 CHECK (CASE max_lateral_acceleration_mps2_status WHEN 'value' THEN max_lateral_acceleration_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_lateral_acceleration_mps2 IS NULL WHEN 'not_applicable' THEN max_lateral_acceleration_mps2 IS NULL WHEN 'undefined' THEN max_lateral_acceleration_mps2 IS NULL WHEN 'incomplete' THEN max_lateral_acceleration_mps2 IS NULL WHEN 'error' THEN max_lateral_acceleration_mps2 IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_total_jerk_mps3 CHECK (CASE max_total_jerk_mps3_status WHEN 'value' THEN max_total_jerk_mps3 IS NOT NULL WHEN 'no_conflict' THEN max_total_jerk_mps3 IS NULL WHEN 'not_applicable' THEN max_total_jerk_mps3 IS NULL WHEN 'undefined' THEN max_total_jerk_mps3 IS NULL WHEN 'incomplete' THEN max_total_jerk_mps3 IS NULL WHEN 'error' THEN max_total_jerk_mps3 IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_yaw_rate_radps CHECK (CASE max_yaw_rate_radps_status WHEN 'value' THEN max_yaw_rate_radps IS NOT NULL WHEN 'no_conflict' THEN max_yaw_rate_radps IS NULL WHEN 'not_applicable' THEN max_yaw_rate_radps IS NULL WHEN 'undefined' THEN max_yaw_rate_radps IS NULL WHEN 'incomplete' THEN max_yaw_rate_radps IS NULL WHEN 'error' THEN max_yaw_rate_radps IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_yaw_acceleration_radps2 CHECK (CASE max_yaw_acceleration_radps2_status WHEN 'value' THEN max_yaw_acceleration_radps2 IS NOT NULL WHEN 'no_conflict' THEN max_yaw_acceleration_radps2 IS NULL WHEN 'not_applicable' THEN max_yaw_acceleration_radps2 IS NULL WHEN 'undefined' THEN max_yaw_acceleration_radps2 IS NULL WHEN 'incomplete' THEN max_yaw_acceleration_radps2 IS NULL WHEN 'error' THEN max_yaw_acceleration_radps2 IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_uncomfortable_time_s CHECK (CASE uncomfortable_time_s_status WHEN 'value' THEN uncomfortable_time_s IS NOT NULL WHEN 'no_conflict' THEN uncomfortable_time_s IS NULL WHEN 'not_applicable' THEN uncomfortable_time_s IS NULL WHEN 'undefined' THEN uncomfortable_time_s IS NULL WHEN 'incomplete' THEN uncomfortable_time_s IS NULL WHEN 'error' THEN uncomfortable_time_s IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_contact_at_fault CHECK (CASE contact_at_fault_status WHEN 'value' THEN contact_at_fault IS NOT NULL WHEN 'no_conflict' THEN contact_at_fault IS NULL WHEN 'not_applicable' THEN contact_at_fault IS NULL WHEN 'undefined' THEN contact_at_fault IS NULL WHEN 'incomplete' THEN contact_at_fault IS NULL WHEN 'error' THEN contact_at_fault IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_distance_to_safe_state_m CHECK (CASE distance_to_safe_state_m_status WHEN 'value' THEN distance_to_safe_state_m IS NOT NULL WHEN 'no_conflict' THEN distance_to_safe_state_m IS NULL WHEN 'not_applicable' THEN distance_to_safe_state_m IS NULL WHEN 'undefined' THEN distance_to_safe_state_m IS NULL WHEN 'incomplete' THEN distance_to_safe_state_m IS NULL WHEN 'error' THEN distance_to_safe_state_m IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_acceleration_disagreement_mps2 CHECK (CASE max_acceleration_disagreement_mps2_status WHEN 'value' THEN max_acceleration_disagreement_mps2 IS NOT NULL WHEN 'no_conflict' THEN max_acceleration_disagreement_mps2 IS NULL WHEN 'not_applicable' THEN max_acceleration_disagreement_mps2 IS NULL WHEN 'undefined' THEN max_acceleration_disagreement_mps2 IS NULL WHEN 'incomplete' THEN max_acceleration_disagreement_mps2 IS NULL WHEN 'error' THEN max_acceleration_disagreement_mps2 IS NULL ELSE 0 END), 
	CONSTRAINT ck_criticality_max_steering_disagreement_rad CHECK (CASE max_steering_disagreement_rad_status WHEN 'value' THEN max_steering_disagreement_rad IS NOT NULL WHEN 'no_conflict' THEN max_steering_disagreement_rad IS NULL WHEN 'not_applicable' THEN max_steering_disagreement_rad IS NULL WHEN 'undefined' THEN max_steering_disagreement_rad IS NULL WHEN 'incomplete' THEN max_steering_disagreement_rad IS NULL WHEN 'error' THEN max_steering_disagreement_rad IS NULL ELSE 0 END), 
	CONSTRAINT fk_criticality_run_number FOREIGN KEY(run_number) REFERENCES run (number)
)

--

CREATE TRIGGER criticality_no_update BEFORE UPDATE ON criticality
BEGIN SELECT RAISE(ABORT, 'criticality is insert-only'); END

--

CREATE TRIGGER criticality_no_delete BEFORE DELETE ON criticality
BEGIN SELECT RAISE(ABORT, 'criticality is insert-only'); END

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
LEFT JOIN criticality k ON k.run_number = r.number

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

--

CREATE TABLE decomposition (
	concept_digest VARCHAR(64) NOT NULL, 
	id TEXT NOT NULL, 
	scheme TEXT NOT NULL, 
	independence TEXT NOT NULL, 
	content TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_decomposition PRIMARY KEY (concept_digest, id), 
	CONSTRAINT fk_decomposition_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE dependent_failure (
	concept_digest VARCHAR(64) NOT NULL, 
	id TEXT NOT NULL, 
	owner TEXT NOT NULL, 
	valid_until TEXT NOT NULL, 
	argument TEXT NOT NULL, 
	content TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_dependent_failure PRIMARY KEY (concept_digest, id), 
	CONSTRAINT fk_dependent_failure_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE decomposition_child (
	concept_digest VARCHAR(64) NOT NULL, 
	fsr_id TEXT NOT NULL, 
	child_id TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_decomposition_child PRIMARY KEY (concept_digest, fsr_id, child_id), 
	CONSTRAINT fk_decomposition_child_concept_digest_fsr_id FOREIGN KEY(concept_digest, fsr_id) REFERENCES decomposition (concept_digest, id), 
	CONSTRAINT fk_decomposition_child_concept_digest_child_id FOREIGN KEY(concept_digest, child_id) REFERENCES fsr (concept_digest, id)
)

--

CREATE TABLE element_relation (
	concept_digest VARCHAR(64) NOT NULL, 
	element_id TEXT NOT NULL, 
	kind TEXT NOT NULL, 
	name TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_element_relation PRIMARY KEY (concept_digest, element_id, kind, name), 
	CONSTRAINT fk_element_relation_concept_digest_element_id FOREIGN KEY(concept_digest, element_id) REFERENCES element (concept_digest, id), 
	CONSTRAINT ck_element_relation_kind CHECK (kind = 'resource' OR kind = 'software' OR kind = 'supplier' OR kind = 'provides' OR kind = 'consumes')
)

--

CREATE TRIGGER decomposition_no_update BEFORE UPDATE ON decomposition
BEGIN SELECT RAISE(ABORT, 'decomposition is insert-only'); END

--

CREATE TRIGGER decomposition_no_delete BEFORE DELETE ON decomposition
BEGIN SELECT RAISE(ABORT, 'decomposition is insert-only'); END

--

CREATE TRIGGER dependent_failure_no_update BEFORE UPDATE ON dependent_failure
BEGIN SELECT RAISE(ABORT, 'dependent_failure is insert-only'); END

--

CREATE TRIGGER dependent_failure_no_delete BEFORE DELETE ON dependent_failure
BEGIN SELECT RAISE(ABORT, 'dependent_failure is insert-only'); END

--

CREATE TRIGGER decomposition_child_no_update BEFORE UPDATE ON decomposition_child
BEGIN SELECT RAISE(ABORT, 'decomposition_child is insert-only'); END

--

CREATE TRIGGER decomposition_child_no_delete BEFORE DELETE ON decomposition_child
BEGIN SELECT RAISE(ABORT, 'decomposition_child is insert-only'); END

--

CREATE TRIGGER element_relation_no_update BEFORE UPDATE ON element_relation
BEGIN SELECT RAISE(ABORT, 'element_relation is insert-only'); END

--

CREATE TRIGGER element_relation_no_delete BEFORE DELETE ON element_relation
BEGIN SELECT RAISE(ABORT, 'element_relation is insert-only'); END

--

CREATE VIEW v_hazard_asil AS
SELECT e.concept_digest AS concept, e.id AS event,
    CASE WHEN e.severity NOT IN ('S0', 'S1', 'S2', 'S3')
        OR e.exposure NOT IN ('E0', 'E1', 'E2', 'E3', 'E4')
        OR e.controllability NOT IN ('C0', 'C1', 'C2', 'C3') THEN 'unknown'
    WHEN e.severity = 'S0' OR e.exposure = 'E0' OR e.controllability = 'C0' THEN NULL
    ELSE CASE substr(e.severity, 2) + substr(e.exposure, 2) + substr(e.controllability, 2)
        WHEN 10 THEN 'D' WHEN 9 THEN 'C' WHEN 8 THEN 'B' WHEN 7 THEN 'A' ELSE 'QM' END
    END AS asil
FROM hazardous_event e

--

CREATE VIEW v_goal_events AS
SELECT g.concept_digest AS concept, g.id AS goal, j.value AS event
FROM safety_goal g JOIN json_each(g.content, '$.hazardous_events') j

--

CREATE VIEW v_goal_asil AS
SELECT g.concept_digest AS concept, g.id AS goal, MAX(CASE substr(g.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END, COALESCE((
    SELECT MAX(CASE substr(e.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END) FROM v_goal_events v
    JOIN v_hazard_asil e ON e.concept = v.concept AND e.event = v.event
    WHERE v.concept = g.concept_digest AND v.goal = g.id), -9)) AS rank
FROM safety_goal g

--

CREATE VIEW v_fsr_goals AS
SELECT f.concept_digest AS concept, f.id AS fsr, j.value AS goal,
    (SELECT value FROM json_each(f.content, '$.fdti')) AS fdti_s,
    (SELECT value FROM json_each(f.content, '$.frti')) AS frti_s,
    (SELECT value FROM json_each(f.content, '$.emergency_operation_interval'))
        AS emergency_operation_s
FROM fsr f JOIN json_each(f.content, '$.goals') j

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
    SELECT concept_digest, id, 'element', id FROM element
    UNION
    SELECT a.concept, a.element, x.kind, x.name
    FROM above a JOIN edge x ON x.concept = a.concept AND x.source = a.name
    WHERE a.kind = 'element')
SELECT concept, element, kind, name FROM above

--

CREATE VIEW v_fsr_causes AS
SELECT DISTINCT a.concept_digest AS concept, a.fsr_id AS fsr, x.kind, x.name
FROM allocation a
JOIN v_element_causes x ON x.concept = a.concept_digest AND x.element = a.element_id

--

CREATE VIEW v_case_counts AS
SELECT k.campaign_id AS campaign, k.scenario, k.architecture, k.inside_odd, COUNT(*) AS planned,
    COUNT(r.number) AS results
FROM campaign_case k LEFT JOIN run r ON r.result_digest = k.result_digest
GROUP BY k.campaign_id, k.scenario, k.architecture, k.inside_odd

--

CREATE VIEW v_check_hazard_asil AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    e.severity || ' ' || e.exposure || ' ' || e.controllability || ' give '
        || COALESCE(h.asil, 'no ASIL') || ', the event has ' || COALESCE(e.asil, 'none') AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
JOIN v_hazard_asil h ON h.concept = e.concept_digest AND h.event = e.id
WHERE h.asil IS NOT e.asil

--

CREATE VIEW v_check_hazard_without_goal AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    'ASIL ' || e.asil || ', and no safety goal is against it' AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
WHERE e.asil <> 'QM' AND NOT EXISTS (
    SELECT 1 FROM v_goal_events g WHERE g.concept = e.concept_digest AND g.event = e.id)

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

CREATE VIEW v_check_goal_without_fsr AS
SELECT c.id AS campaign, 'safety_goal' AS part, g.id,
    'ASIL ' || g.asil || ', and no requirement serves it' AS detail
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM v_fsr_goals s WHERE s.concept = g.concept_digest AND s.goal = g.id)

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

CREATE VIEW v_check_fsr_without_allocation AS
SELECT c.id AS campaign, 'fsr' AS part, f.id, 'no element has to meet it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM allocation a WHERE a.concept_digest = f.concept_digest AND a.fsr_id = f.id)

--

CREATE VIEW v_check_fsr_without_measure AS
SELECT c.id AS campaign, 'fsr' AS part, f.id, 'nothing measures it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE f.measure NOT GLOB '*[^ ]*'

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

CREATE VIEW v_check_element_capability AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'ASIL ' || f.asil || ' on ' || e.id || ', which is capable of ' || e.asil_capability AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
JOIN allocation a ON a.concept_digest = f.concept_digest AND a.fsr_id = f.id
JOIN element e ON e.concept_digest = a.concept_digest AND e.id = a.element_id
WHERE CASE substr(e.asil_capability, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END < CASE substr(f.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END

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
        MIN(CASE substr(f.asil, -2, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END) AS least, MAX(CASE substr(f.asil, -2, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END) AS most,
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
    OR k.least IS NOT g.rank OR k.most IS NOT g.rank

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

CREATE VIEW v_check_independence_argument AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    'nobody says why ' || d.scheme || ' are independent' AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
WHERE d.independence NOT GLOB '*[^ ]*'

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
    JOIN json_each(w.content, '$.covers') v
    WHERE v.value = a.name)

--

CREATE VIEW v_check_expired_dfa AS
SELECT c.id AS campaign, 'dependent_failure' AS part, w.id,
    'was valid until ' || w.valid_until AS detail
FROM campaign c
JOIN dependent_failure w ON w.concept_digest = c.concept_digest
WHERE w.valid_until < date('now')

--

CREATE VIEW v_check_expired_assumption AS
SELECT c.id AS campaign, 'assumption' AS part, a.id,
    'was valid until ' || a.valid_until || ', of ' || a.owner AS detail
FROM campaign c
JOIN assumption a ON a.concept_digest = c.concept_digest
WHERE a.valid_until < date('now')

--

CREATE VIEW v_check_expired_waiver AS
SELECT c.id AS campaign, 'waiver' AS part, r.value AS id,
    'expired on ' || u.value AS detail
FROM campaign c
JOIN concept k ON k.digest = c.concept_digest
JOIN json_each(k.content, '$.waivers') w
JOIN json_each(w.value, '$.requirement') r
JOIN json_each(w.value, '$.expires') u
WHERE u.value < date('now')

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

CREATE VIEW v_check_emergency_operation AS
SELECT c.id AS campaign, 'fsr' AS part, s.fsr AS id,
    'emergency operation of ' || s.emergency_operation_s || ' s, and ' || g.id || ' tolerates '
        || COALESCE((SELECT value FROM json_each(g.content, '$.eotti')) || ' s', 'none') AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
WHERE s.emergency_operation_s
    > COALESCE((SELECT value FROM json_each(g.content, '$.eotti')), 0.0) + 1e-9

--

CREATE VIEW v_check_response_beyond_budget AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'the formula gives ' || CASE typeof(w.value) WHEN 'text' THEN 'unbounded time'
        ELSE w.value || ' s' END || ' to respond, fdti and frti give '
        || b.budget_s || ' s' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
JOIN json_each(f.content, '$.response_s') w
JOIN (
    SELECT DISTINCT concept, fsr, COALESCE(fdti_s, 0.0) + COALESCE(frti_s, 0.0) AS budget_s
    FROM v_fsr_goals WHERE COALESCE(fdti_s, frti_s) IS NOT NULL) b
    ON b.concept = f.concept_digest AND b.fsr = f.id
WHERE w.value > b.budget_s + 1e-9

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

CREATE VIEW v_check_hazard_without_scenario AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    'no requirement of its goals is judged in ' || l.value AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
JOIN json_each(e.content, '$.scenarios') l
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
JOIN json_each(c.factors) x
JOIN json_each(x.value, '$.scenario') n
WHERE NOT EXISTS (
    SELECT 1 FROM campaign_fsr p
    WHERE p.campaign_id = c.id AND p.scenario = n.value AND p.planned > 0)

--

CREATE VIEW v_check_not_applicable_in_gate AS
SELECT DISTINCT p.campaign_id AS campaign, 'fsr' AS part, p.fsr_id AS id,
    'not applicable to ' || p.architecture || ': ' || COALESCE(p.reason, 'no reason') AS detail
FROM campaign_fsr p
WHERE p.in_gate AND p.mandatory AND NOT p.applicable

--

CREATE VIEW v_check_not_run AS
SELECT campaign, 'scenario' AS part, scenario AS id,
    SUM(planned - results) || ' of ' || SUM(planned) || ' test cases of ' || architecture
        || ' have no result' AS detail
FROM v_case_counts
GROUP BY campaign, scenario, architecture
HAVING SUM(results) < SUM(planned)

--

CREATE VIEW v_check_stale_evidence AS
SELECT s.campaign_id AS campaign, 'fsr' AS part, s.fsr_id AS id,
    (SUM(s.results) - SUM(COALESCE(j.runs, 0))) || ' of ' || SUM(s.results)
        || ' results are not judged by it' AS detail
FROM (SELECT f.campaign_id, f.fsr_id, f.architecture, f.scenario, SUM(n.results) AS results
    FROM campaign_fsr f
    JOIN v_case_counts n ON n.campaign = f.campaign_id AND n.scenario = f.scenario
        AND n.architecture = f.architecture
        AND CASE f.applies WHEN 'everywhere' THEN 1 WHEN 'inside' THEN n.inside_odd
            ELSE NOT n.inside_odd END
    WHERE f.applicable
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
        AND CASE f.applies WHEN 'everywhere' THEN 1 WHEN 'inside' THEN n.inside_odd
            ELSE NOT n.inside_odd END
    WHERE f.applicable
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
    SELECT y.architecture_digest, MAX(x.number) AS number, x.plugins_digest
    FROM run x JOIN test_case y ON y.digest = x.test_case_digest
    GROUP BY y.architecture_digest) n ON n.architecture_digest = t.architecture_digest
WHERE r.plugins_digest <> n.plugins_digest
GROUP BY k.campaign_id, k.architecture

--

CREATE VIEW v_check_vacuous_fsr AS
SELECT campaign_id AS campaign, 'fsr' AS part, fsr_id AS id,
    'exercised in none of ' || SUM(runs) || ' runs' AS detail
FROM tally
GROUP BY campaign_id, fsr_id
HAVING SUM(exercised) = 0

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

--

CREATE TABLE campaign_use (
	number INTEGER NOT NULL, 
	campaign_id VARCHAR(32) NOT NULL, 
	at TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_campaign_use PRIMARY KEY (number), 
	CONSTRAINT fk_campaign_use_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TRIGGER campaign_use_no_update BEFORE UPDATE ON campaign_use
BEGIN SELECT RAISE(ABORT, 'campaign_use is insert-only'); END

--

CREATE TRIGGER campaign_use_no_delete BEFORE DELETE ON campaign_use
BEGIN SELECT RAISE(ABORT, 'campaign_use is insert-only'); END

--

CREATE VIEW v_campaigns AS
SELECT number, id AS campaign, odd_id AS odd, title, planned, created_at,
    ROW_NUMBER() OVER (ORDER BY COALESCE((
        SELECT MAX(u.number) FROM campaign_use u WHERE u.campaign_id = campaign.id), 0) DESC,
        number DESC) AS recency
FROM campaign
