-- Schema 0006 for SQLite. A line of two dashes stands between statements.

--

CREATE TABLE decomposition (
	concept_digest VARCHAR(64) NOT NULL, 
	id TEXT NOT NULL, 
	scheme TEXT NOT NULL, 
	independence TEXT NOT NULL, 
	content TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_decomposition PRIMARY KEY (concept_digest, id), 
	CONSTRAINT fk_decomposition_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE dependent_failure (
	concept_digest VARCHAR(64) NOT NULL, 
	id TEXT NOT NULL, 
	owner TEXT NOT NULL, 
	valid_until TEXT NOT NULL, 
	argument TEXT NOT NULL, 
	content TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_dependent_failure PRIMARY KEY (concept_digest, id), 
	CONSTRAINT fk_dependent_failure_concept_digest FOREIGN KEY(concept_digest) REFERENCES concept (digest)
)

--

CREATE TABLE decomposition_child (
	concept_digest VARCHAR(64) NOT NULL, 
	fsr_id TEXT NOT NULL, 
	child_id TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_decomposition_child PRIMARY KEY (concept_digest, fsr_id, child_id), 
	CONSTRAINT fk_decomposition_child_concept_digest_fsr_id FOREIGN KEY(concept_digest, fsr_id) REFERENCES decomposition (concept_digest, id), 
	CONSTRAINT fk_decomposition_child_concept_digest_child_id FOREIGN KEY(concept_digest, child_id) REFERENCES fsr (concept_digest, id)
)

--

CREATE TABLE element_relation (
	concept_digest VARCHAR(64) NOT NULL, 
	element_id TEXT NOT NULL, 
	kind TEXT NOT NULL, 
	name TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_element_relation PRIMARY KEY (concept_digest, element_id, kind, name), 
	CONSTRAINT fk_element_relation_concept_digest_element_id FOREIGN KEY(concept_digest, element_id) REFERENCES element (concept_digest, id), 
	CONSTRAINT ck_element_relation_kind CHECK (kind = 'resource' OR kind = 'software' OR kind = 'supplier' OR kind = 'provides' OR kind = 'consumes')
)

--

CREATE TRIGGER decomposition_no_update BEFORE UPDATE ON decomposition
BEGIN SELECT RAISE(ABORT, 'decomposition is insert-only'); END

--

CREATE TRIGGER decomposition_no_delete BEFORE DELETE ON decomposition
BEGIN SELECT RAISE(ABORT, 'decomposition is insert-only'); END

--

CREATE TRIGGER dependent_failure_no_update BEFORE UPDATE ON dependent_failure
BEGIN SELECT RAISE(ABORT, 'dependent_failure is insert-only'); END

--

CREATE TRIGGER dependent_failure_no_delete BEFORE DELETE ON dependent_failure
BEGIN SELECT RAISE(ABORT, 'dependent_failure is insert-only'); END

--

CREATE TRIGGER decomposition_child_no_update BEFORE UPDATE ON decomposition_child
BEGIN SELECT RAISE(ABORT, 'decomposition_child is insert-only'); END

--

CREATE TRIGGER decomposition_child_no_delete BEFORE DELETE ON decomposition_child
BEGIN SELECT RAISE(ABORT, 'decomposition_child is insert-only'); END

--

CREATE TRIGGER element_relation_no_update BEFORE UPDATE ON element_relation
BEGIN SELECT RAISE(ABORT, 'element_relation is insert-only'); END

--

CREATE TRIGGER element_relation_no_delete BEFORE DELETE ON element_relation
BEGIN SELECT RAISE(ABORT, 'element_relation is insert-only'); END

--

CREATE VIEW v_hazard_asil AS
SELECT e.concept_digest AS concept, e.id AS event,
    CASE WHEN e.severity NOT IN ('S0', 'S1', 'S2', 'S3')
        OR e.exposure NOT IN ('E0', 'E1', 'E2', 'E3', 'E4')
        OR e.controllability NOT IN ('C0', 'C1', 'C2', 'C3') THEN 'unknown'
    WHEN e.severity = 'S0' OR e.exposure = 'E0' OR e.controllability = 'C0' THEN NULL
    ELSE CASE substr(e.severity, 2) + substr(e.exposure, 2) + substr(e.controllability, 2)
        WHEN 10 THEN 'D' WHEN 9 THEN 'C' WHEN 8 THEN 'B' WHEN 7 THEN 'A' ELSE 'QM' END
    END AS asil
FROM hazardous_event e

--

CREATE VIEW v_goal_events AS
SELECT g.concept_digest AS concept, g.id AS goal, j.value AS event
FROM safety_goal g JOIN json_each(g.content, '$.hazardous_events') j

--

CREATE VIEW v_goal_asil AS
SELECT g.concept_digest AS concept, g.id AS goal, MAX(CASE substr(g.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END, COALESCE((
    SELECT MAX(CASE substr(e.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END) FROM v_goal_events v
    JOIN v_hazard_asil e ON e.concept = v.concept AND e.event = v.event
    WHERE v.concept = g.concept_digest AND v.goal = g.id), -9)) AS rank
FROM safety_goal g

--

CREATE VIEW v_fsr_goals AS
SELECT f.concept_digest AS concept, f.id AS fsr, j.value AS goal,
    (SELECT value FROM json_each(f.content, '$.fdti')) AS fdti_s,
    (SELECT value FROM json_each(f.content, '$.frti')) AS frti_s,
    (SELECT value FROM json_each(f.content, '$.emergency_operation_interval'))
        AS emergency_operation_s
FROM fsr f JOIN json_each(f.content, '$.goals') j

--

CREATE VIEW v_element_causes AS
WITH RECURSIVE edge(concept, source, kind, name) AS (
    SELECT r.concept_digest, r.element_id,
        CASE WHEN r.kind = 'resource' AND e.id IS NOT NULL THEN 'element' ELSE r.kind END, r.name
    FROM element_relation r
    LEFT JOIN element e ON e.concept_digest = r.concept_digest AND e.id = r.name
    WHERE r.kind IN ('resource', 'software', 'supplier')
    UNION ALL
    SELECT r.concept_digest, r.element_id, 'element', p.element_id
    FROM element_relation r
    JOIN element_relation p ON p.concept_digest = r.concept_digest AND p.kind = 'provides'
        AND p.name = r.name
    WHERE r.kind = 'consumes'),
above(concept, element, kind, name) AS (
    SELECT concept_digest, id, 'element', id FROM element
    UNION
    SELECT a.concept, a.element, x.kind, x.name
    FROM above a JOIN edge x ON x.concept = a.concept AND x.source = a.name
    WHERE a.kind = 'element')
SELECT concept, element, kind, name FROM above

--

CREATE VIEW v_fsr_causes AS
SELECT DISTINCT a.concept_digest AS concept, a.fsr_id AS fsr, x.kind, x.name
FROM allocation a
JOIN v_element_causes x ON x.concept = a.concept_digest AND x.element = a.element_id

--

CREATE VIEW v_case_counts AS
SELECT k.campaign_id AS campaign, k.scenario, k.architecture, k.inside_odd, COUNT(*) AS planned,
    COUNT(r.number) AS results
FROM campaign_case k LEFT JOIN run r ON r.result_digest = k.result_digest
GROUP BY k.campaign_id, k.scenario, k.architecture, k.inside_odd

--

CREATE VIEW v_check_hazard_asil AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    e.severity || ' ' || e.exposure || ' ' || e.controllability || ' give '
        || COALESCE(h.asil, 'no ASIL') || ', the event has ' || COALESCE(e.asil, 'none') AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
JOIN v_hazard_asil h ON h.concept = e.concept_digest AND h.event = e.id
WHERE h.asil IS NOT e.asil

--

CREATE VIEW v_check_hazard_without_goal AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    'ASIL ' || e.asil || ', and no safety goal is against it' AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
WHERE e.asil <> 'QM' AND NOT EXISTS (
    SELECT 1 FROM v_goal_events g WHERE g.concept = e.concept_digest AND g.event = e.id)

--

CREATE VIEW v_check_goal_asil AS
SELECT c.id AS campaign, 'safety_goal' AS part, g.id,
    'has ASIL ' || g.asil || ', its event ' || e.event || ' has ' || e.asil AS detail
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
JOIN v_goal_events v ON v.concept = g.concept_digest AND v.goal = g.id
JOIN (
    SELECT h.concept, h.event, CASE h.asil WHEN 'unknown' THEN x.asil ELSE h.asil END AS asil
    FROM v_hazard_asil h
    JOIN hazardous_event x ON x.concept_digest = h.concept AND x.id = h.event) e
    ON e.concept = v.concept AND e.event = v.event
WHERE CASE substr(g.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END < CASE substr(e.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END

--

CREATE VIEW v_check_goal_without_fsr AS
SELECT c.id AS campaign, 'safety_goal' AS part, g.id,
    'ASIL ' || g.asil || ', and no requirement serves it' AS detail
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM v_fsr_goals s WHERE s.concept = g.concept_digest AND s.goal = g.id)

--

CREATE VIEW v_check_asil_lost AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'has ASIL ' || f.asil || ', its goal ' || g.goal || ' has ' || CASE g.rank WHEN 0 THEN 'QM' WHEN 1 THEN 'A' WHEN 2 THEN 'B' WHEN 3 THEN 'C' WHEN 4 THEN 'D' ELSE 'none' END AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN fsr f ON f.concept_digest = s.concept AND f.id = s.fsr
JOIN v_goal_asil g ON g.concept = s.concept AND g.goal = s.goal
WHERE CASE substr(f.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END < g.rank AND NOT EXISTS (
    SELECT 1 FROM decomposition_child x
    JOIN v_fsr_goals p ON p.concept = x.concept_digest AND p.fsr = x.fsr_id AND p.goal = s.goal
    WHERE x.concept_digest = f.concept_digest AND x.child_id = f.id)

--

CREATE VIEW v_check_fsr_without_allocation AS
SELECT c.id AS campaign, 'fsr' AS part, f.id, 'no element has to meet it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM allocation a WHERE a.concept_digest = f.concept_digest AND a.fsr_id = f.id)

--

CREATE VIEW v_check_fsr_without_measure AS
SELECT c.id AS campaign, 'fsr' AS part, f.id, 'nothing measures it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE f.measure NOT GLOB '*[^ ]*'

--

CREATE VIEW v_check_threshold_without_source AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'nobody says where ' || f.measure || ' comes from' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE f.threshold_source NOT GLOB '*[^ ]*'

--

CREATE VIEW v_check_element_capability AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'ASIL ' || f.asil || ' on ' || e.id || ', which is capable of ' || e.asil_capability AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
JOIN allocation a ON a.concept_digest = f.concept_digest AND a.fsr_id = f.id
JOIN element e ON e.concept_digest = a.concept_digest AND e.id = a.element_id
WHERE CASE substr(e.asil_capability, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END < CASE substr(f.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END

--

CREATE VIEW v_check_illegal_decomposition AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    p.asil || ' into ' || COALESCE(k.children, 'nothing') || ' for a goal of ASIL '
        || g.asil AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
JOIN fsr p ON p.concept_digest = d.concept_digest AND p.id = d.id
LEFT JOIN (
    SELECT x.concept_digest, x.fsr_id, COUNT(*) AS n, SUM(CASE substr(f.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END) AS total,
        MIN(CASE substr(f.asil, -2, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END) AS least, MAX(CASE substr(f.asil, -2, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END) AS most,
        group_concat(f.asil, ' and ') AS children
    FROM decomposition_child x
    JOIN fsr f ON f.concept_digest = x.concept_digest AND f.id = x.child_id
    GROUP BY x.concept_digest, x.fsr_id) k
    ON k.concept_digest = d.concept_digest AND k.fsr_id = d.id
LEFT JOIN (
    SELECT s.concept, s.fsr, MAX(CASE substr(g.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END) AS rank, MAX(g.asil) AS asil
    FROM v_fsr_goals s JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
    WHERE g.asil <> 'QM'
    GROUP BY s.concept, s.fsr) g ON g.concept = d.concept_digest AND g.fsr = d.id
WHERE COALESCE(k.n, 0) <> 2 OR k.total <> CASE substr(p.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END OR CASE substr(p.asil, 1, 1) WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4 ELSE -9 END < 1
    OR k.least IS NOT g.rank OR k.most IS NOT g.rank

--

CREATE VIEW v_check_decomposition_elements AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    x.child_id || ' has no element that the other child does without' AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
JOIN decomposition_child x ON x.concept_digest = d.concept_digest AND x.fsr_id = d.id
WHERE NOT EXISTS (
    SELECT 1 FROM allocation a
    WHERE a.concept_digest = x.concept_digest AND a.fsr_id = x.child_id AND NOT EXISTS (
        SELECT 1 FROM decomposition_child y
        JOIN allocation b ON b.concept_digest = y.concept_digest AND b.fsr_id = y.child_id
        WHERE y.concept_digest = x.concept_digest AND y.fsr_id = x.fsr_id
            AND y.child_id <> x.child_id AND b.element_id = a.element_id))

--

CREATE VIEW v_check_independence_argument AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    'nobody says why ' || d.scheme || ' are independent' AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
WHERE d.independence NOT GLOB '*[^ ]*'

--

CREATE VIEW v_check_independence_unknown AS
SELECT DISTINCT c.id AS campaign, 'element' AS part, a.element_id AS id,
    'states no resources, and ' || x.child_id || ' of ' || d.id || ' rests on it' AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
JOIN decomposition_child x ON x.concept_digest = d.concept_digest AND x.fsr_id = d.id
JOIN allocation a ON a.concept_digest = x.concept_digest AND a.fsr_id = x.child_id
WHERE NOT EXISTS (
    SELECT 1 FROM element_relation r
    WHERE r.concept_digest = a.concept_digest AND r.element_id = a.element_id
        AND r.kind = 'resource')

--

CREATE VIEW v_check_common_cause AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    x.child_id || ' and ' || y.child_id || ' share ' || a.kind || ' ' || a.name AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
JOIN decomposition_child x ON x.concept_digest = d.concept_digest AND x.fsr_id = d.id
JOIN decomposition_child y ON y.concept_digest = x.concept_digest AND y.fsr_id = x.fsr_id
    AND y.child_id > x.child_id
JOIN v_fsr_causes a ON a.concept = x.concept_digest AND a.fsr = x.child_id
JOIN v_fsr_causes b ON b.concept = a.concept AND b.fsr = y.child_id AND b.kind = a.kind
    AND b.name = a.name
WHERE NOT EXISTS (
    SELECT 1 FROM json_each(d.content, '$.dfa') n
    JOIN dependent_failure w ON w.concept_digest = d.concept_digest AND w.id = n.value
    JOIN json_each(w.content, '$.covers') v
    WHERE v.value = a.name)

--

CREATE VIEW v_check_expired_dfa AS
SELECT c.id AS campaign, 'dependent_failure' AS part, w.id,
    'was valid until ' || w.valid_until AS detail
FROM campaign c
JOIN dependent_failure w ON w.concept_digest = c.concept_digest
WHERE w.valid_until < date('now')

--

CREATE VIEW v_check_expired_assumption AS
SELECT c.id AS campaign, 'assumption' AS part, a.id,
    'was valid until ' || a.valid_until || ', of ' || a.owner AS detail
FROM campaign c
JOIN assumption a ON a.concept_digest = c.concept_digest
WHERE a.valid_until < date('now')

--

CREATE VIEW v_check_expired_waiver AS
SELECT c.id AS campaign, 'waiver' AS part, r.value AS id,
    'expired on ' || u.value AS detail
FROM campaign c
JOIN concept k ON k.digest = c.concept_digest
JOIN json_each(k.content, '$.waivers') w
JOIN json_each(w.value, '$.requirement') r
JOIN json_each(w.value, '$.expires') u
WHERE u.value < date('now')

--

CREATE VIEW v_check_fhti_budget AS
SELECT c.id AS campaign, 'fsr' AS part, s.fsr AS id,
    'FDTI ' || s.fdti_s || ' s and FRTI ' || s.frti_s || ' s exceed the ' || g.ftti_s
        || ' s of ' || g.id AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
WHERE s.fdti_s + s.frti_s > g.ftti_s + 1e-9
UNION ALL
SELECT c.id, 'safety_goal', g.id, 'FDTI ' || b.fdti_s || ' s and FRTI ' || b.frti_s
    || ' s of its requirements exceed its ' || g.ftti_s || ' s'
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
JOIN (
    SELECT concept, goal, COALESCE(MAX(CASE WHEN frti_s IS NULL THEN fdti_s END), 0.0) AS fdti_s,
        COALESCE(MAX(CASE WHEN fdti_s IS NULL THEN frti_s END), 0.0) AS frti_s
    FROM v_fsr_goals GROUP BY concept, goal) b
    ON b.concept = g.concept_digest AND b.goal = g.id
WHERE b.fdti_s + b.frti_s > g.ftti_s + 1e-9

--

CREATE VIEW v_check_emergency_operation AS
SELECT c.id AS campaign, 'fsr' AS part, s.fsr AS id,
    'emergency operation of ' || s.emergency_operation_s || ' s, and ' || g.id || ' tolerates '
        || COALESCE((SELECT value FROM json_each(g.content, '$.eotti')) || ' s', 'none') AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
WHERE s.emergency_operation_s
    > COALESCE((SELECT value FROM json_each(g.content, '$.eotti')), 0.0) + 1e-9

--

CREATE VIEW v_check_fsr_without_scenario AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'no planned test case judges it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM campaign_fsr p
    WHERE p.campaign_id = c.id AND p.fsr_id = f.id AND p.planned > 0)

--

CREATE VIEW v_check_hazard_without_scenario AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    'no requirement of its goals is judged in ' || l.value AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
JOIN json_each(e.content, '$.scenarios') l
WHERE NOT EXISTS (
    SELECT 1 FROM v_goal_events g
    JOIN v_fsr_goals s ON s.concept = g.concept AND s.goal = g.goal
    JOIN campaign_fsr p ON p.campaign_id = c.id AND p.fsr_id = s.fsr AND p.scenario = l.value
    WHERE g.concept = e.concept_digest AND g.event = e.id AND p.planned > 0)
UNION ALL
SELECT c.id, 'hazardous_event', e.id, 'no requirement of its goals is judged anywhere'
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
WHERE e.asil <> 'QM' AND NOT EXISTS (SELECT 1 FROM json_each(e.content, '$.scenarios'))
    AND EXISTS (
        SELECT 1 FROM v_goal_events g JOIN v_fsr_goals s ON s.concept = g.concept
            AND s.goal = g.goal
        WHERE g.concept = e.concept_digest AND g.event = e.id)
    AND NOT EXISTS (
        SELECT 1 FROM v_goal_events g
        JOIN v_fsr_goals s ON s.concept = g.concept AND s.goal = g.goal
        JOIN campaign_fsr p ON p.campaign_id = c.id AND p.fsr_id = s.fsr
        WHERE g.concept = e.concept_digest AND g.event = e.id AND p.planned > 0)

--

CREATE VIEW v_check_orphan_scenario AS
SELECT DISTINCT c.id AS campaign, 'scenario' AS part, n.value AS id,
    'no requirement is judged in it' AS detail
FROM campaign c
JOIN json_each(c.factors) x
JOIN json_each(x.value, '$.scenario') n
WHERE NOT EXISTS (
    SELECT 1 FROM campaign_fsr p
    WHERE p.campaign_id = c.id AND p.scenario = n.value AND p.planned > 0)

--

CREATE VIEW v_check_not_applicable_in_gate AS
SELECT DISTINCT p.campaign_id AS campaign, 'fsr' AS part, p.fsr_id AS id,
    'not applicable to ' || p.architecture || ': ' || COALESCE(p.reason, 'no reason') AS detail
FROM campaign_fsr p
WHERE p.in_gate AND p.mandatory AND NOT p.applicable

--

CREATE VIEW v_check_not_run AS
SELECT campaign, 'scenario' AS part, scenario AS id,
    SUM(planned - results) || ' of ' || SUM(planned) || ' test cases of ' || architecture
        || ' have no result' AS detail
FROM v_case_counts
GROUP BY campaign, scenario, architecture
HAVING SUM(results) < SUM(planned)

--

CREATE VIEW v_check_stale_evidence AS
SELECT s.campaign_id AS campaign, 'fsr' AS part, s.fsr_id AS id,
    (SUM(s.results) - SUM(COALESCE(j.runs, 0))) || ' of ' || SUM(s.results)
        || ' results are not judged by it' AS detail
FROM (SELECT f.campaign_id, f.fsr_id, f.architecture, f.scenario, SUM(n.results) AS results
    FROM campaign_fsr f
    JOIN v_case_counts n ON n.campaign = f.campaign_id AND n.scenario = f.scenario
        AND n.architecture = f.architecture
        AND CASE f.applies WHEN 'everywhere' THEN 1 WHEN 'inside' THEN n.inside_odd
            ELSE NOT n.inside_odd END
    WHERE f.applicable
    GROUP BY f.campaign_id, f.fsr_id, f.architecture, f.scenario) s
LEFT JOIN (SELECT campaign_id, fsr_id, architecture, scenario, SUM(runs) AS runs
    FROM tally GROUP BY campaign_id, fsr_id, architecture, scenario) j ON j.campaign_id = s.campaign_id AND j.fsr_id = s.fsr_id
    AND j.architecture = s.architecture AND j.scenario = s.scenario
WHERE s.results > COALESCE(j.runs, 0)
GROUP BY s.campaign_id, s.fsr_id

--

CREATE VIEW v_check_outside_odd AS
SELECT j.campaign_id AS campaign, 'fsr' AS part, j.fsr_id AS id,
    SUM(j.runs - COALESCE(s.planned, 0)) || ' runs too many are counted in ' || j.scenario
        AS detail
FROM (SELECT campaign_id, fsr_id, architecture, scenario, SUM(runs) AS runs
    FROM tally GROUP BY campaign_id, fsr_id, architecture, scenario) j
LEFT JOIN (SELECT f.campaign_id, f.fsr_id, f.architecture, f.scenario, SUM(n.planned) AS planned
    FROM campaign_fsr f
    JOIN v_case_counts n ON n.campaign = f.campaign_id AND n.scenario = f.scenario
        AND n.architecture = f.architecture
        AND CASE f.applies WHEN 'everywhere' THEN 1 WHEN 'inside' THEN n.inside_odd
            ELSE NOT n.inside_odd END
    WHERE f.applicable
    GROUP BY f.campaign_id, f.fsr_id, f.architecture, f.scenario) s ON s.campaign_id = j.campaign_id AND s.fsr_id = j.fsr_id
    AND s.architecture = j.architecture AND s.scenario = j.scenario
WHERE j.runs > COALESCE(s.planned, 0)
GROUP BY j.campaign_id, j.fsr_id, j.scenario

--

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
    SELECT y.architecture_digest, MAX(x.number) AS number, x.plugins_digest
    FROM run x JOIN test_case y ON y.digest = x.test_case_digest
    GROUP BY y.architecture_digest) n ON n.architecture_digest = t.architecture_digest
WHERE r.plugins_digest <> n.plugins_digest
GROUP BY k.campaign_id, k.architecture

--

CREATE VIEW v_check_vacuous_fsr AS
SELECT campaign_id AS campaign, 'fsr' AS part, fsr_id AS id,
    'exercised in none of ' || SUM(runs) || ' runs' AS detail
FROM tally
GROUP BY campaign_id, fsr_id
HAVING SUM(exercised) = 0

--

CREATE VIEW v_check AS
SELECT 'hazard_asil' AS rule, campaign, part, id, detail FROM v_check_hazard_asil
UNION ALL
SELECT 'hazard_without_goal' AS rule, campaign, part, id, detail FROM v_check_hazard_without_goal
UNION ALL
SELECT 'goal_asil' AS rule, campaign, part, id, detail FROM v_check_goal_asil
UNION ALL
SELECT 'goal_without_fsr' AS rule, campaign, part, id, detail FROM v_check_goal_without_fsr
UNION ALL
SELECT 'asil_lost' AS rule, campaign, part, id, detail FROM v_check_asil_lost
UNION ALL
SELECT 'fsr_without_allocation' AS rule, campaign, part, id, detail FROM v_check_fsr_without_allocation
UNION ALL
SELECT 'fsr_without_measure' AS rule, campaign, part, id, detail FROM v_check_fsr_without_measure
UNION ALL
SELECT 'threshold_without_source' AS rule, campaign, part, id, detail FROM v_check_threshold_without_source
UNION ALL
SELECT 'element_capability' AS rule, campaign, part, id, detail FROM v_check_element_capability
UNION ALL
SELECT 'illegal_decomposition' AS rule, campaign, part, id, detail FROM v_check_illegal_decomposition
UNION ALL
SELECT 'decomposition_elements' AS rule, campaign, part, id, detail FROM v_check_decomposition_elements
UNION ALL
SELECT 'independence_argument' AS rule, campaign, part, id, detail FROM v_check_independence_argument
UNION ALL
SELECT 'independence_unknown' AS rule, campaign, part, id, detail FROM v_check_independence_unknown
UNION ALL
SELECT 'common_cause' AS rule, campaign, part, id, detail FROM v_check_common_cause
UNION ALL
SELECT 'expired_dfa' AS rule, campaign, part, id, detail FROM v_check_expired_dfa
UNION ALL
SELECT 'expired_assumption' AS rule, campaign, part, id, detail FROM v_check_expired_assumption
UNION ALL
SELECT 'expired_waiver' AS rule, campaign, part, id, detail FROM v_check_expired_waiver
UNION ALL
SELECT 'fhti_budget' AS rule, campaign, part, id, detail FROM v_check_fhti_budget
UNION ALL
SELECT 'emergency_operation' AS rule, campaign, part, id, detail FROM v_check_emergency_operation
UNION ALL
SELECT 'fsr_without_scenario' AS rule, campaign, part, id, detail FROM v_check_fsr_without_scenario
UNION ALL
SELECT 'hazard_without_scenario' AS rule, campaign, part, id, detail FROM v_check_hazard_without_scenario
UNION ALL
SELECT 'orphan_scenario' AS rule, campaign, part, id, detail FROM v_check_orphan_scenario
UNION ALL
SELECT 'not_applicable_in_gate' AS rule, campaign, part, id, detail FROM v_check_not_applicable_in_gate
UNION ALL
SELECT 'not_run' AS rule, campaign, part, id, detail FROM v_check_not_run
UNION ALL
SELECT 'stale_evidence' AS rule, campaign, part, id, detail FROM v_check_stale_evidence
UNION ALL
SELECT 'outside_odd' AS rule, campaign, part, id, detail FROM v_check_outside_odd
UNION ALL
SELECT 'older_version' AS rule, campaign, part, id, detail FROM v_check_older_version
UNION ALL
SELECT 'vacuous_fsr' AS rule, campaign, part, id, detail FROM v_check_vacuous_fsr
