-- Whether a run exercises an FSR about the failure, which passes.
CASE WHEN EXISTS (
    SELECT 1 FROM campaign_fsr f
    JOIN verdict v ON v.run_number = c.judged AND v.fsr_digest = f.fsr_digest
    WHERE $judged AND v.verdict = 'PASS' AND v.exercised = 1 AND ($about)) THEN 1 ELSE 0 END
