"""Built-in metrics by the table that holds them.

The rows of ``metric`` are part of the hash of a result. A metric that came later must not change
what was hashed: it stands in a table of its own, and a result that is older lacks it.
"""

from __future__ import annotations

from typing import Final

FIRST_METRIC_IDS: Final = (
    "contact",
    "impact_speed_mps",
    "min_distance_m",
    "min_ttc_s",
    "min_time_headway_s",
    "max_drac_mps2",
    "max_required_deceleration_mps2",
    "rss_violation_s",
    "fault_to_safe_state_s",
    "max_jerk_mps3",
    "max_deceleration_mps2",
    "max_lane_offset_m",
    "first_detection_distance_m",
    "takeover_time_s",
    "standstill_gap_m",
    "detection_latency_s",
    "missed_time_s",
    "false_track_time_s",
    "range_error_rms_m",
    "position_error_p95_m",
    "rear_detection_margin_m",
)
"""Of the first schema, in ``metric``."""

TIMING_IDS: Final = (
    "fault_detection_time_s",
    "fault_reaction_time_s",
    "fault_handling_time_s",
    "emergency_operation_time_s",
    "nominal_availability",
    "takeovers",
    "trips",
    "stop_rating",
    "stop_regret",
)
"""In the table ``timing``."""

CRITICALITY_IDS: Final = (
    "min_time_gap_s",
    "min_mttc_s",
    "min_ettc_s",
    "max_mdrac_mps2",
    "max_dst_mps2",
    "min_mtc",
    "min_psd",
    "max_btn",
    "max_stn",
    "min_ttb_s",
    "min_tts_s",
    "min_ttk_s",
    "min_ttr_s",
    "tet_s",
    "tit_s2",
    "tet_share",
    "tit_mean_s",
    "crash_potential",
    "time_to_accident_s",
    "min_rss_ratio",
    "rss_response_violation_s",
    "min_ttc_2d_s",
    "min_wttc_s",
    "min_dce_m",
    "min_ttce_s",
    "min_pet_s",
    "pet_overlap_s",
    "max_encroachment_time_s",
    "min_predicted_pet_s",
    "min_rear_ttc_s",
    "max_follower_deceleration_mps2",
    "delta_v_mps",
    "other_delta_v_mps",
    "fatality_probability",
    "max_acceleration_mps2",
    "max_lateral_acceleration_mps2",
    "max_total_jerk_mps3",
    "max_yaw_rate_radps",
    "max_yaw_acceleration_radps2",
    "uncomfortable_time_s",
    "contact_at_fault",
    "distance_to_safe_state_m",
    "max_acceleration_disagreement_mps2",
    "max_steering_disagreement_rad",
)
"""In the table ``criticality``."""

METRIC_IDS: Final = (*FIRST_METRIC_IDS, *TIMING_IDS, *CRITICALITY_IDS)
"""All of them, four columns each: value, status, time of the worst case, actor."""

TABLES: Final = {
    "metric": FIRST_METRIC_IDS,
    "timing": TIMING_IDS,
    "criticality": CRITICALITY_IDS,
}
"""The tables that hold them."""
