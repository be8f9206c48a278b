CREATE VIEW v_verdicts AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    c.result_digest AS run, c.test_case_digest AS test_case, f.fsr_id AS fsr, f.asil, f.mandatory,
    COALESCE(v.verdict, 'NOT_RUN') AS verdict, v.exercised, v.margin, v.unit, v.robustness_low,
    v.robustness_high, v.signal, v.predicate, v.time_s, v.actor, v.value, v.threshold, v.detail
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN campaign_fsr f ON $judged
LEFT JOIN run r ON r.result_digest = c.result_digest
LEFT JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
    AND NOT EXISTS (SELECT 1 FROM withdrawal x WHERE x.result_digest = c.result_digest)
