-- The cases of a plan, in its order.
SELECT c.scenario, c.architecture, t.fault_entry, t.situation_digest
FROM campaign_case c JOIN test_case t ON t.digest = c.test_case_digest
WHERE c.campaign_id = ? ORDER BY c.ordinal
