CREATE VIEW v_faults AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    c.result_digest AS run, i.class, i.fdti_s, i.frti_s, i.fhti_s, i.eoti_s, i.ftti_s,
    i.ftti_s - i.fhti_s AS margin_s,
    $moments,
    i.fault_free_violation_s, i.without_mechanism, i.twins
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN injection i ON i.result_digest = c.result_digest
WHERE i.version = (SELECT MAX(x.version) FROM injection x
    WHERE x.result_digest = i.result_digest)
    AND NOT EXISTS (SELECT 1 FROM withdrawal y WHERE y.result_digest = c.result_digest)
