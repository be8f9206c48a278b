-- The cases of a block that have a run, and whether it exercises an FSR.
SELECT c.campaign_id, c.ordinal, r.number, c.scenario, c.architecture, t.fault_entry,
    CASE WHEN EXISTS (
        SELECT 1 FROM campaign_fsr f
        JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
        WHERE $judged AND v.exercised = 1) THEN 1 ELSE 0 END
FROM work w
JOIN campaign_case c ON c.campaign_id = w.campaign_id
    AND c.ordinal >= w.from_ordinal AND c.ordinal < w.to_ordinal
JOIN test_case t ON t.digest = c.test_case_digest
JOIN run r ON r.result_digest = c.result_digest
WHERE w.id = ? ORDER BY c.ordinal
