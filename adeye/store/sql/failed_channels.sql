-- How often which channel failed how in a campaign, and whether that is mastered.
SELECT architecture, channel, told, mastered, COUNT(*) FROM (
    SELECT c.architecture AS architecture, r.outcome_channel AS channel,
        r.outcome || ': ' || COALESCE(r.outcome_detail, '') AS told, $first AS mastered
    FROM run r CROSS JOIN campaign_case c ON c.result_digest = r.result_digest
    WHERE r.outcome_channel IS NOT NULL AND c.campaign_id = ?
    UNION ALL
    SELECT c.architecture, e.subject, e.text, $later
    FROM run r CROSS JOIN campaign_case c ON c.result_digest = r.result_digest
    JOIN event e ON e.run_number = r.number
    WHERE r.outcome_channel IS NOT NULL AND c.campaign_id = ? AND e.kind = 'channel'
        AND e.subject <> r.outcome_channel AND SUBSTR(e.text, 1, 8) = 'channel_'
) AS failed GROUP BY 1, 2, 3, 4 ORDER BY 1, 2, 3, 4
