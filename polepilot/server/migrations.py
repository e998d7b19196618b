"""The database's shape, one script per version; ``PRAGMA user_version`` says which ones ran."""

from __future__ import annotations

MIGRATIONS = (
    """
    CREATE TABLE sites (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        version INTEGER NOT NULL,
        deleted_at REAL
    );
    CREATE TABLE site_versions (
        site_id INTEGER NOT NULL REFERENCES sites(id),
        version INTEGER NOT NULL,
        name TEXT NOT NULL,
        updated_at REAL NOT NULL,
        document TEXT NOT NULL,
        repairs TEXT NOT NULL,
        PRIMARY KEY (site_id, version)
    ) WITHOUT ROWID;
    CREATE TABLE plans (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        site_id INTEGER NOT NULL,
        site_version INTEGER NOT NULL,
        mode TEXT NOT NULL,
        route TEXT,
        pending_of INTEGER,
        created_at REAL NOT NULL,
        document TEXT NOT NULL,
        FOREIGN KEY (site_id, site_version) REFERENCES site_versions(site_id, version)
    );
    CREATE TABLE runs (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        plan_id INTEGER NOT NULL REFERENCES plans(id),
        started_at REAL NOT NULL,
        ended_at REAL,
        outcome TEXT,
        reason TEXT NOT NULL DEFAULT '',
        coverage REAL,
        travelled REAL NOT NULL DEFAULT 0,
        duration REAL NOT NULL DEFAULT 0,
        missed TEXT
    );
    CREATE TABLE idempotency (
        operation TEXT NOT NULL,
        key TEXT NOT NULL,
        digest TEXT NOT NULL,
        result_id INTEGER NOT NULL,
        created_at REAL NOT NULL,
        PRIMARY KEY (operation, key)
    ) WITHOUT ROWID;
    CREATE TABLE settings (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
    """,
)
