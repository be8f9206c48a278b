-- Evidence was made with another version than the newest in the database.
-- Run the ODD again with this release and the code as it is.
CREATE VIEW v_check_older_version AS
SELECT k.campaign_id AS campaign, 'architecture' AS part, k.architecture AS id,
    COUNT(*) || ' runs are of numerics version ' || r.numerics_version || ', the newest is of '
        || (SELECT MAX(numerics_version) FROM run) AS detail
FROM campaign_case k JOIN run r ON r.result_digest = k.result_digest
WHERE r.numerics_version < (SELECT MAX(numerics_version) FROM run)
GROUP BY k.campaign_id, k.architecture, r.numerics_version
UNION ALL
SELECT k.campaign_id, 'architecture', k.architecture,
    COUNT(*) || ' runs were made before the code of its plug-ins changed'
FROM campaign_case k
JOIN run r ON r.result_digest = k.result_digest
JOIN test_case t ON t.digest = r.test_case_digest
JOIN (
    SELECT y.architecture_digest, MAX(x.number) AS number
    FROM run x JOIN test_case y ON y.digest = x.test_case_digest
    GROUP BY y.architecture_digest) n ON n.architecture_digest = t.architecture_digest
JOIN run last ON last.number = n.number
WHERE r.plugins_digest <> last.plugins_digest
GROUP BY k.campaign_id, k.architecture
