-- How often which channel failed how in a campaign, and whether that is mastered; apart for the twins
-- with half the step that its verdicts rest on, which are mastered where the run itself is.
WITH tried AS (
    SELECT c.campaign_id, c.architecture, c.scenario, c.inside_odd, r.number AS failed,
        r.number AS judged, 0 AS is_twin, r.outcome, r.outcome_channel, r.outcome_detail
    FROM run r CROSS JOIN campaign_case c ON c.result_digest = r.result_digest
    WHERE r.outcome_channel IS NOT NULL AND c.campaign_id = ?
    UNION ALL
    SELECT c.campaign_id, c.architecture, c.scenario, c.inside_odd, t.number,
        r.number, 1, t.outcome, t.outcome_channel, t.outcome_detail
    FROM $twins JOIN run t ON t.result_digest = h.result_digest
    JOIN run r ON r.result_digest = h.origin_digest
    WHERE t.outcome_channel IS NOT NULL AND c.campaign_id = ?
)
SELECT architecture, channel, told, mastered, is_twin, COUNT(*) FROM (
    SELECT c.architecture AS architecture, c.outcome_channel AS channel,
        c.outcome || ': ' || COALESCE(c.outcome_detail, '') AS told, $first AS mastered, c.is_twin
    FROM tried c
    UNION ALL
    SELECT c.architecture, e.subject, e.text, $later, c.is_twin
    FROM tried c JOIN event e ON e.run_number = c.failed
    WHERE e.kind = 'channel' AND e.subject <> c.outcome_channel
        AND SUBSTR(e.text, 1, 8) = 'channel_'
) AS failed GROUP BY 1, 2, 3, 4, 5 ORDER BY 1, 2, 3, 4, 5
