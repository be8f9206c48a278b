-- A mandatory requirement cannot be judged for an architecture of the gate.
-- Write it over signals that the architecture has, or take that out of the gate.
CREATE VIEW v_check_not_applicable_in_gate AS
SELECT DISTINCT p.campaign_id AS campaign, 'fsr' AS part, p.fsr_id AS id,
    'not applicable to ' || p.architecture || ': ' || COALESCE(p.reason, 'no reason') AS detail
FROM campaign_fsr p
WHERE p.in_gate = 1 AND p.mandatory = 1 AND p.applicable = 0
