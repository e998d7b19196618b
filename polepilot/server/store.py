"""What people make, kept in SQLite: sites and their versions, plans, runs.

One connection behind one lock, WAL with ``synchronous=FULL``: what a method has returned survives a
power cut. Methods block (a commit takes well under a millisecond): call them from a thread.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from polepilot.core.errors import InputError
from polepilot.server.errors import NotFoundError, PreconditionError
from polepilot.server.migrations import MIGRATIONS

KEY_LIFETIME = 7 * 86_400.0
"""Seconds after which an idempotency key is forgotten."""


@dataclass(frozen=True, slots=True)
class SiteRow:
    """One version of a site; ``document`` is its SITE.json."""

    id: int
    version: int
    name: str
    updated_at: float
    document: dict[str, Any]
    repairs: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SiteLine:
    """A line of the list of sites."""

    id: int
    name: str
    version: int
    updated_at: float


@dataclass(frozen=True, slots=True)
class PlanRow:
    """A plan; ``document`` is ``Plan.to_json()`` with the options and the area."""

    id: int
    site_id: int
    site_version: int
    mode: Literal["scan", "route"]
    route: str | None
    pending_of: int | None
    created_at: float
    document: dict[str, Any]


@dataclass(frozen=True, slots=True)
class RunRow:
    """A run; ``outcome`` is None while it goes on. ``missed``: MultiPolygon coordinates."""

    id: int
    site_id: int
    plan_id: int
    mode: Literal["scan", "route"]
    route: str | None
    started_at: float
    ended_at: float | None
    outcome: str | None
    reason: str
    coverage: float | None
    travelled: float
    duration: float
    missed: list[Any] | None


@dataclass(frozen=True, slots=True)
class Once:
    """A request that is to be carried out once, however often it arrives."""

    operation: str
    key: str
    digest: str

    @staticmethod
    def of(operation: str, key: str | None, body: Any) -> Once | None:
        """None where no key was sent."""
        if key is None:
            return None
        text = json.dumps(body, sort_keys=True, separators=(",", ":"))
        return Once(operation, key, hashlib.sha256(text.encode()).hexdigest())


class Store:
    """The database of one data directory."""

    def __init__(self, path: Path) -> None:
        """Open or make the database and bring it to the present shape.

        Raises:
            InputError: the file is no database, or one of a later program.
        """
        self._path = path
        self._lock = threading.RLock()
        try:
            self._db = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
            self._db.row_factory = sqlite3.Row
            for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON"):
                self._db.execute(f"PRAGMA {pragma}")
            self._migrate()
        except sqlite3.Error as error:
            raise InputError(f"{path}: cannot be used as the database: {error}.") from None

    def close(self) -> None:
        """Finish; nothing may be asked afterwards."""
        with self._lock:
            self._db.close()

    # sites

    def sites(self) -> list[SiteLine]:
        """All sites that were not deleted, by name."""
        rows = self._all(
            "SELECT s.id, v.name, s.version, v.updated_at FROM sites s"
            " JOIN site_versions v ON v.site_id = s.id AND v.version = s.version"
            " WHERE s.deleted_at IS NULL ORDER BY v.name COLLATE NOCASE, s.id"
        )
        return [SiteLine(**row) for row in rows]

    def site(self, site_id: int, version: int | None = None) -> SiteRow:
        """A site's newest or given version.

        Raises:
            NotFoundError: there is none.
        """
        newest = self._one(
            "SELECT version FROM sites WHERE id = ? AND deleted_at IS NULL", (site_id,)
        )
        if newest is None:
            raise NotFoundError(f"There is no site {site_id}.", code="no_site")
        return self.site_as_planned(site_id, newest["version"] if version is None else version)

    def site_as_planned(self, site_id: int, version: int) -> SiteRow:
        """A version of a site, even if it was deleted meanwhile.

        Raises:
            NotFoundError: there is none.
        """
        row = self._one(
            "SELECT * FROM site_versions WHERE site_id = ? AND version = ?", (site_id, version)
        )
        if row is None:
            raise NotFoundError(f"Site {site_id} has no version {version}.", code="no_version")
        return SiteRow(
            id=site_id,
            version=version,
            name=row["name"],
            updated_at=row["updated_at"],
            document=json.loads(row["document"]),
            repairs=tuple(json.loads(row["repairs"])),
        )

    def site_versions(self, site_id: int) -> list[tuple[int, float]]:
        """Version and time of change, oldest first.

        Raises:
            NotFoundError: there is no such site.
        """
        self.site(site_id)
        rows = self._all(
            "SELECT version, updated_at FROM site_versions WHERE site_id = ? ORDER BY version",
            (site_id,),
        )
        return [(row["version"], row["updated_at"]) for row in rows]

    def add_site(
        self, document: dict[str, Any], repairs: Sequence[str] = (), once: Once | None = None
    ) -> SiteRow:
        """Keep a new site as version 1."""
        with self._transaction():
            done = self._done_before(once)
            if done is not None:
                return self.site(done, 1)
            site_id = self._insert("INSERT INTO sites(version) VALUES (1)", ())
            self._add_version(site_id, 1, document, repairs)
            self._remember(once, site_id)
        return self.site(site_id, 1)

    def change_site(
        self,
        site_id: int,
        edited: int | None,
        document: dict[str, Any],
        repairs: Sequence[str] = (),
    ) -> SiteRow:
        """Keep a new version that was made from version ``edited`` (None: from any).

        Raises:
            NotFoundError: there is no such site.
            PreconditionError: somebody else has changed it meanwhile.
        """
        with self._transaction():
            version = self._check_version(site_id, edited) + 1
            self._add_version(site_id, version, document, repairs)
            self._db.execute("UPDATE sites SET version = ? WHERE id = ?", (version, site_id))
        return self.site(site_id)

    def delete_site(self, site_id: int, edited: int | None) -> None:
        """Take a site off the list. Raises as ``change_site`` does."""
        with self._transaction():
            self._check_version(site_id, edited)
            self._db.execute("UPDATE sites SET deleted_at = ? WHERE id = ?", (time.time(), site_id))

    # plans

    def add_plan(
        self,
        site: SiteRow,
        mode: str,
        route: str | None,
        pending_of: int | None,
        document: dict[str, Any],
    ) -> PlanRow:
        """Keep a plan."""
        with self._transaction():
            plan_id = self._insert(
                "INSERT INTO plans(site_id, site_version, mode, route, pending_of, created_at,"
                " document) VALUES (?, ?, ?, ?, ?, ?, ?)",
                (site.id, site.version, mode, route, pending_of, time.time(), _dump(document)),
            )
        return self.plan(plan_id)

    def plan(self, plan_id: int) -> PlanRow:
        """A plan.

        Raises:
            NotFoundError: there is none.
        """
        row = self._one("SELECT * FROM plans WHERE id = ?", (plan_id,))
        if row is None:
            raise NotFoundError(f"There is no plan {plan_id}.", code="no_plan")
        return PlanRow(**{**dict(row), "document": json.loads(row["document"])})

    # runs

    def add_run(self, plan_id: int, once: Once | None = None) -> tuple[RunRow, bool]:
        """Keep that a run begins. Returns it, and whether it is new (or was asked for before).

        Raises:
            InputError: the key was used for another request.
        """
        with self._transaction():
            run_id = self._done_before(once)
            new = run_id is None
            if run_id is None:
                run_id = self._insert(
                    "INSERT INTO runs(plan_id, started_at) VALUES (?, ?)", (plan_id, time.time())
                )
                self._remember(once, run_id)
        return self.run(run_id), new

    def drop_run(self, run_id: int) -> None:
        """Forget a run that the robot refused, and the key that it was asked with."""
        with self._transaction():
            self._db.execute(
                "DELETE FROM idempotency WHERE operation = 'run' AND result_id = ?", (run_id,)
            )
            self._db.execute("DELETE FROM runs WHERE id = ?", (run_id,))

    def end_run(
        self,
        run_id: int,
        *,
        outcome: str,
        reason: str,
        coverage: float | None,
        travelled: float,
        duration: float,
        missed: list[Any] | None,
    ) -> None:
        """Keep how a run ended."""
        with self._transaction():
            self._db.execute(
                "UPDATE runs SET ended_at = ?, outcome = ?, reason = ?, coverage = ?,"
                " travelled = ?, duration = ?, missed = ? WHERE id = ?",
                (
                    time.time(),
                    outcome,
                    reason,
                    coverage,
                    travelled,
                    duration,
                    None if missed is None else _dump(missed),
                    run_id,
                ),
            )

    def run(self, run_id: int) -> RunRow:
        """A run.

        Raises:
            NotFoundError: there is none.
        """
        row = self._one(f"{_RUNS} WHERE r.id = ?", (run_id,))
        if row is None:
            raise NotFoundError(f"There is no run {run_id}.", code="no_run")
        return _run(row)

    def runs(self) -> list[RunRow]:
        """All runs, newest first."""
        return [_run(row) for row in self._all(f"{_RUNS} ORDER BY r.id DESC")]

    def open_runs(self) -> list[RunRow]:
        """Runs whose end nobody recorded, oldest first."""
        return [_run(row) for row in self._all(f"{_RUNS} WHERE r.outcome IS NULL ORDER BY r.id")]

    # settings

    def setting(self, key: str) -> str | None:
        """A remembered choice."""
        row = self._one("SELECT value FROM settings WHERE key = ?", (key,))
        return None if row is None else str(row["value"])

    def set_setting(self, key: str, value: str) -> None:
        """Remember a choice."""
        with self._transaction():
            self._db.execute("INSERT OR REPLACE INTO settings VALUES (?, ?)", (key, value))

    # inside

    def _migrate(self) -> None:
        version = self._db.execute("PRAGMA user_version").fetchone()[0]
        if version > len(MIGRATIONS):
            raise InputError(
                f"{self._path}: was written by a later Polepilot (shape {version}):"
                f" expected at most {len(MIGRATIONS)}."
            )
        for number, script in enumerate(MIGRATIONS[version:], version + 1):
            self._db.executescript(f"BEGIN; {script}; PRAGMA user_version = {number}; COMMIT;")

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._lock:
            self._db.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._db.execute("COMMIT")
            except BaseException:
                # A full disk may have rolled back already, or have made the commit fail.
                if self._db.in_transaction:
                    self._db.execute("ROLLBACK")
                raise

    def _all(self, sql: str, values: Sequence[Any] = ()) -> list[Any]:
        with self._lock, closing(self._db.execute(sql, values)) as cursor:
            return cursor.fetchall()

    def _one(self, sql: str, values: Sequence[Any] = ()) -> Any:
        with self._lock, closing(self._db.execute(sql, values)) as cursor:
            return cursor.fetchone()

    def _insert(self, sql: str, values: Sequence[Any]) -> int:
        with closing(self._db.execute(sql, values)) as cursor:
            return int(cursor.lastrowid or 0)

    def _add_version(
        self, site_id: int, version: int, document: dict[str, Any], repairs: Sequence[str]
    ) -> None:
        self._db.execute(
            "INSERT INTO site_versions VALUES (?, ?, ?, ?, ?, ?)",
            (
                site_id,
                version,
                document.get("name", ""),
                time.time(),
                _dump(document),
                _dump(list(repairs)),
            ),
        )

    def _check_version(self, site_id: int, edited: int | None) -> int:
        present = self.site(site_id).version
        if edited is not None and edited != present:
            raise PreconditionError(
                f"Version {edited} was edited, but version {present} is the newest.",
                status=412,
                code="conflict",
                remedy="Load the newest version and make the change again.",
            )
        return present

    def _done_before(self, once: Once | None) -> int | None:
        if once is None:
            return None
        row = self._one(
            "SELECT digest, result_id FROM idempotency WHERE operation = ? AND key = ?"
            " AND created_at > ?",
            (once.operation, once.key, time.time() - KEY_LIFETIME),
        )
        if row is None:
            return None
        if row["digest"] != once.digest:
            raise InputError(
                "This Idempotency-Key was used for another request.",
                code="idempotency_key_reused",
                remedy="Use a new key for a new request.",
            )
        return int(row["result_id"])

    def _remember(self, once: Once | None, result_id: int) -> None:
        if once is None:
            return
        now = time.time()
        self._db.execute("DELETE FROM idempotency WHERE created_at <= ?", (now - KEY_LIFETIME,))
        self._db.execute(
            "INSERT INTO idempotency VALUES (?, ?, ?, ?, ?)",
            (once.operation, once.key, once.digest, result_id, now),
        )


_RUNS = (
    "SELECT r.id, p.site_id, r.plan_id, p.mode, p.route, r.started_at, r.ended_at, r.outcome,"
    " r.reason, r.coverage, r.travelled, r.duration, r.missed"
    " FROM runs r JOIN plans p ON p.id = r.plan_id"
)


def _run(row: Any) -> RunRow:
    missed = None if row["missed"] is None else json.loads(row["missed"])
    return RunRow(**{**dict(row), "missed": missed})


def _dump(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)
