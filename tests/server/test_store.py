"""What is kept stays kept: versions, keys, and everything acknowledged before a kill -9."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from server.fakes import SQUARE, plan_document

from polepilot.core.errors import InputError
from polepilot.server.errors import NotFoundError, PreconditionError
from polepilot.server.migrations import MIGRATIONS
from polepilot.server.services import DataFolder
from polepilot.server.store import Once, Store

WRITER = """
import sys
from pathlib import Path
from polepilot.server.store import Store
store = Store(Path(sys.argv[1]))
site = store.add_site({"boundary": []})
number = 1
while True:
    number = store.change_site(site.id, number, {"boundary": [], "name": "x" * 500}).version
    print(number, flush=True)
"""


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "polepilot.db")


def test_versions(store: Store) -> None:
    site = store.add_site(SQUARE, ["a point was dropped"])
    assert site.repairs == ("a point was dropped",)
    changed = store.change_site(site.id, 1, {**SQUARE, "name": "B"})
    assert (changed.version, changed.name) == (2, "B")
    with pytest.raises(PreconditionError, match="Version 1 was edited, but version 2"):
        store.change_site(site.id, 1, SQUARE)
    assert store.site(site.id, 1).document == SQUARE
    assert [version for version, _ in store.site_versions(site.id)] == [1, 2]


def test_a_deleted_site_is_gone_but_its_plans_keep_it(store: Store) -> None:
    site = store.add_site(SQUARE)
    store.delete_site(site.id, 1)
    assert store.sites() == []
    with pytest.raises(NotFoundError):
        store.site(site.id)
    assert store.site_as_planned(site.id, 1).document == SQUARE


def test_of_two_edits_at_once_one_is_refused(store: Store) -> None:
    site = store.add_site(SQUARE)
    refused = []

    def edit(name: str) -> None:
        try:
            store.change_site(site.id, 1, {**SQUARE, "name": name})
        except PreconditionError as error:
            refused.append(error)

    threads = [threading.Thread(target=edit, args=(name,)) for name in "abcdefgh"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(refused) == 7
    assert store.site(site.id).version == 2


def test_runs(store: Store) -> None:
    site = store.add_site(SQUARE)
    plan = store.add_plan(site, "scan", None, None, plan_document("scan"))
    once = Once.of("run", "k", {"plan_id": plan.id})
    run, new = store.add_run(plan.id, once)
    assert new
    assert store.add_run(plan.id, once) == (run, False)
    with pytest.raises(InputError, match="another request"):
        store.add_run(plan.id, Once.of("run", "k", {"plan_id": 5}))
    assert store.open_runs() == [run]
    missed = [[[[0, 0], [1, 0], [1, 1]]]]
    store.end_run(
        run.id,
        outcome="done",
        reason="",
        coverage=0.5,
        travelled=2.0,
        duration=3.0,
        missed=missed,
    )
    assert store.open_runs() == []
    ended = store.run(run.id)
    assert (ended.outcome, ended.coverage, ended.missed) == ("done", 0.5, missed)
    assert ended.ended_at is not None
    later, _ = store.add_run(plan.id)
    assert [run.id for run in store.runs()] == [later.id, run.id]
    store.drop_run(later.id)
    assert [run.id for run in store.runs()] == [ended.id]


def test_a_failed_change_leaves_nothing(store: Store) -> None:
    site = store.add_site(SQUARE)
    with pytest.raises(ValueError, match="JSON"):
        store.change_site(site.id, 1, {"boundary": [[float("nan"), 0]]})
    assert store.site(site.id).version == 1
    assert store.change_site(site.id, 1, SQUARE).version == 2


def test_opens_again(tmp_path: Path) -> None:
    path = tmp_path / "polepilot.db"
    first = Store(path)
    first.add_site(SQUARE)
    first.set_setting("site", "1")
    first.close()
    again = Store(path)
    assert again.site(1).name == "Square"
    assert again.setting("site") == "1"
    assert again.setting("other") is None


def test_a_database_of_a_later_program_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "polepilot.db"
    with sqlite3.connect(path) as database:
        database.execute(f"PRAGMA user_version = {len(MIGRATIONS) + 1}")
    database.close()
    with pytest.raises(InputError, match="later Polepilot"):
        Store(path)


def test_what_is_no_database(tmp_path: Path) -> None:
    path = tmp_path / "polepilot.db"
    path.write_bytes(b"this is a text file, and a long one" * 100)
    with pytest.raises(InputError, match=r"polepilot\.db: cannot be used as the database"):
        Store(path)


def test_a_folder_is_used_by_one_service(tmp_path: Path) -> None:
    folder = DataFolder(tmp_path / "data")
    with pytest.raises(InputError, match="another Polepilot"):
        DataFolder(tmp_path / "data")
    folder.release()
    DataFolder(tmp_path / "data").release()


def test_a_folder_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "data").write_text("")
    with pytest.raises(InputError, match="cannot be used as the data folder"):
        DataFolder(tmp_path / "data")


def test_kill_9_loses_nothing_that_was_acknowledged(tmp_path: Path) -> None:
    for attempt in range(3):
        path = tmp_path / f"{attempt}.db"
        writer = subprocess.Popen(
            [sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, text=True
        )
        assert writer.stdout is not None
        for _ in range(50 + 37 * attempt):
            line = writer.stdout.readline()
        writer.kill()
        acknowledged = int([line, *writer.stdout.readlines()][-1])
        writer.wait()
        writer.stdout.close()
        store = Store(path)
        assert store.site(1).version >= acknowledged >= 50
        assert len(store.site_versions(1)) == store.site(1).version
        store.close()
