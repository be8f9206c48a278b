-- Certificates of determinism.

--

CREATE TABLE certificate (
	number INTEGER NOT NULL, 
	campaign_id VARCHAR(32) NOT NULL, 
	at TEXT NOT NULL, 
	tool TEXT NOT NULL, 
	class TEXT NOT NULL, 
	executed INTEGER NOT NULL, 
	asked INTEGER NOT NULL, 
	sampled INTEGER NOT NULL, 
	machine_dependent INTEGER NOT NULL, 
	conditions TEXT NOT NULL, 
	findings TEXT NOT NULL, 
	row_hash VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_certificate PRIMARY KEY (number), 
	CONSTRAINT ck_certificate_class CHECK (class = 'portable' OR class = 'same platform'), 
	CONSTRAINT ck_certificate_sampled CHECK (sampled BETWEEN 1 AND executed), 
	CONSTRAINT fk_certificate_campaign_id FOREIGN KEY(campaign_id) REFERENCES campaign (id)
)

--

CREATE TRIGGER certificate_no_update BEFORE UPDATE ON certificate
BEGIN SELECT RAISE(ABORT, 'certificate is insert-only'); END

--

CREATE TRIGGER certificate_no_delete BEFORE DELETE ON certificate
BEGIN SELECT RAISE(ABORT, 'certificate is insert-only'); END
