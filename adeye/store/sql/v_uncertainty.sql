-- Pairs of which a run is withdrawn are none, and what is left of a sample tells no uncertainty.
CREATE VIEW v_uncertainty AS
SELECT u.campaign_id AS campaign, u.scenario, u.architecture, u.kind, u.name, u.unit, u.sampled,
    CASE WHEN w.pairs IS NULL THEN u.pairs WHEN u.pairs > w.pairs THEN u.pairs - w.pairs ELSE 0
        END AS pairs,
    CASE WHEN w.pairs IS NULL THEN u.p95 END AS p95,
    CASE WHEN w.pairs IS NULL THEN u.largest END AS largest,
    CASE WHEN w.pairs IS NULL THEN u.uncertainty END AS uncertainty,
    CASE WHEN w.pairs IS NULL THEN u.differing ELSE 0 END AS differing,
    CASE WHEN w.pairs IS NULL THEN u.changes ELSE '{}' END AS changes
FROM uncertainty u
LEFT JOIN (
    SELECT c.campaign_id, c.scenario, c.architecture, COUNT(DISTINCT h.origin_digest) AS pairs
    FROM withdrawal x
    JOIN half_step h ON x.result_digest IN (h.result_digest, h.origin_digest)
    JOIN campaign_case c ON c.result_digest = h.origin_digest
    GROUP BY c.campaign_id, c.scenario, c.architecture) w ON w.campaign_id = u.campaign_id
    AND w.scenario = u.scenario AND w.architecture = u.architecture
