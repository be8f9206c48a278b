-- How often which channel failed how in a campaign, and whether that is mastered; apart for the twins
-- with half the step that its verdicts rest on, which are mastered where the run itself is.
SELECT architecture, channel, told, mastered, is_twin, COUNT(*) FROM (
    SELECT c.architecture AS architecture, r.outcome_channel AS channel,
        r.outcome || ': ' || COALESCE(r.outcome_detail, '') AS told, $first AS mastered,
        0 AS is_twin
    FROM run r CROSS JOIN campaign_case c ON c.result_digest = r.result_digest
    WHERE r.outcome_channel IS NOT NULL AND c.campaign_id = ?
    UNION ALL
    SELECT c.architecture, e.subject, e.text, $later, 0
    FROM run r CROSS JOIN campaign_case c ON c.result_digest = r.result_digest
    JOIN event e ON e.run_number = r.number
    WHERE r.outcome_channel IS NOT NULL AND c.campaign_id = ? AND e.kind = 'channel'
        AND e.subject <> r.outcome_channel AND SUBSTR(e.text, 1, 8) = 'channel_'
    UNION ALL
    SELECT c.architecture, t.outcome_channel, t.outcome || ': ' || COALESCE(t.outcome_detail, ''),
        $twin, 1
    FROM $twins
    WHERE t.outcome_channel IS NOT NULL AND c.campaign_id = ?
    UNION ALL
    SELECT c.architecture, e.subject, e.text, $later, 1
    FROM $twins
    JOIN event e ON e.run_number = t.number
    WHERE t.outcome_channel IS NOT NULL AND c.campaign_id = ? AND e.kind = 'channel'
        AND e.subject <> t.outcome_channel AND SUBSTR(e.text, 1, 8) = 'channel_'
) AS failed GROUP BY 1, 2, 3, 4, 5 ORDER BY 1, 2, 3, 4, 5
