"""Public data sets are found or fetched, and are what was published, or refused."""

import hashlib
import logging
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest
from refusals import refuses

from stickslip.logs import benchmarks, find_benchmark

CONTENT = {"one.mat": b"first file", "two.mat": b"second file"}


class QuietHandler(SimpleHTTPRequestHandler):
    def log_message(self, format, *args):  # noqa: A002 (the base class names it so)
        """Say nothing: requests are part of the test."""


@pytest.fixture
def published(tmp_path):
    """Serve a data set on this machine; return its folder and its address."""
    folder = tmp_path / "published"
    folder.mkdir()
    for name, content in CONTENT.items():
        (folder / name).write_bytes(content)
    handler = partial(QuietHandler, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield folder, f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()
        thread.join()


@pytest.fixture
def registered(published, tmp_path, monkeypatch):
    """Make that data set known under the name "stage", with an empty cache."""
    benchmark = benchmarks._Benchmark(
        address=published[1],
        files={name: hashlib.sha256(content).hexdigest() for name, content in CONTENT.items()},
    )
    monkeypatch.setattr(benchmarks, "_BENCHMARKS", {"stage": benchmark})
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("STICKSLIP_DATA", raising=False)
    monkeypatch.setattr("pooch.os_cache", lambda project: tmp_path / "cache" / project)
    return published[0]


def test_fetched_once_and_reported(registered, caplog):
    with caplog.at_level(logging.WARNING, logger="stickslip"):
        folder = find_benchmark("stage")
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == CONTENT
    assert [each.getMessage()[:18] for each in caplog.records] == ["stickslip: fetched"] * 2
    for path in registered.iterdir():
        path.unlink()
    assert find_benchmark("stage") == folder
    assert len(caplog.records) == 2


def test_what_is_fetched_must_be_what_was_published(registered):
    (registered / "two.mat").write_bytes(b"another file")
    with refuses("data_not_published", file="two.mat", variable="STICKSLIP_DATA"):
        find_benchmark("stage")


def test_a_file_in_the_cache_that_was_damaged_is_fetched_anew(registered, caplog):
    folder = find_benchmark("stage")
    (folder / "one.mat").write_bytes(b"damaged")
    find_benchmark("stage")
    assert caplog.records[-1].getMessage().endswith("/one.mat")
    assert (folder / "one.mat").read_bytes() == CONTENT["one.mat"]


def test_no_such_page(registered):
    (registered / "one.mat").unlink()
    with refuses("data_not_fetched", file="one.mat"):
        find_benchmark("stage")


def test_no_network(registered, monkeypatch, caplog):
    closed = benchmarks._Benchmark(
        address="http://127.0.0.1:1/", files=benchmarks._BENCHMARKS["stage"].files
    )
    monkeypatch.setattr(benchmarks, "_BENCHMARKS", {"stage": closed})
    with refuses("data_not_fetched"):
        find_benchmark("stage")
    assert caplog.records == [], "a refusal is one line"


def test_a_folder_of_ones_own_comes_first(registered, tmp_path, monkeypatch):
    own = tmp_path / "data" / "stage"
    own.mkdir(parents=True)
    for name, content in CONTENT.items():
        (own / name).write_bytes(content)
    monkeypatch.setenv("STICKSLIP_DATA", str(tmp_path / "data"))
    assert find_benchmark("stage") == own
    (own / "one.mat").write_bytes(b"damaged")
    with refuses("data_file_differs"):
        find_benchmark("stage")
    (own / "one.mat").unlink()
    with refuses("data_file_missing"):
        find_benchmark("stage")
    (own / "two.mat").unlink()
    own.rmdir()
    assert find_benchmark("stage") != own


def test_a_folder_of_ones_own_that_is_not_there(registered, tmp_path, monkeypatch):
    for place in (tmp_path / "nowhere", tmp_path / "published" / "one.mat"):
        monkeypatch.setenv("STICKSLIP_DATA", str(place))
        with refuses("place_of_data_missing"):
            find_benchmark("stage")


def test_a_cache_that_cannot_be_written(registered, tmp_path):
    (tmp_path / "cache").write_text("a file where the cache's folder would be")
    with refuses("no_cache_of_data"):
        find_benchmark("stage")


def test_an_unknown_data_set():
    with refuses("not_a_choice", name="data set", value="nemo"):
        find_benchmark("nemo")
