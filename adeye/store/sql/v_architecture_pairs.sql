-- CROSS JOIN keeps the order of the tables: along the pairs, which lie in the order of the plan.
-- What few ask for is looked up in the list of columns, so that nobody else waits for it.
CREATE VIEW v_architecture_pairs AS
SELECT a.campaign_id AS campaign, ca.scenario, a.fault_entry,
    (SELECT t.situation_digest FROM test_case t WHERE t.digest = ca.test_case_digest) AS situation,
    (SELECT t.parameters FROM test_case t WHERE t.digest = ca.test_case_digest) AS parameters,
    (SELECT t.replicate FROM test_case t WHERE t.digest = ca.test_case_digest) AS replicate,
    ca.architecture AS architecture_a, cb.architecture AS architecture_b, ca.point AS point_a,
    cb.point AS point_b, ca.result_digest AS run_a, cb.result_digest AS run_b,
    (SELECT r.outcome FROM run r WHERE r.number = ma.run_number) AS outcome_a,
    (SELECT r.outcome FROM run r WHERE r.number = mb.run_number) AS outcome_b,
    $differences,
    $verdicts_a AS verdicts_a, $verdicts_b AS verdicts_b
FROM case_match a
CROSS JOIN case_match b ON b.campaign_id = a.campaign_id AND b.first_ordinal = a.first_ordinal
    AND b.ordinal <> a.ordinal
CROSS JOIN campaign_case ca ON ca.campaign_id = a.campaign_id AND ca.ordinal = a.ordinal
CROSS JOIN campaign_case cb ON cb.campaign_id = b.campaign_id AND cb.ordinal = b.ordinal
LEFT JOIN case_run oa ON oa.campaign_id = ca.campaign_id AND oa.ordinal = ca.ordinal
LEFT JOIN case_run ob ON ob.campaign_id = cb.campaign_id AND ob.ordinal = cb.ordinal
JOIN metric ma ON ma.run_number = $number_a
JOIN metric mb ON mb.run_number = $number_b
WHERE cb.architecture > ca.architecture
    AND NOT EXISTS (SELECT 1 FROM withdrawal y
        WHERE y.result_digest IN (ca.result_digest, cb.result_digest))
    AND (cb.point = ca.point OR NOT EXISTS (
        SELECT 1 FROM json_each(ca.point) x JOIN json_each(cb.point) y
            ON y.key = x.key AND (y.value <> x.value OR (y.value IS NULL) <> (x.value IS NULL))))
