-- What is said of the runs that pass an FSR.
SELECT DISTINCT c.architecture, v.detail FROM $judged_cases
WHERE c.campaign_id = ? AND f.fsr_id = ? AND v.verdict = 'PASS'
