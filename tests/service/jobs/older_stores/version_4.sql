BEGIN TRANSACTION;
CREATE TABLE dems (
    id TEXT PRIMARY KEY, name TEXT NOT NULL, created_at_s REAL NOT NULL, summary TEXT NOT NULL
, tenant TEXT NOT NULL DEFAULT 'default') STRICT;
INSERT INTO "dems" VALUES('00000000000000000000000000000001','hill.tif',1780000001.5,'{"rows": 3, "cols": 4, "sha256": "0000000000000000000000000000000000000000000000000000000000000001"}','default');
INSERT INTO "dems" VALUES('00000000000000000000000000000002','Grüne Höhe.asc',1780000003.0,'{"rows": 6, "cols": 4, "sha256": "0000000000000000000000000000000000000000000000000000000000000002"}','default');
INSERT INTO "dems" VALUES('00000000000000000000000000000003','fell.tif',1780000030.0,'{"rows": 6, "cols": 4, "sha256": "00000000000000000000000000000003"}','north');
CREATE TABLE jobs (
    id TEXT PRIMARY KEY, kind TEXT NOT NULL, dem_id TEXT NOT NULL, request TEXT NOT NULL, status TEXT NOT NULL,
    created_at_s REAL NOT NULL, started_at_s REAL, finished_at_s REAL, attempts INTEGER NOT NULL DEFAULT 0,
    digest TEXT, summary TEXT, failure TEXT
, pinned INTEGER NOT NULL DEFAULT 0, tenant TEXT NOT NULL DEFAULT 'default') STRICT;
INSERT INTO "jobs" VALUES('00000000000000000000000000000010','visibility-map','00000000000000000000000000000001','{"parameters": {"anchors": [{"id": "A16"}]}}','succeeded',1780000004.5,1780000006.0,1780000007.5,1,'0000000000000000000000000000000a','{"share": 0.5, "version": "0.1.0"}',NULL,0,'default');
INSERT INTO "jobs" VALUES('00000000000000000000000000000011','visibility-map','00000000000000000000000000000001','{"parameters": {"anchors": [{"id": "A17"}]}, "notes": ["max_dop is called dop_limit now."]}','succeeded',1780000009.0,1780000010.5,1780000012.0,1,'0000000000000000000000000000000a','{"share": 0.5, "version": "0.1.0"}',NULL,0,'default');
INSERT INTO "jobs" VALUES('00000000000000000000000000000012','lines-of-sight','00000000000000000000000000000002','{"parameters": {"anchors": [{"id": "A18"}]}, "has_inputs": true}','failed',1780000013.5,1780000015.0,1780000016.5,1,NULL,NULL,'{"error": "service.LimitError", "detail": "Too much.", "data": {"limit": 3}}',0,'default');
INSERT INTO "jobs" VALUES('00000000000000000000000000000013','path','00000000000000000000000000000002','{"parameters": {"anchors": [{"id": "A19"}]}}','cancelled',1780000018.0,NULL,1780000019.5,0,NULL,NULL,'{"error": "service.JobCancelledError", "detail": "The job was cancelled before it was finished.", "data": {}}',0,'default');
INSERT INTO "jobs" VALUES('00000000000000000000000000000014','dop-map','00000000000000000000000000000001','{"parameters": {"anchors": [{"id": "A20"}]}}','running',1780000021.0,1780000024.0,NULL,2,NULL,NULL,NULL,0,'default');
INSERT INTO "jobs" VALUES('00000000000000000000000000000015','dop-map','00000000000000000000000000000001','{"parameters": {"anchors": [{"id": "A21"}]}}','queued',1780000025.5,NULL,NULL,0,NULL,NULL,NULL,0,'default');
CREATE TABLE mission_versions (
        mission_id TEXT NOT NULL, version INTEGER NOT NULL, name TEXT, saved_at_s REAL NOT NULL, saved_by TEXT,
        document TEXT NOT NULL, PRIMARY KEY (mission_id, version)
    ) STRICT, WITHOUT ROWID;
INSERT INTO "mission_versions" VALUES('237582bc20c24315be365333550e3253',1,'first',1.79596054694700050353e+09,'ada','{"name": "Grüne Höhe"}');
INSERT INTO "mission_versions" VALUES('ab911b7a888140ab81f2b3f9a5f7b905',1,NULL,1.79599580073881959912e+09,'ada','{"name": "Nord"}');
CREATE TABLE missions (
        id TEXT PRIMARY KEY, name TEXT NOT NULL, dem_sha256 TEXT, ground TEXT, anchors INTEGER NOT NULL,
        created_at_s REAL NOT NULL, saved_at_s REAL NOT NULL, version INTEGER NOT NULL, saved_by TEXT
    , tenant TEXT NOT NULL DEFAULT 'default') STRICT;
INSERT INTO "missions" VALUES('237582bc20c24315be365333550e3253','Grüne Höhe',NULL,'hill.npy',2,1.79596054694700050353e+09,1.79596054694700050353e+09,1,'ada','default');
INSERT INTO "missions" VALUES('ab911b7a888140ab81f2b3f9a5f7b905','Nord',NULL,NULL,1,1.79599580073881959912e+09,1.79599580073881959912e+09,1,'ada','north');
CREATE TABLE results (digest TEXT PRIMARY KEY, bytes INTEGER NOT NULL) STRICT;
CREATE TABLE spent (
        tenant TEXT NOT NULL, hour INTEGER NOT NULL, seconds REAL NOT NULL, PRIMARY KEY (tenant, hour)
    ) STRICT, WITHOUT ROWID;
CREATE TABLE tenants (name TEXT PRIMARY KEY, salt TEXT NOT NULL) STRICT;
INSERT INTO "tenants" VALUES('north','9932463f59e83f107c6971ccdd802c9c');
CREATE INDEX jobs_by_status ON jobs (status);
CREATE INDEX jobs_by_digest ON jobs (digest);
CREATE INDEX jobs_over ON jobs (finished_at_s) WHERE finished_at_s IS NOT NULL;
CREATE INDEX dems_of_tenants ON dems (tenant, created_at_s DESC, id);
CREATE INDEX jobs_of_tenants ON jobs (tenant, kind, created_at_s DESC, id);
CREATE INDEX missions_of_tenants ON missions (tenant, saved_at_s DESC, id);
COMMIT;
PRAGMA user_version = 4;
