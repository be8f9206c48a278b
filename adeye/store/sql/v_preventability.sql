CREATE VIEW v_preventability AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    b.result_digest AS run, b.model, b.edition, b.drive_digest AS drive, m.contact,
    r.realised, m.impact_speed_mps, n.contact AS drive_contact, d.realised AS drive_realised,
    n.impact_speed_mps AS drive_impact_speed_mps
FROM benchmark b
JOIN run r ON r.result_digest = b.result_digest
JOIN metric m ON m.run_number = r.number
JOIN run d ON d.result_digest = b.drive_digest
JOIN metric n ON n.run_number = d.number
JOIN campaign_case c ON c.result_digest = b.result_digest
JOIN test_case t ON t.digest = c.test_case_digest
WHERE b.version = (SELECT MAX(x.version) FROM benchmark x
    WHERE x.result_digest = b.result_digest AND x.model = b.model AND x.edition = b.edition)
    AND NOT EXISTS (SELECT 1 FROM withdrawal y
        WHERE y.result_digest IN (b.result_digest, b.drive_digest))
