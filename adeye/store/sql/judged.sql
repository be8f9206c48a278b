SELECT campaign_id, fsr_id, architecture, scenario, SUM(runs) AS runs
    FROM tally GROUP BY campaign_id, fsr_id, architecture, scenario
