CREATE VIEW v_uncertainty AS
SELECT campaign_id AS campaign, scenario, architecture, kind, name, unit, sampled, pairs, p95,
    largest, uncertainty, differing, changes
FROM uncertainty
