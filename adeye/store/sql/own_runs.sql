-- Numbers of the runs that a campaign has or no campaign has, such as forks.
SELECT r.number FROM run r
WHERE EXISTS (SELECT 1 FROM campaign_case c
    WHERE c.result_digest = r.result_digest AND c.campaign_id = ?)
OR NOT EXISTS (SELECT 1 FROM campaign_case c
    WHERE c.result_digest = r.result_digest AND c.campaign_id <> ?)
ORDER BY r.number
