-- Runs that nothing has asked for.
SELECT result_digest FROM run r
WHERE NOT EXISTS (SELECT 1 FROM campaign_case c WHERE c.result_digest = r.result_digest)
    AND NOT EXISTS (SELECT 1 FROM fork f WHERE f.result_digest = r.result_digest)
    AND NOT EXISTS (SELECT 1 FROM half_step h WHERE h.result_digest = r.result_digest)
    AND NOT EXISTS (SELECT 1 FROM benchmark b WHERE b.drive_digest = r.result_digest)
ORDER BY result_digest
