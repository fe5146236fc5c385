"""The demo goes the whole way over HTTP and leaves nothing running."""

import contextlib
import json
import subprocess
import sys
import time

import numpy as np
import psutil
import pytest
import rasterio

import service.cli.demo
import service.cli.own_service
from service.cli.own_service import running_service
from service.errors import ServiceError


def services():
    """Processes that serve, started by this one."""
    serving = set()
    for child in psutil.Process().children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess, psutil.ZombieProcess):
            if "serve" in child.cmdline():
                serving.add(child.pid)
    return serving


@pytest.fixture
def leaves_nothing_running():
    """A test after which no service runs that did not run before: other tests may share theirs for a whole session."""
    before = services()
    yield
    assert services() - before == set()


@pytest.mark.usefixtures("leaves_nothing_running")
def test_the_demo_writes_the_layers_and_prints_what_it_found(sightline, tmp_path):
    ended = sightline("demo", "--out", tmp_path)
    assert ended.code == 0
    for words in ("D1", "D4", "jacksboro.tif", "visible", str(tmp_path / "map.png"), "http://127.0.0.1:"):
        assert words in ended.stdout
    names = {path.name for path in tmp_path.iterdir()}
    assert names >= {"visibility.json", "visible.tif", "min_visible_altitude.tif", "count.tif", "map.png"}
    with rasterio.open(tmp_path / "visible.tif") as dataset:
        visible = dataset.read()
    assert visible.shape[0] == 4
    assert set(np.unique(visible)) == {0, 1, 255}
    summary = json.loads((tmp_path / "visibility.json").read_text())
    known = summary["dem"]["rows"] * summary["dem"]["cols"] - summary["dem"]["unknown_posts"]
    for anchor, band in zip(summary["anchors"], visible, strict=True):
        assert anchor["visible_share"] == pytest.approx((band == 1).sum() / known, abs=1e-9)
        assert anchor["visible_share"] > 0.01


@pytest.mark.usefixtures("leaves_nothing_running")
def test_a_service_that_does_not_start_is_a_fault_in_one_sentence(sightline, tmp_path, monkeypatch):
    monkeypatch.setenv("SIGHTLINE_MAX_UPLOAD_BYTES", "plenty")
    ended = sightline("demo", "--out", tmp_path)
    assert ended.code == 1
    assert "The service ended with exit code 2" in ended.stderr
    assert ended.stderr.count("\n") == 1


@pytest.mark.usefixtures("leaves_nothing_running")
def test_a_service_that_takes_too_long_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(service.cli.own_service, "START_MAY_TAKE_S", 0.0)
    with pytest.raises(ServiceError, match="took longer than"), running_service(tmp_path):
        pass


@pytest.mark.usefixtures("leaves_nothing_running")
def test_a_refusal_of_the_service_is_told(sightline, tmp_path, monkeypatch):
    monkeypatch.setenv("SIGHTLINE_MAX_ANCHORS", "3")
    ended = sightline("demo", "--out", tmp_path)
    assert ended.code == 1
    assert "refused /visibility-maps: 4 anchors are more than the limit of 3" in ended.stderr
    assert ended.stderr.count("\n") == 1


def test_a_demo_that_is_terminated_takes_its_service_with_it(tmp_path):
    demo = subprocess.Popen([sys.executable, "-m", "service.cli", "demo", "--out", str(tmp_path)])
    try:
        family = psutil.Process(demo.pid)
        while demo.poll() is None and not family.children():
            time.sleep(0.01)
        (served,) = family.children()
        demo.terminate()
        assert demo.wait(30) != 0
        served.wait(30)
    finally:
        demo.kill()
