-- FSRs whose blocks are done, and what is counted of them once is missing.
SELECT DISTINCT f.fsr_id, f.architecture FROM campaign_fsr f
LEFT JOIN case_repeat a ON a.campaign_id = f.campaign_id AND a.fsr_id = f.fsr_id
    AND a.architecture = f.architecture AND a.scenario = ''
WHERE f.campaign_id = :campaign AND f.applicable = 1
    AND NOT EXISTS (
        SELECT 1 FROM work w WHERE w.campaign_id = f.campaign_id AND w.state <> 'done')
    AND COALESCE(a.unheld, -1) <> (
        SELECT COUNT(*) FROM never_held h WHERE h.campaign_id = f.campaign_id
            AND h.fsr_id = f.fsr_id AND h.architecture = f.architecture)
ORDER BY f.fsr_id, f.architecture
