-- Cases, and results, of the side of the ODD on which an FSR is judged.
FROM campaign_fsr f
    JOIN v_case_counts n ON n.campaign = f.campaign_id AND n.scenario = f.scenario
        AND n.architecture = f.architecture
        AND f.applies IN ('everywhere', CASE n.inside_odd WHEN 1 THEN 'inside' ELSE 'outside' END)
    WHERE f.applicable = 1
    GROUP BY f.campaign_id, f.fsr_id, f.architecture, f.scenario
